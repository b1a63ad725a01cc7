"""The commands estimate and convert as a user types them."""

import gzip
import json
import struct
from dataclasses import replace

import numpy as np
import pytest

import gfimu
from gfimu import AccelerometerArray, Estimate, Recording, specific_force
from gfimu.base import STANDARD_GRAVITY

CUBE = AccelerometerArray.load("cube12")


@pytest.fixture
def run(tmp_path):
    """A table turned back and forth for 10 s; 100 Hz, perfect sensors, two frames lost."""
    t = np.arange(1000) / 100.0
    axis = np.array([[0.0, 0.0, 1.0]])
    omega = np.sin(t)[:, None] * axis
    readings = specific_force(CUBE, STANDARD_GRAVITY * axis, np.cos(t)[:, None] * axis, omega)
    keep = np.delete(np.arange(1000), [500, 501])
    file = tmp_path / "run.parquet"
    Recording.from_arrays(
        t[keep],
        readings[keep],
        CUBE,
        reference={"tacho_rad_s": np.sin(t[keep])},
        metadata={"mounting_rotvec_rad": [0, 0, 0]},
    ).write(file)
    return file


@pytest.mark.parametrize("suffix", ["parquet", "csv"])
def test_estimate(gfimu_command, run, suffix):
    out = run.with_name(f"estimate.{suffix}")
    result = gfimu_command("estimate", run, "--array", "cube12", "--out", out, "--json")
    assert (result.code, result.stderr) == (0, "")
    figures = json.loads(result.stdout)
    assert figures["samples"] == 998
    assert figures["gaps"] == 1
    assert figures["sample_rate_hz"] == pytest.approx(100.0)
    assert figures["tacho_rmse_rad_s"] < 1e-5
    assert figures["angle_rad"] == pytest.approx(1 - np.cos(9.99), abs=1e-4)
    assert figures["p_rms_m_s2"] == pytest.approx([0.0, 0.0, STANDARD_GRAVITY], abs=1e-9)
    assert figures["files"] == {"estimate": str(out)}
    found = Estimate.read(out)
    np.testing.assert_allclose(found.omega[:, 2], np.sin(found.t_s), atol=1e-5)


def test_equivalent_biases_of_p_at_rest(gfimu_command, tmp_path):
    """Table 1 of the GF-IMU paper, with and without taking the channels' biases off."""
    t = np.arange(500) / 100.0
    bias = np.linspace(-0.03, 0.05, 12)
    noise = 0.01 * np.random.default_rng(1).standard_normal((500, 12))
    readings = specific_force(CUBE, [0.0, 0.0, STANDARD_GRAVITY], [0.0] * 3, [0.0] * 3) + bias + noise
    Recording.from_arrays(t, readings, CUBE).write(tmp_path / "rest.csv")
    expected = bias.reshape(4, 3).mean(axis=0) / STANDARD_GRAVITY * 1e3
    for options in ((), ("--rest-bias",)):
        how = ("estimate", tmp_path / "rest.csv", *options, "--out", tmp_path / "e.csv")
        found = json.loads(gfimu_command(*how, "--json").stdout)["at_rest"]
        assert np.all(np.abs(np.array(found["bias_mg"]) - expected) < 4.0 * np.array(found["std_mg"]))
        shown = gfimu_command(*how).stdout
        for words in (
            f"Equivalent biases of p, first rest ({found['start_s']:.4g} to {found['stop_s']:.4g} s), mg",
            "the first stretch in which no reading varies beyond its noise",
            "Without a tachometer a steady spin may pass for one",
            f"{found['bias_mg'][0]:+.2f}",
            "a bias and a lean are one",
        ):
            assert words in " ".join(shown.split())


def test_table_for_people(gfimu_command, run):
    out = run.with_name("estimate.parquet")
    result = gfimu_command("estimate", run, "--array", "cube12", "--out", out)
    assert result.code == 0
    for words in ("samples", "998", "gaps", "angle at the end", "ω against tacho", "cube12"):
        assert words in result.stdout
    assert str(out) in result.stdout


