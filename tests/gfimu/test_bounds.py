"""Per-sample bound on the angular rate: closed forms, and Fisher information taken another way."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from gfimu import AccelerometerArray, InputError, rate_bound, specific_force
from gfimu.array import omega_products
from gfimu.rate import alpha_std, omega_products_jacobian, rate_bound_isotropic, rate_information

rates = hnp.arrays(float, (3,), elements=st.floats(-40.0, 40.0)).filter(lambda w: np.linalg.norm(w) > 0.1)


@given(omega=rates, noise=st.floats(1e-4, 1.0))
def test_tetrahedral_cube_has_the_closed_form(omega, noise):
    array = AccelerometerArray.load("cube12")
    h, speed = 0.05, np.linalg.norm(omega)
    along = np.outer(omega, omega) / speed**2
    across = np.eye(3) - along
    expected = (8 * across + 32 * along) * h**2 * speed**2 / noise**2
    np.testing.assert_allclose(rate_information(array, omega, noise), expected, rtol=1e-9, atol=1e-9 * expected.max())
    perpendicular, parallel = rate_bound_isotropic(alpha_std(array, noise)[0], speed)
    variance = np.diag(across) * perpendicular**2 + np.diag(along) * parallel**2
    np.testing.assert_allclose(rate_bound(array, omega, noise), np.sqrt(variance), rtol=1e-6)


def test_published_figures_for_alternate_corners():
    # Spin ω about z, edge L: sd(α) = σ/(√2 L); sd(ω_z) = 0.354 σ/(Lω), transverse 0.707 σ/(Lω).
    array = AccelerometerArray.load("cube12_as_built")
    noise, edge, speed = 0.03, 0.1, 7.0
    np.testing.assert_allclose(alpha_std(array, noise), noise / (np.sqrt(2) * edge))
    bound = rate_bound(array, [0, 0, speed], noise) * edge * speed / noise
    np.testing.assert_allclose(bound, [0.707, 0.707, 0.354], atol=5e-4)


@pytest.mark.parametrize("name", ["cube12", "corners8", "p3_three_plus_one", "mimu4444"])
def test_information_is_that_of_the_nine_unknowns_with_motion_eliminated(name):
    # Independent way: Jacobian of the forward model by [α, p, ω], differentiated numerically, then a Schur complement.
    array = AccelerometerArray.load(name)
    omega, noise, step = np.array([3.0, -5.0, 2.0]), 0.02, 1e-5

    def readings(unknowns):
        return specific_force(array, unknowns[3:6], unknowns[:3], unknowns[6:])[0]

    centre = np.r_[np.zeros(6), omega]
    slopes = np.column_stack(
        [(readings(centre + move) - readings(centre - move)) / (2 * step) for move in step * np.eye(9)]
    )
    fisher = slopes.T @ slopes / noise**2
    schur = fisher[6:, 6:] - fisher[6:, :6] @ np.linalg.solve(fisher[:6, :6], fisher[:6, 6:])
    np.testing.assert_allclose(rate_information(array, omega, noise), schur, rtol=1e-5, atol=1e-5 * schur.max())
    np.testing.assert_allclose(rate_bound(array, omega, noise), np.sqrt(np.diag(np.linalg.inv(schur))), rtol=1e-5)


def test_what_one_sample_cannot_tell_is_infinite():
    cube, nap, six = (AccelerometerArray.load(n) for n in ("cube12", "nap_3_2_2_2", "p1_face_diagonals"))
    bounds = rate_bound(cube, [[0, 0, 0], [0, 0, 5.0]], 0.03)
    assert np.isinf(bounds[0]).all()
    assert np.isfinite(bounds[1]).all()
    # The nine-accelerometer package sees ωxωy, ωxωz, ωyωz only: about z it sees ωx and ωy, never ωz itself.
    np.testing.assert_array_equal(np.isinf(rate_bound(nap, [0, 0, 5.0], 0.03)), [False, False, True])
    assert np.isinf(rate_bound(six, [1.0, 2.0, 3.0], 0.03)).all()
    perpendicular, parallel = rate_bound_isotropic(1.0, [0.0, 2.0])
    np.testing.assert_array_equal(perpendicular, [np.inf, 0.5])
    np.testing.assert_array_equal(parallel, [np.inf, 0.25])


@given(omega=rates)
def test_jacobian_is_the_derivative_of_the_products(omega):
    step = 1e-6
    numeric = np.column_stack(
        [(omega_products(omega + move) - omega_products(omega - move)) / (2 * step) for move in step * np.eye(3)]
    )
    np.testing.assert_allclose(omega_products_jacobian(omega), numeric, atol=1e-6)


def test_noise_must_be_positive():
    with pytest.raises(InputError, match=r"noise_std = 0\.0"):
        rate_bound(AccelerometerArray.load("cube12"), [0, 0, 1], 0.0)
