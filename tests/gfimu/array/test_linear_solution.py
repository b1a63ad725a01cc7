"""The linear part of the motion, with all channels and with some missing, against known motion."""

import numpy as np
import pytest

from gfimu import AccelerometerArray, GeometryError, InputError, specific_force
from gfimu.array import omega_products
from gfimu.array.linear_solution import linear_solution

FORM_OF = {
    "cube12": "linear",
    "cube12_as_built": "linear",
    "corners8": "linear",
    "p3_three_plus_one": "joint",
    "mimu4444": "joint",
    "p2_face_centres": "recursive",
}


def motion(n=200, seed=4):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(n, 3)) * 8, rng.normal(size=(n, 3)) * 20, rng.normal(size=(n, 3)) * 5


def solve(array, readings, **options):
    return linear_solution(array, readings, np.ones(array.n_channels), **options)


@pytest.mark.parametrize(("name", "form"), FORM_OF.items())
def test_exact_readings_give_the_motion_back(name, form):
    array = AccelerometerArray.load(name)
    p, alpha, omega = motion()
    solution = solve(array, specific_force(array, p, alpha, omega))
    assert solution.form == form
    assert solution.needs_omega == (form == "recursive")
    found = solution.with_omega(omega)
    np.testing.assert_allclose(found, np.hstack([alpha, p]), atol=1e-8)
    seen = np.isfinite(solution.omega_products).all(axis=0)
    np.testing.assert_allclose(solution.omega_products[:, seen], omega_products(omega)[:, seen], atol=1e-7)
    assert seen.sum() == {"recursive": 0}.get(form, 6)


@pytest.mark.parametrize("missing", [1, 2, 3])
def test_missing_channels_are_made_up_for_by_the_others(missing):
    array = AccelerometerArray.load("cube12")
    p, alpha, omega = motion()
    readings = specific_force(array, p, alpha, omega)
    rng = np.random.default_rng(missing)
    for row in range(50, 150):
        readings[row, rng.choice(12, missing, replace=False)] = np.nan
    solution = solve(array, readings)
    assert solution.needs_omega  # the centripetal terms no longer cancel
    np.testing.assert_allclose(solution.with_omega(omega), np.hstack([alpha, p]), atol=1e-8)
    assert len(solution.leakage) == len(np.unique(solution.pattern)) <= 101


def test_samples_with_too_few_channels_stay_unknown():
    array = AccelerometerArray.load("cube12")
    p, alpha, omega = motion(5)
    readings = specific_force(array, p, alpha, omega)
    readings[1, 3:] = np.nan
    readings[3] = np.nan
    found = solve(array, readings).with_omega(omega)
    assert np.isnan(found).all(axis=1).tolist() == [False, True, False, True, False]
    np.testing.assert_allclose(found[[0, 2, 4]], np.hstack([alpha, p])[[0, 2, 4]], atol=1e-8)


def test_covariance_is_that_of_noisy_readings():
    array = AccelerometerArray.load("p3_three_plus_one")
    n = 20_000
    rng = np.random.default_rng(8)
    noise = rng.uniform(0.01, 0.05, 12)
    solution = linear_solution(array, rng.normal(size=(n, 12)) * noise, noise)
    # Relative sampling error of a standard deviation: 1/√(2n) = 0.5 %; five of them.
    expected = np.sqrt(np.diag(solution.covariance[0]))
    np.testing.assert_allclose(solution.motion.std(axis=0), expected, rtol=0.025)
    np.testing.assert_allclose(solution.omega_products.std(axis=0), solution.omega_products_std[0], rtol=0.025)
    np.testing.assert_allclose(solution.alpha_variance[0], expected[:3] ** 2)


def test_forms_can_be_chosen_where_the_geometry_allows():
    p, alpha, omega = motion(20)
    cube = AccelerometerArray.load("cube12")
    readings = specific_force(cube, p, alpha, omega)
    for form in ("linear", "joint", "recursive"):
        np.testing.assert_allclose(solve(cube, readings, form=form).with_omega(omega)[:, 3:], p, atol=1e-9)
    uniaxial = AccelerometerArray.load("p2_face_centres")
    readings = specific_force(uniaxial, p, alpha, omega)
    with pytest.raises(GeometryError, match="leaves products of the angular rate"):
        solve(uniaxial, readings, form="linear")
    with pytest.raises(GeometryError, match="can't separate alpha_x"):
        solve(uniaxial, readings, form="joint")
    with pytest.raises(InputError, match="unknown form 'magic'; valid: auto, joint, linear, recursive"):
        solve(uniaxial, readings, form="magic")
