"""A rotation about a known axis, by command, from a file of one chip with a gyro beside it."""

import json

import numpy as np

from gfimu import AccelerometerArray, Chip, TurningAxis
from gfimu.recording import Recording


def test_one_chip_on_a_table_is_estimated_by_its_own_axis(gfimu_command, tmp_path):
    t = np.arange(0.0, 20.0, 0.01)
    rate = np.where(t > 3.0, 4.0 * np.sin(0.8 * (t - 3.0)), 0.0)
    alpha = np.where(t > 3.0, 3.2 * np.cos(0.8 * (t - 3.0)), 0.0)
    readings = np.column_stack([-0.1 * rate**2, 0.1 * alpha, np.full_like(t, 9.80665)])
    readings += 0.03 * np.random.default_rng(1).standard_normal(readings.shape)
    chip = Chip("a1", np.array([0.1, 0.0, 0.0]), np.eye(3))
    array = AccelerometerArray("arm", (chip,), turning_axis=TurningAxis.of("z"))
    gyro = {f"gyro_{axis}_rad_s": rate if axis == "z" else np.zeros_like(t) for axis in "xyz"}
    Recording.from_arrays(t, readings, array, reference=gyro).write(tmp_path / "run.csv")
    made = gfimu_command("estimate", tmp_path / "run.csv", "--out", tmp_path / "estimate.csv", "--json")
    assert made.code == 0, made.stderr
    assert json.loads(made.stdout)["gyro_rmse_rad_s"] < 0.1
    refused = gfimu_command("estimate", tmp_path / "run.csv", "--gyro", "--out", tmp_path / "other.csv")
    assert refused.code == 2
    assert "no use with --axis" in refused.stderr
    assert not (tmp_path / "other.csv").exists()
