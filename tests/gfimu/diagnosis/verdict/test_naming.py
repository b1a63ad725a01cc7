"""Names of causes: parameters by the delta method, probabilities, rivals and confounded effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_cases import cause_of, lively, small_twin, stretches_of
from numpy.testing import assert_allclose

from gfimu import NamedCause
from gfimu.diagnosis import Policy, starting_point
from gfimu.diagnosis.fit.gauss_newton import Fit
from gfimu.diagnosis.fit.linear import Point
from gfimu.diagnosis.search.explain import Explanation
from gfimu.diagnosis.search.screening import screen
from gfimu.diagnosis.verdict.naming import (
    capped,
    cause_parameters,
    channel_share,
    conflicting,
    contested,
    fault_causes,
    mimics,
    name_cause,
    probabilities,
    rival_list,
)
from sim.effects import EFFECTS, make_effect

TWIN = small_twin("cube12")
ARRAY = TWIN.array
POLICY = Policy()


def fit_of(names, log_posterior, objective=100.0):
    causes = tuple(cause_of(name, ARRAY) for name in names)
    return Fit(Point(causes, (), ()), log_posterior, log_posterior, objective, np.zeros((0, 0)), np.zeros(0))


def explanation_of(best, *rivals, nothing=-500.0, screening=None):
    return Explanation(best, fit_of((), nothing, 900.0), {}, rivals, screening)


def test_parameters_by_the_delta_method_equal_simulated_ones():
    covariance = np.array([[2e-4, 6e-5], [6e-5, 3e-4]])
    cause = replace(cause_of("cogging", ARRAY, [1.2, -0.7], order=4.0), covariance=covariance)
    parameters, std = cause_parameters(cause, ARRAY)
    draws = np.random.default_rng(1).multivariate_normal(cause.coordinates, covariance, 4000)
    drawn = [cause.at(one).effect(ARRAY, 0).parameters for one in draws]
    assert parameters["amplitude_rad_s2"] == pytest.approx(np.hypot(1.2, 0.7))
    for key in ("amplitude_rad_s2", "phase_rad"):
        assert std[key] == pytest.approx(np.std([one[key] for one in drawn]), rel=0.06)
    assert parameters["order"] == 4.0
    assert "order" not in std  # a whole number has no standard deviation


def test_a_phase_goes_round_the_circle():
    cause = replace(cause_of("cogging", ARRAY, [-1.0, 1e-6], order=4.0), covariance=1e-4 * np.eye(2))
    _, std = cause_parameters(cause, ARRAY)
    assert std["phase_rad"] == pytest.approx(0.01, rel=1e-2)


def test_units_shapes_and_zeros():
    cause = cause_of("warm_up", ARRAY, np.append(2.0, np.zeros(11)), time_constant_s=9.0)
    cause = replace(cause, covariance=np.diag(np.append(0.04, np.zeros(11))), shape_std={"time_constant_s": 1.5})
    parameters, std = cause_parameters(cause, ARRAY)
    prior = EFFECTS["warm_up"].sizes(ARRAY)[0].prior_std
    assert parameters == {f"{ARRAY.channels[0]}_m_s2": pytest.approx(2.0 * prior), "time_constant_s": 9.0}
    assert std == {f"{ARRAY.channels[0]}_m_s2": pytest.approx(0.2 * prior, rel=1e-3), "time_constant_s": 1.5}


def test_probabilities_are_shares_of_the_sets_that_hold_an_effect():
    best, rival = fit_of(("bias",), 0.0), fit_of(("gravity",), -1.2)
    both = fit_of(("gravity", "bias"), -2.4)
    found = probabilities(explanation_of(best, rival, both), POLICY)
    weight = np.exp(np.array([0.0, -1.2, -2.4]) / POLICY.temperature)
    assert found["bias"] == pytest.approx((weight[0] + weight[2]) / weight.sum())
    assert found["gravity"] == pytest.approx((weight[1] + weight[2]) / weight.sum())
    # Nothing is ever quite certain, and a set that is listed twice counts once.
    assert probabilities(explanation_of(best, nothing=-1e4), POLICY)["bias"] == POLICY.most_certain
    assert probabilities(explanation_of(best, rival, both, rival), POLICY) == pytest.approx(found)


def test_what_does_not_stand_out_is_no_surer_than_that():
    seen = NamedCause("bias", {"a_m_s2": 0.3, "b_m_s2": 0.01}, {"a_m_s2": 0.1, "b_m_s2": 0.1}, 0.99)
    assert capped(seen, POLICY) is seen
    unseen = replace(seen, parameters={"a_m_s2": 0.15, "b_m_s2": -0.15})
    assert capped(unseen, POLICY).probability == 1.0 - POLICY.small
    # A shape is never near zero and a phase is compared with nothing.
    mode = NamedCause("resonance", {"gain": 0.1, "frequency_hz": 8.0}, {"gain": 0.1, "frequency_hz": 0.1}, 0.99)
    assert capped(mode, POLICY).probability == 0.99
    assert capped(mode, POLICY, {"frequency_hz"}).probability == 1.0 - POLICY.small
    turn = NamedCause("cogging", {"amplitude": 0.1, "phase_rad": 3.0}, {"amplitude": 0.1, "phase_rad": 0.1}, 0.99)
    assert capped(turn, POLICY).probability == 1.0 - POLICY.small
    assert capped(replace(unseen, std={}), POLICY).probability == 0.99
    assert capped(replace(unseen, probability=0.4), POLICY).probability == 0.4


def test_rivals_that_the_data_can_not_tell_from_the_best():
    best = fit_of(("bias",), 0.0)
    close, far = fit_of(("gravity",), -POLICY.ambiguous + 0.1), fit_of(("quadratic",), -POLICY.ambiguous - 0.1)
    larger, same = fit_of(("gravity", "cogging"), -0.1), fit_of(("bias",), -0.1)
    assert conflicting(explanation_of(best, larger, same, close, far), POLICY) == [close]
    assert conflicting(explanation_of(fit_of((), 0.0), close), POLICY) == []


def test_contested_causes_list_each_other():
    shared, one, other = (NamedCause(name, {}, {}, 0.5) for name in ("cogging", "bias", "gravity"))
    fits = [fit_of(("cogging", "bias"), 0.0), fit_of(("cogging", "gravity"), -0.5)]
    same, first, second = contested([shared, one, other], fits, EFFECTS)
    assert same is shared
    assert first.not_distinguishable_from == ("gravity",)
    assert second.not_distinguishable_from == ("bias",)
    assert first.would_be_separated_by == EFFECTS["bias"].separated_by
    known = replace(one, not_distinguishable_from=("mount_tilt", "gravity"), would_be_separated_by="a run upside down")
    first = contested([shared, known, other], fits, EFFECTS)[1]
    assert first.not_distinguishable_from == ("gravity", "mount_tilt")
    assert first.would_be_separated_by == "a run upside down"


def test_rivals_and_why_they_lost():
    best = fit_of(("gravity",), 0.0, 100.0)
    worse, wider = fit_of(("cogging",), -50.0, 210.0), fit_of(("bias",), -8.0, 99.0)
    rivals = rival_list(explanation_of(best, worse, wider), POLICY)
    assert [one.effects for one in rivals] == [("cogging",), ("bias",), ("nothing",)]
    assert [one.log_odds for one in rivals] == [-50.0, -8.0, -500.0]
    assert "fits worse: χ² is larger by 110" in rivals[0].why
    assert "needs 11 more free numbers" in rivals[1].why
    assert "larger by 800" in rivals[2].why


def test_a_rival_that_is_more_probable_is_not_called_less_so():
    (rival, _) = rival_list(explanation_of(fit_of(("bias",), 0.0), fit_of(("bias", "cogging"), 1.5)), POLICY)
    assert rival.why.startswith("it is more probable, but its further causes bring less than a cause must")


@pytest.mark.parametrize(("gain", "sure"), [(1.2499, True), (1.25, False)])
def test_a_size_at_its_limit_is_not_sure(gain, sure):
    family = EFFECTS["resonance"]
    (size,) = family.sizes(ARRAY)
    mode = cause_of("resonance", ARRAY, [gain / size.prior_std], frequency_hz=8.0, damping_ratio=0.02)
    mode = replace(mode, covariance=1e-6 * np.eye(1))
    best = Fit(Point((mode,), (), ()), 0.0, 0.0, 100.0, np.zeros((0, 0)), np.zeros(0))
    found = name_cause(explanation_of(best), best, mode, {"resonance": 0.997}, ARRAY, {}, POLICY)
    assert found.probability == (0.997 if sure else 1.0 - POLICY.small)
    assert ("gain stands at the end of its range, so that its size is not known" in found.why) is not sure


def test_faults_of_the_samples_are_named_once():
    flip, other = (make_effect("sign_flip", {"channel": name}, ARRAY) for name in ARRAY.channels[:2])
    (found,) = fault_causes([flip, other], {"sign_flip": "a channel is inverted"}, POLICY)
    assert (found.effect, found.parameters["channel"]) == ("sign_flip", ARRAY.channels[0])
    assert (found.probability, found.why) == (POLICY.most_certain, "a channel is inverted")


def test_share_of_each_channel():
    assert channel_share(np.array([[3.0, 0.0], [-3.0, 1.0]]), ["a", "b"]) == pytest.approx({"a": 3.0, "b": 0.5**0.5})


def test_confounded_effects_are_listed():
    # In one upright run the whole cube off the axis is every chip off its place; a tilted table is not.
    hidden = cause_of("eccentricity", ARRAY, [2.0, -1.0])
    stretches = stretches_of(TWIN, [hidden.effect(ARRAY, 0)], duration=6.0, motion=lively())
    start = starting_point(stretches, 0.1)
    best = Fit(replace(start, causes=(hidden,)), 0.0, 0.0, 0.0, np.zeros((0, 0)), np.zeros(0))
    explanation = explanation_of(best, screening=screen(stretches, best.point))
    found = mimics(explanation, hidden, POLICY)
    assert "sensor_position" in found
    assert not {"eccentricity", "bias", "table_tilt"} & set(found)
    # What is hardly seen is confounded with anything: no list is made of it.
    assert mimics(explanation, hidden.at(1e-4 * hidden.coordinates), POLICY) == []
    assert_allclose(hidden.coordinates, [2.0, -1.0])


@pytest.mark.parametrize(
    ("parameters", "std", "probability"),
    [
        ({"gain": 1.25, "frequency_hz": 38.9}, {"gain": 0.9, "frequency_hz": 47.0}, 0.9),
        ({"gain": 1.25, "frequency_hz": 38.9}, {"gain": 0.9, "frequency_hz": 4.0}, 0.997),
        ({"amplitude": 0.01, "phase_rad": 2.0}, {"amplitude": 0.008, "phase_rad": 0.1}, 0.9),
        ({"channel": "a11"}, {}, 0.997),
    ],
)
def test_what_does_not_stand_out_from_its_uncertainty_is_not_certain(parameters, std, probability):
    assert capped(NamedCause("resonance", parameters, std, 0.997), POLICY).probability == probability
    assert capped(NamedCause("resonance", parameters, std, 0.6), POLICY).probability == 0.6


def test_a_frequency_that_is_known_makes_no_mode_certain():
    """What a torque ripple left, named a mode: gain 0.17 ± 0.80, but a frequency of 24.5 ± 9.8 Hz, at P 0.997."""
    mode = NamedCause("resonance", {"gain": 0.17, "frequency_hz": 24.5}, {"gain": 0.80, "frequency_hz": 9.8}, 0.997)
    assert capped(mode, POLICY, {"frequency_hz": 24.5}).probability == 0.9
