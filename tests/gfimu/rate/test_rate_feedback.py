"""Integration of an angular acceleration that depends on the rate, against scipy's solution of the same equation."""

import numpy as np
import pytest
import scipy.integrate

from gfimu import InputError
from gfimu.array import omega_products
from gfimu.rate import integrate_rate_recursively

# α_x = u_x + ω_y ω_z and so on: the six uniaxial sensors at the face centres.
LEAKAGE = -np.array([[0, 0, 0, 0, 0, 1.0], [0, 0, 0, 0, 1.0, 0], [0, 0, 0, 1.0, 0, 0]])
START = np.array([0.3, -0.2, 0.1])


def linear_part(t):
    return np.stack([np.cos(t), np.sin(1.3 * t), np.cos(0.7 * t + 1.0)], axis=-1)


def exact(times):
    solution = scipy.integrate.solve_ivp(
        lambda t, omega: linear_part(t) - LEAKAGE @ omega_products(omega),
        (times[0], times[-1]),
        START,
        t_eval=times,
        method="DOP853",
        rtol=1e-12,
        atol=1e-12,
    )
    return solution.y.T


def integrate(t, alpha=None, leakage=LEAKAGE, start=START):
    alpha = linear_part(t) if alpha is None else alpha
    return integrate_rate_recursively(t, alpha, leakage[None], np.zeros(len(t), dtype=np.intp), start)


def test_third_order():
    errors = []
    for n in (51, 101, 201):
        t = np.linspace(0.0, 1.0, n)
        errors.append(np.abs(integrate(t) - exact(t)).max())
    assert errors[0] < 1e-5
    # Halving the step divides the error by eight.
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 8.0, rtol=0.25)


def test_uneven_steps_keep_the_order():
    rng = np.random.default_rng(0)
    errors = []
    for n in (51, 201):
        even = np.linspace(0.0, 1.0, n)
        t = even + np.pad(rng.uniform(-0.15, 0.15, n - 2), 1) * even[1]
        errors.append(np.abs(integrate(t) - exact(t)).max())
    assert errors[0] / errors[1] > 4**2.5


def test_lost_samples_are_bridged_and_stay_unknown():
    t = np.linspace(0.0, 1.0, 201)
    alpha = linear_part(t)
    alpha[100:103] = np.nan
    found = integrate(t, alpha)
    assert np.isnan(found[100:103]).all()
    known = np.isfinite(found).all(axis=1)
    assert known.sum() == 198
    # The trapezoid over 20 ms: h³/12 = 7e-7 times the second derivative, which is of order one here.
    assert np.abs(found[known] - exact(t)[known]).max() < 1e-5


def test_without_feedback_it_is_a_quadrature():
    t = np.linspace(0.0, 3.0, 301)
    found = integrate(t, np.stack([t**2, t, np.ones_like(t)], axis=1), leakage=np.zeros((3, 6)), start=np.zeros(3))
    # Exact for parabolas, but for the trapezoid of the first step: h³/6.
    np.testing.assert_allclose(found, np.stack([t**3 / 3, t**2 / 2, t], axis=1), atol=0.01**3)


def test_divergence_is_told():
    t = np.linspace(0.0, 20.0, 2001)
    alpha = np.ones((len(t), 3))
    with pytest.raises(InputError, match=r"the rate diverges .* s after the start"):
        integrate(t, alpha)


def test_nothing_known():
    t = np.linspace(0.0, 1.0, 5)
    assert np.isnan(integrate(t, np.full((5, 3), np.nan))).all()
