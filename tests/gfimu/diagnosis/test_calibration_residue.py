"""The residue of a calibration: its algebra against dense Gaussians, and that it is taken for no cause."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gfimu.diagnosis import diagnose, engine
from gfimu.diagnosis.calibration_residue import TOLERANCE, CalibrationResidue
from gfimu.diagnosis.data.prepared_runs import PreparedRuns
from gfimu.diagnosis.data.run import prepare_run
from gfimu.diagnosis.engine import explain
from gfimu.diagnosis.evidence import SCALES
from gfimu.diagnosis.long_run import explain_any_length
from gfimu.diagnosis.refinement import refine
from gfimu.diagnosis.screening import screen
from gfimu.diagnosis.search import log_odds_beside_residue
from gfimu.diagnosis.stretches import make_segments
from gfimu.geometry.array import AccelerometerArray
from sim.campaign import Measurement, measure
from sim.effects import make_effect
from sim.study.cases import Case, study_cases
from sim.study.outcome import draw_world
from sim.twin import Twin

TWIN = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


@pytest.fixture
def segment():
    recording = measure(np.random.default_rng(3), TWIN, [], Measurement(duration=6.0))
    (one,) = make_segments(TWIN, [prepare_run(recording, TWIN)])
    one.prepare_weights()
    return one


def noise_of(segment, column):
    """Covariance (n, n) of one observation's noise: white plus slow cosines of bias instability."""
    sigma, share = segment.levels.white[column], segment.modes.share[:, column]
    low = segment.modes.of(np.eye(len(segment.run.t)), column)  # (n, K)
    precision = (np.eye(len(low)) - (low * share) @ low.T) / sigma**2
    return np.linalg.inv(precision)


def test_marginalised_with_the_drive_as_a_dense_gaussian_is(segment):
    rng = np.random.default_rng(4)
    n, observed = segment.weight_mask.shape
    columns = np.zeros((observed, 5, n))
    for column in range(observed - 1):
        columns[column, rng.choice(5, 2, replace=False)] = 0.02 * rng.standard_normal((2, n))
    signature = np.zeros((observed, 1, n))
    signature[2, 0], signature[7, 0] = np.sin(np.arange(n) / 20), 0.5
    plain = segment.linearise([])
    segment.calibration_residue = CalibrationResidue.of_columns(columns)
    line = segment.linearise([])
    gram, score, _ = segment.whitened_products(line, signature)

    drive = np.vstack([plain.jacobian.channel(column).toarray() for column in range(observed)])  # (c n, m)
    precision = np.zeros((observed * n, observed * n))
    for column in range(observed):
        part = slice(column * n, (column + 1) * n)
        precision[part, part] = np.linalg.inv(noise_of(segment, column))
    unknowns = np.hstack([drive, columns.transpose(0, 2, 1).reshape(-1, 5)])
    prior = np.zeros((unknowns.shape[1],) * 2)
    prior[:-5, :-5] = segment.drive_prior.precision.toarray()
    prior[-5:, -5:] = np.eye(5)
    left = unknowns.T @ precision
    solved = np.linalg.solve(left @ unknowns + prior, left)
    reduced = precision - left.T @ solved
    one = signature.transpose(0, 2, 1).reshape(-1)
    assert_allclose(gram[0, 0], one @ reduced @ one, rtol=1e-5)
    residual = line.residual.T.reshape(-1)
    pull = np.zeros(unknowns.shape[1])
    pull[:-5] = -(segment.drive_prior.precision @ segment.coefficients)
    pull[:-5] += np.asarray(
        segment.drive_prior.begin.T @ np.array([segment.start_angle / segment.start_angle_std])
    ).ravel()
    moved = np.linalg.solve(left @ unknowns + prior, left @ residual + pull)
    assert_allclose(score[0], one @ precision @ (residual - unknowns @ moved), rtol=1e-4)
    assert_allclose(line.drive.alone()[1], moved[-5:], rtol=1e-4, atol=1e-6)
    information, right = line.drive.residue()
    assert_allclose(np.linalg.solve(information, right), moved[-5:], rtol=1e-4, atol=1e-6)


