"""Error model of a sensor triad: l = M a + b, and other ways of writing it; axes that bend: l = b + y + q y² + c y³.

l is what the triad reads (counts, or m/s²), a the true input (specific force, m/s²), M the sensitivity matrix, b the
bias. With a full M there are 12 parameters; with a triangular one there are 9, and the zeros of M fix the frame in
which a is expressed (Persian calibration paper, its two models).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.base.errors import InputError, check_name, unknown_name

__all__ = ["GAUGES", "ErrorModel", "free_elements"]

GAUGES = {
    "poses": "the axes of the poses given to the calibration",
    "x_axis": "sensing axis x along frame x, sensing axis y in the frame's x-y plane (M lower triangular)",
    "z_axis": "sensing axis z along frame z, sensing axis y in the frame's y-z plane (M upper triangular)",
    "coarse": "the frame nearest to that of the coarse solution (minimum norm)",
    "array": "the body frame in which the chips' mean rotation from their drawing is zero",
}
"""Ways to fix the frame of a calibrated triad, and what each means."""

_CUBIC_STEPS = 5  # numerical: Newton's, from the quadratic solution; the last one changes nothing below 20 % of bending
_LEAST_SLOPE = 0.1  # numerical: of the reading against the input, beyond which no axis bends

_FULL = tuple((i, j) for i in range(3) for j in range(3))
_LOWER = tuple((i, j) for i, j in _FULL if i >= j)
_UPPER = tuple((i, j) for i, j in _FULL if i <= j)


def free_elements(gauge: str) -> tuple[tuple[int, int], ...]:
    """Return the elements (row, column) of M that are parameters under a gauge; the others are zero.

    Raises
    ------
    InputError
        If the gauge is unknown; the message lists the gauges.
    """
    check_name("gauge", gauge, GAUGES)
    return {"x_axis": _LOWER, "z_axis": _UPPER}.get(gauge, _FULL)


@dataclass(frozen=True)
class ErrorModel:
    """Sensitivity and bias of one triad: l = M a + b.

    Parameters
    ----------
    sensitivity : ndarray, shape (3, 3)
        M, reading unit per m/s² (per rad/s for a gyro).
    bias : ndarray, shape (3,)
        b, reading unit.
    quadratic : ndarray, shape (3,), optional
        q of each sensing axis, 1 per reading unit: l = b + y + q y² with y = M a; zero by default.
    cubic : ndarray, shape (3,), optional
        c of each sensing axis, 1 per reading unit squared; zero by default. Exactly, q and c are the coefficients of
        the correction M a = u − q u² − c u³ with u = l − b; `series` gives those of the reading.
    """

    sensitivity: NDArray[np.float64]
    bias: NDArray[np.float64]
    quadratic: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    cubic: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        sensitivity = np.asarray(self.sensitivity, dtype=float)
        bias = np.asarray(self.bias, dtype=float)
        if sensitivity.shape != (3, 3) or bias.shape != (3,):
            raise InputError("an error model needs a 3 × 3 sensitivity matrix and a bias of three")
        if not np.isfinite(sensitivity).all() or not np.isfinite(bias).all() or np.linalg.cond(sensitivity) > 1e9:
            raise InputError(
                "the sensitivity matrix is singular or not finite: two sensing axes are alike or one is dead"
            )
        object.__setattr__(self, "sensitivity", sensitivity)
        object.__setattr__(self, "bias", bias)

    @property
    def inverse(self) -> NDArray[np.float64]:
        """W = M⁻¹, m/s² per reading unit, shape (3, 3)."""
        return np.asarray(np.linalg.inv(self.sensitivity), dtype=np.float64)

    def read(self, a: ArrayLike) -> NDArray[np.float64]:
        """Return the readings l of true inputs ``a``, shape (..., 3): what `correct` turns back into ``a``."""
        straight = np.asarray(a, dtype=float) @ self.sensitivity.T
        root = np.sqrt(np.maximum(1.0 - 4.0 * self.quadratic * straight, 0.0))  # of u − q u² = M a
        bent = 2.0 * straight / (1.0 + root)
        if self.cubic.any():
            for _ in range(_CUBIC_STEPS):
                slope = 1.0 - bent * (2.0 * self.quadratic + 3.0 * self.cubic * bent)
                bent = bent + (straight - self._straight(bent)) / np.maximum(slope, _LEAST_SLOPE)
        return np.asarray(bent + self.bias, dtype=np.float64)

    def correct(self, readings: ArrayLike) -> NDArray[np.float64]:
        """Return the true inputs a = M⁻¹ (u − q u² − c u³) with u = l − b of readings, shape (..., 3)."""
        return np.asarray(self._straight(np.asarray(readings, dtype=float) - self.bias) @ self.inverse.T)

    def _straight(self, bent: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return M a of readings without bias, u − q u² − c u³."""
        if self.cubic.any():
            return np.asarray(bent - bent**2 * (self.quadratic + self.cubic * bent), dtype=np.float64)
        return bent - self.quadratic * bent**2 if self.quadratic.any() else bent

    @property
    def series(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Coefficients of y² and y³ in l = b + y + q y² + (c + 2 q²) y³ + …, y = M a, each (3,)."""
        return self.quadratic, self.cubic + 2.0 * self.quadratic**2

    @classmethod
    def nominal(cls, scale: float = 1.0, bias: float = 0.0) -> ErrorModel:
        """Return the model of a perfect triad with ``scale`` reading units per m/s² and an equal bias on each axis."""
        return cls(scale * np.eye(3), np.full(3, float(bias)))

    @classmethod
    def from_correction(cls, T: ArrayLike, K: ArrayLike, bias: ArrayLike) -> ErrorModel:
        """Model from the correction form a = T K (l − b).

        Parameters
        ----------
        T : array_like, shape (3, 3)
            Alignment matrix with unit diagonal.
        K : array_like, shape (3,)
            Scale per axis, m/s² per reading unit.
        bias : array_like, shape (3,)
            b, reading unit.
        """
        correction = np.asarray(T, dtype=float) @ np.diag(np.asarray(K, dtype=float))
        return cls(np.linalg.inv(correction), np.asarray(bias, dtype=float))

    def to_correction(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return the correction form a = T K (l − b): T (3, 3) with unit diagonal, K (3,), b (3,)."""
        correction = self.inverse
        scale = np.diag(correction)
        return correction / scale, scale, self.bias

    @classmethod
    def from_counts(cls, B: ArrayLike, S: ArrayLike, E: ArrayLike | None = None) -> ErrorModel:
        """Model from the counts form l = B + S a + E a of the Chinese calibration paper's table 1.

        Parameters
        ----------
        B : array_like, shape (3,)
            Bias, reading unit.
        S : array_like, shape (3,)
            Scale factor per axis, reading unit per m/s².
        E : array_like, shape (3, 3), optional
            Misalignment, zero diagonal, same unit as S.
        """
        misalignment = np.zeros((3, 3)) if E is None else np.asarray(E, dtype=float)
        return cls(np.diag(np.asarray(S, dtype=float)) + misalignment, np.asarray(B, dtype=float))

    def to_counts(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return the counts form l = B + S a + E a: B (3,), S (3,), E (3, 3) with zero diagonal."""
        scale = np.diag(self.sensitivity)
        return self.bias, scale.copy(), self.sensitivity - np.diag(scale)

    @classmethod
    def from_voltage(cls, offset: ArrayLike, W: ArrayLike) -> ErrorModel:
        """Model from the inverse linear form a = offset + W l (Chinese calibration paper, coarse model)."""
        inverse = np.asarray(W, dtype=float)
        sensitivity = np.linalg.inv(inverse)
        return cls(sensitivity, -sensitivity @ np.asarray(offset, dtype=float))

    def to_voltage(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the inverse linear form a = offset + W l: offset (3,), m/s², and W (3, 3)."""
        inverse = self.inverse
        return -inverse @ self.bias, inverse

    def in_gauge(self, gauge: str) -> ErrorModel:
        """Express the same triad in the frame of another gauge, ``x_axis`` or ``z_axis``.

        A rotation R of the frame turns M into M Rᵀ and leaves |a| as it was, so that magnitudes cannot separate the two
        apart; the rotation that makes M triangular with a positive diagonal is unique.
        """
        if gauge == "x_axis":
            _q, r = np.linalg.qr(self.sensitivity.T)  # Mᵀ = q r, so M = rᵀ qᵀ with rᵀ lower triangular
            triangular = r.T
        elif gauge == "z_axis":
            flip = np.eye(3)[::-1]
            _q, r = np.linalg.qr((flip @ self.sensitivity).T)
            triangular = flip @ r.T @ flip
        else:
            raise unknown_name("triangular gauge", gauge, ("x_axis", "z_axis"))
        signs = np.sign(np.diag(triangular))
        return replace(self, sensitivity=triangular * signs)

    def parameters(self, gauge: str) -> NDArray[np.float64]:
        """Parameter vector: the free elements of M row by row, then b; shape (12,) or (9,)."""
        return np.concatenate([[self.sensitivity[i, j] for i, j in free_elements(gauge)], self.bias])

    @classmethod
    def from_parameters(cls, parameters: ArrayLike, gauge: str) -> ErrorModel:
        """Model from a parameter vector in the order of `parameters`."""
        values = np.asarray(parameters, dtype=float)
        elements = free_elements(gauge)
        sensitivity = np.zeros((3, 3))
        for value, (i, j) in zip(values, elements, strict=False):
            sensitivity[i, j] = value
        return cls(sensitivity, values[len(elements) :])