def test_array_is_found_in_the_recording_or_a_file(gfimu_command, run):
    named = gfimu_command("estimate", run, "--out", run.with_name("a.parquet"), "--json")
    assert json.loads(named.stdout)["array"] == "cube12"
    file = run.with_name("my_cube.toml")
    file.write_text(CUBE.to_toml().replace('"cube12"', '"my_cube"', 1))
    given = gfimu_command("estimate", run, "--array", file, "--out", run.with_name("b.parquet"), "--json")
    assert json.loads(given.stdout)["array"] == "my_cube"


def test_position_and_rerun(gfimu_command, run):
    out, rrd = run.with_name("estimate.parquet"), run.with_name("run.rrd")
    result = gfimu_command("estimate", run, "--out", out, "--rrd", rrd, "--position", "--json")
    assert result.code == 0
    assert Estimate.read(out).position is not None
    assert rrd.stat().st_size > 10_000
    assert json.loads(result.stdout)["files"] == {"estimate": str(out), "rrd": str(rrd)}


def test_a_position_is_summed_up_by_the_errors_that_would_explain_it(gfimu_command, run):
    out = run.with_name("estimate.parquet")
    result = gfimu_command("estimate", run, "--out", out, "--position", "--latitude", "35.7", "--json")
    found = json.loads(result.stdout)["position"]
    estimate = Estimate.read(out)
    time, end = np.ptp(estimate.t_s), estimate.position[-1]
    np.testing.assert_allclose(found["position_m"], end)
    np.testing.assert_allclose(found["equivalent_p_bias_m_s2"], 2 * end / time**2)
    drift = np.degrees(6 * np.hypot(*end[:2]) / (9.80665 * time**3)) * 3600  # GF-IMU paper, eq. 30
    assert found["equivalent_rate_drift_deg_h"] == pytest.approx(drift)
    assert found["earth_horizontal_rate_deg_h"] == pytest.approx(12.21, abs=0.01)  # 15.04 °/h × cos 35.7°
    assert "equivalent bias of p" in gfimu_command("estimate", run, "--out", out, "--position").stdout


def test_gravity_of_the_place_is_taken_from_the_recording(gfimu_command, tmp_path):
    run, out = tmp_path / "run.parquet", tmp_path / "estimate.parquet"
    changes = ("gravity_m_s2=9.7", "duration_s=8")
    gfimu_command("simulate", "rest", *(f"--set={change}" for change in changes), "--out", run)
    assert Recording.read(run).metadata["gravity_m_s2"] == 9.7
    assert gfimu_command("estimate", run, "--out", out, "--position", "--rest-bias").code == 0
    assert Estimate.read(out).metadata["gravity_m_s2"] == 9.7


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--latitude", "91"), ["latitude 91° is outside"]),
        (("--north-rad", "1"), ["no use without a latitude"]),
        (("--latitude", "50", "--north-rad", "nan"), ["--north-rad nan: must be a finite number"]),
        (("--latitude", "50", "--axis", "z"), ["no use with --axis"]),
    ],
)
def test_a_place_that_can_not_be_is_one_line(gfimu_command, run, options, words):
    result = gfimu_command("estimate", run, "--out", run.with_name("e.parquet"), *options)
    assert result.code == 2
    assert len(result.stderr.strip().splitlines()) == 1
    assert all(word in result.stderr for word in words)
    assert not run.with_name("e.parquet").exists()


def test_convert_there_and_back(gfimu_command, run):
    text, back = run.with_name("run.csv"), run.with_name("back.parquet")
    assert gfimu_command("convert", run, text).code == 0
    result = gfimu_command("convert", text, back, "--json")
    assert json.loads(result.stdout)["samples"] == 998
    one, other = Recording.read(run), Recording.read(back)
    np.testing.assert_array_equal(one.readings, other.readings)
    assert one.metadata == other.metadata
    assert one.gaps.tolist() == other.gaps.tolist() == [499]


