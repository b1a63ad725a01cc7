"""The budget: closed cases by hand, shares, halving, scaling, and the simulated units beside it."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import scipy.stats
from tolerance_cases import ONLY, motion_of, only, poses, run_of

from gfimu import AccelerometerArray, ChipErrors, InputError, tolerance
from gfimu.budget import pay_for, room_for
from gfimu.budget.tolerances.budget import tolerance_budget
from gfimu.budget.tolerances.calibrated import CALIBRATIONS, calibrations_of, check_calibration
from gfimu.budget.tolerances.comparison import compare
from gfimu.budget.tolerances.propagation import error_maps
from gfimu.budget.tolerances.tolerances import CAUSES, Tolerances
from sim.trials.worlds.tolerance_units import UnitTask, simulate_units
from sim.trials.worlds.toleranced import calibration_poses, known_motion_of, reference_motion


def usual(array, **changes):
    return Tolerances.of(array, 100.0, **({"placement_m": 2e-4, "angle_rad": 0.00873, "temperature_K": 5.0} | changes))


def budget_of(name, calibration, tolerances=None, **changes):
    array = run_of(name).array
    chosen = usual(array, **changes) if tolerances is None else tolerances
    return tolerance_budget(array, motion_of(name), chosen, calibration=calibration, poses=poses())


def test_bias_of_the_cube_by_hand():
    """S of the cube has rows of two entries ±1/(4h)·… : σ_α = b/(√8 h), h = 5 cm (docs/theory/geometry.md)."""
    found = budget_of("cube12", "none", only(run_of("cube12").array, "bias")).quantities["alpha"]
    assert found.rms == pytest.approx(math.sqrt(3.0) * 0.3 / (math.sqrt(8.0) * 0.05))


def test_placement_in_a_steady_spin_by_hand():
    """Of chips that turn about z at ω, Ω = −ω² diag(1, 1, 0): each x and y axis reads −ω² δ, and no z axis."""
    array = AccelerometerArray.load("cube12")
    motion = motion_of("cube12")
    steady = np.abs(motion.alpha).max(axis=1) < 1e-9
    steady &= np.abs(motion.omega[:, 2] - 5.0) < 1e-9
    held = dataclasses.replace(
        motion, t=motion.t[steady], p=motion.p[steady], alpha=motion.alpha[steady], omega=motion.omega[steady],
        rotation=motion.rotation[steady],
    )  # fmt: skip
    tolerances = only(array, "placement")
    found = tolerance_budget(array, held, tolerances, calibration="none", poses=poses()).quantities["alpha"]
    reading = 25.0 * tolerances.placement_std  # m/s², of the eight x and y axes
    rows = np.linalg.pinv(array.regression_matrix)[:3]
    across = np.abs(array.axes[:, 2]) < 0.5
    assert found.rms == pytest.approx(reading * np.sqrt(np.sum(rows[:, across] ** 2)))


@pytest.mark.parametrize("calibration", CALIBRATIONS)
def test_shares_sum_to_one_and_halving_is_what_half_a_tolerance_does(calibration):
    array = run_of("cube12").array
    whole = budget_of("cube12", calibration, placement_m=2e-3)
    half = budget_of("cube12", calibration, placement_m=1e-3)
    for name, one in whole.quantities.items():
        assert sum(one.shares.values()) == pytest.approx(1.0)
        assert list(one.by_cause) == [cause for cause in CAUSES if cause in one.by_cause]
        assert half.quantities[name].rms == pytest.approx(one.rms * (1.0 - one.halving["placement"]))
    assert set(whole.quantities) == {"alpha", "omega", "omega_null_space", "position"}
    assert array.n_channels == 12


def test_the_allowance_makes_a_tenth_more():
    tolerances = usual(run_of("cube12").array)
    before = budget_of("cube12", "rest", tolerances).quantities["omega"]
    for cause, field in (("placement", "placement_m"), ("angles", "angle_rad")):
        larger = dataclasses.replace(tolerances, **{field: getattr(tolerances, field) * before.allowance[cause]})
        assert budget_of("cube12", "rest", larger).quantities["omega"].rms == pytest.approx(1.1 * before.rms)
    assert room_for(before, tolerances).startswith("a tenth more at placement ±")


@pytest.mark.parametrize("calibration", CALIBRATIONS)
def test_no_tolerance_no_error(calibration):
    nothing = only(run_of("cube12").array, "none of them")
    budget = budget_of("cube12", calibration, nothing)
    for one in budget.quantities.values():
        assert one.rms == 0.0
        assert not one.shares
        assert pay_for(one).startswith("no tolerance")
        np.testing.assert_array_equal(one.draw(5, "uniform", np.random.default_rng(0)), 0.0)
    assert budget.attitude_rad == 0.0


def test_a_calibration_takes_off_what_it_says():
    none, rest, posed, both = (budget_of("cube12", name).quantities["omega"].by_cause for name in CALIBRATIONS)
    assert "bias" in none
    assert not {"bias", "calibration"} & set(rest)
    assert not {"bias", "gain", "nonlinearity"} & set(posed)
    assert "calibration" in posed
    assert both["angles"] < rest["angles"] < none["angles"]
    # Of independent rotations of four chips, and of a mean over four: half as much.
    assert posed["placement"] == pytest.approx(none["placement"])


def test_the_first_order_map_draws_what_the_budget_states():
    for calibration in ("rest", "poses"):
        for one in budget_of("cube12", calibration).quantities.values():
            drawn = one.draw(4000, "uniform", np.random.default_rng(1))
            sampling = 0.5 * np.std(drawn**2) / np.mean(drawn**2) / math.sqrt(4000)
            assert np.sqrt(np.mean(drawn**2)) == pytest.approx(one.rms, rel=4.0 * sampling)


def test_quantiles_of_the_first_order_map_are_those_of_units():
    """Also of an error that is almost all noise, whose mean square over the run scatters little."""
    tolerances = usual(run_of("cube12").array)
    errors = simulated("cube12", ("rest",), tolerances, 60)["rest"].errors
    for name, one in budget_of("cube12", "rest", tolerances).quantities.items():
        drawn = one.draw(5000, "uniform", np.random.default_rng(1))
        assert scipy.stats.ks_2samp(drawn, errors[name]).pvalue > 1e-3, name


def simulated(name, calibrations, tolerances, units, workers=1):
    run = run_of(name)
    posed, _ = calibration_poses(run)
    rates = error_maps(run.array, motion_of(name)).rate is not None
    return simulate_units(UnitTask(run, posed, tolerances, calibrations, rates, 4), units, workers)


@pytest.mark.parametrize("name", ["cube12", "corners8", "p1_face_diagonals", "p2_face_centres"])
def test_simulated_units_agree_with_first_order_after_a_rest(name):
    tolerances = usual(run_of(name).array)
    found = simulated(name, ("rest",), tolerances, 30)["rest"]
    assert not found.failures
    budget = budget_of(name, "rest", tolerances)
    for quantity, errors in found.errors.items():
        one = compare(budget.quantities[quantity], errors, "uniform")
        assert one.units == 30
        assert one.ratio == pytest.approx(1.0, abs=0.02 + 4.0 * one.ratio_std)
        assert one.ratio_std < 0.17
        assert one.agrees


def test_simulated_units_agree_with_first_order_after_poses():
    """The calibration itself runs for each unit: 18 poses of 6 s with noise, and the fit."""
    tolerances = usual(run_of("cube12").array, placement_m=2e-3, angle_rad=0.02)
    found = simulated("cube12", ("poses", "poses+rest"), tolerances, 15)
    for calibration, units in found.items():
        budget = budget_of("cube12", calibration, tolerances)
        for quantity in ("alpha", "omega", "omega_null_space"):
            one = compare(budget.quantities[quantity], units.errors[quantity], "uniform")
            assert one.ratio == pytest.approx(1.0, abs=0.03 + 4.0 * one.ratio_std), (calibration, quantity)


def test_an_array_whose_rate_diverges():
    """Units that could not be estimated are counted by their reason, and what is left is not called first order."""
    tolerances = usual(run_of("p2_face_centres").array)
    run = reference_motion(run_of("p2_face_centres").array, time=3.0, rate=5.0)
    found = simulate_units(UnitTask(run, calibration_poses(run)[0], tolerances, ("none", "rest"), False, 0), 20, 1)
    (reason,) = found["none"].failures
    assert found["none"].failures[reason] == 20
    assert reason.startswith("the rate diverges … s after the start")
    assert not found["none"].errors
    motion = known_motion_of(run)
    budget = tolerance_budget(run.array, motion, tolerances, calibration="rest", poses=poses())
    one = compare(budget.quantities["alpha"], found["rest"].errors["alpha"], "uniform")
    assert one.units == 20 - sum(found["rest"].failures.values())
    assert not one.agrees


def test_where_first_order_fails_it_says_so():
    """Without calibration the attitude is off by several radians after 3 s: position is bounded, first order not."""
    tolerances = usual(run_of("cube12").array)
    found = simulated("cube12", ("none",), tolerances, 20)["none"]
    budget = budget_of("cube12", "none", tolerances)
    assert not compare(budget.quantities["position"], found.errors["position"], "uniform").agrees
    assert compare(budget.quantities["alpha"], found.errors["alpha"], "uniform").agrees
    assert budget.attitude_rad > 1.0


@pytest.mark.parametrize("cause", list(ONLY))
def test_units_of_one_cause(cause):
    """One cause at a time, so that a share is simulated as well, not the total alone."""
    tolerances = only(run_of("cube12").array, cause, share=0.3)
    found = simulated("cube12", ("none",), tolerances, 16)["none"].errors
    budget = budget_of("cube12", "none", tolerances)
    for quantity in ("alpha", "omega", "omega_null_space"):
        one = compare(budget.quantities[quantity], found[quantity], "normal")
        assert one.ratio == pytest.approx(1.0, abs=0.05 + 4.0 * one.ratio_std)


def test_no_tolerance_no_error_of_units():
    found = simulated("cube12", ("none", "rest"), only(run_of("cube12").array, "none of them"), 10)
    for units in found.values():
        for errors in units.errors.values():
            np.testing.assert_allclose(errors, 0.0, atol=1e-9)


@pytest.mark.study
def test_units_do_not_depend_on_workers_or_on_other_calibrations():
    tolerances = usual(run_of("p1_face_diagonals").array)
    alone = simulated("p1_face_diagonals", ("rest",), tolerances, 12)["rest"].errors
    spread = simulated("p1_face_diagonals", ("none", "rest"), tolerances, 12, workers=2)["rest"].errors
    for quantity, errors in alone.items():
        np.testing.assert_array_equal(errors, spread[quantity])


def test_a_unit_is_the_same_in_any_batch():
    run = run_of("cube12")
    task = UnitTask(run, calibration_poses(run)[0], usual(run.array), ("none",), True, 4)
    assert task.row(2) == [task.row(number) for number in range(3)][2]
    other = UnitTask(run, task.poses, task.tolerances, ("none",), True, 5)
    assert other.row(2) != task.row(2)


def test_chips_with_one_axis_have_no_poses():
    array = AccelerometerArray.load("p1_face_diagonals")
    motion = motion_of("p1_face_diagonals")
    assert calibrations_of(array, motion) == ("none", "rest")
    with pytest.raises(InputError, match="three orthogonal axes"):
        check_calibration("poses", array, motion)


def test_without_rest_biases_cannot_be_read():
    array, motion = AccelerometerArray.load("cube12"), motion_of("cube12")
    later = dataclasses.replace(
        motion, t=motion.t[100:], p=motion.p[100:], alpha=motion.alpha[100:], omega=motion.omega[100:],
        rotation=motion.rotation[100:],
    )  # fmt: skip
    assert calibrations_of(array, later) == ("none", "poses")


def test_data_sheets_and_what_is_given():
    array = AccelerometerArray.load("cube12")
    sheet = usual(array)
    assert sheet.bias[:3] == pytest.approx([0.343233, 0.343233, 0.392266])
    assert sheet.gain[0] == 0.01
    assert sheet.noise[0] == pytest.approx(0.75 * 0.038245935)
    given = usual(array, chip=ChipErrors(bias_m_s2=0.1, noise_m_s2_rthz=1e-3), shape="normal")
    assert given.bias == pytest.approx(np.full(12, 0.1))
    assert given.noise == pytest.approx(np.full(12, 1e-3 * math.sqrt(50.0)))
    assert "bias_m_s2" not in given.from_data_sheet
    assert (sheet.placement_std, given.placement_std) == pytest.approx((2e-4 / math.sqrt(3.0), 2e-4 / 3.0))


@pytest.mark.parametrize("wrong", [{"placement_m": -1e-3}, {"angle_rad": math.nan}, {"shape": "triangle"}])
def test_wrong_tolerances(wrong):
    with pytest.raises(InputError):
        usual(AccelerometerArray.load("cube12"), **wrong)


def test_a_tolerance_that_does_not_matter_gets_no_absurd_limit():
    """After poses the angles hardly matter; first order would allow thousands of degrees."""
    result = tolerance("mimu4444", calibrated=["poses"], closed_form=True)
    room = room_for(result.budgets["poses"].quantities["position"], result.tolerances)
    assert room == "a tenth more at placement over ±2 mm or angles over ±5°"
