"""Free numbers on a pattern are told from numbers that happen to be as they are."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gfimu import AccelerometerArray
from gfimu.diagnosis import Cause
from gfimu.diagnosis.criticism.coincidence.bound_numbers import coincidences
from gfimu.diagnosis.criticism.coincidence.patterns import Pattern, channel_patterns, chip_patterns, distinct
from gfimu.diagnosis.fit.gauss_newton import Fit
from gfimu.diagnosis.fit.linear import Point
from sim.effects import EFFECTS

ARRAY, UPRIGHT = AccelerometerArray.load("cube12"), np.eye(3)
ENOUGH = 5.0  # nats


def numbers_of(effect, values):
    """A cause with some sizes in their units, the same for all coordinates."""
    family = EFFECTS[effect]
    prior = np.array([size.prior_std for size in family.sizes(ARRAY)])
    return Cause(family, "all", np.eye(len(prior)), {}, np.asarray(values) / prior)


def fitted(causes, strength, rng):
    """A fit whose data determine the numbers to a fraction of their prior, each as well as they happen to."""
    z = np.concatenate([cause.coordinates for cause in causes])
    mix = rng.standard_normal((3 * len(z), len(z)))
    gram = strength * mix.T @ mix / len(mix)
    score = gram @ z + np.linalg.cholesky(gram) @ rng.standard_normal(len(z))
    covariance = np.linalg.inv(gram + np.eye(len(z)) * 1e-3)
    ends = np.cumsum([0, *(len(cause.coordinates) for cause in causes)])
    told = tuple(
        Cause(c.family, c.place, c.mixing, {}, (covariance @ score)[a:b], covariance=covariance[a:b, a:b])
        for c, a, b in zip(causes, ends[:-1], ends[1:], strict=True)
    )
    return Fit(Point(told, (), ()), 0.0, 0.0, 0.0, gram, score)


@pytest.mark.parametrize("effect", ["quadratic", "bias", "scale_factor", "sensor_position", "misalignment"])
def test_numbers_that_nothing_binds_are_no_coincidence(effect):
    rng = np.random.default_rng(5)
    family = EFFECTS[effect]
    prior = np.array([size.prior_std for size in family.sizes(ARRAY)])
    odds = []
    for strength in np.repeat([30.0, 1e3, 1e5], 15):
        free = numbers_of(effect, prior * rng.standard_normal(len(prior)))
        odds += [one.log_odds for one in coincidences(fitted([free], strength, rng), ARRAY, UPRIGHT)]
    assert len(odds) == 45
    assert max(odds) < ENOUGH


@pytest.mark.parametrize(
    ("effect", "values", "pattern"),
    [
        ("quadratic", -np.sum(ARRAY.positions[:, :2] * ARRAY.axes[:, :2], axis=1), "the centripetal arm"),
        ("bias", ARRAY.axes[:, 2], "gravity"),
        ("sensor_position", np.tile([1.0, -0.5, 0.0], len(ARRAY.chips)), "a number per component"),
        ("sensor_position", np.cross([0, 0, 1.0], ARRAY.chip_positions).ravel(), "a turn of the whole array about z"),
    ],
    ids=["as the arm", "as gravity", "the whole array moved", "the whole array turned"],
)
@pytest.mark.parametrize("scatter", [0.0, 0.01])
def test_what_one_thing_upstream_does_is_told_by_its_pattern(effect, values, pattern, scatter):
    rng = np.random.default_rng(6)
    prior = np.array([size.prior_std for size in EFFECTS[effect].sizes(ARRAY)])
    scaled = values / np.abs(values / prior).max() + scatter * prior * rng.standard_normal(len(prior))
    best = coincidences(fitted([numbers_of(effect, scaled)], 1e5, rng), ARRAY, UPRIGHT)[0]
    assert best.log_odds > ENOUGH
    assert pattern in best.pattern or "on sensing axis 3" in best.pattern
    assert best.causes == (effect,)
    assert best.numbers == len(prior) > best.free
    assert effect in best.sentence


@pytest.mark.parametrize(("factor", "way"), [(-1.0, "opposite"), (1.0, "equal"), (0.37, "proportional")])
def test_two_causes_with_the_same_numbers_are_told(factor, way):
    rng = np.random.default_rng(7)
    values = 0.05 * rng.standard_normal(ARRAY.n_channels)
    bound = [numbers_of("bias", values), numbers_of("warm_up", factor * values)]
    best = coincidences(fitted(bound, 1e5, rng), ARRAY, UPRIGHT)[0]
    assert best.causes == ("bias", "warm_up")
    assert way in best.pattern
    assert best.log_odds > ENOUGH
    apart = [bound[0], numbers_of("warm_up", 0.05 * rng.standard_normal(ARRAY.n_channels))]
    assert coincidences(fitted(apart, 1e5, rng), ARRAY, UPRIGHT)[0].log_odds < ENOUGH


def test_arms_are_those_of_the_mounting():
    turned = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # a quarter about x: y is up
    upright, lying = (
        {one.name: one.columns[:, 0] for one in channel_patterns(ARRAY, mount)} for mount in (UPRIGHT, turned)
    )
    assert_allclose(upright["the share of gravity"], ARRAY.axes[:, 2])
    assert_allclose(lying["the share of gravity"], ARRAY.axes[:, 1])
    assert_allclose(upright["the centripetal arm"], ARRAY.centripetal_matrix[:, 2])
    assert_allclose(upright["the tangential arm"], ARRAY.regression_matrix[:, 2])


def test_patterns_that_span_the_same_are_tried_once():
    prior = np.ones(8)
    ramp = np.arange(8.0)
    tried = [Pattern("ramp", ramp[:, None]), Pattern("twice", -2.0 * ramp[:, None]), Pattern("few", np.eye(8)[:, :1])]
    [one] = distinct(tried, prior)
    assert one.name == "ramp"
    assert_allclose(np.sum(one.columns**2), 7.0)  # of unit rms over its seven entries


def test_one_number_per_chip_has_no_turn_of_the_cube():
    assert not [one for one in chip_patterns(ARRAY, UPRIGHT, 1) if "turn" in one.name]
    assert [one for one in chip_patterns(ARRAY, UPRIGHT, 3) if "turn" in one.name]
