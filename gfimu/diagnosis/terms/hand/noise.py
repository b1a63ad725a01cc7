"""Noise of a free body's channels: white, slow, and what the sampled gyro can't say of a violent motion.

Besides white noise per channel and bias instability there are two terms that grow with the motion. Readings that change
fast disagree by what they change within an uncertain instant; and between two samples of the gyro the angular
acceleration does what it likes. Both are in proportion to d, the rate of change of the readings, and both are fitted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from gfimu.array.array import AccelerometerArray
from gfimu.diagnosis.data.cosine_basis import NoiseLevels
from gfimu.diagnosis.policy import Policy

__all__ = ["LEAST_POWER", "BodyNoise", "Projection", "learn_motion_noise", "white_from_rows"]

_AGITATION_GRID = np.concatenate([[0.0], np.geomspace(2e-5, 2e-2, 31)])  # numerical: s
_SLOPE_GRID = np.concatenate([[0.0], np.geomspace(1e-3, 3.0, 22)])  # numerical: rad/s² per m/s³
_FLOOR_GRID = np.concatenate([[0.0], np.geomspace(1e-2, 3e2, 19)])  # numerical: rad/s²
_RATIO_SPREAD = 0.5  # numerical: holds ratios of channels that few combinations hardly separate
_QUIET, _FEWEST_QUIET = 0.34, 200  # numerical: share of the samples that change least, and how many they have to be
LEAST_POWER = 1e-9
"""Numerical: of the loudest row, or the strongest direction, below which there are rounding errors."""


@dataclass(frozen=True)
class BodyNoise(NoiseLevels):
    """Noise of a run: white and slow noise as `NoiseLevels` has them, and what grows with the motion.

    The last entry, that of a reference, is infinite, as is that of a channel without data.

    Parameters
    ----------
    agitation : float
        Disagreement of the channels per rate of change of their readings, s.
    acceleration : float
        Error of the angular acceleration that the gyro gives, rad/s².
    acceleration_slope : float
        The part of it per rate of change of the readings, rad/s² per m/s³.
    log_odds : float
        Log likelihood that the terms in proportion to d gain.
    misfit : float
        How much more than such noise the residual scatters along the columns of causes; log likelihoods are divided by
        it.
    """

    agitation: float = 0.0
    acceleration: float = 0.0
    acceleration_slope: float = 0.0
    log_odds: float = 0.0
    misfit: float = 1.0

    @classmethod
    def of(cls, white: NDArray[np.float64], flicker: float, acceleration: float = 0.0) -> BodyNoise:
        """Return white noise (c,) and the bias instability of all channels, m/s²."""
        slow = np.append(np.full(len(white), flicker), 0.0)
        return cls(np.append(white, np.inf), slow, acceleration=acceleration)

    @property
    def typical(self) -> float:
        """Typical white noise, m/s²."""
        return float(np.median(self.white[np.isfinite(self.white)]))

    @property
    def instability(self) -> float:
        """Bias instability of every channel, rms, m/s²."""
        return float(self.flicker[0])

    def with_instability(self, level: float) -> BodyNoise:
        """Return the noise with another bias instability, rms, m/s²."""
        return replace(self, flicker=np.append(np.full(len(self.white) - 1, level), 0.0))

    def common(self, change: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the factor by which the variance grows, shape (n,), for changes of the readings (n,), m/s³."""
        return 1.0 + (self.agitation * change / self.typical) ** 2

    def lost(self, change: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the variance of the angular acceleration that the gyro's samples don't hold, shape (n,)."""
        return self.acceleration**2 + (self.acceleration_slope * change) ** 2


class Projection:
    """Derivative by specific force and angular acceleration, the same at all samples.

    Whitened combinations of the channels that the specific force can't move.

    The first three sense the angular acceleration with ``strength`` (per rad/s²), the others don't. ``sensed`` (c, 3)
    is what the channels read per specific force, where gains and cross-axis effects make that other than the axes.

    About a known axis ``rate_row`` (c,) is what senses an error of the squared rate, with ``rate_strength`` (per
    rad²/s²), of the combinations that the angular acceleration does not enter. On chips of three axes with noise alike
    nothing of it is lost: tangential and radial differences are orthogonal.
    """

    predictions = 4
    """How many predictions it takes."""

    def __init__(
        self, array: AccelerometerArray, white: NDArray[np.float64], sensed: NDArray[np.float64] | None = None
    ) -> None:
        self.inverse = np.where(np.isfinite(white), 1.0 / white, 0.0)  # (c,)
        axes = (array.axes if sensed is None else sensed) * self.inverse[:, None]
        basis, _, _ = np.linalg.svd(axes, full_matrices=True)
        free = basis[:, 3:]  # (c, c − 3)
        arms = array.regression_matrix[:, :3] * self.inverse[:, None]
        left, strength, turn = np.linalg.svd(free.T @ arms, full_matrices=True)
        self.rows = (free @ left).T * self.inverse  # (c − 3, c): residual (m/s²) to rows
        axis = array.turning_axis
        # What the channels read per squared rate about the known axis, (c,), m; nothing without one.
        self.squared_rate = np.zeros(array.n_channels) if axis is None else array.centripetal_about(axis.direction)
        by_rate = self.rows @ self.squared_rate
        by_rate[:3] *= strength <= LEAST_POWER * max(strength.max(), 1e-300)
        self.rate_strength = float(np.linalg.norm(by_rate))
        self.rate_row = (by_rate / max(self.rate_strength, 1e-300)) @ self.rows  # (c,)
        self.force_rows = basis[:, :3].T * self.inverse  # (3, c): what the specific force takes
        self.strength = strength  # (3,)
        self.turn = turn  # (3, 3): row i reads strength_i · turn_i · α
        self.to_force = np.linalg.pinv(axes) * self.inverse  # (3, c)
        # Gains near −1 leave no specific force to be sensed.
        self.force_covariance = np.linalg.pinv(axes.T @ axes, hermitian=True)
        self.alive = np.flatnonzero(np.linalg.norm(self.rows, axis=1) > 0)


def white_from_rows(
    projected: NDArray[np.float64],
    projector: NDArray[np.float64],
    change: NDArray[np.float64],
    use: NDArray[np.bool_],
    expected: NDArray[np.float64],
) -> NDArray[np.float64]:
    """White noise of each channel from residuals r = P e of the quiet samples, shape (c,), m/s².

    With independent channels E r_i² = Σ_j P_ij² σ_j²; second differences in time leave white noise alone. Where few
    combinations are left the channels can't be distinguished well: their ratios are held near those of the data sheet.
    """
    both = use[2:] & use[1:-1] & use[:-2]
    quiet = both & (change[1:-1] <= np.quantile(change[1:-1][both], _QUIET)) if both.any() else both
    if quiet.sum() < _FEWEST_QUIET:
        quiet = both
    second = np.diff(projected, 2, axis=0)[quiet]
    power = (np.median(np.abs(second), axis=0) / 0.6745) ** 2 / 6.0
    alive = power > LEAST_POWER * power.max(initial=0.0)
    mixing = projector[np.ix_(alive, alive)] ** 2 * expected[alive] ** 2
    scale = power[alive].sum() / mixing.sum()
    error = power[alive] * (
        np.sqrt(3.0 / max(int(quiet.sum()), 1)) + 2.0 * Policy.noise_accuracy
    )  # of a power, twice that of a level
    count = len(error)
    design = np.vstack([scale * mixing / error[:, None], np.eye(count) / _RATIO_SPREAD])
    ratio, _ = nnls(design, np.concatenate([power[alive] / error, np.ones(count) / _RATIO_SPREAD]))
    found = scale * expected**2  # what no row shows is as loud as the rest
    found[alive] = ratio * scale * expected[alive] ** 2
    return np.sqrt(np.maximum(found, 0.04 * np.median(found[alive])))


def learn_motion_noise(
    white: NDArray[np.float64],
    projection: Projection,
    rows: NDArray[np.float64],
    change: NDArray[np.float64],
    use: NDArray[np.bool_],
    acceleration_error: float,
) -> BodyNoise:
    """Fit the terms that grow with the motion to whitened residual rows (n, c − 3), by likelihood.

    Second differences in time leave what changes from sample to sample: noise, and no effect of a smooth motion. What
    the gyro's own noise makes of the angular acceleration (rad/s²) is slower than that and is put in as known.
    """
    both = use[2:] & use[1:-1] & use[:-2]
    second = np.diff(rows, 2, axis=0)[both] / np.sqrt(6.0)
    d = change[1:-1][both]
    first = BodyNoise.of(white, 0.0)
    typical = first.typical
    free = np.setdiff1d(projection.alive, np.arange(3))
    power, count = np.sum(second[:, free] ** 2, axis=1), len(free)
    # Neighbouring second differences share samples: about half of them are news.
    worth = Policy().motion_odds
    values = [_likelihood(power, count, 1.0 + (tau * d / typical) ** 2) / 2 for tau in _AGITATION_GRID]
    best = int(np.argmax(values))
    if values[best] - values[0] < worth:
        best = 0
    agitation, gain = float(_AGITATION_GRID[best]), values[best] - values[0]
    common = 1.0 + (agitation * d / typical) ** 2
    floors = np.hypot(_FLOOR_GRID, acceleration_error)
    table = np.array(
        [
            [
                sum(
                    _likelihood(second[:, i] ** 2, 1, common + s**2 * (floor**2 + (slope * d) ** 2))
                    for i, s in enumerate(projection.strength)
                )
                / 2
                for slope in _SLOPE_GRID
            ]
            for floor in floors
        ]
    )
    still = int(np.argmax(table[:, 0]))
    floor_place, slope_place = np.unravel_index(int(np.argmax(table)), table.shape)
    if table.max() - table[still, 0] < worth:
        floor_place, slope_place = np.intp(still), np.intp(0)
    gain += float(table[floor_place, slope_place] - table[still, 0])
    return replace(
        first,
        agitation=agitation,
        acceleration=float(floors[floor_place]),
        acceleration_slope=float(_SLOPE_GRID[slope_place]),
        log_odds=gain if agitation or slope_place else 0.0,
    )


def _likelihood(power: NDArray[np.float64], count: int, variance: NDArray[np.float64]) -> float:
    return float(-0.5 * np.sum(count * np.log(variance) + power / variance))
