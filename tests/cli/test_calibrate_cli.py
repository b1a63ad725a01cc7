"""The commands calibrate and noise, and a calibration used by estimate, as a user types them."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from gfimu import AccelerometerArray, Estimate, Recording, load_calibration, local_gravity, specific_force
from gfimu.calibration import METHODS
from gfimu.sensor_noise import white_noise

CUBE = AccelerometerArray.load("cube12")
GRAVITY = local_gravity(52.3, 80.0)
DIRECTIONS = np.array(
    [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if 0 < abs(x) + abs(y) + abs(z) < 3], float
)
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=1, keepdims=True)


class Sensors:
    """Twelve channels with gain, cross-axis and bias errors, the mean rotation against the drawing being zero."""

    def __init__(self, seed=1):
        rng = np.random.default_rng(seed)
        relative = np.eye(3) + rng.normal(0, 0.01, (4, 3, 3))
        relative -= ((relative - relative.swapaxes(1, 2)) / 2).mean(axis=0)
        self.gain = np.zeros((12, 12))
        for chip in range(4):
            block = slice(3 * chip, 3 * chip + 3)
            self.gain[block, block] = relative[chip]
        self.bias = rng.normal(0, 0.35, 12)
        self.rng = rng

    def read(self, true, sigma=0.02):
        return true @ self.gain.T + self.bias + self.rng.normal(0, sigma, true.shape)


@pytest.fixture
def sensors():
    return Sensors()


@pytest.fixture
def poses(tmp_path, sensors):
    """Eighteen poses of 5 s with motion between them."""
    parts = []
    for number, direction in enumerate(DIRECTIONS):
        parts.append(np.tile(GRAVITY * direction, (500, 1)))
        following = DIRECTIONS[(number + 1) % len(DIRECTIONS)]
        share = np.linspace(0, 1, 150)[:, None]
        shake = 4 * np.sin(np.linspace(0, 25, 150))[:, None]
        parts.append(GRAVITY * ((1 - share) * direction + share * following) + shake)
    p = np.concatenate(parts)
    true = specific_force(CUBE, p, np.zeros((1, 3)), np.zeros((1, 3)))
    path = tmp_path / "poses.parquet"
    Recording.from_arrays(np.arange(len(p)) / 100, sensors.read(true), CUBE).write(path)
    return path


@pytest.fixture
def run(tmp_path, sensors):
    """A table turned back and forth for 20 s."""
    t = np.arange(2000) / 100
    axis = np.array([[0.0, 0.0, 1.0]])
    true = specific_force(CUBE, GRAVITY * axis, np.cos(t)[:, None] * axis, np.sin(t)[:, None] * axis)
    path = tmp_path / "run.parquet"
    Recording.from_arrays(t, sensors.read(true), CUBE, reference={"tacho_rad_s": np.sin(t)}).write(path)
    return path


@pytest.mark.parametrize("method", ["six-position", "recursive", "multi-position", "twelve-position", "array"])
def test_every_method(gfimu_command, poses, method):
    out = poses.with_name("calibration.json")
    place = ("--latitude", 52.3, "--height", 80)
    result = gfimu_command("calibrate", method, poses, *place, "--out", out, "--json")
    assert (result.code, result.stderr) == (0, "")
    answer = json.loads(result.stdout)
    assert answer["method"] == method
    assert answer["gravity_m_s2"] == pytest.approx(9.812484, abs=1e-5)
    assert len(answer["parameters"]) == 4 * ((9 if method == "multi-position" else 12) + 3)  # three bends per chip
    assert all(parameter["std"] > 0 for parameter in answer["parameters"])
    assert load_calibration(out).to_dict() == {key: answer[key] for key in answer if key != "files"}


def test_table_notes_and_picture(gfimu_command, poses):
    out, picture = poses.with_name("calibration.json"), poses.with_name("calibration.png")
    options = ("--parameters", 12, "--gravity", GRAVITY, "--picture", picture)
    result = gfimu_command("calibrate", "multi-position", poses, "--out", out, *options)
    assert result.code == 0
    for words in ("a1_M_xy", "a4_b_z", "XY / YX", "correlation", "rest_threshold_chosen_by", "note: 3 directions"):
        assert words in result.stdout
    assert picture.read_bytes()[:4] == b"\x89PNG"


def test_calibration_takes_the_drift_off(gfimu_command, poses, run):
    out = poses.with_name("calibration.json")
    assert gfimu_command("calibrate", "array", poses, "--gravity", GRAVITY, "--out", out).code == 0
    errors = {}
    for name, options in (("raw", ()), ("calibrated", ("--calibration", out))):
        estimate = run.with_name(f"{name}.parquet")
        result = gfimu_command("estimate", run, "--out", estimate, *options, "--json")
        assert (result.code, result.stderr) == (0, "")
        errors[name] = abs(Estimate.read(estimate).omega[-1, 2] - np.sin(19.99))
    assert errors["raw"] > 5.0  # rad/s after 20 s
    assert errors["calibrated"] < 0.05 * errors["raw"]


def test_positions_from_a_second_recording(gfimu_command, poses, run):
    out = poses.with_name("calibration.json")
    options = ("--motion", run, "--gravity", GRAVITY)
    result = gfimu_command("calibrate", "array", poses, *options, "--out", out)
    assert result.code == 0
    assert "not determined: the z position of every chip" in result.stdout
    fitted = load_calibration(out).calibrated_array(CUBE).chip_positions
    np.testing.assert_allclose(fitted, CUBE.chip_positions, atol=2e-3)


def test_carried_over_to_a_later_run(gfimu_command, poses):
    """Biases that changed at power-on are found from three of its poses."""
    first, later, out = (poses.with_name(name) for name in ("first.json", "later.parquet", "later.json"))
    assert gfimu_command("calibrate", "array", poses, "--gravity", GRAVITY, "--out", first).code == 0
    before = Recording.read(poses)
    shift = np.random.default_rng(7).normal(0, 0.03, 12)
    rows = before.t_s < 19.0
    moved = before.for_array(CUBE)[rows] + shift
    Recording.from_arrays(before.t_s[rows], moved, CUBE).write(later)
    result = gfimu_command("calibrate", "array", later, "--update", first, "--turn-on-std", "0.03", "--out", out)
    assert (result.code, result.stderr) == (0, "")
    assert "updated with 3 poses: biases taken to change by 0.03" in " ".join(result.stdout.split())
    change = load_calibration(out).values - load_calibration(first).values
    np.testing.assert_allclose(change[:48].reshape(4, 12)[:, 9:].ravel(), shift, atol=0.005)
    refused = gfimu_command("calibrate", "six-position", later, "--update", first, "--out", out)
    assert refused.code == 2
    assert "use it with array, not six-position" in refused.stderr


def test_raw_counts(gfimu_command, tmp_path, poses, run):
    """The same with counts: the calibration says so and estimate reads counts for it."""
    counts = []
    for path in (poses, run):
        recording = Recording.read(path)
        scaled = np.round(recording.readings / 0.03824)
        counts.append(path.with_name(f"counts_{path.name}"))
        columns = {"t_s": recording.t_s}
        columns |= {f"{channel}_lsb": scaled[:, i] for i, channel in enumerate(recording.channels)}
        lines = [
            ",".join(columns),
            *(",".join(f"{v:.10g}" for v in row) for row in zip(*columns.values(), strict=True)),
        ]
        counts[-1] = counts[-1].with_suffix(".csv")
        counts[-1].write_text("\n".join(lines))
    out = tmp_path / "calibration.json"
    options = ("--array", "cube12", "--gravity", GRAVITY, "--out", out)
    assert gfimu_command("calibrate", "array", counts[0], *options).code == 0
    assert load_calibration(out).unit == "lsb"
    estimate = tmp_path / "estimate.parquet"
    result = gfimu_command("estimate", counts[1], "--array", "cube12", "--calibration", out, "--out", estimate)
    assert (result.code, result.stderr) == (0, "")
    assert abs(Estimate.read(estimate).omega[-1, 2] - np.sin(19.99)) < 0.5


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("seven-position", "POSES"),
            "unknown calibration method 'seven-position'; valid: array, gyro, gyro-rate-table, multi-position",
        ),
        (("multi-position", "RUN"), "no rest found"),
        (("multi-position", "POSES", "--gravity", 9.81, "--latitude", 50), "give --gravity or --latitude"),
        (("multi-position", "POSES", "--latitude", 95), "latitude 95° is outside"),
        (("multi-position", "POSES", "--gravity", 1), "not one in m/s²"),
        (("multi-position", "POSES", "--parameters", 10), "choose 12"),
        (("multi-position", "POSES", "--input", "boiled"), "unknown input 'boiled'"),
        (("gyro", "POSES"), "lacks gyro_x_rad_s"),
        (("gyro", "POSES", "--update", "POSES"), "use it with array, not gyro"),
        (("six-position", "POSES", "--motion", "RUN"), "use it with array, not six-position"),
        (
            ("recursive", "POSES", "--levelling-std", 0.001),
            "use it with six-position or twelve-position or gyro-rate-table, not recursive",
        ),
        (("array", "POSES", "--parameters", 9), "twelve-position, not array"),
        (("array", "POSES", "--input", "raw"), "twelve-position, not array"),
        (("array", "POSES", "--array", "mimu4444"), "columns m11"),
        (("multi-position", "missing.csv"), "missing.csv"),
    ],
)
def test_bad_input(gfimu_command, poses, run, arguments, message):
    places = {"POSES": poses, "RUN": run}
    out = poses.with_name("none.json")
    words = [places.get(word, word) for word in arguments]
    result = gfimu_command("calibrate", *words, "--out", out)
    assert result.code == 2
    assert message in result.stderr
    assert result.stderr.count("\n") == 1
    assert "Traceback" not in result.stderr
    assert not out.exists()


def test_a_calibration_with_nan_covariance_is_one_line(gfimu_command, poses, run):
    """Its covariance is the prior of an update: NaN there would make every number of the result NaN."""
    good, bad = poses.with_name("good.json"), poses.with_name("nan.json")
    assert gfimu_command("calibrate", "array", poses, "--gravity", GRAVITY, "--out", good).code == 0
    content = json.loads(good.read_text())
    content["covariance"][3][3] = float("nan")
    bad.write_text(json.dumps(content))
    for command in (
        ("calibrate", "array", poses, "--update", bad, "--out", poses.with_name("out.json")),
        ("estimate", run, "--calibration", bad, "--out", run.with_name("estimate.parquet")),
    ):
        refused = gfimu_command(*command)
        assert refused.code == 2
        assert "nan.json: damaged calibration file (the covariance of a1_M_yx and a1_M_yx is nan" in refused.stderr
        assert refused.stderr.count("\n") == 1


@pytest.fixture(scope="module")
def turned(tmp_path_factory):
    """A table that holds four speeds, the cube upright, chips without other errors than a bend of a11."""
    t = np.arange(4000) / 100
    rate = np.interp(t, [0, 4, 5, 13, 14, 22, 23, 31, 32, 40], [0, 0, 10, 10, 18, 18, 24, 24, 30, 30])
    alpha = np.gradient(rate, t)
    turns = np.outer(rate, [0.0, 0.0, 1.0]), np.outer(alpha, [0.0, 0.0, 1.0])
    ideal = specific_force(CUBE, np.tile([0.0, 0.0, 9.80665], (len(t), 1)), turns[1], turns[0])
    ideal[:, 0] += 1e-4 * ideal[:, 0] ** 2
    readings = ideal + np.random.default_rng(6).normal(0, 0.02, ideal.shape)
    path = tmp_path_factory.mktemp("table") / "turned.parquet"
    Recording.from_arrays(t, readings, CUBE, reference={"tacho_rad_s": rate}).write(path)
    return path


def test_spin(gfimu_command, turned):
    out = turned.with_name("spin.json")
    result = gfimu_command("calibrate", "spin", turned, "--out", out, "--radius-std", 2e-4)
    assert (result.code, result.stderr) == (0, "")
    assert "spin, not determined: a1_q_z" in " ".join(result.stdout.split())
    assert "radius of a chip 0.2 mm per coordinate" in " ".join(result.stdout.split())
    found = load_calibration(out)
    assert found.method == "spin"
    assert abs(found.value("a1_q_x") - 1e-4) < 4 * found.std_of("a1_q_x")
    assert found.value("a1_q_x") > 3 * found.std_of("a1_q_x")
    again = gfimu_command(
        *(
            "calibrate",
            "spin",
            turned,
            "--calibration",
            out,
            "--turn-on-std",
            0.01,
            "--out",
            turned.with_name("again.json"),
        )
    )
    assert again.code == 0
    assert "K0, K1 and alignment start from the spin calibration" in " ".join(again.stdout.split())


def test_spin_bad_input(gfimu_command, turned, poses):
    out = turned.with_name("none.json")
    slow = turned.with_name("slow.parquet")
    Recording.read(turned).between(0.0, 13.0).write(slow)
    for arguments, message in (
        (("spin", poses), "the recording has no tacho_rad_s column"),
        (("spin", slow), "one speed only (10 rad/s)"),
        (("spin", turned, "--min-rest", 20), "no plateau of constant rate"),
        (("spin", turned, "--motion", turned), "--motion is the motion of a whole array; use it with array, not spin"),
        (("array", poses, "--calibration", turned), "--calibration is what a spin starts from; use it with spin"),
        (("spin", turned, "--stretch-std", -1), "stretch_std_s2_rad2 = -1: a standard deviation is positive"),
        (("spin", turned, "--array", "corners8"), "array"),
    ):
        result = gfimu_command("calibrate", *arguments, "--out", out)
        assert result.code == 2, arguments
        assert message in result.stderr
        assert result.stderr.count("\n") == 1
        assert not out.exists()


def test_the_help_lists_every_method(gfimu_command):
    shown = " ".join(gfimu_command("calibrate", "--help").stdout.split()).replace("- ", "-")  # lines break at hyphens
    assert ", ".join(METHODS) in shown


def test_estimate_refuses_a_file_that_is_no_calibration(gfimu_command, run):
    bad = run.with_name("bad.json")
    bad.write_text("{}")
    result = gfimu_command("estimate", run, "--calibration", bad, "--out", run.with_name("estimate.parquet"))
    assert result.code == 2
    assert "not a calibration file" in result.stderr


@pytest.fixture
def still(tmp_path):
    rng = np.random.default_rng(4)
    readings = np.column_stack([white_noise(20_000, 100.0, N, rng) for N in (0.003, 0.003, 0.004)])
    path = tmp_path / "still.csv"
    Recording(np.arange(20_000) / 100, readings, ("a11", "a12", "a13")).write(path)
    return path


def test_noise(gfimu_command, still):
    kalibr, picture = still.with_name("imu.yaml"), still.with_name("allan.png")
    result = gfimu_command("noise", still, "--kalibr", kalibr, "--picture", picture, "--json")
    assert (result.code, result.stderr) == (0, "")
    answer = json.loads(result.stdout)
    terms = answer["channels"]["a13"]["terms"]
    assert terms["N"]["value"] == pytest.approx(0.004, rel=0.03)
    assert terms["N"]["low_95"] < terms["N"]["value"] < terms["N"]["high_95"]
    assert not terms["K"]["found"]
    assert answer["rate_hz"] == pytest.approx(100.0)
    assert "accelerometer_noise_density" in Path(kalibr).read_text()
    assert picture.read_bytes()[:4] == b"\x89PNG"
    table = gfimu_command("noise", still)
    assert table.code == 0
    assert re.search(r"0\.00[34]\d+\(\d\)", table.stdout)
    for words in ("a13", "velocity random walk", "m/s²/√Hz"):
        assert words in table.stdout


def test_noise_bad_input(gfimu_command, still, tmp_path):
    for arguments, message in (
        ((tmp_path / "none.csv",), "none.csv"),
        ((still, "--stretch", "some"), "unknown stretch 'some'"),
        ((still, "--rest-threshold", 1e-12), "no rest found"),
    ):
        result = gfimu_command("noise", *arguments)
        assert result.code == 2
        assert message in result.stderr
        assert result.stderr.count("\n") == 1


@pytest.fixture
def on_table(tmp_path):
    """Files of a gyro alone on a rate table, with its x-, y- and z-axis along the table's; no accelerometers."""
    rng = np.random.default_rng(2)
    rates = np.repeat([0.0, 2.0, -2.0, 5.0, -5.0], 2)
    t = np.arange(5000) / 100.0
    table = np.interp(t, np.concatenate([[10.0 * number, 10.0 * number + 7.0] for number in range(5)]), rates)
    files = []
    for axis, name in enumerate("xyz"):
        gyro = np.array([0.01, -0.02, 0.0]) + np.outer(table, np.diag([1.02, 0.99, 1.0])[:, axis])
        gyro += 1e-3 * rng.standard_normal(gyro.shape)
        head = "t_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,tacho_rpm"
        files.append(tmp_path / f"{name}.csv")
        rows = np.column_stack([t, gyro, table * 30.0 / np.pi])
        np.savetxt(files[-1], rows, delimiter=",", header=head, comments="", fmt="%.8f")
    return files


