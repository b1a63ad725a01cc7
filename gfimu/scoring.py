"""Figures of merit of array geometries: condition number, GDOP, errors per axis, what ω² leaves, what ω can be seen.

All figures but the rate bound are pure numbers with lengths in a stated length unit: the condition number and the GDOP
of a regression matrix mean nothing without it (GF-IMU paper, step 6, quotes L/2 = 1).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from gfimu.array import OMEGA_PRODUCTS, AccelerometerArray
from gfimu.bounds import rate_bound
from gfimu.errors import InputError
from gfimu.kinematics import MOTION_NAMES, joint_covariance, null_space, omega_leakage, require_all_motions

__all__ = ["DEFAULT_NOISE_STD", "Score", "gdop", "gdop_lower_bound", "score"]

DEFAULT_NOISE_STD = 0.0287
"""Channel noise at which rate bounds are quoted, m/s²: ADXL345, x and y axes at 100 Hz (0.75 LSB of 3.9 mg)."""

_NEGLIGIBLE = 1e-6  # coefficient of a product of ω not worth a word
_SINGULAR = 1e-13  # of the cube of the mean eigenvalue


@dataclass(frozen=True)
class Score:
    """Figures of merit of one array.

    Parameters
    ----------
    name, description : str
        The array.
    n_channels : int
        Number of sensing axes c.
    length_unit_m : float
        Length that counts as 1 in every figure below, m.
    condition_number : float
        κ(J) = ‖J‖ ‖J⁻¹‖, ratio of the largest to the least singular value.
    gdop : float
        √tr((JᵀJ)⁻¹).
    gdop_joint : float
        The same for α and p with the products of ω free (`gfimu.kinematics.joint_form`): the price of not needing ω;
        infinite where that is impossible.
    sigma_alpha, sigma_p : ndarray, shape (3,)
        Standard deviations of the components of S a for channels of unit standard deviation: σ_α in channel units per
        length unit, σ_p in channel units.
    omega_squared_leakage : ndarray, shape (6,)
        Largest coefficient of a product of ω left in α_x, α_y, α_z, p_x, p_y, p_z by the linear solution S a.
    omega_squared_matrix : ndarray, shape (6, 6)
        All of them, S Q; columns in the order `gfimu.array.OMEGA_PRODUCTS`.
    null_space_rank : int
        How many of the six products of ω the null space of J sees.
    omega_rad_s : ndarray, shape (3,)
        Angular rate at which the bound below holds, body axes.
    noise_m_s2 : float
        Channel standard deviation at which it holds.
    rate_bound_rad_s : ndarray, shape (3,)
        Cramér–Rao bound of one sample on the components of ω; infinite where one sample can't tell.
    """

    name: str
    description: str
    n_channels: int
    length_unit_m: float
    condition_number: float
    gdop: float
    gdop_joint: float
    sigma_alpha: NDArray[np.float64]
    sigma_p: NDArray[np.float64]
    omega_squared_leakage: NDArray[np.float64]
    omega_squared_matrix: NDArray[np.float64]
    null_space_rank: int
    omega_rad_s: NDArray[np.float64]
    noise_m_s2: float
    rate_bound_rad_s: NDArray[np.float64]

    @property
    def omega_squared_terms(self) -> dict[str, str]:
        """Terms left by ω² in words, for each component of α and p that has any; length unit as stated."""
        words = {
            name: " ".join(
                f"{coefficient:+.4g}·{_product_in_words(product)}"
                for coefficient, product in zip(row, OMEGA_PRODUCTS, strict=True)
                if abs(coefficient) > _NEGLIGIBLE
            )
            for name, row in zip(MOTION_NAMES, self.omega_squared_matrix, strict=True)
        }
        return {name: terms for name, terms in words.items() if terms}

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of ``gfimu score --json``."""
        return {
            "name": self.name,
            "description": self.description,
            "channels": self.n_channels,
            "length_unit_m": self.length_unit_m,
            "condition_number": self.condition_number,
            "gdop": self.gdop,
            "gdop_joint": self.gdop_joint,
            "sigma_alpha": self.sigma_alpha,
            "sigma_p": self.sigma_p,
            "omega_squared_leakage": self.omega_squared_leakage,
            "omega_squared_terms": self.omega_squared_terms,
            "null_space_rank": self.null_space_rank,
            "omega_rad_s": self.omega_rad_s,
            "noise_m_s2": self.noise_m_s2,
            "rate_bound_rad_s": self.rate_bound_rad_s,
        }


