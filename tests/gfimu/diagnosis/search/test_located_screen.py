"""The screen of located terms: waves that are looked for, priors of patterns, and places that are free in time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from few_effects import having

from gfimu import AccelerometerArray
from gfimu.diagnosis import (
    LOCATED,
    LocatedScreen,
    Policy,
    free_time,
    prepare,
    signal_of,
    starting_point,
    stretches_of,
)
from gfimu.model import USUAL, Operator, Wave
from sim.trials import Measurement, measure
from sim.twin import Twin

TWIN = having(Twin(array=AccelerometerArray.load("cube12"), array_name="cube12"), "scale_factor")
POLICY = Policy()


def started(change):
    """Stretches of a recording with something added to its readings, and the drive that the reference gives."""
    recording = measure(np.random.default_rng(5), TWIN, [], Measurement(duration=20.0))
    recording = replace(recording, readings=recording.readings + change(recording.t_s))
    stretches = stretches_of(TWIN, prepare([recording], TWIN, ["run"]))
    return stretches, starting_point(stretches, POLICY.knots)


@pytest.fixture(scope="module")
def humming():
    return started(lambda t: np.outer(0.05 * np.sin(2 * np.pi * 17.321 * t), np.eye(12)[7]))


def test_a_tone_is_found_on_its_channel_to_a_tenth_of_what_can_be_separated(humming):
    stretches, point = humming
    leaders = LocatedScreen(stretches, point).leaders()
    screen = LocatedScreen(stretches, point)
    best = screen.refined(leaders[0]).term
    assert (best.where.components, best.dependence.kind) == (("a32",), "tone")
    assert best.dependence.cycles == pytest.approx(17.321, abs=0.1 / 20.0)
    odds = [leader.log_odds for leader in leaders]
    assert odds == sorted(odds, reverse=True)
    assert all(np.isfinite(odds))


def test_one_channel_of_twelve_and_a_wave_pay_for_having_been_chosen(humming):
    stretches, point = humming
    best = LocatedScreen(stretches, point).leaders()[0]
    assert best.cause.log_prior == pytest.approx(LOCATED.log_prior - USUAL.wave_looks - np.log(12.0))


def test_a_channel_that_jumps_is_the_place_of_an_error_that_is_free_in_time():
    stretches, point = started(lambda t: np.outer(np.where((t > 6.0) & (t < 9.0), 0.2, 0.0), np.eye(12)[7]))
    best, *_ = free_time(stretches, point, POLICY)
    assert (best.where.components, best.pattern) == (("a32",), "one")
    assert best.log_odds > LOCATED.free_odds


def test_the_signal_of_a_place_is_the_error_there_where_there_is_no_noise():
    rng = np.random.default_rng(1)
    direction, error = rng.standard_normal((50, 13)), rng.standard_normal(50)
    weights = rng.uniform(1.0, 4.0, 13)
    whitened = direction * error[:, None] * weights
    np.testing.assert_allclose(signal_of(Operator(direction), whitened, weights), error)


def test_the_neighbours_of_a_wave_are_within_what_can_be_separated():
    cycles = [one.cycles for one in Wave(30.0, 0.2).near(1.0)]
    assert cycles == pytest.approx([29.8, 29.9, 30.0, 30.1, 30.2])
