"""The part of the motion that is linear in the readings, sample by sample, from whichever channels are there.

[α; p] = G a − Λ s(ω), with s the six products of ω. G is one of three left inverses of J:

==============  ==================================  =============================================================
form            G                                   Λ
==============  ==================================  =============================================================
``linear``      J⁺ = (JᵀJ)⁻¹Jᵀ                      zero: the geometry cancels the centripetal terms
``joint``       first six rows of [J Q]⁺            zero: the products of ω are solved for as well, at the cost of
                                                    noise where J and Q are not orthogonal
``recursive``   J⁺                                  J⁺ Q: ω has to be known, so α feeds back on itself
==============  ==================================  =============================================================

A sample that lacks channels is solved from the others with a form of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.kinematics import joint_form, null_space, omega_leakage, omega_products, pseudo_inverse
from gfimu.base.errors import GeometryError, check_name
from gfimu.base.short_repr import short_repr

__all__ = ["FORMS", "LinearSolution", "linear_solution"]

FORMS = ("auto", "linear", "joint", "recursive")
"""Names of the forms; ``auto`` takes the first of the others that the geometry allows."""

_DETERMINED = 1e-6


@dataclass(frozen=True)
class LinearSolution:
    """Linear part of the motion and what the null space says about ω.

    Parameters
    ----------
    form : {"linear", "joint", "recursive"}
        Form used for complete samples.
    motion : ndarray, shape (n, 6)
        G a: [α; p] in rad/s² and m/s², but for −Λ s(ω); NaN where the channels present don't suffice.
    omega_products : ndarray, shape (n, 6)
        Products of ω from the null space of J in the order `gfimu.array.array.OMEGA_PRODUCTS`, rad²/s²; NaN where
        unseen.
    pattern : ndarray, shape (n,)
        Which pattern of present channels each sample has; 0 is the complete one.
    leakage : ndarray, shape (k, 6, 6)
        Λ of each pattern.
    covariance : ndarray, shape (k, 6, 6)
        Covariance of G a of each pattern.
    omega_products_covariance : ndarray, shape (k, 6, 6)
        Covariance of ``omega_products`` of each pattern.
    """

    form: str
    motion: NDArray[np.float64]
    omega_products: NDArray[np.float64]
    pattern: NDArray[np.intp]
    leakage: NDArray[np.float64]
    covariance: NDArray[np.float64]
    omega_products_covariance: NDArray[np.float64]

    __repr__ = short_repr

    @property
    def needs_omega(self) -> bool:
        """Whether α or p of any sample depends on ω."""
        return bool(self.leakage.any())

    @property
    def alpha_variance(self) -> NDArray[np.float64]:
        """Variance of each component of α by the noise of the readings, shape (n, 3), (rad/s²)²."""
        return np.diagonal(self.covariance, axis1=1, axis2=2)[:, :3][self.pattern]

    @property
    def omega_products_std(self) -> NDArray[np.float64]:
        """Standard deviation of the products of ω, shape (n, 6), rad²/s²."""
        return np.sqrt(np.diagonal(self.omega_products_covariance, axis1=1, axis2=2))[self.pattern]

    def with_omega(self, omega: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return [α; p] for a given angular rate (n, 3), rad/s: G a − Λ s(ω), shape (n, 6)."""
        if not self.needs_omega:
            return self.motion
        products = omega_products(omega)  # (n, 6)
        result = self.motion.copy()
        for index, leakage in enumerate(self.leakage):
            if leakage.any():
                rows = self.pattern == index
                result[rows] -= products[rows] @ leakage.T
        return result