def score(
    arrays: AccelerometerArray | str | Path | Sequence[AccelerometerArray | str | Path],
    *,
    length_unit_m: float | None = None,
    omega_rad_s: ArrayLike = (0.0, 0.0, 2.0 * math.pi),
    noise_m_s2: float = DEFAULT_NOISE_STD,
) -> list[Score]:
    """Score the geometry of one or several arrays.

    Parameters
    ----------
    arrays : AccelerometerArray, str, Path, or sequence of these
        Arrays, names of shipped arrays, or paths of array files.
    length_unit_m : float, optional
        Length that counts as 1 for all of them; without it each array's own unit (half the edge of a cube).
    omega_rad_s : array_like, shape (3,)
        Angular rate in body axes at which the rate bound is taken; one revolution per second about z by default.
    noise_m_s2 : float
        Standard deviation of every channel at which the rate bound is taken.

    Raises
    ------
    GeometryError
        If an array can't see all six motions; the message names the motions.
    InputError
        If an array is unknown or an argument is out of range.
    """
    if length_unit_m is not None and not (math.isfinite(length_unit_m) and length_unit_m > 0):
        raise InputError(f"length unit {length_unit_m!r}: must be a positive length, m")
    omega = np.asarray(omega_rad_s, dtype=float)
    if omega.shape != (3,) or not np.isfinite(omega).all():
        raise InputError(f"angular rate {omega_rad_s!r}: must be three finite numbers, rad/s")
    given = [arrays] if isinstance(arrays, AccelerometerArray | str | Path) else arrays
    loaded = [item if isinstance(item, AccelerometerArray) else AccelerometerArray.load(item) for item in given]
    return [_score(array, length_unit_m or array.length_unit, omega, noise_m_s2) for array in loaded]


def gdop(positions: ArrayLike, axes: ArrayLike | None = None, *, length_unit_m: float = 1.0) -> NDArray[np.float64]:
    """GDOP = √tr((JᵀJ)⁻¹) of many geometries at once, without forming or inverting any 6 × 6 matrix.

    Parameters
    ----------
    positions : array_like, shape (m, k, 3) or (k, 3)
        Positions of k sensors in each of m geometries, m.
    axes : array_like, shape (m, k, 3) or (k, 3), optional
        Sensing axes, unit vectors; without them every sensor is a tri-axial chip, whose turn doesn't matter.
    length_unit_m : float
        Length that counts as 1, m.

    Returns
    -------
    ndarray, shape (m,)
        Infinite for geometries of rank < 6.
    """
    places = np.ascontiguousarray(np.asarray(positions, dtype=float) / length_unit_m)
    places = places[None] if places.ndim == 2 else places
    if places.ndim != 3 or places.shape[-1] != 3:
        raise InputError(f"positions of shape {np.shape(positions)}: give (m, k, 3), m")
    result = np.empty(len(places))
    if axes is None:
        _gdop_of_triads(places, result)
        return result
    try:
        directions = np.array(np.broadcast_to(np.asarray(axes, dtype=float), places.shape), order="C")
    except ValueError:
        raise InputError(f"axes of shape {np.shape(axes)} don't fit positions of shape {places.shape}") from None
    _gdop_of_axes(places, directions, result)
    return result


def gdop_lower_bound(n_chips: int) -> float:
    """Least GDOP that ``n_chips`` tri-axial chips inside the cube [−1, 1]³ can have: √(9/(2n)).

    tr of the α block of JᵀJ is 2 Σ|r|² ≤ 6n, so the trace of that block's inverse is at least 9/(6n); the p block is
    n·I; an inverse's block is never below the inverse of the block. Equality needs every chip in a corner, the mean
    position at the centre and equal moments: n a multiple of four.
    """
    return math.sqrt(9.0 / (2.0 * n_chips))


def _score(array: AccelerometerArray, unit: float, omega: NDArray[np.float64], noise: float) -> Score:
    require_all_motions(array)
    scaled = array.regression_matrix / np.array([unit] * 3 + [1.0] * 3)  # (c, 6), lengths in the unit
    singular_values = np.linalg.svd(scaled, compute_uv=False)
    deviations = np.linalg.norm(np.linalg.pinv(scaled), axis=1)  # (6,)
    joint_variance = np.diag(joint_covariance(array))[:6] * np.array([unit**2] * 3 + [1.0] * 3)
    leakage = omega_leakage(array) / np.array([1.0] * 3 + [unit] * 3)[:, None]
    return Score(
        name=array.name,
        description=array.description,
        n_channels=array.n_channels,
        length_unit_m=unit,
        condition_number=float(singular_values[0] / singular_values[-1]),
        gdop=float(np.linalg.norm(deviations)),
        gdop_joint=math.inf if np.isnan(joint_variance).any() else float(np.sqrt(joint_variance.sum())),
        sigma_alpha=deviations[:3],
        sigma_p=deviations[3:],
        omega_squared_leakage=np.abs(leakage).max(axis=1),
        omega_squared_matrix=leakage,
        null_space_rank=null_space(array).rank,
        omega_rad_s=omega,
        noise_m_s2=noise,
        rate_bound_rad_s=rate_bound(array, omega, noise),
    )


def _product_in_words(product: str) -> str:
    first, second = product[0], product[1]
    return f"ω{first}²" if first == second else f"ω{first}ω{second}"


