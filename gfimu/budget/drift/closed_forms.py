"""Closed forms of drift: position and attitude error per error of the motion, as functions of time.

Small errors of the motion that navigation is fed with — constant offsets of p, of the rate and of the angular
acceleration, their white noise and random walks — grow into position through known powers of time. The unit is at
rest or turns at constant rate Ω about the vertical. A tilt error θ lets gravity in: δr̈ = θ × g ẑ + R δp, so the chain
is α → rate → tilt → gravity. With a horizontal vector written as the complex number x + iy, z = iΩt, and the entire
functions φ_k(z) = Σ_j z^j / (j + k)! (φ_k(0) = 1/k!), the error after time t is

================  ======================  ==============  ================
constant error    turning, horizontal     at rest         turning, Ωt ≫ 1
================  ======================  ==============  ================
b of p            t² φ₂ b                 b t²/2          b t/Ω
d of the rate     −i g t³ φ₃ d            g d t³/6        g d t²/(2Ω)
b of α            −i g t⁴ (φ₃ − 3φ₄) b    g b t⁴/24       g b t²/(2Ω²)
================  ======================  ==============  ================

(GF-IMU paper, eq. 30 for the unit at rest.) The vertical error of p is b t²/2 always: turning does not average it.
The forms are exact to first order in the errors, also for a unit off the axis.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.integration import integrate_samples
from gfimu.base.declared import Declared, figure
from gfimu.base.errors import InputError
from gfimu.base.short_repr import short_repr
from gfimu.base.units import STANDARD_GRAVITY

__all__ = [
    "ErrorSources",
    "accumulated_covariance",
    "attitude_growth",
    "position_error",
    "position_from_bias",
    "position_from_impulse",
    "position_from_rate",
]

_SERIES_RADIUS = 4.0
_SERIES_TERMS = 40
_LARGEST = 1e6  # numerical: of a source of error, SI


@dataclass(frozen=True)
class ErrorSources(Declared):
    """Sensor errors that cause drift; all but the last belong to each sensing axis, independently.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.ErrorSources(bias=0.01, noise_density=2.8e-3)
    ErrorSources(bias=0.01, noise_density=0.0028, bias_random_walk=0.0, rate_drift=0.0)
    """

    bias: Annotated[float, figure("Constant bias, 1 σ.", "m/s²", key="bias_m_s2")] = 0.0
    noise_density: Annotated[
        float, figure("White noise, one-sided density.", "m/s²/√Hz", key="noise_density_m_s2_sqrt_hz")
    ] = 0.0
    bias_random_walk: Annotated[
        float, figure("Random walk of the bias.", "m/s²/√s", key="bias_random_walk_m_s2_sqrt_s")
    ] = 0.0
    rate_drift: Annotated[
        float, figure("Constant error of the angular rate per axis, 1 σ.", "rad/s", key="rate_drift_rad_s")
    ] = 0.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0.0 <= value <= _LARGEST:
                raise InputError(
                    f"{name} is {value}; it must be a finite number, zero or above, of at most {_LARGEST:g}"
                )


@dataclass(frozen=True)
class AttitudeGrowth:
    """Growth of the attitude error; every field has shape (n,).

    Parameters
    ----------
    t_s : ndarray
        Time since the start of navigation, s.
    tilt : ndarray
        Standard deviation of the tilt about one horizontal axis (mean of the two), rad.
    heading : ndarray
        Standard deviation of the turn about the vertical, rad.
    deciding : ndarray
        The error that ends the validity of first order, rad: tilt or heading, the larger; for a unit on the axis of
        a turning table the error of the rate relative to the table's, where that is smaller, stands for heading.
    """

    t_s: NDArray[np.float64]
    tilt: NDArray[np.float64]
    heading: NDArray[np.float64]
    deciding: NDArray[np.float64]

    __repr__ = short_repr


def position_error(
    time: ArrayLike,
    *,
    p_bias: ArrayLike = (0.0, 0.0, 0.0),
    rate_drift: ArrayLike = (0.0, 0.0, 0.0),
    alpha_bias: ArrayLike = (0.0, 0.0, 0.0),
    rate: float = 0.0,
    offset: tuple[float, float] = (0.0, 0.0),
    gravity: float = STANDARD_GRAVITY,
) -> NDArray[np.float64]:
    """Position error from given constant errors, to first order.

    Parameters
    ----------
    time : array_like, shape (...)
        Time since the start of navigation, s.
    p_bias, rate_drift, alpha_bias : array_like, shape (3,)
        Constant errors in body axes of p, m/s², rate, rad/s, and angular acceleration, rad/s².
    rate : float
        Constant rate of the table about the vertical, rad/s.
    offset : tuple of float
        Horizontal position of the unit from the axis, body axes, m.
    gravity : float
        Magnitude of gravity, m/s².

    Returns
    -------
    ndarray, shape (..., 3)
        Position error in world axes (those of the body at the start), m.
    """
    t = np.asarray(time, dtype=float)
    place = complex(*offset)
    return (
        position_from_p(t, rate) @ np.asarray(p_bias, dtype=float)
        + position_from_rate(t, rate, place, gravity) @ np.asarray(rate_drift, dtype=float)
        + position_from_alpha(t, rate, place, gravity) @ np.asarray(alpha_bias, dtype=float)
    )


def position_from_p(t: ArrayLike, rate: float) -> NDArray[np.float64]:
    """Position error per constant bias of p: matrices that take body axes to world axes, shape (..., 3, 3), s²."""
    t = np.asarray(t, dtype=float)
    return _matrix(t**2 * _phi(2, 1j * rate * t), 0.5 * t**2)


def position_from_rate(t: ArrayLike, rate: float, offset: complex, gravity: float) -> NDArray[np.float64]:
    """Position error per constant error of the rate, shape (..., 3, 3), m s/rad; ``offset`` is x + iy, m."""
    t = np.asarray(t, dtype=float)
    z = 1j * rate * t
    matrix = _matrix(-1j * gravity * t**3 * _phi(3, z))
    # Off the axis the centripetal force −Ω² ρ turns with the attitude error as gravity does.
    heading = -1j * rate**2 * offset * t**3 * (_phi(2, z) - 2.0 * _phi(3, z))  # ∫(t − s) s e^{iΩs} ds = t³ φ₂′
    lift = -(rate**2) * t**3 * offset * _phi(3, z)
    return _with_offset(matrix, heading, lift)


def position_from_alpha(t: ArrayLike, rate: float, offset: complex, gravity: float) -> NDArray[np.float64]:
    """Position error per constant bias of the angular acceleration, shape (..., 3, 3), m s²/rad."""
    t = np.asarray(t, dtype=float)
    z = 1j * rate * t
    phi_2, phi_3, phi_4 = _phi(2, z), _phi(3, z), _phi(4, z)
    matrix = _matrix(-1j * gravity * t**4 * (phi_3 - 3.0 * phi_4))  # φ₃′ = φ₃ − 3 φ₄
    heading = -0.5j * rate**2 * offset * t**4 * (phi_2 - 4.0 * phi_3 + 6.0 * phi_4)  # φ₂″
    lift = -(rate**2) * t**4 * offset * phi_4
    return _with_offset(matrix, heading, lift)


def position_from_bias(t: ArrayLike, rate: float, offset: complex, gravity: float) -> NDArray[np.float64]:
    """Position error per constant bias of [alpha; p], shape (..., 3, 6)."""
    return np.concatenate([position_from_alpha(t, rate, offset, gravity), position_from_p(t, rate)], axis=-1)


def position_from_impulse(t: NDArray[np.float64], rate: float, offset: complex, gravity: float) -> NDArray[np.float64]:
    """Position error per impulse of [alpha; p] at times ``t`` before, (m,), body axes of then, shape (m, 3, 6).

    An impulse of alpha is a step of the rate, one of p a step of the velocity.
    """
    from_alpha = position_from_rate(t, rate, offset, gravity)
    return np.concatenate([from_alpha, t[:, None, None] * np.eye(3)], axis=-1)


def accumulated_covariance(
    impulse: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    covariance: NDArray[np.float64],
    time: float,
    rate: float,
) -> NDArray[np.float64]:
    """Covariance of the position from a steady stream of small independent errors, shape (3, 3), m².

    ∫ R(t − τ) H(τ) Σ H(τ)ᵀ R(t − τ)ᵀ dτ, where ``impulse`` gives H(τ), shape (m, 3, 6), the position in the axes of
    the body when an impulse came, a time τ after it, and ``covariance`` is Σ per unit of time.
    """
    panels = 1 + int(abs(rate) * time)
    nodes, weights = np.polynomial.legendre.leggauss(8)  # exact for the polynomials at rest, up to t⁸ (degree 15)
    width = time / panels
    tau = ((np.arange(panels)[:, None] + 0.5 * (nodes + 1.0)) * width).ravel()
    turned = _matrix(np.exp(1j * rate * (time - tau)), 1.0) @ impulse(tau)  # (m, 3, 6)
    return np.einsum("m,mij,jk,mlk->il", np.tile(0.5 * width * weights, panels), turned, covariance, turned)


def attitude_growth(
    alpha_covariance: NDArray[np.float64],
    sources: ErrorSources,
    time: float,
    rate: float = 0.0,
    *,
    off_axis: bool = False,
) -> AttitudeGrowth:
    """Compute how the attitude error grows up to a time.

    Parameters
    ----------
    alpha_covariance : ndarray, shape (3, 3)
        Covariance of alpha for channels of unit variance, 1/m².
    sources : ErrorSources
        Errors of the sensors.
    time : float
        Last time, s.
    rate : float
        Constant rate of the table about the vertical, rad/s.
    off_axis : bool
        Whether the unit sits off the axis, so that heading moves it.

    Returns
    -------
    AttitudeGrowth
        Standard deviations on a grid of times.
    """
    t = np.linspace(0.0, time, 513 + int(16 * abs(rate) * time))
    z = 1j * rate * t
    density, walk = sources.noise_density / math.sqrt(2.0), sources.bias_random_walk

    def growth(of_rate: NDArray[np.float64], of_alpha: NDArray[np.float64], unit: float) -> NDArray[np.float64]:
        # Noise is a sum of small steps of the rate, a random walk one of small steps of the bias.
        sums = integrate_samples(t, np.column_stack([of_rate, of_alpha]), method="centred4")
        return np.sqrt(
            sources.rate_drift**2 * of_rate
            + unit * (sources.bias**2 * of_alpha + density**2 * sums[:, 0] + walk**2 * sums[:, 1])
        )

    level = float(alpha_covariance.diagonal()[:2].mean())
    upright = float(alpha_covariance[2, 2])
    tilt = growth(np.abs(t * _phi(1, z)) ** 2, np.abs(t**2 * (_phi(1, z) - _phi(2, z))) ** 2, level)  # φ₁′ = φ₁ − φ₂
    heading = growth(t**2, 0.25 * t**4, upright)
    deciding = np.maximum(tilt, heading)
    if rate and not off_axis:
        # A unit on the axis does not mind its heading, only that the table seems to turn at another rate.
        wrong_rate = growth(np.ones_like(t), t**2, upright) / abs(rate)
        deciding = np.maximum(tilt, np.minimum(heading, wrong_rate))
    return AttitudeGrowth(t, tilt, heading, deciding)


def _phi(k: int, z: NDArray[np.complexfloating]) -> NDArray[np.complexfloating]:
    """φ_k(z) = Σ_j z^j / (j + k)!, for any complex z without loss of digits."""
    small = np.abs(z) < _SERIES_RADIUS
    series = np.zeros_like(z)
    inner = np.where(small, z, 0.0)
    for j in range(_SERIES_TERMS, -1, -1):  # Horner
        series = series * inner + 1.0 / math.factorial(j + k)
    outer = np.where(small, 1.0, z)
    closed = np.exp(outer)
    for j in range(k):  # φ_{j+1} = (φ_j − 1/j!) / z
        closed = (closed - 1.0 / math.factorial(j)) / outer
    return np.where(small, series, closed)


def _matrix(horizontal: NDArray[np.complexfloating], vertical: ArrayLike = 0.0) -> NDArray[np.float64]:
    """3×3 matrices that multiply x + iy by a complex gain and z by a real one, shape (..., 3, 3)."""
    matrix = np.zeros((*horizontal.shape, 3, 3))
    matrix[..., 0, 0] = matrix[..., 1, 1] = horizontal.real
    matrix[..., 1, 0] = horizontal.imag
    matrix[..., 0, 1] = -horizontal.imag
    matrix[..., 2, 2] = vertical
    return matrix


def _with_offset(
    matrix: NDArray[np.float64], heading: NDArray[np.complexfloating], lift: NDArray[np.complexfloating]
) -> NDArray[np.float64]:
    """Add the horizontal error per heading error and the vertical error Im(conj(θ) · lift) per tilt error θ."""
    matrix[..., 0, 2] = heading.real
    matrix[..., 1, 2] = heading.imag
    matrix[..., 2, 0] = lift.imag
    matrix[..., 2, 1] = -lift.real
    return matrix
