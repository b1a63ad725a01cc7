"""The clocks of board and reference agree when a recording begins, whatever the board's shows then."""

from __future__ import annotations

import numpy as np
import pytest

from gfimu.model import SpinState
from sim.effects import make_effect
from sim.trials import random_profile
from sim.twin import Twin

TWIN = Twin.load("cube12_turntable")
FAST = make_effect("clock_error", {"ratio": 0.004})
T = np.arange(0.0, 20.0, 0.01)


class Later:
    """A motion that begins later."""

    def __init__(self, spin, by: float) -> None:
        self.spin, self.by = spin, by

    def at(self, t) -> SpinState:
        return self.spin.at(np.asarray(t) - self.by)


def test_a_clock_error_does_not_grow_with_the_time_at_which_a_recording_begins():
    spin = random_profile(np.random.default_rng(2), 20.0)
    channels, reference = TWIN.predict(spin, T, effects=[FAST], start=0.0)
    later, reference_later = TWIN.predict(Later(spin, 5000.0), T + 5000.0, effects=[FAST], start=5000.0)
    np.testing.assert_allclose(later, channels, atol=1e-6)
    np.testing.assert_allclose(reference_later, reference, atol=1e-8)


def test_board_times_are_true_at_the_start():
    world = TWIN.world([FAST], None, 100.0)
    assert world.true_times(np.array([100.0, 200.4])) == pytest.approx([100.0, 200.0])
    assert TWIN.world([FAST]).true_times(np.array([0.0, 100.4])) == pytest.approx([0.0, 100.0])
