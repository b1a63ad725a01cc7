"""A cubic of a reading is not the sum of a gain and a square, and these are no cubic."""

from __future__ import annotations

from dataclasses import replace

import pytest
from made_fits import POLICY, cause, channel, fitted, quiet, recorded, twin

from gfimu.base import STANDARD_GRAVITY
from gfimu.diagnosis import reading_curve
from gfimu.model import OF_READING
from sim.effects import make_effect

CHANNEL = "a12"
COMPROMISE = [cause("scale_factor", f"channel {CHANNEL}"), cause("quadratic", f"channel {CHANNEL}")]


def bent(size):
    def change(t, spin, readings, reference):
        readings[:, channel(CHANNEL)] += size * readings[:, channel(CHANNEL)] ** 3

    return change


@pytest.mark.parametrize(("size", "causes"), [(3e-4, COMPROMISE), (1.2e-4, COMPROMISE[1:])], ids=["two", "one"])
def test_a_cubic_takes_the_place_of_a_compromise(size, causes):
    found = reading_curve(*fitted(recorded(4, bent(size)), causes=causes))
    assert found.log_odds > POLICY.lack_odds
    assert found.instead
    assert found.signature.startswith(f"channel {CHANNEL} follows a curve")
    assert found.hints == (OF_READING,)
    [(key, coefficient)] = found.surrogate.items()
    assert key == f"{CHANNEL}: {OF_READING}"
    assert coefficient / STANDARD_GRAVITY**3 == pytest.approx(size, rel=0.15)


@pytest.mark.parametrize("causes", [COMPROMISE, COMPROMISE[1:]], ids=["two", "one"])
def test_effects_of_the_library_are_no_cubic(causes):
    hidden = [make_effect("quadratic", {f"{CHANNEL}_s2_m": 1e-3}, twin().array)]
    if len(causes) > 1:
        hidden.append(make_effect("scale_factor", {CHANNEL: 0.02}, twin().array))
    odds = reading_curve(*fitted(recorded(5, effects=hidden), causes=causes)).log_odds
    assert -float("inf") < odds < 0.0


def test_a_fit_without_effects_of_a_reading_has_no_curve():
    stretches, fit = quiet()
    moved = replace(fit, point=replace(fit.point, causes=(cause("sensor_position"), cause("sensor_lag"))))
    for one in (fit, moved):
        assert reading_curve(stretches, one).log_odds == -float("inf")
