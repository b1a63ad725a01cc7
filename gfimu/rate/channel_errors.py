"""Errors of gains, axes, places and mounting: constants of a run that an estimate considers and does not correct.

A reading is linear in the twelve features m = [α; p; s(ω)] of the motion, y = n·F(r) m for a channel along n at r. So
is what an error does to it: a gain, a tilt of n, a shift of r, a turn of all chips against the drawing. An error of
one standard deviation has the pattern T (c, 12), and its effect on α = A y and z = Z y is [A; Z] T m.

Of the hundred errors of an array a run excites few combinations. With the moments E[m mᵀ] of its features, the
combinations are the eigenvectors of Σ (T m)ᵀ [A; Z]ᵀ Λ [A; Z] (T m), Λ the inverse noise; those that matter over the
memory of a filter are kept.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.rate.channel_sets import ChannelSets
from gfimu.rate.sensing import SensorErrors

__all__ = ["ChannelErrors", "ErrorPolicy", "features_of", "usual_moments"]


@dataclass(frozen=True)
class ErrorPolicy:
    """Which combinations of errors are considered.

    Parameters
    ----------
    memory_s : float
        Time over which a filter averages, s: a lasting error counts against noise by its square root.
    least : float
        χ² over that time from which a combination is considered: 0.3 is a tenth of a half minute's noise.
    most : int
        Combinations at most: a filter's time per sample grows with them.
    usual_alpha, usual_rate : float
        Standard deviations per axis of the motion that a stream is expected to have, rad/s² and rad/s.
    """

    memory_s: float = 1.0
    least: float = 0.3
    most: int = 64
    usual_alpha: float = 10.0
    usual_rate: float = 5.0


@dataclass(frozen=True)
class ChannelErrors:
    """Combinations of errors, each of one standard deviation.

    Parameters
    ----------
    patterns : ndarray, shape (q, c, 12)
        What each makes of the features, in the order α, p, products of ω.
    """

    patterns: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.patterns)

    @classmethod
    def stated(cls, array: AccelerometerArray, errors: SensorErrors) -> Self:
        """Return every error of the channels that is stated: gains, axes, places, and one turn of all chips."""
        c = array.n_channels
        maps = np.stack([_force(place) for place in array.chip_positions])[array.chip_of_channel]  # (c, 3, 12)
        patterns = []

        def add(std: float, channels: NDArray[np.bool_], rows: NDArray[np.float64]) -> None:
            if std > 0.0:
                patterns.append(np.where(channels[:, None], std * rows, 0.0))

        directions = array.axes  # (c, 3)
        across = np.linalg.svd(directions[:, None, :])[2][:, 1:]  # (c, 2, 3)
        for channel in range(c):
            alone = np.arange(c) == channel
            add(errors.scale_std, alone, np.einsum("ca,caf->cf", directions, maps))
            for k in range(2):
                add(errors.axis_std, alone, np.einsum("ca,caf->cf", across[:, k], maps))
        for chip in range(len(array.chips)):
            for k in range(3):
                moved = _force(np.eye(3)[k]) - _force(np.zeros(3))
                add(errors.placement_std, array.chip_of_channel == chip, directions @ moved)
        for k in range(3):
            turned = np.cross(np.eye(3)[k], directions)
            add(errors.rotation_std, np.ones(c, dtype=bool), np.einsum("ca,caf->cf", turned, maps))
        return cls(np.array(patterns).reshape(-1, c, 12))

    def excited(
        self,
        sets: ChannelSets,
        moments: NDArray[np.float64],
        period: float,
        *,
        path: bool = False,
        policy: ErrorPolicy = ErrorPolicy(),
    ) -> Self:
        """Return the combinations that matter in a motion whose features have these moments (12, 12).

        Those that matter to p count where the ``path`` is followed.
        """
        full = sets.full
        noise = np.concatenate([np.diag(full.alpha_noise), np.ones(sets.products), np.diag(full.force_noise)])
        seen = sets.rows(path=path) @ self.patterns  # (q, 3 + m, 12), or with p (q, 6 + m, 12)
        weights = 1.0 / noise[: seen.shape[1]]
        values, vectors = np.linalg.eigh(np.einsum("qkf,fg,k,rkg->qr", seen, moments, weights, seen, optimize=True))
        matter = values * policy.memory_s / period > policy.least
        kept = vectors[:, matter][:, ::-1][:, : policy.most]
        return type(self)(np.einsum("qk,qcf->kcf", kept, self.patterns))

    def of_rows(self, rows: NDArray[np.float64], features: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what each makes of combinations (d, c) of the readings at features (n, 12), shape (n, d, q)."""
        return np.asarray(np.einsum("qdf,nf->ndq", rows @ self.patterns, features))

    def covariance_of(self, rows: NDArray[np.float64], moments: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the mean covariance that rows (d, c) of the readings get in a motion with these moments, (d, d)."""
        seen = rows @ self.patterns  # (q, d, 12)
        return np.asarray(np.einsum("qdf,fg,qeg->de", seen, moments, seen, optimize=True))

    def variance_of(self, rows: NDArray[np.float64], features: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the mean variance that rows (d, c) of the readings get at features (n, 12), shape (n,)."""
        seen = rows @ self.patterns  # (q, d, 12)
        energy = np.einsum("qdf,qdg->fg", seen, seen) / max(len(rows), 1)
        return np.asarray(np.einsum("nf,fg,ng->n", features, energy, features, optimize=True))


def features_of(
    array: AccelerometerArray, readings: NDArray[np.float64], present: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return the features (n, 12) that readings (n, c) of the channels ``present`` (c,) show, the least ones."""
    both = np.hstack([array.regression_matrix, array.centripetal_matrix])[present]
    size = np.array([array.length_unit] * 3 + [1.0] * 3 + [array.length_unit] * 6)  # of a feature in m/s²
    return np.asarray(readings[:, present] @ np.linalg.pinv(both / size, rcond=1e-6).T / size)


def usual_moments(policy: ErrorPolicy = ErrorPolicy()) -> NDArray[np.float64]:
    """Return the moments (12, 12) of the features of a motion in all directions."""
    products = np.full((3, 3), policy.usual_rate**4) + 2.0 * policy.usual_rate**4 * np.eye(3)
    moments = np.diag([policy.usual_alpha**2] * 3 + [STANDARD_GRAVITY**2 / 3.0] * 3 + [policy.usual_rate**4] * 6)
    moments[6:9, 6:9] = products
    return moments


def _force(place: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return F (3, 12), the specific force at a place (3,) by the features: p + α × r + (ω ωᵀ − |ω|²) r."""
    x, y, z = place
    return np.array(
        [
            [0.0, z, -y, 1.0, 0.0, 0.0, 0.0, -x, -x, y, z, 0.0],
            [-z, 0.0, x, 0.0, 1.0, 0.0, -y, 0.0, -y, x, 0.0, z],
            [y, -x, 0.0, 0.0, 0.0, 1.0, -z, -z, 0.0, 0.0, x, y],
        ]
    )
