"""The rate of a shake as a cubic spline, and its normal equations: a band with a border.

The rate ω(t) is a cubic B-spline with evenly spaced knots, so that its derivative is the angular acceleration exactly.
A sample touches four coefficients. The normal matrix of all of them is a band; the parameters common to all samples
are its border and remain after the band is eliminated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

from gfimu.calibration.shake_start import Shake

__all__ = ["BorderedBand", "RateSpline"]

Floats = NDArray[np.float64]

_WIDTH = 12  # four coefficients of three axes


@dataclass(frozen=True)
class RateSpline:
    """Cubic splines of several shakes, their coefficients one after another.

    Parameters
    ----------
    place : ndarray of int, shape (n,)
        First of the four coefficients of each sample; ascending.
    basis, slope : ndarray, shape (n, 4)
        Their weights in ω, and in dω/dt, 1/s.
    size : int
        Number of coefficients per axis.
    """

    place: NDArray[np.intp]
    basis: Floats
    slope: Floats
    size: int

    @classmethod
    def of(cls, found: list[Shake], knot_s: float) -> RateSpline:
        """Lay knots every ``knot_s`` seconds over each shake."""
        places, shares, size = [], [], 0
        for shake in found:
            x = (shake.t_s - shake.t_s[0]) / knot_s
            place = np.floor(x).astype(np.intp)
            places.append(place + size)
            shares.append(x - place)
            size += int(place[-1]) + 4
        u = np.concatenate(shares)
        basis = np.stack([(1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3], axis=1) / 6.0
        slope = np.stack([-((1 - u) ** 2), 3 * u**2 - 4 * u, -3 * u**2 + 2 * u + 1, u**2], axis=1) / (2.0 * knot_s)
        return cls(np.concatenate(places), basis, slope, size)

    def at_samples(self, coefficients: Floats) -> tuple[Floats, Floats]:
        """Rate and its derivative at the samples, (n, 3) each, from coefficients (size, 3)."""
        own = coefficients[self.place[:, None] + np.arange(4)]
        return np.einsum("na,naj->nj", self.basis, own), np.einsum("na,naj->nj", self.slope, own)

    def fit(self, omega: Floats) -> Floats:
        """Coefficients (size, 3) of the smooth spline through rates (n, 3)."""
        band = BorderedBand(self.size, 0)
        jacobian = np.einsum("na,ij->niaj", self.basis, np.eye(3)).reshape(len(omega), 3, _WIDTH)
        band.add(self.place, jacobian, None, omega)
        band.stiffen(1e-2)
        return band.solve().spline


@dataclass(frozen=True)
class Solved:
    """Solution of a bordered band: the spline's step for no border, its response to it, and the reduced border."""

    spline: Floats
    response: Floats
    normal: Floats
    right: Floats
    log_determinant: float


class BorderedBand:
    """Normal equations of a spline's coefficients (size · 3) and m common parameters, summed block by block."""

    def __init__(self, size: int, border: int) -> None:
        self.band = np.zeros((_WIDTH, 3 * size))
        self.coupling = np.zeros((3 * size, border))
        self.right = np.zeros(3 * size)
        self.border = np.zeros((border, border))
        self.border_right = np.zeros(border)
        self.square = 0.0

    def add(self, place: NDArray[np.intp], spline: Floats, border: Floats | None, residual: Floats) -> None:
        """Add whitened rows: Jacobians (n, p, 12) and (n, p, m), residuals (n, p), of samples in ascending order."""
        starts = np.flatnonzero(np.diff(place, prepend=place[0] - 1))
        first = 3 * place[starts]
        turned = spline.swapaxes(1, 2)
        normal = _summed(turned @ spline, starts)  # (s, 12, 12)
        right = _summed((turned @ residual[:, :, None])[:, :, 0], starts)
        for a in range(_WIDTH):
            self.right[first + a] += right[:, a]
            for b in range(a, _WIDTH):
                self.band[b - a, first + a] += normal[:, a, b]
        self.square += float(np.sum(residual**2))
        if border is None:
            return
        mixed = _summed(turned @ border, starts)  # (s, 12, m)
        for a in range(_WIDTH):
            self.coupling[first + a] += mixed[:, a]
        flat = border.reshape(residual.size, border.shape[2])
        self.border += flat.T @ flat
        self.border_right += flat.T @ residual.ravel()

    def stiffen(self, weight: float) -> None:
        """Add the squares of second differences of neighbouring coefficients."""
        n = self.band.shape[1]
        n, values = self.band.shape[1], (1.0, -2.0, 1.0)
        for i, one in enumerate(values):
            for j, other in enumerate(values[i:], start=i):
                self.band[3 * (j - i), 3 * i : n - 3 * (2 - i)] += weight * one * other

    def solve(self) -> Solved:
        """Eliminate the coefficients of the spline."""
        self.band[0] += 1e-9 * float(self.band[0].max())
        root = cholesky_banded(self.band, lower=True, check_finite=False)
        both = cho_solve_banded((root, True), np.column_stack([self.right, self.coupling]), check_finite=False)
        return Solved(
            both[:, 0].reshape(-1, 3),
            both[:, 1:],
            self.border - self.coupling.T @ both[:, 1:],
            self.border_right - self.coupling.T @ both[:, 0],
            2.0 * float(np.sum(np.log(root[0]))),
        )


def _summed(parts: Floats, starts: NDArray[np.intp]) -> Floats:
    """Sum the parts of samples that share their coefficients."""
    return parts if len(starts) == len(parts) else np.asarray(np.add.reduceat(parts, starts, axis=0))
