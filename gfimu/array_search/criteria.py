"""What a search makes small, as functions of the rows of [J Q] of a design.

Every criterion gives the logarithm of its figure, so that two of them can be weighed against each other, in three
forms:

- `Criterion.exact`: the figure of many designs at once;
- `Criterion.smooth`: a differentiable form with its gradient by the rows, for the polish. Where the figure itself has
  kinks (a largest eigenvalue, a worst channel) that is an ℓ_p norm which a larger ``sharpness`` p brings nearer;
- `Criterion.exchanged`: the figure with one chip replaced by each of many candidates, by rank-k updates where the
  figure is a trace of the inverse information.

GDOP and the variances are traces tr(W (TᵀMT)⁻¹) of M = RᵀR, R the rows: `TraceCriterion`. They are convex in M, from
which their certificate follows (`gfimu.array_search.certificate`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Criterion",
    "FaultCriterion",
    "Goal",
    "KappaCriterion",
    "Term",
    "TraceCriterion",
]

_Vector = NDArray[np.float64]

_RIDGE = 1e-13  # numerical: of the mean eigenvalue, added so that designs of rank < 6 have a large figure and no NaN
_UPDATE_RIDGE = (
    1e-9  # numerical: the same for what is left without one chip, where a large figure would drown the gains
)
_FULL = 1e-9  # numerical: least 1 − leverage, so that a channel whose faults never show has a large figure
_LEAST_INFORMATION = 1e-30  # numerical: added where there is none at all
_LEAST_VALUE = 1e-300  # numerical: whose logarithm is finite
_AGREE, _AGREE_ROUGHLY = 1e-6, 1e-3  # relative: of a smooth figure, and of one with kinks, where a polish ends sooner
_SHARPER = 10.0  # numerical: power of the norm over draws, over that inside a criterion


class Criterion(Protocol):
    """The logarithm of a figure that is to be small."""

    @property
    def kinks(self) -> bool:
        """Whether the figure has kinks, so that `smooth` depends on the sharpness."""
        ...

    def exact(self, rows: _Vector) -> _Vector:
        """Logarithm of the figure, shape (...,), of rows of shape (..., c, 12)."""
        ...

    def smooth(self, rows: _Vector, sharpness: float) -> tuple[_Vector, _Vector]:
        """Logarithm, shape (s,), and its gradient, shape (s, c, 12), of rows of shape (s, c, 12)."""
        ...

    def exchanged(self, others: _Vector, candidates: _Vector) -> _Vector:
        """Logarithm, shape (s, m), with each candidate chip, shape (s, m, k, 12), beside the others, (s, c − k, 12)."""
        ...


@dataclass(frozen=True)
class Term:
    """tr(W (TᵀMT + R)⁻¹).

    Parameters
    ----------
    into : ndarray, shape (12, q)
        T: which combinations of the twelve columns are unknown.
    weight : ndarray, shape (q, q)
        W, positive semidefinite.
    prior : ndarray, shape (q,)
        Diagonal of R: what is known of the unknowns beforehand.
    """

    into: _Vector
    weight: _Vector
    prior: _Vector

    def inverse(self, information: _Vector) -> _Vector:
        """Inverse of the information, shape (..., q, q), with a small ridge."""
        q = information.shape[-1]
        ridge = _RIDGE * np.trace(information, axis1=-2, axis2=-1)[..., None, None] / q
        return np.linalg.inv(information + (ridge + _LEAST_INFORMATION) * np.eye(q) + np.diag(self.prior))

    def bounded_inverse(self, information: _Vector) -> _Vector:
        """Inverse of information that may be singular, positive definite in spite of rounding, shape (..., q, q)."""
        values, vectors = np.linalg.eigh(information + np.diag(self.prior))
        least = _UPDATE_RIDGE * values.mean(axis=-1, keepdims=True) + _LEAST_INFORMATION
        return (vectors / np.maximum(values, least)[..., None, :]) @ np.swapaxes(vectors, -1, -2)

    def of_rows(self, rows: _Vector) -> _Vector:
        """Value for rows of shape (..., c, 12), shape (...,)."""
        mapped = rows @ self.into
        return np.asarray(np.einsum("ij,...ji->...", self.weight, self.inverse(np.swapaxes(mapped, -1, -2) @ mapped)))


@dataclass(frozen=True)
class TraceCriterion:
    """Root of a sum of terms tr(W (TᵀMT)⁻¹)."""

    terms: tuple[Term, ...]
    kinks: bool = False

    def exact(self, rows: _Vector) -> _Vector:
        """See `Criterion.exact`."""
        return 0.5 * np.log(np.sum([term.of_rows(rows) for term in self.terms], axis=0))

    def smooth(self, rows: _Vector, sharpness: float) -> tuple[_Vector, _Vector]:
        """See `Criterion.smooth`."""
        del sharpness
        total, slope = np.zeros(rows.shape[:-2]), np.zeros_like(rows)
        for term in self.terms:
            mapped = rows @ term.into  # (s, c, q)
            inverse = term.inverse(np.swapaxes(mapped, -1, -2) @ mapped)
            weighed = inverse @ term.weight
            total = total + np.trace(weighed, axis1=-2, axis2=-1)
            slope -= 2.0 * mapped @ (weighed @ inverse) @ term.into.T
        return 0.5 * np.log(total), slope / (2.0 * total[..., None, None])

    def exchanged(self, others: _Vector, candidates: _Vector) -> _Vector:
        """See `Criterion.exchanged`."""
        total = np.zeros(candidates.shape[:2])
        for term in self.terms:
            mapped = others @ term.into
            inverse = term.bounded_inverse(np.swapaxes(mapped, -1, -2) @ mapped)[:, None]  # (s, 1, q, q)
            added = candidates @ term.into  # (s, m, k, q)
            pulled = added @ inverse
            # tr W(M + BᵀB)⁻¹ = tr WH − tr (I + BHBᵀ)⁻¹ BHWHBᵀ with H = M⁻¹: rank k, no inverse of M + BᵀB.
            spread = np.swapaxes(added, -1, -2)
            gain = pulled @ term.weight @ np.swapaxes(pulled, -1, -2)
            inner = pulled @ spread
            if inner.shape[-1] == 1:
                less = gain[..., 0, 0] / (1.0 + inner[..., 0, 0])
            else:
                less = np.trace(np.linalg.solve(np.eye(inner.shape[-1]) + inner, gain), axis1=-2, axis2=-1)
            total += np.einsum("ij,saji->sa", term.weight, inverse) - less
        return 0.5 * np.log(np.maximum(total, _LEAST_VALUE))

    def steered(self, others: _Vector, arms: _Vector) -> tuple[_Vector, _Vector]:
        """Return the best direction of a single sensing axis at each of many places, in closed form.

        The gain of direction u is uᵀF HWH Fᵀu / uᵀ(I + F H Fᵀ)u with F the rows of the three body axes at the place:
        largest for a generalised eigenvector.

        Parameters
        ----------
        others : ndarray, shape (c, 12)
            Rows of the other chips.
        arms : ndarray, shape (m, 3, 12)
            F of each place.

        Returns
        -------
        values, directions : ndarray, shape (m,) and (m, 3)
            Logarithm of the figure with that axis, and the axis.
        """
        (term,) = self.terms
        mapped, levers = others @ term.into, arms @ term.into
        inverse = term.bounded_inverse(mapped.T @ mapped)
        turned = np.swapaxes(levers, 1, 2)
        gain = levers @ (inverse @ term.weight @ inverse) @ turned
        lower = np.linalg.inv(np.linalg.cholesky(np.eye(3) + levers @ inverse @ turned))
        gains, vectors = np.linalg.eigh(lower @ gain @ np.swapaxes(lower, 1, 2))
        directions = np.einsum("mji,mj->mi", lower, vectors[:, :, -1])
        value = np.sum(term.weight * inverse) - gains[:, -1]
        return 0.5 * np.log(np.maximum(value, _LEAST_VALUE)), directions / np.linalg.norm(
            directions, axis=1, keepdims=True
        )


@dataclass(frozen=True)
class KappaCriterion:
    """Condition number κ(J) with lengths times ``scale``."""

    scale: float
    kinks: bool = True

    def _mapped(self, rows: _Vector) -> _Vector:
        return rows[..., :6] * np.array([self.scale] * 3 + [1.0] * 3)

    @staticmethod
    def _floor(values: Any) -> _Vector:
        return np.maximum(values, _RIDGE * values.max(axis=-1, keepdims=True) + _LEAST_VALUE)

    def exact(self, rows: _Vector) -> _Vector:
        """See `Criterion.exact`."""
        mapped = self._mapped(rows)
        values = self._floor(np.linalg.eigvalsh(np.swapaxes(mapped, -1, -2) @ mapped))
        return np.asarray(0.5 * np.log(values[..., -1] / values[..., 0]))

    def smooth(self, rows: _Vector, sharpness: float) -> tuple[_Vector, _Vector]:
        """See `Criterion.smooth`."""
        mapped = self._mapped(rows)
        values, vectors = np.linalg.eigh(np.swapaxes(mapped, -1, -2) @ mapped)
        logs = np.log(self._floor(values))
        high, by_high = _soft_max(logs, sharpness)
        low, by_low = _soft_max(-logs, sharpness)
        by_value = 0.5 * (by_high - by_low) / np.exp(logs)
        by_information = (vectors * by_value[..., None, :]) @ np.swapaxes(vectors, -1, -2)
        slope = np.zeros_like(rows)
        slope[..., :6] = 2.0 * mapped @ by_information * np.array([self.scale] * 3 + [1.0] * 3)
        return 0.5 * (high + low), slope

    def exchanged(self, others: _Vector, candidates: _Vector) -> _Vector:
        """See `Criterion.exchanged`."""
        kept, added = self._mapped(others), self._mapped(candidates)
        information = (np.swapaxes(kept, -1, -2) @ kept)[:, None] + np.swapaxes(added, -1, -2) @ added
        values = self._floor(np.linalg.eigvalsh(information))
        return np.asarray(0.5 * np.log(values[..., -1] / values[..., 0]))


@dataclass(frozen=True)
class FaultCriterion:
    """Least fault of the worst channel that is seen, ``least`` / √(1 − leverage).

    The whitened null space Z of J has |z_i|² = 1 − h_i for channel i, with h_i = J_i (JᵀJ)⁻¹ J_iᵀ its leverage; with
    equal white noise the information on a fault of that channel is proportional to it (`gfimu.rate.health.detectable`).
    """

    least: float
    kinks: bool = True

    @staticmethod
    def _inverse(kept: _Vector) -> _Vector:
        information = np.swapaxes(kept, -1, -2) @ kept
        ridge = _RIDGE * np.trace(information, axis1=-2, axis2=-1)[..., None, None] / 6.0
        return np.linalg.inv(information + ridge * np.eye(6))

    def _of_leverage(self, leverage: _Vector) -> _Vector:
        return np.asarray(math.log(self.least) - 0.5 * np.log(np.maximum(1.0 - leverage, _FULL)))

    def exact(self, rows: _Vector) -> _Vector:
        """See `Criterion.exact`."""
        kept = rows[..., :6]
        leverage = np.einsum("...ci,...ij,...cj->...c", kept, self._inverse(kept), kept)
        return self._of_leverage(leverage.max(axis=-1))

    def smooth(self, rows: _Vector, sharpness: float) -> tuple[_Vector, _Vector]:
        """See `Criterion.smooth`."""
        kept = rows[..., :6]
        inverse = self._inverse(kept)
        pulled = kept @ inverse  # (s, c, 6)
        leverage = np.sum(pulled * kept, axis=-1)
        value, share = _soft_max(self._of_leverage(leverage), sharpness)
        by_leverage = share * 0.5 / np.maximum(1.0 - leverage, _FULL)
        slope = np.zeros_like(rows)
        through = np.einsum("...ci,...c,...cj->...ij", pulled, by_leverage, pulled)
        slope[..., :6] = 2.0 * by_leverage[..., None] * pulled - 2.0 * kept @ through
        return value, slope

    def exchanged(self, others: _Vector, candidates: _Vector) -> _Vector:
        """See `Criterion.exchanged`."""
        kept = np.broadcast_to(others[:, None], (*candidates.shape[:2], *others.shape[1:]))
        return self.exact(np.concatenate([kept, candidates], axis=-2))


@dataclass(frozen=True)
class Goal:
    """Sum of weights times logarithms of figures: one figure, or a compromise between two.

    Parameters
    ----------
    parts : tuple of (float, Criterion, bool)
        Weight, criterion, and whether its worst draw of the tolerance counts; else the nominal array does.
    """

    parts: tuple[tuple[float, Criterion, bool], ...]

    @property
    def kinks(self) -> bool:
        """Whether the sum has kinks, so that `smooth` depends on the sharpness."""
        return any(part.kinks or drawn for _, part, drawn in self.parts)

    @property
    def agreement(self) -> float:
        """Relative difference of the figure below which two ends of a search count as one."""
        return _AGREE_ROUGHLY if self.kinks else _AGREE

    @property
    def steering(self) -> TraceCriterion | None:
        """The criterion for which the best direction of a sensing axis is known in closed form, where it is alone."""
        criterion, drawn = self.parts[0][1:]
        alone = len(self.parts) == 1 and not drawn
        return criterion if alone and isinstance(criterion, TraceCriterion) and len(criterion.terms) == 1 else None

    def exact(self, rows: _Vector) -> float:
        """Sum for one design under s draws, the first of them nominal, rows of shape (s, c, 12)."""
        return float(sum(weight * part.exact(rows[: _draws(drawn)]).max() for weight, part, drawn in self.parts))

    def smooth(self, rows: _Vector, sharpness: float) -> tuple[float, _Vector]:
        """Differentiable form of `exact`, and its gradient, shape (s, c, 12)."""
        total, slope = 0.0, np.zeros_like(rows)
        for weight, part, drawn in self.parts:
            few = rows[: _draws(drawn)]
            values, slopes = part.smooth(few, sharpness)
            # Draws differ little in their figure, so their maximum takes a higher power.
            value, share = _soft_max(values, _SHARPER * sharpness) if drawn else (values[0], np.ones(1))
            total += weight * float(value)
            slope[: len(few)] += weight * share[:, None, None] * slopes
        return total, slope

    def exchanged(self, others: _Vector, candidates: _Vector) -> _Vector:
        """Sum with each candidate chip, shape (s, m, k, 12), beside the others, (s, c − k, 12); shape (m,)."""
        parts = [
            weight * part.exchanged(others[: _draws(drawn)], candidates[: _draws(drawn)]).max(axis=0)
            for weight, part, drawn in self.parts
        ]
        return np.asarray(np.sum(parts, axis=0))


def _draws(drawn: bool) -> int | None:
    return None if drawn else 1


def _soft_max(values: _Vector, sharpness: float) -> tuple[_Vector, _Vector]:
    """Smooth largest value along the last axis, log Σ exp(p v) / p, and the share of each in its gradient."""
    top = values.max(axis=-1, keepdims=True)
    powers = np.exp(sharpness * (values - top))
    total = powers.sum(axis=-1, keepdims=True)
    return (top + np.log(total) / sharpness)[..., 0], powers / total
