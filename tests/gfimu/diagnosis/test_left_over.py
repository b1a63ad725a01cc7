"""What the library lacks is reported by its channel and form, and is not taken for the nearest thing it has."""

from __future__ import annotations

import numpy as np
import pytest

from gfimu import AccelerometerArray
from gfimu.base import STANDARD_GRAVITY
from gfimu.diagnosis import diagnose
from gfimu.recording import Recording
from sim.effects import make_effect
from sim.trials import Measurement, measure
from sim.twin import Twin

SETTING = Measurement(duration=24.0)
CHANNEL = "a12"


@pytest.fixture(scope="module")
def twin():
    return Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


def recorded(twin, seed, change, effects=()):
    """A run in which the readings are changed by ``change(t, readings)`` after everything else."""
    run = measure(np.random.default_rng(seed), twin, effects, SETTING)
    readings = run.readings.copy()
    change(run.t_s, readings)
    return Recording.from_arrays(run.t_s, readings, twin.array, reference=run.reference)


@pytest.mark.study
def test_a_jump_is_told_by_its_channel(twin):
    place = twin.array.channels.index(CHANNEL)

    def jump(t, readings):
        readings[t > 9.7, place] += 0.08

    found = diagnose([recorded(twin, 3, jump)], twin)
    assert found.verdict == "unknown"
    assert found.causes[-1].unlisted.series == (CHANNEL,)


@pytest.mark.study
def test_a_cubic_is_not_a_scale_factor_and_a_quadratic(twin):
    place = twin.array.channels.index(CHANNEL)

    def bend(t, readings):
        readings[:, place] += 3e-4 * readings[:, place] ** 3

    found = diagnose([recorded(twin, 4, bend)], twin)
    assert found.verdict == "unknown"
    (cause,) = found.causes
    assert (cause.unlisted.series, cause.unlisted.dependence) == ((CHANNEL,), "y^3")
    (effect,) = found.twin.effects
    [[size]] = effect.parameters["coefficients"]
    assert size / STANDARD_GRAVITY**3 == pytest.approx(3e-4, rel=0.1)  # of the reading in units of gravity


@pytest.mark.study
def test_a_scale_factor_and_a_quadratic_are_no_cubic(twin):
    hidden = [
        make_effect("scale_factor", {CHANNEL: 0.02}, twin.array),
        make_effect("quadratic", {f"{CHANNEL}_s2_m": 1e-3}, twin.array),
    ]
    found = diagnose([recorded(twin, 5, lambda t, readings: None, hidden)], twin)
    assert {cause.effect for cause in found.causes} == {"scale_factor", "quadratic"}
    assert not found.unexplained.significant


@pytest.mark.study
def test_a_walk_beside_strong_bias_instability_is_no_warm_up():
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    unstable = Measurement(duration=30.0, bias_instability=0.5e-3 * 9.80665)
    walk = make_effect("bias_random_walk", {"strength_m_s2_rts": 0.02})
    found = diagnose([measure(np.random.default_rng(6), twin, [walk], unstable)], twin)
    assert [cause.effect for cause in found.causes] == ["bias_random_walk"]
    (cause,) = found.causes
    assert abs(cause.parameters["strength_m_s2_rts"] - 0.02) < 3 * cause.std["strength_m_s2_rts"]


@pytest.mark.study
def test_a_few_wandering_channels_are_no_walk_of_all(twin):
    rng = np.random.default_rng(8)

    def wander(t, readings):
        readings[:, :3] += np.cumsum(0.004 * rng.standard_normal((len(t), 3)), axis=0)

    found = diagnose([recorded(twin, 7, wander)], twin)
    assert "bias_random_walk" not in [cause.effect for cause in found.causes]


@pytest.mark.study
def test_what_stands_beside_a_large_cause_is_told_with_its_place(twin):
    hidden = make_effect("eccentricity", {"x_m": 0.03, "y_m": -0.02})
    place = twin.array.channels.index(CHANNEL)

    def whistle(t, readings):
        readings[:, place] += 0.15 * np.sin(2 * np.pi * 17.0 * t)

    found = diagnose([recorded(twin, 8, whistle, [hidden])], twin)
    named = next(cause for cause in found.causes if cause.effect == "eccentricity")
    assert abs(named.parameters["x_m"] - 0.03) < 3 * named.std["x_m"]
    other = next(cause.unlisted for cause in found.causes if cause.unlisted is not None)
    assert (other.series, other.dependence) == ((CHANNEL,), "tone at 17 Hz")
