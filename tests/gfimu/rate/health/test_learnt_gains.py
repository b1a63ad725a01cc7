"""The watch of a recording that was not calibrated, whose gains and axes are learnt first."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from watched_world import CUBE, GRAVITY, RATE_HZ, readings

from gfimu import SensorErrors
from gfimu.rate.health import watch_from_rest, with_learnt_gains

SHEET = replace(SensorErrors.from_parts(CUBE, RATE_HZ).with_part_gains(CUBE), stuck_after=0)


def run(seed, step=0.0):
    """A tumbling cube with gains and axes of 1 %, and a step of a channel, m/s², at some moment."""
    t, values, _ = readings("tumble", seed, duration=30.0, gains=0.01, axes=0.007, places=0.0, rest=2.0)
    rng = np.random.default_rng([seed, 8])
    channel, onset = int(rng.integers(12)), rng.uniform(12.0, 25.0)
    values[t >= onset, channel] += step
    return t, values, CUBE.channels[channel], onset


@pytest.mark.parametrize("seed", range(4))
def test_a_step_of_20_mg_is_isolated_within_two_seconds(seed):
    t, values, channel, onset = run(seed, step=0.02 * GRAVITY)
    found = watch_from_rest(CUBE, t, *with_learnt_gains(CUBE, t, values, SHEET))
    assert [fault.channels for fault in found.faults] == [(channel,)]
    assert onset < found.faults[0].found_s < onset + 2.0


def test_with_the_data_sheets_errors_it_is_not():
    t, values, channel, onset = run(0, step=0.02 * GRAVITY)
    found = watch_from_rest(CUBE, t, values, SHEET)
    assert not any(fault.channels == (channel,) and fault.found_s < onset + 2.0 for fault in found.faults)


@pytest.mark.parametrize("seed", range(10, 16))
def test_sound_channels_are_kept(seed):
    t, values, _, _ = run(seed)
    corrected, errors = with_learnt_gains(CUBE, t, values, SHEET)
    assert watch_from_rest(CUBE, t, corrected, errors).faults == ()
    assert errors.gain_std < 0.1 * SHEET.gain_std


def test_a_rest_shows_no_gains():
    t, values, _ = readings("rest", 1, gains=0.01, axes=0.007)
    corrected, errors = with_learnt_gains(CUBE, t, values, SHEET)
    assert errors.gain_std > 0.3 * SHEET.gain_std
    assert watch_from_rest(CUBE, t, corrected, errors).faults == ()
