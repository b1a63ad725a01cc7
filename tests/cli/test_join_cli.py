"""Files of two clocks are joined by command, and what they hide is found."""

import numpy as np
import pytest

from gfimu import AccelerometerArray
from gfimu.diagnosis import diagnose
from gfimu.recording import Recording
from sim.effects import make_effect
from sim.trials import Measurement, measure
from sim.twin import Twin

TWIN = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


def test_files_are_joined_and_diagnosed(tmp_path, gfimu_command):
    hidden = make_effect("table_tilt", {"x_rad": 0.02, "y_rad": -0.01}, TWIN.array)
    run = measure(np.random.default_rng(3), TWIN, [hidden], Measurement(duration=40.0))
    Recording(run.t_s, run.readings, run.channels).carrying(TWIN.array).write(tmp_path / "channels.csv")
    times = np.arange(0.003, 39.0, 0.05)
    speeds = np.interp(times, run.t_s, run.reference["tacho_rad_s"]) * 30.0 / np.pi
    rows = zip(1000.0 * (times - 3.05) / 1.0035, speeds, strict=True)
    lines = "\n".join(f"{t:.3f};{value:.5f}" for t, value in rows)
    (tmp_path / "tacho.csv").write_text(f"millis;speed\n{lines}\n")
    (tmp_path / "tacho.toml").write_text(
        'name = "tacho"\n[time]\ncolumn = "millis"\nunit = "ms"\n'
        '[reference]\ntacho_rad_s = { column = "speed", unit = "rpm" }\n'
    )
    arguments = ["join", tmp_path / "channels.csv", tmp_path / "tacho.csv", "--out", tmp_path / "run.parquet"]
    refused = gfimu_command(*arguments)
    assert refused.code == 2
    assert "--reference-map" in refused.stderr
    joined = gfimu_command(*arguments, "--reference-map", tmp_path / "tacho.toml")
    assert joined.code == 0, joined.stderr
    assert "rate error of the clocks" in joined.stdout
    found = diagnose([Recording.read(tmp_path / "run.parquet")], TWIN)
    (cause,) = found.causes
    assert cause.effect == "table_tilt"
    assert cause.parameters["x_rad"] == pytest.approx(0.02, abs=1e-3)
