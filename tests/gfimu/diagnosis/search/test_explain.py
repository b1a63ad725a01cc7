"""The search: it names what is hidden, one defined here outside the package as well, and nothing in noise."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from core_cases import cause_of, lively, small_twin, stretches_of
from numpy.testing import assert_allclose
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from gfimu import AccelerometerArray
from gfimu.diagnosis import Policy, State, starting_point
from gfimu.diagnosis.fit.posterior import condition
from gfimu.diagnosis.search.explain import explain, reduced
from gfimu.diagnosis.search.sets import Sets, excess, has_stalled, prune
from sim import SplineSpin
from sim.effects import EFFECTS, Effect, Size
from sim.twin import Twin

TWIN = small_twin()


class SlowCoupling:
    """A share of the cube's rate that follows the table's by a first-order lag."""

    def __init__(self, motion, t, share, time_constant):
        step = 2e-3
        grid = np.arange(t[0] - 0.1, t[-1] + 0.2, step)
        rate = motion.at(grid).rate
        keep = np.exp(-step / time_constant)
        late, _ = lfilter([1.0 - keep], [1.0, -keep], rate, zi=[keep * rate[0]])
        self._motion, self._rate = motion, CubicSpline(grid, share * (late - rate))
        self._angle, self._acceleration = self._rate.antiderivative(), self._rate.derivative()

    def at(self, t):
        state = self._motion.at(t)
        return State(
            state.angle + self._angle(t), state.rate + self._rate(t), state.acceleration + self._acceleration(t)
        )


class SoftCoupling(Effect):
    """An effect with memory that the package does not have."""

    name = "soft_coupling"
    summary = "part of the cube's rate lags the table's"
    place = "motion"

    @classmethod
    def sizes(cls, array: AccelerometerArray):
        return (Size("share", "", 0.05),)

    @classmethod
    def shapes(cls, duration, sample_rate):
        return tuple({"time_constant_s": tau} for tau in (0.1, 0.2, 0.4))

    def apply(self, world):
        share, tau = self.value("share"), self.value("time_constant_s", 0.2)
        return world.changed(mount_steps=(*world.mount_steps, lambda motion, t: SlowCoupling(motion, t, share, tau)))


class LargerLibrary(Twin):
    """A twin whose library has one effect more."""

    def families(self):
        return {**EFFECTS, SoftCoupling.name: SoftCoupling}


@pytest.fixture(scope="module")
def foreign():
    twin = LargerLibrary(array=TWIN.array, array_name=TWIN.array_name, sample_rate=50.0)
    effect = SoftCoupling({"share": 0.15, "time_constant_s": 0.25})
    return effect, stretches_of(twin, [effect], duration=8.0, motion=lively())


def test_the_derivative_holds_the_memory_of_an_effect_from_outside(foreign):
    effect, stretches = foreign
    (drive,) = starting_point(stretches, 0.05).drives
    jacobian = condition(stretches[0], drive, [effect], stretches[0].first_levels).jacobian
    step = 1e-5
    for number in range(20, drive.spline.size - 20, 25):
        unit = np.eye(drive.spline.size)[number]
        up, down = (stretches[0].predict([effect], drive.moved(sign * step * unit).spin) for sign in (1.0, -1.0))
        truth = (up - down) / (2.0 * step)
        assert np.linalg.norm(jacobian.times(unit) - truth) < 1e-2 * np.linalg.norm(truth)


def test_an_effect_from_outside_is_named(foreign):
    effect, stretches = foreign
    found = explain(stretches, Policy())
    assert found.best.names == {"soft_coupling"}
    (cause,) = found.best.causes
    std = 0.05 * float(np.sqrt(cause.covariance[0, 0]))
    assert abs(float(cause.sizes(stretches[0].model.array, 0)[0]) - effect.value("share")) < 5.0 * std
    assert abs(cause.shape["time_constant_s"] - 0.25) < 5.0 * cause.shape_std["time_constant_s"]


@pytest.fixture(scope="module")
def tilted():
    hidden = cause_of("table_tilt", TWIN.array, [1.0, -0.5])
    return explain(stretches_of(TWIN, [hidden.effect(TWIN.array, 0)], duration=8.0, motion=lively()), Policy())


def test_what_is_hidden_is_named(tilted):
    assert tilted.best.names == {"table_tilt"}
    (cause,) = tilted.best.causes
    off = cause.coordinates - np.array([1.0, -0.5])
    assert float(off @ np.linalg.solve(cause.covariance, off)) < 18.4  # one in ten thousand
    assert tilted.nothing.causes == ()
    assert tilted.best.log_posterior > tilted.nothing.log_posterior + 50.0
    assert tilted.without["table_tilt"].key == frozenset()
    values = [one.log_posterior for one in tilted.rivals]
    assert values == sorted(values, reverse=True)
    assert all(one.key != tilted.best.key and one.causes for one in tilted.rivals)


def test_without_a_cause_the_others_are_judged_anew(tilted):
    less = reduced(tilted, "table_tilt", Policy())
    assert less.best.causes == ()
    assert less.best.log_posterior == tilted.nothing.log_posterior


def test_the_last_screening_is_about_the_best_set(tilted):
    screening = tilted.screening
    (cause,) = tilted.best.causes
    mine = next(one for one in screening.signatures if one.family.name == "table_tilt")
    assert_allclose(screening.base[mine.columns], cause.mixing @ cause.coordinates)
    assert np.count_nonzero(screening.base) == 2


@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_found_in_noise(seed):
    found = explain(stretches_of(TWIN, seed=seed, duration=8.0), Policy())
    assert found.best.causes == ()
    assert found.best is found.nothing or found.best.key == found.nothing.key


def test_a_set_far_behind_is_not_fitted(tilted, monkeypatch):
    added = cause_of("mount_tilt", TWIN.array, [0.0, 0.0])
    best = replace(tilted.best, point=replace(tilted.best.point, causes=(*tilted.best.causes, added)))
    size = len(tilted.best.score)
    gram = np.zeros((size + 2, size + 2))
    gram[:size, :size], score = tilted.best.gram, np.append(tilted.best.score, [0.0, 0.0])
    best = replace(best, gram=gram, score=score, log_posterior=tilted.best.log_posterior - 1.0)
    fitted = []
    monkeypatch.setattr("gfimu.diagnosis.search.sets.each_apart", lambda work, items, keep: [*map(work, items)])
    monkeypatch.setattr(Sets, "_roughly", lambda self, point: fitted.append(frozenset(c.name for c in point.causes)))
    for strong, expected in ((True, [frozenset({"table_tilt"})]), (False, [{"table_tilt"}, {"mount_tilt"}])):
        sets = Sets(tilted.stretches, best.point, Policy())
        fitted.clear()
        sets.without_each(best if strong else replace(best, score=1e-3 * score))
        assert sorted(fitted, key=sorted) == sorted(expected, key=sorted)
        assert (frozenset({added.key}) in sets.found) == strong


@pytest.mark.parametrize(("name", "share"), [("cogging", 0.02), ("hysteresis", 0.01), ("table_tilt", 0.0)])
def test_a_further_cause_must_bring_more_than_an_inexact_one_leaves(tilted, name, share):
    """A set of two whose second brings a little less, and a little more, than the share of the first."""
    policy, explained = Policy(), 10_000.0
    strong, weak = cause_of(name, TWIN.array), cause_of("mount_tilt", TWIN.array)
    assert strong.family.inexactness == share
    for beyond, kept in ((-1.0, {name}), (1.0, {name, "mount_tilt"})):
        worth = policy.extra_odds + share * (explained + beyond) + beyond
        sets = Sets(tilted.stretches, tilted.best.point, policy)
        for causes, value in (((strong, weak), explained + worth), ((strong,), explained), ((weak,), worth), ((), 0.0)):
            one = replace(tilted.best, point=replace(tilted.best.point, causes=causes), log_posterior=value)
            sets.found[one.key] = one
        assert prune(sets).names == kept


@pytest.mark.study
def test_a_cause_that_bends_the_drive_is_found_though_knots_could_follow(monkeypatch):
    """Closer knots follow a strong ripple of the torque, too: which is more probable, their evidences say."""
    hidden = cause_of("cogging", TWIN.array, [30.0, 10.0], order=5.0)
    motion = SplineSpin(CubicSpline(np.arange(-2.0, 14.0, 0.5), 4.0 + np.sin(np.arange(-2.0, 14.0, 0.5))))
    stretches = stretches_of(TWIN, [hidden.effect(TWIN.array, 0)], duration=10.0, motion=motion)
    found = explain(stretches, Policy())
    assert found.best.names == {"cogging"}


@pytest.mark.parametrize(
    ("before", "after", "free_body", "hardly"),
    [(10.0, 9.6, False, True), (10.0, 5.0, False, False), (1.3, 1.29, False, False), (10.0, 9.6, True, False)],
    ids=["a little less of much", "half", "near the noise", "a body in the hand"],
)
def test_more_of_the_same_leads_nowhere_where_much_is_left_and_hardly_less(before, after, free_body, hardly):
    stretches = [SimpleNamespace(observations=600), SimpleNamespace(observations=400)]
    fits = [SimpleNamespace(objective=1000.0 * value) for value in (before, after)]
    assert excess(stretches, fits[1]) == pytest.approx(after - 1.0)
    assert has_stalled(stretches, *fits, replace(Policy(), free_body=free_body)) == hardly
