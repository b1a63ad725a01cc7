"""The marginal likelihood of a stretch against one dense Gaussian of all its observations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_cases import cause_of, dense, dense_gaussian, lively, part_of, small_twin, stretches_of
from numpy.testing import assert_allclose
from scipy.special import ndtr

from gfimu.diagnosis import Columns, Drive, NoiseLevels, family_columns, starting_point
from gfimu.diagnosis.data.rounding import Steps
from gfimu.diagnosis.fit.posterior import condition, energy
from sim.effects import EFFECTS, make_effect

EFFECTS_THERE = [make_effect("table_tilt", {"x_rad": 0.02, "y_rad": -0.01})]
NOISE = {"white": (0.0, 0.0), "instability": (0.05, 0.0), "instability and walk": (0.03, 0.03)}


@pytest.fixture(scope="module")
def stretch():
    return part_of(stretches_of(small_twin(), EFFECTS_THERE, duration=5.0, motion=lively())[0], 120)


@pytest.fixture(scope="module")
def drive(stretch):
    """A drive near the truth, whose roughness is small enough for a dense covariance in double precision."""
    found = starting_point([stretch], 0.1).drives[0]
    rough = 200.0 * np.exp(0.3 * np.random.default_rng(0).standard_normal(found.spline.intervals))
    return replace(found, roughness=rough, angle=0.01, angle_std=0.02)


def settled(stretch, drive, levels):
    """A drive at its most probable."""
    for _ in range(4):
        drive = drive.moved(condition(stretch, drive, EFFECTS_THERE, levels).step)
    return drive


def levels_of(stretch, kind):
    flicker, walk = NOISE[kind]
    white = stretch.first_levels.white
    each = np.append(flicker * np.linspace(0.6, 1.5, len(white) - 1), 0.0)
    return NoiseLevels(white, each, walk)


def cut_modes(stretch, levels):
    return len(stretch.basis.corrections(levels))


def random_columns(stretch, count=4, seed=0):
    """Smooth columns, one of which acts on one channel only."""
    rng = np.random.default_rng(seed)
    n, c = stretch.mask.shape
    values = 0.02 * np.cumsum(rng.standard_normal((n, c, count)), axis=0)
    values[:, 1:, 0] = 0.0
    return values


def compare(stretch, drive, levels, *, modes, rtol=2e-4):
    columns = random_columns(stretch)
    posterior = condition(stretch, drive, EFFECTS_THERE, levels)
    gram, score, _ = posterior.products(Columns.of(columns, posterior.observed.weight))
    truth = dense_gaussian(stretch, drive, EFFECTS_THERE, levels, columns, modes=modes)
    scale = np.sqrt(np.diag(truth.gram))
    assert_allclose(gram / np.outer(scale, scale), truth.gram / np.outer(scale, scale), atol=rtol)
    assert_allclose(score / scale, truth.score / scale, atol=rtol * np.sqrt(truth.objective))
    assert posterior.objective == pytest.approx(truth.objective, rel=rtol)
    return posterior, truth


@pytest.mark.parametrize("kind", NOISE)
def test_columns_and_misfit_equal_a_dense_gaussian(stretch, drive, kind):
    levels = levels_of(stretch, kind)
    compare(stretch, drive, levels, modes=cut_modes(stretch, levels))


@pytest.mark.parametrize("angle_std", [0.02, np.inf])
def test_an_angle_that_is_known_and_one_that_is_not(stretch, drive, angle_std):
    levels = levels_of(stretch, "instability")
    compare(stretch, replace(drive, angle_std=angle_std), levels, modes=cut_modes(stretch, levels))


def test_the_modes_that_are_left_out_hardly_matter(stretch, drive):
    levels = levels_of(stretch, "instability and walk")
    compare(stretch, drive, levels, modes=len(stretch.basis.frequency), rtol=0.02)


def test_masked_samples_under_white_noise(stretch, drive):
    rng = np.random.default_rng(4)
    run = stretch.run
    valid, reference = rng.random(run.valid.shape) > 0.2, rng.random(len(run.t)) > 0.6
    valid[40:60, 2] = False
    masked = replace(stretch, run=replace(run, valid=valid, reference_valid=reference))
    compare(masked, drive, levels_of(stretch, "white"), modes=1)


def test_the_log_volume_is_that_of_the_dense_determinant(stretch, drive):
    levels = levels_of(stretch, "instability")
    modes = cut_modes(stretch, levels)
    posterior, truth = compare(stretch, drive, levels, modes=modes)
    rough = replace(drive, roughness=3.0 * drive.roughness)
    other, other_truth = compare(stretch, rough, levels, modes=modes)
    gained = other.log_volume - posterior.log_volume
    assert gained == pytest.approx(other_truth.log_volume - truth.log_volume, abs=1e-3)
    assert abs(gained) > 5.0


def test_a_drive_with_uneven_knots_equals_the_dense_gaussian(stretch, drive):
    levels = levels_of(stretch, "instability")
    uneven = drive.cut(np.arange(drive.spline.intervals) % 5 == 0)
    compare(stretch, uneven.cut(np.arange(uneven.spline.intervals) % 7 == 0), levels, modes=cut_modes(stretch, levels))


@pytest.mark.parametrize("every", [1, 3])
def test_log_volumes_of_different_knots_are_comparable(stretch, drive, every):
    # The dense one is free in angle, rate, acceleration and jerk at the start, whatever the knots.
    levels = levels_of(stretch, "instability")
    modes = cut_modes(stretch, levels)
    closer = drive.cut(np.arange(drive.spline.intervals) % every == 0)
    posterior, truth = compare(stretch, drive, levels, modes=modes)
    other, other_truth = compare(stretch, closer, levels, modes=modes)
    gained = other.log_volume - posterior.log_volume
    assert gained == pytest.approx(other_truth.log_volume - truth.log_volume, abs=0.05)


def test_the_step_leads_to_the_least_energy(stretch, drive):
    levels = levels_of(stretch, "instability")
    start = drive.moved(0.5 * (settled(stretch, drive, levels).coefficients - drive.coefficients))
    posterior = condition(stretch, start, EFFECTS_THERE, levels)
    assert posterior.energy == pytest.approx(energy(stretch, start, EFFECTS_THERE, levels))
    there = start.moved(posterior.step)
    promised = posterior.energy - posterior.objective
    gained = posterior.energy - energy(stretch, there, EFFECTS_THERE, levels)
    assert promised > 1.0
    assert gained == pytest.approx(promised, rel=1e-2)
    at_best = condition(stretch, there, EFFECTS_THERE, levels)
    assert at_best.energy - at_best.objective < 1e-3 * promised
    # Its inverse Hessian is the covariance.
    hessian = posterior.root @ posterior.root.T
    assert_allclose(posterior.covariance @ hessian, np.eye(drive.spline.size), atol=1e-5)


def test_the_response_is_how_the_step_follows_a_column(stretch, drive):
    levels = levels_of(stretch, "instability")
    posterior = condition(stretch, drive, EFFECTS_THERE, levels)
    columns = Columns.of(random_columns(stretch), posterior.observed.weight)
    _, _, across = posterior.products(columns)
    moved = replace(
        stretch, run=replace(stretch.run, readings=stretch.run.readings - columns.times(np.eye(4)[1])[:, :-1])
    )
    moved = replace(moved, run=replace(moved.run, reference=stretch.run.reference - columns.times(np.eye(4)[1])[:, -1]))
    other = condition(moved, drive, EFFECTS_THERE, levels, jacobian=posterior.jacobian)
    assert_allclose(other.step - posterior.step, posterior.response(across)[:, 1], atol=1e-8)


def test_whitened_residuals_give_the_scores_of_columns(stretch, drive):
    levels = levels_of(stretch, "instability and walk")
    posterior = condition(stretch, drive, EFFECTS_THERE, levels)
    columns = random_columns(stretch)
    _, score, _ = posterior.products(Columns.of(columns, posterior.observed.weight))
    assert_allclose(np.einsum("nc,ncp->p", posterior.whitened, columns), score, rtol=1e-6, atol=1e-6)


# -- coarse readings -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def coarse():
    step = 0.3
    effects = [*EFFECTS_THERE, make_effect("coarse_resolution", {"step_m_s2": step})]
    one = part_of(stretches_of(small_twin(), effects, duration=5.0, motion=lively())[0], 120)
    return replace(one, steps=Steps(channels=step))


def rounded_misfit(stretch, prediction, levels):
    """−2 log probability of rounded channels, and the squares of the reference, sample by sample."""
    off, step, white = np.abs(stretch.measured - prediction)[:, :-1], stretch.steps.channels, levels.white[:-1]
    each = -2.0 * np.log(ndtr((0.5 * step - off) / white) - ndtr((-0.5 * step - off) / white))
    reference = (stretch.measured - prediction)[:, -1] / levels.white[-1]
    return float(each.sum() + reference @ reference)


def test_the_misfit_of_coarse_readings_is_their_probability(coarse):
    levels = levels_of(coarse, "white")
    drive = settled(coarse, starting_point([coarse], 0.1).drives[0], levels)
    prediction = coarse.predict(EFFECTS_THERE, drive.spin)
    expected = rounded_misfit(coarse, prediction, levels)
    assert condition(coarse, drive, EFFECTS_THERE, levels).observed.misfit == pytest.approx(expected, rel=1e-9)


def test_scores_of_coarse_readings_are_slopes_of_their_probability(coarse):
    levels = levels_of(coarse, "white")
    drive = settled(coarse, starting_point([coarse], 0.1).drives[0], levels)
    seen = condition(coarse, drive, EFFECTS_THERE, levels).observed
    columns = random_columns(coarse)
    _, score = seen.products(Columns.of(columns, seen.weight))
    for k in range(columns.shape[2]):
        up, down = (rounded_misfit(coarse, seen.prediction + size * columns[:, :, k], levels) for size in (1e-4, -1e-4))
        assert score[k] == pytest.approx(-0.25 * (up - down) / 1e-4, rel=1e-4, abs=1e-3)


@pytest.mark.parametrize("kind", ["white", "instability"])
def test_coarse_readings_equal_a_dense_gaussian_of_their_weights(coarse, kind):
    levels = levels_of(coarse, kind)
    found = starting_point([coarse], 0.1).drives[0]
    drive = replace(found, roughness=np.full(found.spline.intervals, 200.0))
    posterior = condition(coarse, drive, EFFECTS_THERE, levels)
    seen, columns = posterior.observed, random_columns(coarse)
    gram, score, _ = posterior.products(Columns.of(columns, seen.weight))
    truth = dense_gaussian(
        coarse,
        drive,
        EFFECTS_THERE,
        levels,
        columns,
        modes=64,
        residual=seen.residual / seen.weight,
        weight=seen.weight,
    )
    scale = np.sqrt(np.diag(truth.gram))
    tolerance = 1e-3 if kind == "white" else 0.03  # modes with a share below 0.05 are left out
    assert_allclose(gram / np.outer(scale, scale), truth.gram / np.outer(scale, scale), atol=tolerance)
    assert_allclose(score / scale, truth.score / scale, atol=tolerance * np.sqrt(truth.objective))


def test_a_reference_alone_determines_the_drive(stretch):
    alone = stretch.of_reference()
    drive = Drive.still(stretch.run.t, 0.0, 0.1, 0.0, 1e-3)
    posterior = condition(alone, drive, [], stretch.first_levels)
    rate = drive.moved(posterior.step).spin.at(stretch.run.t).rate
    assert np.sqrt(np.mean((rate - stretch.run.reference) ** 2)) < 2.0 * stretch.first_levels.white[-1]


def test_a_column_that_the_drive_takes_whole_is_gone(stretch, drive):
    # A change of the drive itself, seen by every observation, with the drive hardly bound.
    free = replace(drive, roughness=np.full(drive.spline.intervals, 1e9), angle_std=np.inf)
    levels = levels_of(stretch, "white")
    posterior = condition(stretch, free, EFFECTS_THERE, levels)
    column = posterior.jacobian.times(np.random.default_rng(1).standard_normal(drive.spline.size))[:, :, None]
    weighed = Columns.of(column, posterior.observed.weight)
    before, _ = posterior.observed.products(weighed)
    gram, _, _ = posterior.products(weighed)
    assert gram[0, 0] < 1e-6 * before[0, 0]


def test_an_overflowing_prediction_has_no_energy(stretch, drive):
    far = drive.moved(np.full(drive.spline.size, 1e200) * np.arange(drive.spline.size))
    with np.errstate(all="ignore"):
        assert energy(stretch, far, EFFECTS_THERE, stretch.first_levels) == np.inf


def test_columns_of_the_library_pass_through(stretch, drive):
    levels = levels_of(stretch, "white")
    posterior = condition(stretch, drive, [], levels)
    columns = family_columns(stretch, posterior.observed, drive, [], EFFECTS["table_tilt"], {})
    gram, _, _ = posterior.products(columns)
    truth = dense_gaussian(stretch, drive, [], levels, dense(columns), modes=1)
    assert_allclose(gram, truth.gram, rtol=1e-3, atol=1e-3 * truth.gram.max())
    assert len(cause_of("table_tilt", stretch.model.array).coordinates) == len(gram)
