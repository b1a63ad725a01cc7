"""A twin keeps the worlds that it is asked for again, and takes none for another."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from gfimu import AccelerometerArray
from sim import SplineSpin, forward
from sim.effects import make_effect
from sim.twin import Twin

T = np.linspace(0.0, 2.0, 40)
SPIN = SplineSpin.through(T, 3.0 + np.sin(T))
FAR, NEAR = (make_effect("eccentricity", {"x_m": x, "y_m": 0.0}) for x in (0.03, 0.01))


def twin():
    return Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


@pytest.mark.parametrize(
    "asked",
    [{"effects": [FAR]}, {"effects": [NEAR]}, {"effects": [FAR, NEAR]}, {"mounting": np.array([0.5, 0, 0])}, {}],
    ids=["far", "near", "both", "turned", "plain"],
)
def test_what_was_asked_for_before_changes_no_prediction(asked):
    used = twin()
    for before in ({"effects": [FAR]}, {"effects": [NEAR]}, {"mounting": np.zeros(3)}, {}, asked):
        used.predict(SPIN, T, **before)
    for told, right in zip(used.predict(SPIN, T, **asked), twin().predict(SPIN, T, **asked), strict=True):
        assert_array_equal(told, right)


def test_effects_that_are_gone_leave_no_world_behind():
    used = twin()
    for x in np.linspace(0.0, 0.05, 60):  # each may get the identity of one before
        effects = [make_effect("eccentricity", {"x_m": float(x), "y_m": 0.0})]
        assert_array_equal(used.predict(SPIN, T, effects=effects)[0], twin().predict(SPIN, T, effects=effects)[0])
        del effects


def test_a_world_is_placed_once(monkeypatch):
    placed, kept = [], forward.table_geometry
    monkeypatch.setattr(forward, "table_geometry", lambda world: placed.append(world) or kept(world))
    used = twin()
    for _ in range(5):
        used.predict(SPIN, T, effects=[FAR])
    assert len(placed) == 1