def test_a_gyro_on_a_rate_table(gfimu_command, on_table, tmp_path):
    x, y, z = on_table
    how = ("calibrate", "gyro", x, "--rate-table", "--out", tmp_path / "gyro.json")
    result = gfimu_command(*how, "--also", y, "--also", z, "--table-axes", "x,y,z")
    assert (result.code, result.stderr) == (0, "")
    found = load_calibration(tmp_path / "gyro.json")
    expected = np.concatenate([np.diag([1.02, 0.99, 1.0]).ravel(), [0.01, -0.02, 0.0]])
    assert np.all(np.abs(found.values - expected) < 5.0 * found.std)
    assert "against the table's rate" in " ".join(result.stdout.split())
    alone = gfimu_command(*how)
    assert "rates about x, y is not determined" in " ".join(alone.stdout.split())


def test_what_a_rate_table_refuses(gfimu_command, on_table, tmp_path):
    x, y, _ = on_table
    (tmp_path / "no_tacho.csv").write_text("t_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s\n0,1,2,3\n0.01,1,2,3\n")
    out = ("--out", tmp_path / "gyro.json")
    for arguments, words in (
        (("gyro", tmp_path / "no_tacho.csv", "--rate-table"), "no_tacho.csv: the recording lacks tacho_rad_s"),
        (("gyro", x, "--rate-table", "--also", y, "--table-axes", "x"), "1 axes along the table's for 2 recordings"),
        (("gyro", x, "--rate-table", "--table-axes", "w"), "give x, y, z, -x, -y or -z"),
        (("gyro", x, "--rate-table", "--picture", tmp_path / "p.png"), "are of accelerometers"),
        (("six-position", x, "--rate-table"), "are of a gyro on a rate table"),
        (("gyro", x, "--rate-table", "--also", tmp_path / "gone.csv"), "gone.csv: no such file"),
    ):
        result = gfimu_command("calibrate", *arguments, *out)
        assert (result.code, result.stderr.count("\n")) == (2, 1), result.stderr
        assert words in result.stderr
        assert not (tmp_path / "gyro.json").exists()