def test_a_residue_alone_is_no_cause_and_is_told():
    world = draw_world(Case("reduced", 700, residue=True, duration=20.0))
    found = diagnose([world.recording], world.twin)
    assert found.verdict == "nothing_found", found
    assert found.noise["calibration_residue"] == 1.0
    assert any("calibration is a little off" in sentence for sentence in found.sentences)
    corrections = {effect.name for effect in found.twin.effects}
    assert corrections == set(TOLERANCE)
    again = diagnose([world.recording], found.twin)
    assert again.verdict == "nothing_found"
    assert again.noise["calibration_residue"] == 0.0


def test_a_cause_beside_a_residue_is_named_alone():
    world = draw_world(Case("reduced", 701, ("clock_error",), 1500.0, residue=True, duration=20.0))
    found = diagnose([world.recording], world.twin)
    assert [cause.effect for cause in found.causes] == ["clock_error"]
    ((_, truth),) = world.truth
    (cause,) = found.causes
    assert abs(cause.parameters["ratio"] - truth["ratio"]) < 4 * cause.std["ratio"]


@pytest.fixture
def screened(segment):
    """Normal equations of the library about no cause, for a recording with nothing hidden."""
    fit = refine([segment], (), [()], iterations=8)
    return screen([segment], fit, [()], 1)


def test_odds_beside_a_residue_are_those_of_all_sizes_marginalised_together(screened, segment):
    """A set beside a residue, against the residue's sizes and the set's integrated out at once."""
    array = segment.model.array
    member = next(k for k, one in enumerate(screened.hypotheses) if one.name == "eccentricity")
    cause = screened.hypotheses[member]
    columns, spread = [], []
    for signature in screened.signatures:
        if signature.family.name in TOLERANCE:
            prior = np.array([size.prior_std for size in signature.family.sizes(array)])
            columns += list(signature.columns)
            spread += list(TOLERANCE[signature.family.name] / prior)
    basis = np.zeros((len(screened.score), len(columns) + cause.mixing.shape[1]))
    basis[columns, np.arange(len(columns))] = spread
    basis[np.ix_(cause.signature.columns, np.arange(len(columns), basis.shape[1]))] = cause.mixing
    gram, score = basis.T @ screened.gram @ basis, basis.T @ screened.score

    def evidence(scale):
        """Of the residue at its own spread and the cause at a scale of its prior."""
        precision = np.append(np.ones(len(columns)), np.full(cause.mixing.shape[1], scale**-2))
        whole = gram + np.diag(precision)
        value = 0.5 * score @ np.linalg.solve(whole, score) - 0.5 * np.linalg.slogdet(whole)[1]
        return value + 0.5 * np.log(precision).sum()

    weights = np.array([0.07, 0.13, 0.14, 0.14, 0.14, 0.13, 0.10, 0.07, 0.05, 0.03])
    both = np.logaddexp.reduce([evidence(scale) for scale in SCALES] + np.log(weights)) + cause.log_prior
    residue = slice(len(columns))
    whole = gram[residue, residue] + np.eye(len(columns))
    alone = 0.5 * score[residue] @ np.linalg.solve(whole, score[residue]) - 0.5 * np.linalg.slogdet(whole)[1]
    found = log_odds_beside_residue(screened, [member], TOLERANCE, array)
    assert found == pytest.approx(max(both, alone), abs=1e-3)
    assert log_odds_beside_residue(screened, [], TOLERANCE, array) == pytest.approx(alone, abs=1e-6)


