"""Wrong samples by hand: isolated values and channels that hold one value."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_runs import PERIOD, made_run, without

from gfimu.diagnosis import frozen_stretches
from gfimu.diagnosis.data.samples import channel_spikes, frozen_fault, is_at_extreme, reference_spikes

N, SIGMA, STEP = 1000, 0.05, 0.04
T = PERIOD * np.arange(N)
SMOOTH = np.column_stack([3.0 * np.sin(2.0 * T), 2.0 * np.cos(1.3 * T)])
READINGS = SMOOTH + SIGMA * np.random.default_rng(8).standard_normal(SMOOTH.shape)
WHITE, QUANTUM = np.full(2, SIGMA), np.full(2, STEP)


def spikes_of(*spikes, run=None):
    readings = READINGS.copy()
    for row, channel, size in spikes:
        readings[row, channel] += size
    return channel_spikes(made_run(readings) if run is None else replace(run, readings=readings), WHITE, QUANTUM)


def test_noise_and_motion_hold_no_spikes():
    assert not spikes_of().any()


@pytest.mark.parametrize("size", [1.5, -1.5])
def test_isolated_readings_are_spikes_and_their_neighbours_are_not(size):
    # 30 σ: beyond 8 σ of noise and six times what neighbours differ by, about 1 σ.
    assert np.argwhere(spikes_of((400, 1, size), (700, 0, size))).tolist() == [[400, 1], [700, 0]]


def test_a_few_standard_deviations_are_no_spike_and_rough_surroundings_hide_more():
    assert not spikes_of((400, 1, 7.0 * SIGMA)).any()
    rough = made_run(READINGS)
    shaken = READINGS.copy()
    shaken[380:420, 1] += 1.5 * (-1.0) ** np.arange(40)  # neighbours differ by 3 m/s²
    assert not channel_spikes(replace(rough, readings=shaken), WHITE, QUANTUM).any()


def test_a_gap_is_no_neighbour():
    run = without(made_run(READINGS), slice(300, 304), 0)
    readings = READINGS.copy()
    readings[300:304, 0] = 0.0
    readings[305, 0] += 3.0
    found = channel_spikes(replace(run, readings=readings), WHITE, QUANTUM)
    assert np.argwhere(found).tolist() == [[305, 0]]


def test_spikes_of_a_reference_close_to_each_other():
    rate = 2.0 * np.sin(T) + 0.01 * np.random.default_rng(1).standard_normal(N)
    spoiled = rate.copy()
    spoiled[[100, 103, 600]] += [3.0, -3.0, 1.0]
    assert np.flatnonzero(reference_spikes(made_run(READINGS, reference=spoiled))).tolist() == [100, 103, 600]
    assert not reference_spikes(made_run(READINGS, reference=rate)).any()


def test_a_channel_that_holds_one_value_while_it_should_move():
    readings = np.round(READINGS / STEP) * STEP
    readings[200:500, 0] = readings[200, 0]
    noise = np.full(2, SIGMA)
    ((channel, start, stop),) = frozen_stretches(made_run(readings), SMOOTH, STEP, noise)
    assert channel == 0
    assert abs(start - 200) <= 1
    assert abs(stop - 500) <= 1
    parameters, text = frozen_fault(made_run(readings), [(channel, start, stop)], ["a11", "a12"])
    assert parameters["channel"] == "a11"
    assert parameters["start_s"] == pytest.approx(2.0, abs=PERIOD)
    assert text == f"channel a11 holds one value from {T[start]:.2f} s to {T[stop]:.2f} s"


def test_what_is_not_frozen():
    noise = np.full(2, SIGMA)
    readings = np.round(READINGS / STEP) * STEP
    assert frozen_stretches(made_run(readings), SMOOTH, STEP, noise) == []
    # At a limit a channel may stay.
    clipped = made_run(np.minimum(readings, 2.0))
    assert all(is_at_extreme(clipped, held, STEP, SIGMA) for held in frozen_stretches(clipped, SMOOTH, STEP, noise))
    # Where all channels repeat themselves no single one has stopped.
    both = readings.copy()
    both[200:500] = both[200]
    assert frozen_stretches(made_run(both), SMOOTH, STEP, noise) == []
