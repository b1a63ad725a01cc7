"""The search for causes goes on while a round brings something, and ends where nothing of it would be believed."""

import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gfimu.diagnosis import diagnose, engine, loose_calibration
from gfimu.diagnosis.calibration_residue import CalibrationResidue
from gfimu.diagnosis.conclusion import is_unknown
from gfimu.diagnosis.data.prepared_runs import PreparedRuns
from gfimu.diagnosis.fit import Fit
from gfimu.diagnosis.nuisances import learn_noise
from gfimu.diagnosis.refinement import refine
from gfimu.diagnosis.residual_tests import LeftOver
from gfimu.diagnosis.signatures import Signature, hypotheses
from gfimu.diagnosis.verdict.verdict import Gain
from gfimu.geometry.array import AccelerometerArray
from gfimu.recording import Recording
from sim.campaign import Measurement, measure, random_profile
from sim.effects import make_effect
from sim.study.cases import Case
from sim.study.outcome import draw_world
from sim.twin import Twin

SETTING = Measurement(duration=12.0)
ALL_ROUNDS = 6
LIBRARY = {"bias", "scale_factor", "quadratic", "eccentricity"}


class SmallLibrary(Twin):
    """Few effects, so that a search is quick."""

    def families(self):
        return {name: family for name, family in super().families().items() if name in LIBRARY}


@pytest.fixture(scope="module")
def twin():
    return SmallLibrary(array=AccelerometerArray.load("cube12"), array_name="cube12")


def explained(twin, recording, *, loose=False):
    """The explanation of a recording and how many rounds the search took; ``loose``: with small errors admitted."""
    segments, fixed = PreparedRuns.build([recording], twin, ["run"]).segments(twin)
    if loose:
        n, observed = segments[0].weight_mask.shape
        columns = np.zeros((observed, observed - 1, n))
        columns[np.arange(observed - 1), np.arange(observed - 1)] = 0.003
        segments[0].calibration_residue = CalibrationResidue.of_columns(columns)
    told = []
    found = engine.explain(segments, fixed, 1, report=lambda share, text: told.append(text))
    return found, sum(text.startswith("search") for text in told)


@pytest.fixture(scope="module")
def foreign(twin):
    """A ripple of three cycles per revolution that grows with the square of the rate, other in every channel."""
    rng = np.random.default_rng(2)
    motion = random_profile(rng, SETTING.duration)
    run = measure(rng, twin, (), SETTING, motion=motion)
    state = motion.at(run.t_s)
    ripple = 0.002 * state.rate**2 * np.cos(3 * state.angle)
    readings = run.readings + np.outer(ripple, np.arange(1, 13) / 6)
    return Recording.from_arrays(run.t_s, readings, twin.array, reference=run.reference)


def test_a_hopeless_search_ends_and_judges_no_rivals(twin, foreign, monkeypatch):
    found, rounds = explained(twin, foreign)
    assert rounds == 1
    assert not found.rivals
    assert not found.without
    monkeypatch.setattr(engine, "_MUCH", np.inf)
    patient, rounds = explained(twin, foreign)
    assert rounds > 1
    assert patient.without
    # What the other rounds would have brought.
    assert found.fit.objective < 1.05 * patient.fit.objective


def test_a_search_ends_where_a_round_brings_little_of_what_is_left(twin, foreign, monkeypatch):
    monkeypatch.setattr(engine, "_MUCH", np.inf)
    found, rounds = explained(twin, foreign)
    monkeypatch.setattr(engine, "_STALLED", 0.0)
    patient, more = explained(twin, foreign)
    assert rounds < more
    assert found.fit.objective < 1.02 * patient.fit.objective


def test_a_tone_that_nothing_explains_ends_a_search(twin):
    run = measure(np.random.default_rng(4), twin, (), SETTING)
    readings = run.readings.copy()
    readings[:, 4] += 0.8 * np.sin(2 * np.pi * 23.4 * run.t_s)
    readings[:, 7] += 0.8 * np.sin(2 * np.pi * 14.9 * run.t_s)
    found, rounds = explained(twin, Recording.from_arrays(run.t_s, readings, twin.array, reference=run.reference))
    assert found.given_up
    assert rounds <= 3


def test_with_a_residue_of_the_calibration_admitted_a_search_goes_on(twin, foreign):
    found, rounds = explained(twin, foreign, loose=True)
    assert rounds > 3
    assert found.without


