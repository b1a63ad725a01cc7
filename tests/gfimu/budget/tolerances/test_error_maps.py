"""The linear maps against finite differences of the nonlinear chain: MuJoCo, chips, estimate, cause by cause."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tolerance_cases import ONLY, estimated, motion_of, only, perfect, poses, run_of

from gfimu import AccelerometerArray
from gfimu.budget.tolerances.budget import tolerance_budget
from gfimu.budget.tolerances.calibrated import remaining
from gfimu.budget.tolerances.propagation import error_maps, null_space_of
from gfimu.calibration import Observations
from gfimu.calibration.array_static import array_static
from gfimu.calibration.nonlinearity import quadratic_std
from gfimu.rate.maximum_likelihood import rates_of_null_space
from gfimu.recording import Recording
from sim.trials.worlds.toleranced import draw_unit, known_motion_of, reference_motion

ARRAYS = ("cube12", "p1_face_diagonals", "p2_face_centres", "p3_three_plus_one")
"""One of each form of the solution: linear; recursive, with ω² in p alone and in α; joint."""

SMALL = 1e-3
"""Share of a usual error: small enough that the second order is a thousandth of the first."""

CAUSES = [cause for cause in ONLY if cause != "noise"]


def draw_with_parameters(array, cause, seed, share=SMALL):
    """Draw a unit with small errors of one cause, and the parameters behind them in standard deviations, (m,)."""
    tolerances = only(array, cause, share=share)
    unit = draw_unit(array, tolerances, np.random.default_rng(seed))
    rng = np.random.default_rng(seed)  # the same numbers, in the order in which the unit is drawn
    places, turns = rng.standard_normal((len(array.chips), 3)), rng.standard_normal((len(array.chips), 3))
    c = array.n_channels
    bias, gain = rng.standard_normal(c), rng.standard_normal(c)
    cross, quadratic = rng.standard_normal((c, c)), rng.standard_normal(c)
    tempco = np.concatenate([rng.standard_normal(c), rng.standard_normal(c)])
    pairs = [
        (i, j) for i in range(c) for j in range(c) if i != j and array.chip_of_channel[i] == array.chip_of_channel[j]
    ]
    parameters = {
        "placement": places.ravel(), "angles": turns.ravel(), "bias": bias, "gain": gain,
        "cross-axis": np.array([cross[pair] for pair in pairs]), "nonlinearity": quadratic, "temperature": tempco,
    }  # fmt: skip
    return tolerances, unit, parameters[cause]


def readings_of(unit, run, tolerances):
    silent = replace(unit, noise=np.zeros(run.array.n_channels))
    return silent.record(run, np.random.default_rng(0), temperature=25.0 + tolerances.temperature_K).readings


def rest_removed(readings, motion):
    return readings - readings[: motion.rest].mean(axis=0)


@pytest.mark.parametrize("calibration", ["none", "rest"])
@pytest.mark.parametrize("cause", CAUSES)
@pytest.mark.parametrize("name", ARRAYS)
def test_each_cause_against_the_whole_chain(name, cause, calibration):
    run, motion = run_of(name), motion_of(name)
    array = run.array
    share = 10 * SMALL if cause == "angles" else SMALL  # MuJoCo has the direction of an axis to 1e-8 only
    tolerances, unit, parameters = draw_with_parameters(array, cause, 3, share)
    ideal = readings_of(perfect(array), run, tolerances)
    error = readings_of(unit, run, tolerances) - ideal
    if calibration == "rest":
        error = rest_removed(error, motion)
    before, after = estimated(run, ideal - error), estimated(run, ideal + error)  # central: free of second order

    maps = error_maps(array, motion)
    found = remaining(calibration, array, motion, tolerances, poses()).signatures
    nothing_to_pick_up = cause == "cross-axis" and len(array.chips[0].axes) == 1
    if nothing_to_pick_up or (cause == "bias" and calibration == "rest"):
        assert cause not in found
        np.testing.assert_allclose(after.omega, before.omega, atol=1e-12)
        return
    signature = found[cause] @ parameters  # (n, c)
    omega, _, position = np.split(np.einsum("nrc,nc->r", maps.end, signature), 3)
    seen_omega = 0.5 * (after.omega[-1] - before.omega[-1])
    seen_position = 0.5 * (after.position[-1] - before.position[-1])
    np.testing.assert_allclose(omega, seen_omega, atol=5e-3 * np.linalg.norm(seen_omega))
    np.testing.assert_allclose(position, seen_position, atol=5e-3 * np.linalg.norm(seen_position))

    alpha = 0.5 * np.sqrt(np.sum((after.alpha - before.alpha) ** 2, axis=1).mean())
    budget = tolerance_budget(array, motion, tolerances, calibration=calibration, poses=poses(), maps=maps)
    predicted = np.linalg.norm(budget.quantities["alpha"].factors[cause] @ parameters)
    assert predicted == pytest.approx(alpha, rel=5e-3)


@pytest.mark.parametrize("cause", CAUSES)
@pytest.mark.parametrize("name", ["cube12", "p3_three_plus_one"])
def test_the_rate_of_the_null_space(name, cause):
    run, motion = run_of(name), motion_of(name)
    tolerances, unit, parameters = draw_with_parameters(
        run.array, cause, 5, 10 * SMALL if cause == "angles" else SMALL
    )  # MuJoCo has the direction of an axis to 1e-8 only
    rows, sensitivity = null_space_of(run.array, motion)
    ideal, real = (readings_of(one, run, tolerances)[motion.turning] for one in (perfect(run.array), unit))
    found = [rates_of_null_space(one @ rows.T, sensitivity)[0] for one in (ideal, real)]
    found = [
        np.where(np.sum(one * motion.omega[motion.turning], axis=1, keepdims=True) < 0, -one, one) for one in found
    ]
    signature = remaining("none", run.array, motion, tolerances, poses()).signatures[cause] @ parameters
    predicted = np.einsum("kac,kc->ka", error_maps(run.array, motion).rate, signature[motion.turning])
    seen = found[1] - found[0]
    np.testing.assert_allclose(predicted, seen, atol=5e-3 * np.abs(seen).max())


@pytest.mark.parametrize("cause", ["placement", "angles", "bias", "gain", "cross-axis", "temperature"])
def test_what_poses_leave(cause):
    """The fit to the poses of a unit without noise, and its run corrected by it."""
    run, motion = run_of("cube12"), motion_of("cube12")
    array = run.array
    tolerances, unit, parameters = draw_with_parameters(array, cause, 7)
    up = poses().directions
    force = np.einsum("pi,ci->pc", 9.80665 * up, unit.array.axes)
    means = unit.errors.distort(force, np.full(len(up), 25.0))
    observations = Observations.from_means(means, 1e-6 * np.eye(array.n_channels), channels=array.channels)
    calibration = array_static(observations, array, gravity=9.80665)
    ideal = motion.readings(array)
    record = unit.record(run, np.random.default_rng(0), temperature=25.0 + tolerances.temperature_K)
    seen = calibration.apply(record).readings - ideal

    found = remaining("poses", array, motion, tolerances, poses()).signatures
    predicted = found[cause] @ parameters if cause in found else np.zeros_like(ideal)
    before = np.abs(record.readings - ideal).max()
    np.testing.assert_allclose(predicted, seen, atol=5e-3 * before)


def test_what_the_noise_of_the_poses_leaves():
    """Fits to poses with noise, of chips whose axes bend as expected, against the covariance that the fit predicts."""
    run, motion = run_of("cube12"), motion_of("cube12")
    array, up = run.array, poses().directions
    tolerances = only(array, "noise")
    found = remaining("poses", array, motion, tolerances, poses()).signatures["calibration"]
    rows = slice(None, None, 30)
    predicted = np.sum(found[rows] ** 2, axis=2)  # (rows, c)
    ideal, rng = motion.readings(array)[rows], np.random.default_rng(6)
    bend = quadratic_std(Recording.from_arrays(np.arange(18.0), 9.80665 * up @ array.axes.T, array), array)
    spread = np.diag(tolerances.noise**2 / poses().samples)
    errors = []
    for _ in range(60):
        q = bend * rng.standard_normal(array.n_channels)
        straight = 9.80665 * up @ array.axes.T
        means = straight + q * straight**2 + rng.multivariate_normal(np.zeros(array.n_channels), spread, len(up))
        observations = Observations.from_means(means, spread, channels=array.channels)
        fit = array_static(replace(observations, quadratic_std=bend), array, gravity=9.80665)
        recording = Recording.from_arrays(np.arange(len(ideal), dtype=float), ideal + q * ideal**2, array)
        errors.append(fit.apply(recording).readings - ideal)
    seen = np.mean(np.square(errors), axis=0)
    assert np.mean(seen / predicted) == pytest.approx(1.0, abs=0.1)
    assert np.median(seen / predicted) == pytest.approx(1.0, abs=0.1)


def noisy_runs(run, motion, tolerances, *, rest, count):
    """Return the errors of α, (count, n, 3), and of ω and position at the end, each (count, 3), of runs with noise."""
    ideal, rng = motion.readings(run.array), np.random.default_rng(2)
    before = estimated(run, ideal)
    alpha, omega, position = [], [], []
    for _ in range(count):
        noise = tolerances.noise * rng.standard_normal(ideal.shape)
        found = estimated(run, ideal + (rest_removed(noise, motion) if rest else noise))
        alpha.append(found.alpha - before.alpha)
        omega.append(found.omega[-1] - before.omega[-1])
        position.append(found.position[-1] - before.position[-1])
    return np.array(alpha), np.array(omega), np.array(position)


def as_budgeted(squares, rms):
    """Whether squared norms, (count,), have the mean square that a budget states."""
    sampling = squares.std() / squares.mean() / np.sqrt(len(squares))
    return squares.mean() / rms**2 == pytest.approx(1.0, abs=4.0 * sampling)


def test_noise_against_many_runs():
    """Simpson's weights, the levelled start and the mean over the rest that is taken off, all at once."""
    run, motion = run_of("cube12"), motion_of("cube12")
    tolerances = only(run.array, "noise", share=0.1)
    budget = tolerance_budget(run.array, motion, tolerances, calibration="rest", poses=poses()).quantities
    alpha, omega, position = noisy_runs(run, motion, tolerances, rest=True, count=80)
    assert as_budgeted(np.sum(omega**2, axis=1), budget["omega"].rms)
    assert as_budgeted(np.sum(position**2, axis=1), budget["position"].rms)
    over_run = np.sum(alpha**2, axis=2).mean(axis=1)
    assert as_budgeted(over_run, budget["alpha"].rms)
    drawn = budget["alpha"].draw(2000, "normal", np.random.default_rng(0))
    assert drawn.std() == pytest.approx(np.sqrt(over_run).std(), rel=4.0 / np.sqrt(2 * 80))


@pytest.mark.parametrize("calibration", ["none", "rest"])
def test_noise_that_feeds_itself(calibration):
    """An array whose α depends on ω²: the noise of ω comes back in α, where it is larger than the noise of a sample."""
    run = reference_motion(AccelerometerArray.load("p2_face_centres"), time=2.7, rate=5.0)
    motion = known_motion_of(run)
    tolerances = only(run.array, "noise", share=1e-2)
    maps = error_maps(run.array, motion)
    budget = tolerance_budget(
        run.array, motion, tolerances, calibration=calibration, poses=poses(), maps=maps
    ).quantities["alpha"]
    assert budget.rms > 1.2 * np.sqrt(np.sum((maps.alpha * tolerances.noise) ** 2))
    alpha, _, _ = noisy_runs(run, motion, tolerances, rest=calibration == "rest", count=80)
    assert as_budgeted(np.sum(alpha**2, axis=2).mean(axis=1), budget.rms)


def test_an_array_without_null_space_has_no_such_rate():
    assert error_maps(AccelerometerArray.load("p1_face_diagonals"), motion_of("p1_face_diagonals")).rate is None
