"""The watch of a recording that was not calibrated, whose gains and axes are learnt first."""

from __future__ import annotations

import numpy as np
import pytest
from watched_world import CUBE, GRAVITY, readings

import gfimu


def run(seed, motion="tumble", step=0.0):
    """Estimate a cube with gains and axes of 1 %, and a step of a channel, m/s², at some moment."""
    t, values, _ = readings(motion, seed, duration=30.0, gains=0.01, axes=0.007, places=0.0, rest=2.0)
    rng = np.random.default_rng([seed, 8])
    channel, onset = int(rng.integers(12)), rng.uniform(12.0, 25.0)
    values[t >= onset, channel] += step
    found = gfimu.estimate((t, values), CUBE, method="filter")
    return found.metadata["faults"], CUBE.channels[channel], onset


@pytest.mark.parametrize("seed", range(4))
def test_a_step_of_20_mg_is_isolated_within_two_seconds(seed):
    """With the data sheets' errors of gains alone this is so in one of twelve."""
    faults, channel, onset = run(seed, step=0.02 * GRAVITY)
    assert [fault["channel"] for fault in faults] == [channel]
    assert onset < faults[0]["detected_s"] < onset + 2.0


@pytest.mark.parametrize("motion", ["tumble", "rest"])
@pytest.mark.parametrize("seed", range(10, 14))
def test_sound_channels_are_kept(seed, motion):
    assert run(seed, motion)[0] == []


@pytest.mark.parametrize(("seed", "size"), [(2, 0.5), (2, 3.0), (3, 5.0)])
def test_a_large_step_does_not_bend_the_gains(seed, size):
    """The size of the step is right within its uncertainty, as it is left out where gains are learnt."""
    faults, channel, onset = run(seed, step=size)
    assert [fault["channel"] for fault in faults] == [channel]
    assert faults[0]["kind"] == "step"
    assert abs(faults[0]["onset_s"] - onset) < 0.3
    assert abs(faults[0]["size"] - size) < 4.0 * faults[0]["std"] + 0.02 * size


def test_channels_of_a_fault_that_can_not_be_told_apart_are_not_all_left_out():
    """The first watch sees a step of 5 m/s² in five channels; without them the rate would not be measured."""
    faults, channel, _ = run(2, step=5.0)
    assert channel in [fault["channel"] for fault in faults]
    assert len(faults) <= 3
