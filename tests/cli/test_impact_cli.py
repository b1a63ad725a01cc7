"""`gfimu impact` as a user calls it."""

import json

import numpy as np
import pytest

from gfimu import AccelerometerArray, specific_force
from gfimu.recording import Recording

PEAK = 4000.0  # rad/s²


@pytest.fixture
def blow(tmp_path, monkeypatch):
    """Write a recording of a blow: half-sines of 10 ms at 20 kHz, along x and about z."""
    monkeypatch.chdir(tmp_path)
    array = AccelerometerArray.load("nap_3_2_2_2")
    t = np.arange(0.0, 0.1, 1 / 20_000)
    phase = np.clip((t - 0.05) / 0.01, 0.0, 1.0) * np.pi
    pulse = np.sin(phase)[:, None]
    omega = PEAK * 0.01 / np.pi * (1.0 - np.cos(phase))[:, None] * [0.0, 0.0, 1.0]
    readings = specific_force(array, pulse * [900.0, 0.0, 0.0] + [0.0, 0.0, 9.8], pulse * [0.0, 0.0, PEAK], omega)
    noise = np.random.default_rng(0).normal(0.0, 0.3, readings.shape)
    Recording.from_arrays(t, readings + noise, array).write("drop.csv")
    return tmp_path


def test_channels_motion_and_picture_are_written(gfimu_command, blow):
    words = ("impact", "drop.csv", "--direction", "+x", "--out", "out.csv", "--estimate", "e.csv", "--picture", "p.png")
    run = gfimu_command(*words, "--json")
    assert run.code == 0, run.stderr
    assert json.loads(run.stdout)["peak_alpha_rad_s2"] == pytest.approx(PEAK, rel=0.02)
    assert (blow / "p.png").stat().st_size > 10_000
    assert Recording.read("out.csv").t_s[0] == pytest.approx(-0.005, abs=1e-3)


def test_the_table_names_peaks_and_polarity(gfimu_command, blow):
    run = gfimu_command("impact", "drop.csv", "--direction", "-y")
    assert all(word in run.stdout for word in ("HIC15", "rad/s²", "accelerated along +x, not -y"))


def test_a_class_too_high_for_the_sample_rate_is_refused(gfimu_command, blow):
    run = gfimu_command("impact", "drop.csv", "--cfc", "5000")
    assert run.code == 2
    assert "take class 1000" in run.stderr