def test_a_search_given_up_too_early_is_judged_after_all(twin, monkeypatch):
    def give_up(search, number, *, settled):
        search.given_up = True
        return True

    monkeypatch.setattr(engine._Search, "ends", give_up)
    hidden = [
        make_effect("eccentricity", {"x_m": 0.01, "y_m": -0.02}),
        make_effect("quadratic", {"a11_s2_m": 0.01}, twin.array),
    ]
    found = diagnose([measure(np.random.default_rng(3), twin, hidden, SETTING)], twin)
    assert {cause.effect for cause in found.causes} == {"eccentricity", "quadratic"}
    assert all(cause.log_odds > 0 for cause in found.causes)


def test_a_search_that_explains_goes_on_to_its_rivals(twin):
    hidden = [
        make_effect("eccentricity", {"x_m": 0.01, "y_m": -0.02}),
        make_effect("quadratic", {"a11_s2_m": 0.01}, twin.array),
    ]
    found, rounds = explained(twin, measure(np.random.default_rng(3), twin, hidden, SETTING))
    assert rounds < ALL_ROUNDS
    assert found.fit.names == {"eccentricity", "quadratic"}
    assert set(found.without) == {"eccentricity", "quadratic"}


def test_several_processors_find_what_one_finds(twin, foreign, several_processors, monkeypatch):
    monkeypatch.setattr(engine, "_MUCH", np.inf)  # for all rounds and the judgement of the rivals
    found, rounds = explained(twin, foreign)
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    alone, as_many = explained(twin, foreign)
    assert rounds == as_many
    assert found.fit.key == alone.fit.key
    assert set(found.without) == set(alone.without)
    assert_allclose(found.fit.log_posterior, alone.fit.log_posterior, rtol=1e-6)


@pytest.mark.parametrize("quadratic", [0.01, 0.0415])
def test_what_is_the_same_in_the_data_is_told_as_a_set_at_any_size(twin, quadratic):
    """A vertical channel of a level table always reads g: its offset, gain and second order are one."""
    hidden = [make_effect("quadratic", {"a13_s2_m": quadratic}, twin.array)]
    found = diagnose([measure(np.random.default_rng(3), twin, hidden, SETTING)], twin)
    assert found.verdict == "ambiguous"
    assert {"bias", "scale_factor"} <= {cause.effect for cause in found.causes}
    assert "quadratic" in {name for cause in found.causes for name in (cause.effect, *cause.not_distinguishable_from)}


def test_a_gross_misfit_is_not_learnt_as_bias_instability(twin):
    rng = np.random.default_rng(9)
    run = measure(rng, twin, (), SETTING)
    readings = run.readings + 3.0 * np.sin(0.9 * run.t_s)[:, None] * np.sign(np.arange(12) - 5.5)
    recording = Recording.from_arrays(run.t_s, readings, twin.array, reference=run.reference)
    prepared = PreparedRuns.build([recording], twin, ["run"])
    segments, fixed = prepared.segments(twin)
    for segment in segments:
        segment.prepare_weights()
    nothing = refine(segments, (), fixed, iterations=8)
    before = segments[0].levels
    learn_noise(segments, nothing, fixed, slow=False)
    assert_allclose(segments[0].levels.flicker, before.flicker)
    learn_noise(segments, nothing, fixed)
    assert segments[0].levels.flicker[:-1].min() > 3 * before.flicker[:-1].max()


def test_a_ripple_of_the_tachometer_does_not_leave_its_knots_to_the_drive():
    """The reference's drive bends with the ripple; on knots that follow it a mode would be named for the rest."""
    world = draw_world(Case("reduced", 91031, ("axis_wobble", "tacho_ripple"), 1000.0, duration=20.0))
    segments, fixed = PreparedRuns.build([world.recording], world.twin, ["run"]).segments(world.twin)
    usual = len(segments[0].coefficients)
    found = engine.explain(segments, fixed, 1)
    assert found.fit.names == {"axis_wobble", "tacho_ripple"}
    assert len(found.segments[0].coefficients) < 1.5 * usual


def test_a_mode_that_pruning_takes_out_is_heard_ringing(monkeypatch):
    """It may be hardly anything as it bends the ramps, and plain as it rings."""
    generator = str(Path(__file__).parents[2] / "independent_world.py:hide")
    world = draw_world(Case("reduced", 600, ("resonance",), 40.0, duration=20.0), generator)
    pruned = engine.prune

    def pruned_if_rung(segments, best, fixed, *done):
        if segments[0].ringing:
            return pruned(segments, best, fixed, *done)
        return refine(segments, (), fixed, drives=best.drives), {}

    monkeypatch.setattr(engine, "prune", pruned_if_rung)
    segments, fixed = PreparedRuns.build([world.recording], world.twin, ["run"]).segments(world.twin)
    assert engine.explain(segments, fixed, 1).fit.names == {"resonance"}


