"""Gravity in the readings of few chips: a file in g, in mg or without gravity is refused, a right one is not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gfimu import AccelerometerArray, Chip
from gfimu.base import STANDARD_GRAVITY
from gfimu.recording import Recording, doubts_of

ONE = AccelerometerArray("one", (Chip("a1", np.array([0.15, 0.0, 0.0]), np.eye(3), "generic"),))


def wheel(rate, *, tilt=np.pi / 2, duration=30.0):
    """Return a recording of one chip 0.15 m off an axis that turns at a steady rate, biases of 0.3 m/s² in it."""
    t = np.arange(0.0, duration, 0.01)
    up = Rotation.from_rotvec([0.0, tilt, 0.0]).apply([0.0, 0.0, STANDARD_GRAVITY])
    force = Rotation.from_rotvec(np.outer(-rate * t, [0.0, 0.0, 1.0])).apply(up)
    force += [-0.15 * rate**2 + 0.3, -0.3, 0.3]
    force += 0.05 * np.random.default_rng(1).standard_normal(force.shape)
    return Recording.from_arrays(t, force, ONE)


RUNS = {
    "at rest": wheel(0.0),
    "a wheel": wheel(6.0),
    "a fast wheel": wheel(15.0),
    "an upright table": wheel(5.0, tilt=0.0),
    "an inclined table": wheel(8.0, tilt=0.6),
}


@pytest.mark.parametrize("run", RUNS.values(), ids=RUNS)
def test_a_right_file_passes(run):
    assert doubts_of(run, ONE) == ()


@pytest.mark.parametrize("name", [name for name in RUNS if name != "a fast wheel"])
@pytest.mark.parametrize(("unit", "factor"), [("g", 1.0), ("mg", 1000.0)])
def test_another_unit_is_refused_by_its_name(name, unit, factor):
    run = RUNS[name]
    (finding,) = doubts_of(replace(run, readings=run.readings * factor / STANDARD_GRAVITY, unit_from=""), ONE)
    assert finding.refused
    assert finding.kind == "unit"
    assert f"…_{unit}" in finding.text


def test_a_fast_wheel_in_g_is_known_by_the_gravity_that_turns():
    run = RUNS["a fast wheel"]  # 3.4 g of centripetal force: as such no sign of a wrong unit
    (finding,) = doubts_of(replace(run, readings=run.readings / STANDARD_GRAVITY), ONE)
    assert finding.refused
    assert "gravity turns in it by 0.99" in finding.text


def test_a_file_without_gravity_is_refused():
    run = RUNS["at rest"]
    (finding,) = doubts_of(replace(run, readings=run.readings - [STANDARD_GRAVITY, 0.0, 0.0]), ONE)
    assert finding.refused
    assert "9.81" in finding.text


def test_a_poor_gain_is_a_warning_only():
    run = RUNS["at rest"]
    (finding,) = doubts_of(replace(run, readings=0.5 * run.readings), ONE)
    assert not finding.refused
    assert "calibrate" in finding.text