@njit(cache=True)
def _gdop_of_triads(positions: NDArray[np.float64], result: NDArray[np.float64]) -> None:
    # GDOP² = 3/n + tr A⁻¹ + |c|² tr A⁻¹ − cᵀA⁻¹c: Schur complement of the p block n·I, with c the centroid and
    # A = Σ |r − c|² I − (r − c)(r − c)ᵀ; A⁻¹ by its adjugate.
    m, n, _ = positions.shape
    for g in range(m):
        sx = sy = sz = xx = yy = zz = xy = xz = yz = 0.0
        for i in range(n):
            x, y, z = positions[g, i, 0], positions[g, i, 1], positions[g, i, 2]
            sx += x
            sy += y
            sz += z
            xx += x * x
            yy += y * y
            zz += z * z
            xy += x * y
            xz += x * z
            yz += y * z
        cx, cy, cz = sx / n, sy / n, sz / n
        xx -= sx * cx
        yy -= sy * cy
        zz -= sz * cz
        a, b, c = yy + zz, xx + zz, xx + yy
        d, e, f = sx * cy - xy, sx * cz - xz, sy * cz - yz
        caa, cbb, ccc = b * c - f * f, a * c - e * e, a * b - d * d
        cab, cac, cbc = e * f - d * c, d * f - b * e, d * e - a * f
        det = a * caa + d * cab + e * cac
        mean = (a + b + c) / 3.0
        if det <= _SINGULAR * mean * mean * mean:
            result[g] = np.inf
            continue
        trace = caa + cbb + ccc
        form = cx * cx * caa + cy * cy * cbb + cz * cz * ccc + 2.0 * (cx * cy * cab + cx * cz * cac + cy * cz * cbc)
        result[g] = math.sqrt(3.0 / n + (trace * (1.0 + cx * cx + cy * cy + cz * cz) - form) / det)


@njit(cache=True)
def _inverse_of_symmetric(matrix: NDArray[np.float64], inverse: NDArray[np.float64]) -> bool:
    # Adjugate over determinant of a 3 × 3; False if singular.
    a, b, c = matrix[0, 0], matrix[1, 1], matrix[2, 2]
    d, e, f = matrix[0, 1], matrix[0, 2], matrix[1, 2]
    caa, cbb, ccc = b * c - f * f, a * c - e * e, a * b - d * d
    cab, cac, cbc = e * f - d * c, d * f - b * e, d * e - a * f
    det = a * caa + d * cab + e * cac
    mean = (a + b + c) / 3.0
    if det <= _SINGULAR * mean * mean * mean:
        return False
    inverse[0, 0], inverse[1, 1], inverse[2, 2] = caa / det, cbb / det, ccc / det
    inverse[0, 1] = inverse[1, 0] = cab / det
    inverse[0, 2] = inverse[2, 0] = cac / det
    inverse[1, 2] = inverse[2, 1] = cbc / det
    return True


@njit(cache=True)
def _gdop_of_axes(positions: NDArray[np.float64], axes: NDArray[np.float64], result: NDArray[np.float64]) -> None:
    # JᵀJ = [[A, B], [Bᵀ, D]] with rows [m, θ], m = r × θ. tr of its inverse by the Schur complement A − B D⁻¹ Bᵀ.
    m, n, _ = positions.shape
    d_block, d_inverse = np.empty((3, 3)), np.empty((3, 3))
    schur, s_inverse = np.empty((3, 3)), np.empty((3, 3))
    b_block, gain = np.empty((3, 3)), np.empty((3, 3))
    moment = np.empty(3)
    for g in range(m):
        d_block[:] = 0.0
        schur[:] = 0.0
        b_block[:] = 0.0
        for i in range(n):
            x, y, z = positions[g, i, 0], positions[g, i, 1], positions[g, i, 2]
            u, v, w = axes[g, i, 0], axes[g, i, 1], axes[g, i, 2]
            moment[0], moment[1], moment[2] = y * w - z * v, z * u - x * w, x * v - y * u
            for j in range(3):
                for k in range(3):
                    schur[j, k] += moment[j] * moment[k]
                    b_block[j, k] += moment[j] * axes[g, i, k]
                    d_block[j, k] += axes[g, i, j] * axes[g, i, k]
        result[g] = np.inf
        if not _inverse_of_symmetric(d_block, d_inverse):
            continue
        for j in range(3):
            for k in range(3):
                gain[j, k] = (
                    b_block[j, 0] * d_inverse[0, k]
                    + b_block[j, 1] * d_inverse[1, k]
                    + (b_block[j, 2] * d_inverse[2, k])
                )
        for j in range(3):
            for k in range(3):
                schur[j, k] -= gain[j, 0] * b_block[k, 0] + gain[j, 1] * b_block[k, 1] + gain[j, 2] * b_block[k, 2]
        if not _inverse_of_symmetric(schur, s_inverse):
            continue
        trace = d_inverse[0, 0] + d_inverse[1, 1] + d_inverse[2, 2]
        for j in range(3):
            trace += s_inverse[j, j]
            for k in range(3):
                # tr(D⁻¹Bᵀ S⁻¹ B D⁻¹) with gain = B D⁻¹
                trace += s_inverse[j, k] * (gain[j, 0] * gain[k, 0] + gain[j, 1] * gain[k, 1] + gain[j, 2] * gain[k, 2])
        result[g] = math.sqrt(trace)
