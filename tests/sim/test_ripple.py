"""A torque ripple under a servo, differentiated by the command: against differences of the motion itself."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import BSpline

from sim.effects.table_dynamics import RippledSpin
from sim.motion import SpinState

DEGREE = 4
BREAKS = np.arange(-0.5, 8.51, 0.1)
KNOTS = np.concatenate([np.full(DEGREE, BREAKS[0]), BREAKS, np.full(DEGREE, BREAKS[-1])])
SIZE = len(KNOTS) - DEGREE - 1
T = np.arange(0.0, 8.0, 0.01)


class Command:
    """A commanded spin with spline coefficients."""

    def __init__(self, coefficients):
        self.spline = BSpline(KNOTS, coefficients, DEGREE)

    def at(self, t):
        return SpinState(*(self.spline.derivative(order)(t) if order else self.spline(t) for order in range(3)))


def command():
    """Coefficients of a rate that goes from 1 to 4 rad/s and back."""
    t = np.linspace(BREAKS[0], BREAKS[-1], 2000)
    angle = 2.5 * t - 1.5 * 8 / (2 * np.pi) * np.sin(2 * np.pi * t / 8)
    return np.linalg.lstsq(BSpline.design_matrix(t, KNOTS, DEGREE).toarray(), angle, rcond=None)[0]


def local(grid):
    """First coefficient that matters on a grid, and what angle and rate take from it and those after it."""
    first = np.clip(np.searchsorted(BREAKS, grid, side="right") - 1, 0, len(BREAKS) - 2)
    unit = BSpline(KNOTS, np.eye(SIZE), DEGREE)
    places = first[:, None] + np.arange(DEGREE + 1)
    return first, *(np.take_along_axis(one(grid), places, axis=1) for one in (unit, unit.derivative(1)))


@pytest.mark.parametrize(("amplitude", "order"), [(0.5, 4), (8.0, 12), (25.0, 10)])
def test_derivative_is_what_a_small_change_of_the_command_does(amplitude, order):
    coefficients, late = command(), T + 7e-4
    motion = RippledSpin(Command(coefficients), T, amplitude, order, 0.4)
    values, rows, ends = motion.derivative(*local(motion.grid), SIZE, late)

    def added(coefficients):
        rippled = RippledSpin(Command(coefficients), T, amplitude, order, 0.4).at(late)
        plain = Command(coefficients).at(late)
        return np.array(
            [rippled.angle - plain.angle, rippled.rate - plain.rate, rippled.acceleration - plain.acceleration]
        )

    for column in (10, 33, 60, 85):
        step = np.zeros(SIZE)
        step[column] = 1e-6
        difference = (added(coefficients + step) - added(coefficients - step)) / 2e-6  # (3, n)
        mine = slice(ends[column], ends[column + 1])
        largest = np.abs(difference).max(axis=1, keepdims=True)
        assert_allclose(values[:, mine] / largest, difference[:, rows[mine]] / largest, atol=1e-4)
        # What has nearly died away is left out.
        assert np.all(np.abs(np.delete(difference, rows[mine], axis=1)) < 0.05 * largest)