@pytest.mark.parametrize(("residue", "left_for"), [(True, "residue"), (False, "")])
def test_a_search_is_left_for_a_residue_that_is_better_than_all_it_may_find(residue, left_for):
    world = draw_world(Case("reduced", 702, ("tacho_latency",), 1500.0, residue=residue, duration=20.0))
    segments, fixed = PreparedRuns.build([world.recording], world.twin, ["run"]).segments(world.twin)
    rounds = []
    found = explain(segments, fixed, 1, instead=lambda *_: False, report=lambda _, text: rounds.append(text))
    assert found.left_for == left_for
    if residue:
        assert rounds.count("search 2") == 1
        assert "search 3" not in rounds


def test_a_search_left_for_a_residue_that_is_none_is_taken_up_again(monkeypatch):
    searches = []

    def noted(*args, **kwargs):
        searches.append(explain_any_length(*args, **kwargs))
        return searches[-1]

    module = sys.modules[diagnose.__module__]
    monkeypatch.setattr(module, "explain_any_length", noted)
    monkeypatch.setattr(engine, "log_odds_beside_residue", lambda *_: np.inf)
    world = draw_world(Case("reduced", 703, ("eccentricity", "clock_error"), 1000.0, duration=20.0))
    found = diagnose([world.recording], world.twin)
    assert [search.left_for for search in searches] == ["residue", ""]
    assert {cause.effect for cause in found.causes} == {"eccentricity", "clock_error"}


def test_a_mode_beside_a_residue_is_named_alone():
    world = draw_world(Case("reduced", 701, ("resonance",), 1500.0, residue=True, duration=14.0))
    found = diagnose([world.recording], world.twin)
    assert [cause.effect for cause in found.causes] == ["resonance"]
    ((_, truth),) = world.truth
    # Its ± is too small: a drive that knows how the mode rings on is not fitted beside a residue.
    assert found.causes[0].parameters["frequency_hz"] == pytest.approx(truth["frequency_hz"], rel=0.02)


def test_a_single_small_error_is_not_called_a_residue():
    recording = measure(
        np.random.default_rng(5), TWIN, [make_effect("bias", {"a21_m_s2": 0.02})], Measurement(duration=20.0)
    )
    found = diagnose([recording], TWIN)
    assert found.noise["calibration_residue"] == 0.0
    assert "bias" in {cause.effect for cause in found.causes}
    assert not any("calibrate the unit" in cause.why for cause in found.causes)


def test_a_cause_that_a_residue_would_replace_as_well_is_not_told_surely():
    """Small errors of all numbers and strong bias instability: one effect alone is as probable as all together."""
    case = next(one for one in study_cases("residue") if one.seed == 50002)
    world = draw_world(case)
    found = diagnose([world.recording], world.twin)
    for cause in found.causes:
        assert cause.probability < 0.95  # 0.995 without the residue among its rivals
        assert "calibrate the unit" in cause.why


def test_the_gain_of_a_residue_is_that_of_the_part_it_was_not_fitted_to(monkeypatch):
    judged = sys.modules["gfimu.diagnosis.diagnose"]
    measured = judged.held_out_gain
    seen = []

    def kept(causes, pairs, constant, *, label):
        seen.extend(pairs)
        return measured(causes, pairs, constant, label=label)

    monkeypatch.setattr(judged, "held_out_gain", kept)
    world = draw_world(Case("reduced", 702, residue=True, duration=30.0))
    found = diagnose([world.recording], world.twin)
    assert found.calibration_residue
    assert found.gain.rms_after < found.gain.rms_before
    whole = next(effect for effect in found.twin.effects if effect.name == "bias")
    one, other = (next(e for e in pair.test_fixed[0] if e.name == "bias") for pair in seen)
    names = [f"{channel}_m_s2" for channel in TWIN.array.channels]
    of_whole, of_one, of_other = (np.array([e.parameters[key] for key in names]) for e in (whole, one, other))
    # Each part's own, and not those of the whole run; both near them, as they measure the same.
    assert np.abs(of_one - of_other).max() > 1e-5
    assert np.abs(of_one - of_whole).max() > 1e-5
    assert np.sqrt(np.mean((of_one - of_other) ** 2)) < 2 * np.sqrt(np.mean(of_whole**2))
