"""Tables of poses, one row each: what they calibrate to, its uncertainty, and how a table differs from a series."""

from itertools import pairwise

import numpy as np
import pytest
from calibration_cases import FACES, GRAVITY, MULTI, calibrate, chips_in_gauge, poses_of

from gfimu import AccelerometerArray, InputError
from gfimu.calibration import ErrorModel, open_poses
from gfimu.recording import Recording

MODEL = ErrorModel(np.array([[0.98, 0, 0], [0.01, 1.02, 0], [-0.01, -0.015, 0.965]]), np.array([0.21, -0.39, 0.44]))
TRUTH = MODEL.parameters("x_axis")
CHANNELS = ("a11", "a12", "a13")
NOISE = 0.01  # m/s²


def directions(n, rng):
    vectors = rng.normal(size=(n, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def table(vectors, rng, noise=NOISE):
    readings = MODEL.read(GRAVITY * vectors) + rng.normal(0.0, noise, vectors.shape)
    return Recording(np.arange(len(vectors), dtype=float), readings, CHANNELS)


def normalised_square(calibration, truth):
    error, covariance = calibration.values[: len(truth)] - truth, calibration.covariance[: len(truth), : len(truth)]
    return float(error @ np.linalg.solve(covariance, error))


@pytest.mark.parametrize(("rows", "stated"), [(18, NOISE), (18, None), (60, None)])
def test_errors_are_as_large_as_stated(rows, stated):
    """The normalised square is χ² of 9 where the noise is stated, and has that mean where the rows show it."""
    rng = np.random.default_rng(rows)
    squares = [
        normalised_square(
            calibrate("multi-position", table(directions(rows, rng), rng), gravity=GRAVITY, row_noise_m_s2=stated),
            TRUTH,
        )
        for _ in range(60)
    ]
    # The variance of χ² over nine, of 60 runs; that of F is larger by (ν + 7)/(ν − 4) with ν = rows − 9.
    spread = np.sqrt(2.0 / 9.0 / 60 * (1.0 if stated else (rows - 2) / (rows - 13)))
    assert np.mean(squares) / 9.0 == pytest.approx(1.0, abs=4.0 * spread)


def test_the_noise_of_a_row_follows_from_the_residuals():
    rng = np.random.default_rng(1)
    found = calibrate("multi-position", table(directions(200, rng), rng), gravity=GRAVITY).statistics["row_noise_m_s2"]
    assert found == pytest.approx(NOISE, rel=4.0 / np.sqrt(2 * 191))


def test_a_stated_noise_that_the_rows_contradict_is_scaled_up_and_reported():
    rng = np.random.default_rng(2)
    recording = table(directions(40, rng), rng)
    honest = calibrate("multi-position", recording, gravity=GRAVITY, row_noise_m_s2=NOISE)
    bold = calibrate("multi-position", recording, gravity=GRAVITY, row_noise_m_s2=NOISE / 10)
    assert not any("disagree" in text for text in honest.warnings)
    assert any("disagree" in text for text in bold.warnings)
    np.testing.assert_allclose(bold.std, honest.std, rtol=0.5)


def test_the_rows_of_a_whole_array():
    rng = np.random.default_rng(3)
    array = AccelerometerArray.load("cube12")
    models = chips_in_gauge(array, rng)
    truth = np.concatenate([np.concatenate([model.sensitivity.ravel(), model.bias]) for model in models])
    errors = []
    for _ in range(10):
        rows = poses_of(array, models, directions(40, rng), rng, NOISE).means
        found = calibrate("array", Recording(np.arange(40.0), rows, array.channels), gravity=GRAVITY, array=array)
        assert "positions are as drawn" in found.statements[-1]
        errors.append((found.values[:48] - truth) / found.std[:48])
    assert np.mean(np.square(errors)) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / 480) * 1.5)


@pytest.mark.parametrize("method", ["six-position", "recursive", "twelve-position"])
def test_methods_of_level_faces_take_tables(method):
    rng = np.random.default_rng(4)
    vectors = np.concatenate([FACES, MULTI[6:]]) if method == "twelve-position" else FACES
    found = calibrate(method, table(vectors, rng), gravity=GRAVITY, row_noise_m_s2=NOISE)
    np.testing.assert_allclose(found.models["a1"].sensitivity, MODEL.sensitivity, atol=6 * NOISE / GRAVITY)
    np.testing.assert_allclose(found.models["a1"].bias, MODEL.bias, atol=6 * NOISE)


def series(vectors, rng, samples=200, noise=NOISE):
    """A recording at 100 Hz that holds each pose and turns to the next in a second."""
    held = [np.repeat(vector[None], samples, axis=0) for vector in vectors]
    turns = [(1 - s) * a + s * b for a, b in pairwise(vectors) for s in [np.linspace(0, 1, 100)[:, None]]]
    parts = [part for pair in zip(held, [*turns, held[-1]], strict=True) for part in pair]
    true = GRAVITY * np.concatenate(parts)
    readings = MODEL.read(true) + rng.normal(0.0, noise, true.shape)
    return Recording(np.arange(len(true)) / 100.0, readings, CHANNELS)


