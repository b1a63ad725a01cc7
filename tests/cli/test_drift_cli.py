"""The drift command: table, JSON, validity, Monte Carlo, bad input."""

import json

import numpy as np
import pytest

import gfimu
from gfimu.budget import position_error

MG = 9.80665e-3


def test_table_states_terms_total_and_limit(gfimu_command):
    result = gfimu_command("drift", "--array", "cube12", "--duration", 0.3, "--bias-mg", 35, "--monte-carlo", 50)
    assert result.code == 0
    for words in ("bias of p", "bias of alpha", "total", "Monte Carlo / total", "The closed forms hold", "11.1 mm"):
        assert words in result.stdout


def test_table_warns_beyond_the_limit(gfimu_command):
    result = gfimu_command("drift", "--array", "cube12", "--duration", 30, "--bias-mg", 35)
    assert result.code == 0
    assert "hold for 0.454 s only" in result.stdout


def test_json_is_the_budget_of_the_library(gfimu_command):
    result = gfimu_command(
        "drift", "--duration", 0.4, "--bias-mg", 35, "--noise-ug", 290, "--speed-rad-s", 6.28, "--monte-carlo", 200,
        "--seed", 3,
        "--json",
    )  # fmt: skip
    data = json.loads(result.stdout)
    assert result.code == 0
    h = 0.05
    np.testing.assert_allclose(data["sources"]["bias_m_s2"], 35 * MG)
    sizes = {term["name"]: term["size"] for term in data["terms"]}
    assert sizes["bias of p"] == pytest.approx(35 * MG / 2)
    assert sizes["bias of alpha"] == pytest.approx(35 * MG / (np.sqrt(8) * h))
    assert data["valid"] is True
    ratio = np.array(data["monte_carlo"]["std_m"]) / data["total_std_m"]
    np.testing.assert_allclose(ratio, 1.0, atol=4 * data["monte_carlo"]["relative_sampling_error"])


def test_infinite_limit_is_null_in_json(gfimu_command):
    result = gfimu_command("drift", "--duration", 1, "--rate-drift-deg-h", 1e-6, "--json")
    assert json.loads(result.stdout)["valid_until_s"] is None


def test_array_from_a_file(gfimu_command, tmp_path):
    file = tmp_path / "mine.toml"
    chips = [([1, 1, 1], "a1"), ([1, -1, -1], "a2"), ([-1, 1, -1], "a3"), ([-1, -1, 1], "a4")]
    file.write_text(
        'name = "mine"\n'
        + "\n".join(
            f'[[chip]]\nname = "{name}"\nposition_m = {[0.1 * x for x in place]}\naxes = [[1,0,0],[0,1,0],[0,0,1]]'
            for place, name in chips
        )
    )
    data = json.loads(gfimu_command("drift", "--array", file, "--duration", 1, "--bias-mg", 1, "--json").stdout)
    assert data["array"] == "mine"
    assert {t["name"]: t["size"] for t in data["terms"]}["bias of alpha"] == pytest.approx(MG / (np.sqrt(8) * 0.1))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "--bias-mg"),
        (("--bias-mg", "-1"), "zero or above"),
        (("--bias-mg", "1", "--duration", "0"), "above zero"),
        (("--bias-mg", "1", "--array", "nowhere"), "cube12"),
        (("--bias-mg", "1", "--monte-carlo", "1"), "2 or more"),
        (("--bias-mg", "1", "--speed-rad-s", "nan"), "finite"),
    ],
)
def test_bad_input_is_one_line_and_code_2(gfimu_command, arguments, words):
    result = gfimu_command("drift", *arguments)
    assert result.code == 2
    assert words in result.stderr
    assert "Traceback" not in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_position_error_is_inverted_with_the_known_bias_taken_off(gfimu_command):
    """GF-IMU paper: about 30 °/h stand for 6.42 m after 30 s; 12.2 °/h of Earth rate at 35.7° N for 2.61 m of it."""
    run = gfimu_command("drift", "--from-position", 6.42, 0, 0, "--latitude", 35.7, "--json")
    found = json.loads(run.stdout)
    assert found["rate_drift_deg_h"] == pytest.approx([0.0, 30.0, 0.0], abs=0.05)
    assert found["earth_rate_deg_h"] == pytest.approx(12.2, abs=0.05)
    assert found["earth_share_m"] == pytest.approx(2.61, abs=0.01)
    half = gfimu_command("drift", "--from-position", 6.42, -6.42, 0, "--known-bias-mg", 0.7273, -0.7273, 0, "--json")
    assert json.loads(half.stdout)["rate_drift_deg_h"] == pytest.approx([15.0, 15.0, 0.0], abs=0.05)
    assert "none" in gfimu_command("drift", "--from-position", 6.42, 1, 2, "--known-bias-mg", 1, 0, 0).stdout