def cause_of(name, shape, scores):
    """A cause so many standard deviations from nothing, in coordinates of 0.5."""
    whole = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    (place, *_) = hypotheses([Signature(whole.families()[name], shape, np.arange(1))], whole.array, 1)
    return replace(place.cause(np.array([0.5])), covariance=np.array([[(0.5 / scores) ** 2]]))


def fit_of(*causes, objective=1000.0):
    return Fit(causes, 0.0, 0.0, objective, (), np.eye(len(causes)), np.zeros(len(causes)))


MODE = {"frequency_hz": 7.0, "damping_ratio": 0.05}


@pytest.mark.parametrize(
    ("scores", "misfit", "left", "plain"),
    [(50.0, 1.0, 2.0, True), (8.0, 1.0, 2.0, False), (50.0, 1.1, 2.0, False), (50.0, 1.0, 40.0, False)],
)
def test_a_mode_is_looked_for_elsewhere_unless_it_is_plain(scores, misfit, left, plain):
    state = SimpleNamespace(_observations=1000, _left=lambda fit: left)
    fit = fit_of(cause_of("resonance", MODE, scores), objective=1000.0 * misfit)
    assert engine._Search._is_plain(state, fit) is plain


@pytest.mark.parametrize(("scores", "heard"), [(50.0, True), (10.0, False)])
def test_a_mode_within_what_a_rough_cause_leaves_is_not_listened_to(scores, heard):
    """Of 100 standard deviations of torque ripple 2 % of the power may be left, which is 14."""
    segment = SimpleNamespace(ringing=False, levels=SimpleNamespace(of_reading=0.03))
    best = fit_of(cause_of("resonance", MODE, scores), cause_of("cogging", {"order": 10.0}, 100.0))
    state = SimpleNamespace(_observations=1000, _best=best, _segments=[segment], _loose=False, given_up=False)
    assert engine._Search._may_hear_mode_ring.fget(state) is heard
    state.given_up, state._outweighed = True, True  # more is left than all that was found explains
    assert not engine._Search._may_hear_mode_ring.fget(state)


def test_beside_what_no_residue_takes_off_no_cause_is_tried_without(twin, foreign, monkeypatch):
    def pruned(*_):
        raise AssertionError("nothing of it will be believed")

    segments, fixed = PreparedRuns.build([foreign], twin, ["run"]).segments(twin)
    plain = engine.explain(segments, fixed, 1)
    assert plain.given_up
    monkeypatch.setattr(loose_calibration, "prune", pruned)
    monkeypatch.setattr(loose_calibration, "FAIR_FIT", np.inf)
    loose, same = loose_calibration.loosen(plain, PreparedRuns.build([foreign], twin, ["run"]), twin)
    assert loose is None
    assert same is plain


@pytest.mark.parametrize(("causes", "verdict"), [(3, False), (4, True)])
def test_causes_as_many_as_may_be_that_leave_something_are_unknown(causes, verdict):
    """Wide causes enough describe anything nearly."""
    names = ("bias", "scale_factor", "quadratic", "mount_tilt")[:causes]
    explanation = SimpleNamespace(
        fit=fit_of(*(cause_of(name, {}, 50.0) for name in names)), nothing=fit_of(objective=1e5)
    )
    left = LeftOver(100.0, "channel a11 depends on rate³", {})
    assert is_unknown(explanation, left, Gain()) is verdict


def test_a_ripple_that_predicts_worse_than_nothing_is_unknown():
    explanation = SimpleNamespace(
        fit=fit_of(cause_of("cogging", {"order": 3.0}, 25.0)), nothing=fit_of(objective=1600.0)
    )
    left = LeftOver(50.0, "depends on 3 per revolution (sine)", {}, dependence="3 per revolution (sine)")
    assert not is_unknown(explanation, left, replace(Gain(), log_likelihood_per_sample=0.01))
    assert is_unknown(explanation, left, replace(Gain(), log_likelihood_per_sample=-0.01))
    other = replace(left, dependence="4 per revolution (sine)")
    assert is_unknown(explanation, other, replace(Gain(), log_likelihood_per_sample=0.01))


@pytest.mark.parametrize(("size_m_s2", "tried"), [(1.0, False), (0.01, True)])
def test_only_a_faint_cause_is_tried_without_beside_a_residue(twin, monkeypatch, size_m_s2, tried):
    sets = []
    pruned = loose_calibration.prune
    monkeypatch.setattr(
        loose_calibration, "prune", lambda segments, fit, *rest: sets.append(fit.names) or pruned(segments, fit, *rest)
    )
    recording = measure(np.random.default_rng(8), twin, [make_effect("bias", {"a21_m_s2": size_m_s2})], SETTING)
    assert [cause.effect for cause in diagnose([recording], twin).causes] == ["bias"]
    assert any(sets) is tried
