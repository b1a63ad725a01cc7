"""Modes of slow noise (bias instability, a random walk) as the observations of a stretch see them.

The noise of observation c is white but for a few modes, orthonormal columns Q_c with shares s_c, so that

    W_c = (I − Q_c diag(s_c) Q_cᵀ) / σ_c².

Where all samples count alike the modes are cosines, the same for all observations. A coarse reading counts more at the
edge of a step than in its middle (`gfimu.diagnosis.data.rounding`), so slow noise comes through with the weight w of
each sample: with B = diag(w) C and the variances S of the cosines C,

    S^½ BᵀB S^½/σ² = V Λ Vᵀ,  Q = B S^½/σ V Λ^−½,  s = Λ/(1 + Λ).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from gfimu.diagnosis.data.cosine_basis import WEAKEST_CORRECTION, CosineBasis, NoiseLevels

__all__ = ["SlowModes", "WeighedModes", "WeighedPowers"]

_MOST_COSINES = 128  # numerical: products of more cost more than the modes are worth
_NO_POWER = 1e-12  # numerical


class SlowModes:
    """Modes that are the same for all observations: cosines.

    Parameters
    ----------
    basis : CosineBasis
        The cosines.
    levels : NoiseLevels
        The noise.
    """

    def __init__(self, basis: CosineBasis, levels: NoiseLevels) -> None:
        self._basis, self._levels = basis, levels

    @cached_property
    def share(self) -> NDArray[np.float64]:
        """s, shape (K, c + 1)."""
        return self._basis.corrections(self._levels)

    @cached_property
    def log_determinant(self) -> float:
        """Log det of the channels' noise covariance."""
        return _log_determinant(self._basis, self._levels)

    @cached_property
    def cosines(self) -> NDArray[np.float64]:
        """The cosines, shape (n, K)."""
        return self._basis.matrix(len(self.share))  # (n, K)

    def of(self, values: NDArray[np.float64], column: int) -> NDArray[np.float64]:
        """Return what each mode has of rows (p, n) of one observation, shape (p, K)."""
        return np.asarray(values @ self.cosines)

    def of_each(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what each mode has of all observations (n, c + 1), shape (K, c + 1)."""
        return np.asarray(self.cosines.T @ values)

    def back(self, sizes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return all observations (n, c + 1) that sizes (K, c + 1) of the modes make."""
        return np.asarray(self.cosines @ sizes)

    def explained(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what slow noise takes of the squares of all observations (n, c + 1), shape (c + 1,)."""
        return np.asarray(np.sum(self.of_each(values) ** 2 * self.share, axis=0))


class WeighedModes(SlowModes):
    """Modes of observations whose samples count differently, each observation's its own.

    Parameters
    ----------
    basis, levels
        As `SlowModes` takes them.
    weight : ndarray, shape (n, c + 1)
        Share of an unrounded sample's amplitude, 0 to 1.
    """

    def __init__(self, basis: CosineBasis, levels: NoiseLevels, weight: NDArray[np.float64]) -> None:
        super().__init__(basis, levels)
        self._weight, self._count = weight, _cosine_count(basis, levels)
        # S^½/σ, (K, c + 1)
        self._root = np.sqrt(basis.variances(levels, self._count)) / levels.white

    @cached_property
    def cosines(self) -> NDArray[np.float64]:
        """The cosines, shape (n, K)."""
        return self._basis.matrix(self._count)

    @cached_property
    def _gram(self) -> NDArray[np.float64]:
        """S^½ BᵀB S^½/σ² of each observation, shape (c + 1, K, K)."""
        root = self._root.T
        return self._basis.products(self._weight**2, self._count) * root[:, :, None] * root[:, None, :]

    @cached_property
    def _factors(self) -> list[NDArray[np.float64]]:
        """Lower Cholesky factors L of I + S^½ BᵀB S^½/σ², each (K, K)."""
        return list(np.linalg.cholesky(self._gram + np.eye(self._count)))

    @cached_property
    def _modes(self) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Λ, largest first, and the mixing S^½ V Λ^−½/σ of the cosines, of each observation."""
        found = []
        for gram, root in zip(self._gram, self._root.T, strict=True):
            power, vectors = np.linalg.eigh(gram)
            power, vectors = np.maximum(power[::-1], 0.0), vectors[:, ::-1]
            resolved = power > WEAKEST_CORRECTION * (1.0 + power)
            found.append((power[resolved], root[:, None] * vectors[:, resolved] / np.sqrt(power[resolved])))
        return found

    @cached_property
    def share(self) -> NDArray[np.float64]:
        """s, shape (K, c + 1); modes of the least shares are left out."""
        share = np.zeros((max(1, *(len(power) for power, _ in self._modes)), len(self._modes)))
        for column, (power, _) in enumerate(self._modes):
            share[: len(power), column] = power / (1.0 + power)
        return share

    @cached_property
    def _mixing(self) -> NDArray[np.float64]:
        """Q_c = diag(w_c) C mixing_c, shape (c + 1, cosines, K)."""
        mixing = np.zeros((len(self._modes), self._count, len(self.share)))
        for column, (_, mine) in enumerate(self._modes):
            mixing[column, :, : mine.shape[1]] = mine
        return mixing

    def columns(self, column: int) -> NDArray[np.float64]:
        """Return Q_c of one observation, shape (n, K)."""
        return np.asarray(self.cosines @ self._mixing[column] * self._weight[:, [column]])

    @cached_property
    def log_determinant(self) -> float:
        """Log det of the channels' noise covariance."""
        return len(self._weight) * float(np.sum(np.log(self._levels.white[:-1] ** 2))) + self.log_narrowing

    @cached_property
    def log_narrowing(self) -> float:
        """Log det of what is known of slow noise once observed, relative to before, of the channels."""
        return 2.0 * float(sum(np.log(factor.diagonal()).sum() for factor in self._factors[:-1]))

    def of(self, values: NDArray[np.float64], column: int) -> NDArray[np.float64]:
        """Return what each mode has of rows (p, n) of one observation, shape (p, K)."""
        return np.asarray((values * self._weight[:, column]) @ self.cosines @ self._mixing[column])

    def of_each(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what each mode has of all observations (n, c + 1), shape (K, c + 1)."""
        return np.asarray(np.einsum("ckm,kc->mc", self._mixing, self.cosines.T @ (values * self._weight)))

    def back(self, sizes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return all observations (n, c + 1) that sizes (K, c + 1) of the modes make."""
        return np.asarray(self.cosines @ np.einsum("ckm,mc->kc", self._mixing, sizes) * self._weight)

    def explained(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what slow noise takes of the squares of all observations (n, c + 1), shape (c + 1,)."""
        return np.asarray(np.sum(self._solved(values) ** 2, axis=0))

    def slow_noise(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the most probable slow noise (n, c + 1), which comes through in observations with their weights."""
        sizes = np.column_stack(
            [
                solve_triangular(factor, mine, lower=True, trans=1, check_finite=False)
                for factor, mine in zip(self._factors, self._solved(values).T, strict=True)
            ]
        )
        return np.asarray(self.cosines @ (self._root * sizes))

    def _solved(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return L⁻¹ S^½ Bᵀ/σ of all observations, shape (K, c + 1)."""
        sizes = self._root * (self.cosines.T @ (values * self._weight))
        return np.column_stack(
            [
                solve_triangular(factor, mine, lower=True, check_finite=False)
                for factor, mine in zip(self._factors, sizes.T, strict=True)
            ]
        )


@dataclass(frozen=True)
class WeighedPowers:
    """Sizes of slow modes in residuals whose samples count differently, and what slow noise of unit size gives them.

    Parameters
    ----------
    power : ndarray, shape (K, c)
        Squared sizes, in units of the residuals.
    flicker, walk : ndarray, shape (K, c) or (K, 1)
        Variances that bias instability and a random walk of unit size give them.
    """

    power: NDArray[np.float64]
    flicker: NDArray[np.float64]
    walk: NDArray[np.float64]

    @classmethod
    def of(cls, basis: CosineBasis, residual: NDArray[np.float64], weight: NDArray[np.float64]) -> WeighedPowers:
        """Take weighted residuals (n, c) and their weights; a constant is left out, as it may be a bias."""
        count = min(len(basis.frequency), _MOST_COSINES)
        flicker, walk = basis.flicker_spectrum[1:count], basis.walk_spectrum[1:count]
        root = np.sqrt(flicker)
        found = cls(*np.zeros((3, count - 1, residual.shape[1])))
        products = basis.products(weight**2, count)
        sizes = basis.matrix(count).T @ (weight * residual)  # (K + 1, c)
        for column, whole in enumerate(products):
            constant = whole[0, 1:] / max(float(whole[0, 0]), _NO_POWER)
            gram = whole[1:, 1:] - np.outer(whole[0, 1:], constant)
            left = sizes[1:, column] - constant * sizes[0, column]
            power, vectors = np.linalg.eigh(gram * np.outer(root, root))
            there = power > _NO_POWER * max(float(power[-1]), _NO_POWER)
            analysis = (root[:, None] * vectors[:, there] / np.sqrt(power[there])).T  # of Bᵀr
            found.power[there, column] = (analysis @ left) ** 2
            found.flicker[there, column] = power[there]
            found.walk[there, column] = (analysis @ gram) ** 2 @ walk
        return found


def _cosine_count(basis: CosineBasis, levels: NoiseLevels) -> int:
    """Return how many cosines matter: more than where all samples count alike, as a few may count for most."""
    louder = NoiseLevels(levels.white, 2.0 * levels.flicker, 2.0 * levels.walk)
    return min(len(basis.corrections(louder)), _MOST_COSINES)


def _log_determinant(basis: CosineBasis, levels: NoiseLevels) -> float:
    """Return log det of the channels' noise covariance."""
    white = levels.white[:-1] ** 2
    spectrum = white + basis.variances(levels, len(basis.frequency))[:, :-1]
    return float(np.sum(np.log(spectrum)) + (basis.n - len(spectrum)) * np.sum(np.log(white)))