@pytest.mark.parametrize("noise", [0.001, 0.1])
def test_a_series_with_rests_stays_a_series(noise):
    rng = np.random.default_rng(5)
    found = calibrate("multi-position", series(MULTI, rng, noise=noise), gravity=GRAVITY)
    assert found.statistics["input"] == "averaged"
    assert found.statistics["poses"] == len(MULTI)


def turning(step_deg, rows=178):
    """Rows that turn about two axes by a step each: neighbours are alike, but none repeats the other."""
    angle = np.deg2rad(step_deg * np.arange(rows))
    tilt = 1.1 * np.sin(4.0 * np.pi * np.arange(rows) / rows)
    return np.column_stack([np.cos(angle) * np.cos(tilt), np.sin(angle) * np.cos(tilt), np.sin(tilt)])


def test_a_table_that_turns_in_steps_is_one():
    found = calibrate("multi-position", table(turning(8.0), np.random.default_rng(6)), gravity=GRAVITY)
    assert found.statistics["poses"] == 178
    assert normalised_square(found, TRUTH) < 30.0


def test_poses_of_averaged_unlike_rows_are_refused():
    """Steps so small that the rows pass for samples: no stretch of them agrees within any noise."""
    recording = table(turning(1.2, 300), np.random.default_rng(7))
    with pytest.raises(InputError, match="--rows poses"):
        calibrate("multi-position", recording, gravity=GRAVITY)
    assert calibrate("multi-position", recording, gravity=GRAVITY, rows="poses").statistics["poses"] == 300
    with pytest.raises(InputError, match="differ as those of several poses do"):
        calibrate("multi-position", table(turning(8.0), np.random.default_rng(6)), gravity=GRAVITY, rows="samples")


@pytest.mark.parametrize(
    ("change", "settings", "message"),
    [
        (lambda rows: rows[:5], {}, "too few for 9 parameters"),
        (
            lambda rows: np.tile(rows[0], (30, 1)) + NOISE * np.random.default_rng(0).normal(size=(30, 3)),
            {},
            "one pose",
        ),
        (lambda rows: rows, {"row_noise_m_s2": -1.0}, "a standard deviation is positive"),
        (lambda rows: rows[:, :2], {}, "three per chip"),
    ],
)
def test_bad_tables_are_refused_in_one_line(change, settings, message):
    rows = change(table(directions(20, np.random.default_rng(8)), np.random.default_rng(8)).readings)
    recording = Recording(np.arange(float(len(rows))), rows, CHANNELS[: rows.shape[1]])
    with pytest.raises(InputError, match=message) as refusal:
        calibrate("multi-position", recording, gravity=GRAVITY, rows="poses", **settings)
    assert "\n" not in str(refusal.value)


def test_rows_that_lack_a_value_or_repeat_another_are_left_out_and_named():
    recording = table(directions(30, np.random.default_rng(9)), np.random.default_rng(9))
    recording.readings[3, 1] = np.nan
    recording.readings[9] = recording.readings[7]
    found = calibrate("multi-position", recording, gravity=GRAVITY)
    assert found.statistics["poses"] == 28
    assert "rows 4 lack a value; left out" in found.warnings
    assert "rows 10 repeat another one to the last digit; left out" in found.warnings


@pytest.mark.parametrize("name", ["bare.txt", "numbered.txt", "table.csv"])
def test_files_without_times_are_tables_in_m_s2(tmp_path, name):
    rows = table(directions(30, np.random.default_rng(10)), np.random.default_rng(10)).readings
    in_g = np.round(rows / 9.80665, 7)
    if name == "table.csv":
        text = "a11_g,a12_g,a13_g\n" + "\n".join(",".join(map(str, row)) for row in in_g)
    else:
        text = "\n".join(" ".join(map(str, [number, *row][name == "bare.txt" :])) for number, row in enumerate(in_g))
    (tmp_path / name).write_text(text)
    read = open_poses(tmp_path / name)
    assert (read.unit, read.channels) == ("m_s2", CHANNELS)
    np.testing.assert_allclose(read.readings, rows, atol=1e-5)
    assert calibrate("multi-position", read, gravity=GRAVITY).statistics["poses"] == 30


def test_the_table_of_sixty_rows(shared_data):
    """Gains 0.98, 1.02, 0.965 and biases 0.21, −0.39, 0.44 m/s² made these rows, in g."""
    file = shared_data / "public" / "poses.txt"
    if not file.exists():
        pytest.skip("no table of poses in the measured data")
    found = calibrate("multi-position", open_poses(file))
    model = found.models["a1"]
    np.testing.assert_allclose(np.diag(model.sensitivity), [0.98, 1.02, 0.965], atol=0.002)
    np.testing.assert_allclose(model.bias, [0.21, -0.39, 0.44], atol=4 * found.std[6:9].max())