def test_convert_and_estimate_a_mimu4444_stream(gfimu_command, tmp_path):
    packets = []
    for number in range(100):
        body = struct.pack(">BHBI48h", 0xAA, number, 0x64, number * 1_024_000, *([0, 0, 2048, 0, 0, 0] * 8))
        packets.append(body + struct.pack(">H", sum(body) % 65536))
    stream = tmp_path / "stream.bin.gz"
    stream.write_bytes(gzip.compress(bytes.fromhex("A02800C8") + b"".join(packets)))
    looked_at = gfimu_command("inspect", stream)
    assert looked_at.code == 2
    assert f"a MIMU4444 stream, which needs no column map; gfimu convert {stream}" in looked_at.stderr
    result = gfimu_command("convert", stream, tmp_path / "run.csv", "--json")
    assert json.loads(result.stdout)["packets"] == 100
    for source in (stream, tmp_path / "run.csv"):
        result = gfimu_command("estimate", source, "--array", "mimu4444", "--out", tmp_path / "e.parquet", "--json")
        assert json.loads(result.stdout)["samples"] == 100


def test_measured_stream(gfimu_command, shared_data, tmp_path):
    stream = shared_data / "mimu4444" / "exp_1.bin.gz"
    out = tmp_path / "estimate.parquet"
    result = gfimu_command("estimate", stream, "--array", "mimu4444", "--out", out, "--json")
    figures = json.loads(result.stdout)
    assert 0.98 < figures["centripetal"]["slope"] < 1.02
    assert figures["centripetal"]["correlation"] >= 0.98
    assert np.isfinite(Estimate.read(out).omega_products).all()


@pytest.fixture
def noisy(tmp_path):
    """The same motion, from rest, by chips with noise; returns a function that writes it changed."""

    def write(change=lambda readings: None):
        t = np.arange(1500) / 100.0
        axis = np.array([[0.0, 0.0, 1.0]])
        omega = (3.0 * np.sin(t - 3.0) * (t > 3.0))[:, None] * axis
        readings = specific_force(CUBE, STANDARD_GRAVITY * axis, np.gradient(omega, t, axis=0), omega)
        readings = readings + 0.032 * np.random.default_rng(1).standard_normal(readings.shape)
        change(readings)
        file = tmp_path / "noisy.parquet"
        Recording.from_arrays(t, readings, CUBE, metadata={"mounting_rotvec_rad": [0, 0, 0]}).write(file)
        return file

    return write


def test_a_wrong_file_is_refused_unless_forced(gfimu_command, noisy):
    def invert(readings):
        readings[:, 2] *= -1.0

    file, out = noisy(invert), noisy().with_name("estimate.parquet")
    file = noisy(invert)
    refused = gfimu_command("estimate", file, "--out", out)
    assert refused.code == 2
    assert "a13 is inverted" in refused.stderr
    assert "--force" in refused.stderr
    assert len(refused.stderr.strip().splitlines()) == 1
    assert not out.exists()
    forced = gfimu_command("estimate", file, "--out", out, "--force", "--json")
    assert forced.code == 0
    assert "a13 is inverted" in json.loads(forced.stdout)["warnings"][0]
    assert "WARNING" in gfimu_command("estimate", file, "--out", out, "--force").stdout


def test_a_large_rest_bias_is_refused_unless_forced(gfimu_command, noisy):
    def shift(readings):
        readings[:, 4] += 0.3 * STANDARD_GRAVITY

    file = noisy(shift)
    out = file.with_name("estimate.parquet")
    refused = gfimu_command("estimate", file, "--out", out, "--rest-bias")
    assert refused.code == 2
    assert "channel a22 of array 'cube12' reads +300 mg beyond gravity" in refused.stderr
    assert gfimu_command("estimate", file, "--out", out, "--rest-bias", "--force").code == 0


