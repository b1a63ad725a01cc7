"""Files that are wrong about themselves, refused by what fits instead."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_cases import lively, small_twin, stretches_of

from gfimu import InputError
from gfimu.diagnosis import refuse_implausible

TWIN = small_twin("cube12")


@pytest.fixture(scope="module")
def stretch():
    return stretches_of(TWIN, duration=10.0, motion=lively())[0]


@pytest.fixture(scope="module")
def predict(stretch):
    """The motion by a factor of the reference, at a mounting: what another reading of the file predicts."""

    def of(run):
        factor = float(run.reference @ stretch.run.reference / (stretch.run.reference @ stretch.run.reference))
        state = replace(stretch, run=run).motion([], lively()) if factor == 1.0 else Turned(factor)
        return TWIN.predict(state, run.t, mounting=run.mounting)[0]

    return of


class Turned:
    """The lively motion as a reference read in other units tells it."""

    def __init__(self, factor):
        self.factor = factor

    def at(self, t):
        state = lively().at(t)
        return type(state)(self.factor * state.angle, self.factor * state.rate, self.factor * state.acceleration)


def test_a_sound_run_is_not_refused(stretch, predict):
    refuse_implausible(TWIN, stretch.run, predict(stretch.run), predict)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda run: replace(run, readings=run.readings / 9.80665), r"run: readings are 0\.102 times .* in g "),
        (lambda run: replace(run, readings=1000.0 * run.readings), r"in mm/s² \(divide them by 1000\)"),
        (lambda run: replace(run, reference=-run.reference), "column tacho_rad_s has the opposite sign"),
        (lambda run: replace(run, reference=run.reference * 30.0 / np.pi), "column tacho_rad_s is in rev/min"),
        (lambda run: replace(run, reference=run.reference * 180.0 / np.pi), "column tacho_rad_s is in deg/s"),
        (lambda run: replace(run, mounting=np.array([np.pi, 0.0, 0.0])), r"an array upright, .*: \[0\.0000, 0\.0000"),
        (lambda run: replace(run, readings=np.full_like(run.readings, 3.0)), "the channels hold one value"),
        (
            lambda run: replace(run, readings=np.random.default_rng(1).standard_normal(run.readings.shape)),
            "no channel follows the motion that column tacho_rad_s states",
        ),
    ],
)
def test_what_fits_otherwise_is_told_with_its_remedy(stretch, predict, change, told):
    wrong = change(stretch.run)
    with pytest.raises(InputError, match=told):
        refuse_implausible(TWIN, wrong, predict(wrong), predict)


def test_a_reference_without_a_direction_is_told_turn_by_turn(predict, stretch):
    t = stretch.run.t
    pulses = np.where((t > 1.0) & (t < 4.0), 6.0 * np.sin(np.pi * (t - 1.0) / 3.0) ** 2, 0.0)
    pulses = pulses - np.where((t > 5.0) & (t < 9.0), 5.0 * np.sin(np.pi * (t - 5.0) / 4.0) ** 2, 0.0)

    def of(run):
        rate = run.reference
        period = run.sample_period
        from gfimu.diagnosis import State

        class Tabled:
            def at(self, times):
                each = [np.cumsum(rate) * period, rate, np.gradient(rate, period)]
                return State(*(np.interp(times, t, one) for one in each))

        return TWIN.predict(Tabled(), run.t, mounting=run.mounting)[0]

    signed = replace(stretch.run, reference=pulses)
    rng = np.random.default_rng(2)
    readings = of(signed) + TWIN.expected_noise(50.0).white * rng.standard_normal(stretch.run.readings.shape)
    sound = replace(signed, readings=readings)
    refuse_implausible(TWIN, sound, of(sound), of)
    wrong = replace(sound, reference=np.abs(pulses))
    with pytest.raises(InputError, match="column tacho_rad_s has the wrong sign in 1 of 2 turns; give it a direction"):
        refuse_implausible(TWIN, wrong, of(wrong), of)
