"""From the most probable causes to the verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_cases import cause_of, lively, small_twin

from gfimu.diagnosis import Policy, make_stretches, prepare
from gfimu.diagnosis.criticism.gain import Gain
from gfimu.diagnosis.criticism.series_tests import LackOfFit
from gfimu.diagnosis.search.explain import explain
from gfimu.diagnosis.search.nuisance_models import Understanding
from gfimu.diagnosis.verdict.conclude import conclude, is_dominant, is_unknown, named_causes
from sim.effects import make_effect
from sim.trials import Measurement, measure

TWIN = small_twin()
HIDDEN = cause_of("table_tilt", TWIN.array, [1.0, -0.5])
POLICY = Policy()
NOTHING_LEFT = LackOfFit(-np.inf, "")


@pytest.fixture(scope="module")
def prepared():
    rng = np.random.default_rng(1)
    recording = measure(rng, TWIN, [HIDDEN.effect(TWIN.array, 0)], Measurement(8.0, 50.0), motion=lively())
    return prepare([recording], TWIN, ["run"])


@pytest.fixture(scope="module")
def understanding(prepared):
    explanation = explain(make_stretches(TWIN, prepared.runs, prepared.effects), POLICY)
    return Understanding(explanation, None, 0.0, np.inf)


def test_an_explained_verdict(prepared, understanding):
    found = conclude(prepared, understanding, NOTHING_LEFT, Gain(), POLICY)
    assert found.verdict == "explained"
    (cause,) = found.causes
    assert cause.effect == "table_tilt"
    truth = HIDDEN.effect(TWIN.array, 0).parameters
    for key, value in truth.items():
        assert abs(cause.parameters[key] - value) < 4.0 * cause.std[key]
    assert cause.probability <= POLICY.most_certain
    assert cause.log_odds == pytest.approx(
        understanding.explanation.best.log_posterior - understanding.explanation.nothing.log_posterior
    )
    assert found.residual.rms_after < found.residual.rms_before
    assert [one.name for one in found.twin.effects] == ["table_tilt"]
    assert not found.unexplained.significant
    assert found.runs[0].after.shape == prepared.runs[0].readings.shape


def test_an_unknown_verdict_names_no_cause_and_extends_no_twin(prepared, understanding):
    left = LackOfFit(500.0, "rate² in a11")
    found = conclude(prepared, understanding, left, Gain(), POLICY, unknown=True)
    assert found.verdict == "unknown"
    assert found.causes == ()
    assert found.twin.effects == ()
    assert found.unexplained.significant
    assert "rate²" in found.unexplained.signature


def test_what_explains_most_comes_first(prepared, understanding, monkeypatch):
    monkeypatch.setattr("gfimu.diagnosis.verdict.conclude.white_factor", lambda *_: (2.0, 0.1))
    steps = {"large": 5.0, "small": 0.01}  # m/s²
    for size, step in steps.items():
        fault = make_effect("coarse_resolution", {"step_m_s2": step}, TWIN.array)
        with_fault = replace(prepared, effects=((fault,),))
        names = [one.effect for one in conclude(with_fault, understanding, NOTHING_LEFT, Gain(), POLICY).causes]
        first = ["coarse_resolution", "table_tilt"] if size == "large" else ["table_tilt", "coarse_resolution"]
        assert names == [*first, "noise"]
    unknown = conclude(prepared, understanding, LackOfFit(500.0, "a"), Gain(), POLICY, unknown=True)
    assert unknown.causes == ()  # noise is no cause beside what nothing explains


def test_a_rival_as_probable_makes_it_ambiguous(prepared, understanding):
    explanation = understanding.explanation
    other = replace(cause_of("axis_wobble", TWIN.array, [0.1, 0.1]), covariance=1e-4 * np.eye(2))
    rival = replace(
        explanation.best,
        point=replace(explanation.best.point, causes=(other,)),
        log_posterior=explanation.best.log_posterior - 0.5 * POLICY.ambiguous,
    )
    close = replace(understanding, explanation=replace(explanation, rivals=(rival,)))
    found = conclude(prepared, close, NOTHING_LEFT, Gain(), POLICY)
    assert found.verdict == "ambiguous"
    by_name = {one.effect: one for one in found.causes}
    assert "axis_wobble" in by_name["table_tilt"].not_distinguishable_from
    assert "table_tilt" in by_name["axis_wobble"].not_distinguishable_from


def test_misfit_beyond_the_noise_widens_standard_deviations(understanding):
    explanation = understanding.explanation
    (usual,) = named_causes(explanation, explanation.best, POLICY)
    observations = sum(one.observations for one in explanation.stretches)
    poor = replace(explanation.best, objective=explanation.best.objective + 3.0 * observations)
    (wider,) = named_causes(explanation, poor, POLICY)
    for key, std in usual.std.items():
        assert 1.5 * std < wider.std[key] < 2.1 * std


def test_a_lack_of_fit_widens_what_a_rough_model_says(understanding):
    """A share ε of what a rough model explains is what an error of √ε of its size leaves."""
    explanation = understanding.explanation
    cogging = replace(cause_of("cogging", TWIN.array, [1.0, 0.0], order=3.0), covariance=1e-8 * np.eye(2))
    observations = float(sum(one.observations for one in explanation.stretches))
    removed = explanation.nothing.objective - observations
    point = replace(explanation.best.point, causes=(cogging,))
    fit = replace(explanation.best, point=point, objective=observations)
    rough = replace(explanation, best=fit)
    (usual,) = named_causes(rough, fit, POLICY)
    (wider,) = named_causes(rough, fit, POLICY, LackOfFit(0.05 * removed, ""))
    key, ratio = "amplitude_rad_s2", 0.1 / 1.1  # of what is left to all that there is
    assert usual.std[key] == pytest.approx(np.sqrt(0.02) * usual.parameters[key], rel=0.01)
    assert wider.std[key] == pytest.approx(np.sqrt(0.02 + ratio) * usual.parameters[key], rel=0.01)
    (same,) = named_causes(explanation, explanation.best, POLICY, LackOfFit(0.05 * removed, ""))
    assert same.std == named_causes(explanation, explanation.best, POLICY)[0].std


def test_a_level_is_found_no_better_than_the_reading_that_gets_there(understanding):
    explanation = understanding.explanation
    play = replace(
        cause_of("hysteresis", TWIN.array, [1.0], width_m_s2=0.01),
        covariance=1e-8 * np.eye(1),
        shape_std={"width_m_s2": 1e-6},
    )
    observations = float(sum(one.observations for one in explanation.stretches))
    point = replace(explanation.best.point, causes=(play,))
    fit = replace(explanation.best, point=point, objective=observations)
    (named,) = named_causes(replace(explanation, best=fit), fit, POLICY)
    white = float(np.median(fit.point.levels[0].white[:-1]))
    assert named.std["width_m_s2"] == pytest.approx(np.hypot(0.2 * white, 0.1 * 0.01), rel=1e-3)


def test_when_causes_are_believed(understanding):
    explanation = understanding.explanation
    removed = explanation.nothing.objective - explanation.best.objective
    small = LackOfFit(0.5 * POLICY.lack_odds, "")
    large = LackOfFit(removed, "rate²")
    assert not is_dominant(explanation, small, POLICY)
    assert is_dominant(explanation, large, POLICY)
    assert not is_unknown(explanation, small, Gain(), POLICY)
    assert is_unknown(explanation, large, Gain(), POLICY)
    # Significant, but little beside what the cause explains: the cause stands.
    beside = LackOfFit(max(POLICY.lack_odds, POLICY.inexactness * removed) + 1.0, "rate²")
    assert 2.0 * beside.log_odds < POLICY.dominant * removed
    assert not is_unknown(explanation, beside, Gain(), POLICY)