def linear_solution(
    array: AccelerometerArray, readings: NDArray[np.float64], noise_std: NDArray[np.float64], *, form: str = "auto"
) -> LinearSolution:
    """Solve every sample for the part of the motion that is linear in the readings.

    Parameters
    ----------
    array : AccelerometerArray
        The array, with c channels.
    readings : ndarray, shape (n, c)
        Specific force along the channels, m/s²; NaN where one is missing.
    noise_std : ndarray, shape (c,)
        Standard deviation of one sample of each channel, m/s².
    form : {"auto", "linear", "joint", "recursive"}
        Left inverse of J; see the module's table.

    Raises
    ------
    GeometryError
        If the array can't see all six motions (the message names those it can't), or does not allow the form.
    """
    check_name("form", form, FORMS)
    used, inverse, leakage = _solve(array, form)
    n = len(readings)
    motion = np.full((n, 6), np.nan)
    products = np.full((n, 6), np.nan)
    pattern = np.zeros(n, dtype=np.intp)
    to_products = _products_inverse(array)
    leakages = [leakage]
    covariances = [_covariance(inverse, noise_std)]
    product_covariances = [_covariance(to_products, noise_std)]
    complete = np.asarray(np.isfinite(readings).all(axis=1))
    rows = slice(None) if complete.all() else complete
    motion[rows] = readings[rows] @ inverse.T
    products[rows] = readings[rows] @ to_products.T
    for members, present in _patterns(readings, complete):
        pattern[members] = len(leakages)
        chosen = readings[np.ix_(members, present)]
        try:
            part = _with_channels(array, present)
            _, inverse, leakage = _solve(part, form)
            motion[members] = chosen @ inverse.T
            to_products = _products_inverse(part)
            products[members] = chosen @ to_products.T
            covariances.append(_covariance(inverse, noise_std[present]))
            product_covariances.append(_covariance(to_products, noise_std[present]))
            leakages.append(leakage)
        except GeometryError:  # too few channels in these samples: they stay NaN
            covariances.append(np.full((6, 6), np.nan))
            product_covariances.append(np.full((6, 6), np.nan))
            leakages.append(np.zeros((6, 6)))
    return LinearSolution(
        used,
        motion,
        products,
        pattern,
        np.array(leakages),
        np.array(covariances),
        np.array(product_covariances),
    )


def _solve(array: AccelerometerArray, form: str) -> tuple[str, NDArray[np.float64], NDArray[np.float64]]:
    """Form used, left inverse G (6, c) and leakage Λ (6, 6)."""
    inverse = pseudo_inverse(array)
    leakage = omega_leakage(array)
    if form in {"auto", "linear"} and not leakage.any():
        return "linear", inverse, leakage
    if form == "linear":
        raise GeometryError(
            f"array {array.name!r} leaves products of the angular rate in its linear solution; "
            "use form 'joint' or 'recursive'"
        )
    if form in {"auto", "joint"}:
        try:
            solution = joint_form(array, np.eye(array.n_channels))
        except GeometryError:
            if form == "joint":
                raise
        else:
            return "joint", np.hstack([solution.alpha, solution.p]).T, np.zeros((6, 6))
    return "recursive", inverse, leakage


def _products_inverse(array: AccelerometerArray) -> NDArray[np.float64]:
    """Matrix (6, c) from readings to the products of ω; NaN rows for products that the null space doesn't see."""
    space = null_space(array)
    sensitivity = space.sensitivity[: space.rank] / array.length_unit  # (rank, 6), of order one
    inverse = np.linalg.pinv(sensitivity)
    seen = np.abs(inverse @ sensitivity - np.eye(6)).max(axis=1) < _DETERMINED
    from_readings = inverse @ space.basis[: space.rank] / array.length_unit  # (6, c)
    return np.where(seen[:, None], from_readings, np.nan)


def _covariance(matrix: NDArray[np.float64], noise_std: NDArray[np.float64]) -> NDArray[np.float64]:
    scaled = matrix * noise_std
    return scaled @ scaled.T


def _patterns(
    readings: NDArray[np.float64], complete: NDArray[np.bool_]
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.bool_]]]:
    """Yield the samples of each pattern of missing channels, and the channels that are present."""
    holed = np.flatnonzero(~complete)
    patterns, membership = np.unique(np.isfinite(readings[holed]), axis=0, return_inverse=True)
    for index, present in enumerate(patterns):
        yield holed[membership.reshape(-1) == index], present


def _with_channels(array: AccelerometerArray, present: NDArray[np.bool_]) -> AccelerometerArray:
    """Return the array without its missing channels; raises `GeometryError` if none is left."""
    chips = [
        replace(chip, axes=chip.axes[present[array.chip_of_channel == index]])
        for index, chip in enumerate(array.chips)
        if present[array.chip_of_channel == index].any()
    ]
    if not chips:
        raise GeometryError(f"array {array.name!r}: no channel is present")
    return replace(array, chips=tuple(chips))
