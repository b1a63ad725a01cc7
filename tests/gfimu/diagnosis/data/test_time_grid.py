"""Time stamps: late ones are no losses, losses are found among late ones, and corrupt values are left out."""

from __future__ import annotations

import gzip
from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray, RecordingWarning
from gfimu.diagnosis import diagnose, prepare_run, time_grid
from gfimu.recording import Recording
from sim.trials import Measurement, measure
from sim.twin import Twin

PERIOD = 0.01
LATE = {
    "normal": lambda rng, n: rng.normal(0.0, 2e-3, n),
    "one-sided": lambda rng, n: np.abs(rng.normal(0.0, 2e-3, n)),
    "exponential": lambda rng, n: rng.exponential(2e-3, n),
}


def stamps(late, share, *, seed=0, n=4000, drift=2e-4):
    """Stamps of the samples that were kept, s, and their numbers."""
    rng = np.random.default_rng(seed)
    number = np.arange(n)
    kept = rng.random(n) >= share
    kept[[0, -1]] = True
    return increasing(number * PERIOD * (1 + drift) + late(rng, n))[kept], number[kept]


def increasing(t_s):
    """A host stamps what comes later no earlier."""
    return np.maximum.accumulate(t_s) + 1e-7 * np.arange(len(t_s))


@pytest.mark.parametrize("late", LATE)
@pytest.mark.parametrize("seed", range(3))
def test_late_stamps_are_no_losses(late, seed):
    t, number = stamps(LATE[late], 0.0, seed=seed)
    assert np.rint(np.diff(t) / PERIOD).max() > 1  # single steps look like losses
    grid = time_grid(t)
    assert grid.lost == 0
    assert (grid.place == number).all()
    assert grid.jitter == pytest.approx(np.std(LATE[late](np.random.default_rng(9), 4000)), rel=0.1)


@pytest.mark.parametrize("late", LATE)
@pytest.mark.parametrize("share", [2e-3, 0.02])
def test_losses_are_found_among_late_stamps(late, share):
    t, number = stamps(LATE[late], share, seed=4)
    grid = time_grid(t)
    assert grid.lost == 4000 - len(number) > 0
    # A loss may be put a sample beside where it was.
    assert np.mean(grid.place != number) < 0.01


@pytest.mark.parametrize("share", [0.0, 0.02, 0.3])
def test_exact_stamps_are_placed_as_they_are(share):
    t, number = stamps(lambda rng, n: np.zeros(n), share)
    grid = time_grid(t)
    assert (grid.place == number).all()
    assert grid.jitter == 0.0
    assert grid.t[number] == pytest.approx(t, abs=1e-9)


def test_a_stalled_host_loses_nothing():
    t = PERIOD * np.arange(2000)
    for start in (200, 900, 1500):  # seven samples stamped in a burst
        t[start : start + 7] = t[start + 7] - 1e-4 * np.arange(7, 0, -1)
    grid = time_grid(t)
    assert grid.lost == 0


@pytest.mark.parametrize("tick", [1e-6, 1e-3])
def test_a_slightly_irregular_sampling_loses_nothing(tick):
    """A clock that wanders by half a percent, at 120 Hz, in whole ticks of the stamps."""
    periods = (1.0 + 5e-3 * np.sin(np.arange(4000) / 300.0)) / 120.0
    t = np.round(np.cumsum(periods) / tick) * tick
    grid = time_grid(t)
    assert grid.lost == 0
    assert grid.jitter < 0.3 * tick + 1e-5  # rounding alone: the clock's wander of 12 ms is no jitter


def test_a_real_pair_has_its_samples_on_the_grid(shared_data):
    if not (shared_data / "wid").is_dir():
        pytest.skip("no ../shared/data/wid")
    with gzip.open(shared_data / "wid" / "trial08_IMU2.csv.gz", "rt") as file:
        t = np.array([float(line.split(",")[1]) for line in file.readlines()[3:]]) * 1e-6
    grid = time_grid(t)
    assert grid.lost == np.rint((t[-1] - t[0]) / np.median(np.diff(t))) + 1 - len(t)
    assert grid.lost < 1e-3 * len(t)
    assert grid.jitter == 0.0


def recorded(share=0.0):
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    rng = np.random.default_rng(11)
    recording = measure(rng, twin, [], Measurement(duration=12.0))
    late = increasing(recording.t_s + np.abs(rng.normal(0.0, 2e-3, len(recording))))
    recording = replace(recording, t_s=late)
    if share:
        kept = rng.random(len(late)) >= share
        kept[[0, -1]] = True
        recording = replace(
            recording,
            t_s=late[kept],
            readings=recording.readings[kept],
            reference={name: values[kept] for name, values in recording.reference.items()},
            extra={},
        )
    return twin, recording


def test_jitter_is_reported_and_is_no_lost_frame():
    twin, recording = recorded()
    found = diagnose([recording], twin)
    assert (found.verdict, found.causes) == ("nothing_found", ())
    assert found.noise.time_jitter_s == pytest.approx(1.2e-3, rel=0.15)  # of |N(0, 2 ms)|
    assert any("scatter by 1.2 ms rms" in sentence for sentence in found.sentences)


def test_lost_frames_are_found_beside_jitter():
    whole = len(recorded()[1])
    twin, recording = recorded(share=0.02)
    found = diagnose([recording], twin)
    (cause,) = found.causes
    assert cause.effect == "dropped_frames"
    assert cause.parameters["count"] == whole - len(recording) > 10
    assert found.noise.time_jitter_s


def test_corrupt_values_are_left_out_and_counted(tmp_path):
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    recording = measure(np.random.default_rng(11), twin, [], Measurement(duration=12.0))
    readings, tacho = recording.readings.copy(), recording.reference["tacho_rad_s"].copy()
    readings[[100, 101, 400], [2, 2, 7]] = [1e19, -1e19, np.inf]
    tacho[500] = 1e19
    spoiled = replace(recording, readings=readings, reference={**recording.reference, "tacho_rad_s": tacho})
    run = prepare_run(spoiled, twin)
    assert run.impossible == 4
    assert np.abs(run.readings).max() < 1e3
    spoiled.write(tmp_path / "spoiled.csv")
    with pytest.warns(RecordingWarning, match="corrupt"):  # the reader leaves them out already
        read = Recording.read(tmp_path / "spoiled.csv")
    assert prepare_run(read, twin).impossible == 4
    found = diagnose([spoiled], twin)
    assert (found.verdict, found.causes) == ("nothing_found", ())
    assert any("4 values are left out as corrupt" in sentence for sentence in found.sentences)
