"""Causes: sizes by run, what physics allows, and steps within it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_cases import cause_of, small_twin
from numpy.testing import assert_allclose

from gfimu.diagnosis import Cause, effects_of, mixing_of
from sim.effects import EFFECTS

ARRAY = small_twin().array


def test_sizes_are_coordinates_in_units_of_the_prior():
    tilt = cause_of("table_tilt", ARRAY, [1.0, -0.5])
    prior = [size.prior_std for size in EFFECTS["table_tilt"].sizes(ARRAY)]
    assert_allclose(tilt.sizes(ARRAY, 0), [prior[0], -0.5 * prior[1]])
    (effect,) = effects_of([tilt], ARRAY, 0)
    assert effect.parameters == pytest.approx({"x_rad": prior[0], "y_rad": -0.5 * prior[1]})
    assert tilt.key == ("table_tilt", tilt.place)


def test_an_effect_that_each_run_has_anew_has_its_own_sizes():
    family = EFFECTS["mount_tilt"]
    assert family.per_run
    (pattern, *_) = family.patterns(ARRAY)
    mixing = mixing_of(pattern, 2)
    count = pattern.mixing.shape[1]
    cause = Cause(family, "", mixing, {}, np.arange(1.0, 2 * count + 1.0))
    prior = np.array([size.prior_std for size in family.sizes(ARRAY)])
    first, second = (cause.sizes(ARRAY, run) / prior for run in (0, 1))
    assert_allclose(first, pattern.mixing @ cause.coordinates[:count])
    assert_allclose(second, pattern.mixing @ cause.coordinates[count:])


@pytest.mark.parametrize(("damping", "ends"), [(1e-3, True), (1.01e-3, False), (0.29, False), (0.3, True)])
def test_a_shape_at_the_end_of_its_range_is_noticed(damping, ends):
    mode = cause_of("resonance", ARRAY, [0.5], frequency_hz=8.0, damping_ratio=damping)
    assert mode.at_limits(ARRAY) == (["damping_ratio"] if ends else [])
    assert cause_of("table_tilt", ARRAY, [1e6, 0.0]).at_limits(ARRAY) == []  # which has no such range


def test_what_is_positive_stays_so():
    lag = cause_of("sensor_lag", ARRAY, [0.5])
    low, high = lag.limits(ARRAY)
    assert low.tolist() == [1e-6]
    assert lag.positive(ARRAY).tolist() == [True]
    assert lag.moved(np.array([-3.0]), ARRAY).coordinates.tolist() == [1e-6]
    tilt = cause_of("table_tilt", ARRAY, [0.5, 0.0])
    assert not tilt.positive(ARRAY).any()
    assert tilt.moved(np.array([-3.0, 1.0]), ARRAY).coordinates.tolist() == [-2.5, 1.0]
    assert (high > 0.0).all()


LIMITED = [
    name for name, one in EFFECTS.items() for size in one.sizes(ARRAY)[:1] if np.isfinite(getattr(size, "most", np.inf))
]


@pytest.mark.parametrize("name", LIMITED)
def test_sizes_stay_within_the_largest(name):
    cause, size = cause_of(name, ARRAY), EFFECTS[name].sizes(ARRAY)[0]
    far = cause.moved(np.concatenate([np.full(len(cause.coordinates), 1e6), np.zeros(len(cause.free_shape))]), ARRAY)
    assert far.sizes(ARRAY, 0)[0] == pytest.approx(size.most)


def test_some_sizes_have_a_largest():
    assert LIMITED


def test_shapes_step_in_their_logarithm_and_angles_linearly():
    mode = cause_of("resonance", ARRAY)
    (frequency,) = (key for key in mode.free_shape if key.endswith("_hz"))
    step = np.zeros(mode.unknowns)
    step[len(mode.coordinates) + mode.free_shape.index(frequency)] = 0.1
    assert mode.moved(step, ARRAY).shape[frequency] == pytest.approx(mode.shape[frequency] * np.exp(0.1))
    assert replace(mode, held=True).free_shape == ()
    assert replace(mode, held=True).unknowns == len(mode.coordinates)
    ripple = next(
        cause_of(name, ARRAY) for name in EFFECTS if any(k.endswith("_rad") for k in cause_of(name, ARRAY).shape)
    )
    key = next(k for k in ripple.free_shape if k.endswith("_rad"))
    assert ripple.shape_moved(key, -0.2) == pytest.approx(ripple.shape[key] - 0.2)


def test_the_reach_of_coordinates_is_that_of_their_sizes():
    family = EFFECTS["bias"]
    one = np.eye(ARRAY.n_channels)[:, [2]]
    assert np.flatnonzero(Cause(family, "", one, {}, np.ones(1)).reach(ARRAY)[0]).tolist() == [2]


def test_shapes_are_apart_by_ratios_and_angles():
    mode = cause_of("resonance", ARRAY, frequency_hz=8.0, damping_ratio=0.02)
    other = replace(mode, shape={"frequency_hz": 8.0 * np.exp(0.3), "damping_ratio": 0.02 * np.exp(-0.4)})
    assert mode.apart(other) == pytest.approx(0.5)
    assert other.apart(mode) == pytest.approx(0.5)
    assert mode.apart(mode) == 0.0
    nod = cause_of("axis_wobble", ARRAY, direction_rad=0.2)
    assert nod.apart(replace(nod, shape={"direction_rad": -0.1})) == pytest.approx(0.3)
    assert cause_of("table_tilt", ARRAY).apart(cause_of("table_tilt", ARRAY)) == 0.0