def test_consistency_and_dead_channels_are_printed(gfimu_command, noisy):
    def hurt(readings):
        readings[:, 7] = np.nan
        readings[900:, 0] += 0.5

    file = noisy(hurt)
    out = file.with_name("estimate.parquet")
    figures = json.loads(gfimu_command("estimate", file, "--out", out, "--method", "filter", "--json").stdout)
    assert figures["channels_left_out"] == ["a32"]
    assert not figures["consistency"]["consistent"]
    assert figures["consistency"]["worst_channel"] == "a11"
    text = gfimu_command("estimate", file, "--out", out, "--method", "filter").stdout
    for words in ("NIS", "INCONSISTENT", "a11", "channels left out", "a32", "WARNING"):
        assert words in text
    clean = gfimu_command("estimate", noisy(), "--out", out, "--method", "smoother", "--json")
    assert json.loads(clean.stdout)["consistency"]["consistent"]


def test_the_first_call_of_the_filter_says_that_it_compiles(monkeypatch):
    from gfimu.commands.estimate import _doing
    from gfimu.commands.known_axis import KnownAxis
    from gfimu.rate import first_call
    from gfimu.rate.body_rate import follow
    from gfimu.rate.open_loop import integrate_open

    def doing(method):
        return _doing({"axis": KnownAxis(), "method": method})

    monkeypatch.setattr(first_call, "must_compile", lambda kernel: kernel is follow)
    assert "compiling" in doing("filter")
    assert "compiling" not in doing("integrate")
    monkeypatch.setattr(first_call, "must_compile", lambda kernel: kernel is integrate_open)
    assert "compiling" not in doing("smoother")
    assert "compiling" in doing("ml")
    monkeypatch.undo()
    if follow.signatures:
        assert not first_call.must_compile()
        assert doing("smoother") == "estimating by smoother"


def test_a_faulty_channel_is_named_in_table_and_json(gfimu_command, tmp_path):
    recording = gfimu.simulate("paper_run", seed=1)
    readings = recording.for_array(CUBE).copy()
    readings[recording.t_s >= 15.0, 4] += 0.3
    replace(recording, readings=readings).write(tmp_path / "bad.parquet")
    how = ("estimate", tmp_path / "bad.parquet", "--method", "filter", "--rest-bias", "--out", tmp_path / "e.csv")
    result = gfimu_command(*how)
    assert result.code == 0
    assert "contradict the others" in result.stdout
    assert "a22: step" in result.stdout + result.stderr
    figures = json.loads(gfimu_command(*how, "--json").stdout)
    assert [fault["channels"] for fault in figures["health"]["faults"]] == [["a22"]]
    (fault,) = figures["faults"]
    assert (fault["channel"], fault["kind"], fault["unit"], fault["excluded"]) == ("a22", "step", "m/s2", True)
    assert fault["onset_s"] == pytest.approx(15.0, abs=0.1)
    assert 15.0 < fault["detected_s"] < 16.0
    assert abs(fault["size"] - 0.3) < 3 * fault["std"] < 0.1
    assert gfimu_command(*how, "--keep-faulty", "--json").code == 0


def test_a_run_is_adjusted_with_what_a_table_shows(gfimu_command, tmp_path):
    gfimu.simulate("paper_run", seed=2).write(tmp_path / "run.parquet")
    out = tmp_path / "e.csv"
    how = ("estimate", tmp_path / "run.parquet", "--rest-bias", "--out", out)
    alone = json.loads(gfimu_command(*how, "--method", "smoother", "--json").stdout)
    result = gfimu_command(*how, "--method", "batch", "--use", "angle", "--use", "axis", "--json")
    assert result.code == 0, result.stderr
    found = json.loads(result.stdout)
    assert found["angle_std_rad"] < 0.1 * alone["angle_std_rad"]
    assert found["tacho_rmse_rad_s"] < 0.5 * alone["tacho_rmse_rad_s"]
    out.unlink()
    refused = gfimu_command(*how, "--method", "batch", "--use", "position")
    assert refused.code == 2
    assert "has no position_x_m" in refused.stderr
    assert not out.exists()