def test_the_inversion_undoes_the_drift_model():
    """Against the closed form of the budget: a drift about each axis comes back."""
    for drift in ([3.0, 0.0, 0.0], [0.0, -7.0, 0.0]):
        rates = np.radians(np.array(drift) / 3600.0)
        error = position_error(20.0, rate_drift=rates)
        found = gfimu.drift_from_position(tuple(error), duration=20.0)
        assert found.rate_drift_deg_h == pytest.approx(drift, abs=1e-9)


@pytest.mark.parametrize(
    "words", ["--from-position 1 0 0 --bias-mg 1", "--latitude 30 --bias-mg 1", "--from-position 1 0 0 --duration 0",
              "--from-position 1 0 0 --latitude 91"],
)  # fmt: skip
def test_the_inversion_refuses_what_has_no_use(gfimu_command, words):
    assert gfimu_command("drift", *words.split()).code == 2


@pytest.fixture(scope="module")
def rest(tmp_path_factory):
    """Two minutes of cube12 at rest, 50 Hz, with offsets and white noise."""
    rng = np.random.default_rng(8)
    cube = gfimu.AccelerometerArray.load("cube12")
    still = gfimu.specific_force(cube, [0.0, 0.0, 1e3 * MG], [0.0] * 3, [0.0] * 3)
    readings = still + 0.2 * rng.standard_normal(12) + 0.02 * rng.standard_normal((6000, 12))
    file = tmp_path_factory.mktemp("rest") / "rest.parquet"
    gfimu.Recording.from_arrays(np.arange(6000) / 50.0, readings, cube).write(file)
    return file


def test_drift_of_a_recording_at_rest(gfimu_command, rest, tmp_path):
    picture = tmp_path / "drift.png"
    how = ("drift", rest, "--duration", 2, "--lead", 5)
    shown = gfimu_command(*how, "--picture", picture)
    assert (shown.code, shown.stderr) == (0, "")
    for words in ("rms of 16 windows", "rms predicted from the noise", "as predicted", "--from-position"):
        assert words in " ".join(shown.stdout.split())
    assert picture.read_bytes().startswith(b"\x89PNG")
    data = json.loads(gfimu_command(*how, "--json").stdout)
    found = gfimu.drift_of_rest(rest, duration=2.0, lead=5.0)
    np.testing.assert_allclose([one["position_m"] for one in data["windows"]], found.final_m)
    assert data["ratio_interval_95"][0] < data["ratio"] < data["ratio_interval_95"][1]
    back = gfimu.drift_from_position(tuple(found.final_m[0]), duration=found.time_s)
    assert np.hypot(*back.rate_drift_deg_h[:2]) == pytest.approx(data["equivalent_rate_drift_deg_h"], rel=1e-6)


def test_beyond_first_order_is_said(gfimu_command, rest):
    shown = gfimu_command("drift", rest, "--duration", 10, "--lead", 5)
    assert shown.code == 0
    assert "beyond first order" in " ".join(shown.stdout.split())


def test_what_a_recording_at_rest_does_not_go_with(gfimu_command, rest, tmp_path):
    for arguments, words in (
        ((rest, "--bias-mg", 3), "its noise is measured"),
        ((rest, "--from-position", 1, 0, 0), "its noise is measured"),
        ((rest, "--duration", 500), "the longest is 119"),
        ((tmp_path / "none.parquet",), "no such file"),
        (("--picture", tmp_path / "x.png"), "name it first"),
        ((rest, "--picture", tmp_path / "x.txt"), ".png"),
    ):
        result = gfimu_command("drift", *arguments)
        assert (result.code, result.stderr.count("\n")) == (2, 1), result.stderr
        assert words in result.stderr
