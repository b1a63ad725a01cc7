"""Fits of causes: sizes with their standard deviations, shapes, and the evidence of what is not there."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from core_cases import cause_of, lively, small_twin, stretches_of
from scipy.interpolate import CubicSpline

from gfimu.diagnosis import NoiseLevels, Policy, starting_point
from gfimu.diagnosis.fit.gauss_newton import SETTLED, fit, linearly_without, log_prior
from gfimu.diagnosis.fit.learn import learn_roughness
from gfimu.diagnosis.fit.linear import energy_of

TWIN = small_twin()
ARRAY = TWIN.array
POLICY = Policy()


def started(effects=(), seed=1, duration=8.0):
    """Stretches of white noise and the point at which a fit of them starts."""
    stretches = stretches_of(TWIN, effects, seed=seed, duration=duration, motion=lively(), bias_instability=0.0)
    point = learn_roughness(stretches, starting_point(stretches, 0.1), 2)
    levels = tuple(NoiseLevels(one.white, np.full(7, 1e-5)) for one in point.levels)
    return stretches, replace(point, levels=levels)


def test_sizes_are_found_with_their_standard_deviations():
    truth = np.array([1.5, -0.8])
    hidden = cause_of("table_tilt", ARRAY, truth)
    chi2 = 0.0
    for seed in range(6):
        stretches, point = started([hidden.effect(ARRAY, 0)], seed)
        found = fit(stretches, replace(point, causes=(hidden.at(np.zeros(2)),)), POLICY)
        off = found.causes[0].coordinates - truth
        chi2 += float(off @ np.linalg.solve(found.causes[0].covariance, off))
        assert found.objective == pytest.approx(energy_of(stretches, found.point))
    assert 3.0 < chi2 < 28.3  # of 12 degrees of freedom, both sides at a half percent


def test_a_shape_is_found_with_its_standard_deviation():
    hidden = cause_of("warm_up", ARRAY, np.linspace(3.0, 6.0, 6), time_constant_s=2.5)
    stretches, point = started([hidden.effect(ARRAY, 0)])
    start = cause_of("warm_up", ARRAY, np.ones(6), time_constant_s=4.0)
    (found,) = fit(stretches, replace(point, causes=(start,)), replace(POLICY, steps=25)).causes
    std = found.shape_std["time_constant_s"]
    assert std < 0.5
    assert abs(found.shape["time_constant_s"] - 2.5) < 4.0 * std


def test_what_is_there_is_more_probable_and_what_is_not_is_less():
    hidden = cause_of("table_tilt", ARRAY, [1.5, -0.8])
    stretches, point = started([hidden.effect(ARRAY, 0)])
    nothing = fit(stretches, point, POLICY)
    assert (nothing.causes, nothing.names, nothing.key) == ((), frozenset(), frozenset())
    there = fit(stretches, replace(point, causes=(hidden.at(np.zeros(2)),)), POLICY)
    assert there.log_evidence > nothing.log_evidence + 100.0
    both = fit(stretches, replace(there.point, causes=(*there.causes, cause_of("scale_factor", ARRAY))), POLICY)
    assert both.objective <= there.objective + SETTLED
    assert both.log_evidence < there.log_evidence
    assert both.names == {"table_tilt", "scale_factor"}


def test_what_is_left_without_a_cause_follows_from_the_linear_world():
    tilt, bias = cause_of("table_tilt", ARRAY, [0.3, -0.2]), cause_of("bias", ARRAY, np.linspace(-0.2, 0.2, 6))
    stretches, point = started([tilt.effect(ARRAY, 0), bias.effect(ARRAY, 0)])
    both = fit(stretches, replace(point, causes=(tilt.at(np.zeros(2)), bias.at(np.zeros(6)))), POLICY)
    for place in range(2):
        alone = fit(stretches, replace(both.point, causes=(both.causes[1 - place],)), POLICY)
        told = linearly_without(both, both.causes[place], POLICY)
        assert told.key == alone.key
        assert both.log_posterior - alone.log_posterior > 10.0
        assert told.log_posterior - both.log_posterior == pytest.approx(
            alone.log_posterior - both.log_posterior, rel=0.02, abs=1.0
        )
        assert told.objective == pytest.approx(alone.objective, rel=0.01)


def test_a_size_of_one_sign_keeps_it():
    stretches, point = started()
    found = fit(stretches, replace(point, causes=(cause_of("centrifugal_flex", ARRAY, [1.0]),)), POLICY)
    (cause,) = found.causes
    assert cause.coordinates[0] > 0.0
    assert cause.coordinates[0] < 4.0 * np.sqrt(cause.covariance[0, 0])


def test_prior_of_a_set():
    one, other = (
        replace(cause_of(name, ARRAY), log_prior=value) for name, value in (("gravity", -3.0), ("bias", -5.0))
    )
    assert log_prior((), POLICY) == 0.0
    assert log_prior((one,), POLICY) == -3.0
    assert log_prior((one, other), POLICY) == -8.0 + POLICY.extra_cause


class Bounded:
    """A simulation that answers only as long as its table is tilted by no more than a bound."""

    def __init__(self, monkeypatch, bound, failing):
        self.refused, usual = 0, type(TWIN).predict

        def predict(twin, spin, t, *, effects=(), **more):
            if any(abs(effect.parameters.get("x_rad", 0.0)) > bound for effect in effects):
                self.refused += 1
                return failing(*usual(twin, spin, t, effects=effects, **more))
            return usual(twin, spin, t, effects=effects, **more)

        monkeypatch.setattr(type(TWIN), "predict", predict)


def not_finite(channels, reference):
    return channels * np.nan, reference


def overflowing(channels, reference):
    return np.exp(1e3 * np.abs(channels) + 1e3), reference


def without_spline(channels, reference):
    return CubicSpline(np.arange(len(channels)), channels * np.nan)(0.0), reference


def singular(channels, reference):
    return np.linalg.solve(np.zeros((2, 2)), np.ones(2)), reference


def dividing(channels, reference):
    return channels / math.sin(0 // int(channels.size < 0)), reference


@pytest.mark.parametrize("failing", [not_finite, overflowing, without_spline, singular, dividing])
def test_a_step_to_where_there_is_no_prediction_is_rejected_and_shortened(monkeypatch, failing):
    hidden = cause_of("table_tilt", ARRAY, [1.5, -0.8])
    stretches, point = started([hidden.effect(ARRAY, 0)])
    start = replace(point, causes=(hidden.at(np.zeros(2)),))
    whole = fit(stretches, start, POLICY)
    (x, _) = whole.causes[0].effect(ARRAY, 0).parameters.values()
    world = Bounded(monkeypatch, 0.7 * abs(x), failing)
    found = fit(stretches, start, POLICY)
    assert world.refused
    assert abs(found.causes[0].effect(ARRAY, 0).parameters["x_rad"]) <= 0.7 * abs(x)
    assert whole.objective < found.objective < energy_of(stretches, start)
    assert energy_of(stretches, whole.point) == np.inf


def test_learning_does_not_move_a_drive_to_where_there_is_no_prediction(monkeypatch):
    stretches, point = started()
    drive = point.drives[0]
    pushed = replace(point, drives=(drive.moved(np.full(len(drive.coefficients), 0.3)),))
    usual = type(TWIN).predict
    held = pushed.drives[0].spin.at(stretches[0].run.t).angle

    def predict(twin, spin, t, **more):
        channels, reference = usual(twin, spin, t, **more)
        far = np.abs(spin.at(t).angle[: len(held)] - held[: len(t)]).max() > 1e-3
        return channels * (np.nan if far else 1.0), reference

    monkeypatch.setattr(type(TWIN), "predict", predict)
    learnt = learn_roughness(stretches, pushed, 3)
    assert np.isfinite(learnt.drives[0].roughness).all()
    assert np.abs(learnt.drives[0].spin.at(stretches[0].run.t).angle - held).max() <= 1e-3


def test_faults_of_a_simulation_itself_are_raised(monkeypatch):
    stretches, point = started()

    def predict(twin, spin, t, **more):
        raise KeyError("a key that is missing")

    monkeypatch.setattr(type(TWIN), "predict", predict)
    with pytest.raises(KeyError, match="missing"):
        fit(stretches, point, POLICY)
