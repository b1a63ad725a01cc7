"""Noise of a free body's channels: white, slow, and what the sampled gyro can't say of a violent motion.

Besides white noise per channel and bias instability there are two terms that grow with the motion. Readings that change
fast disagree by what they change within an uncertain instant; and between two samples of the gyro the angular
acceleration does what it likes. Both are in proportion to d, the rate of change of the readings, and both are fitted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.optimize import nnls

from gfimu.geometry.array import AccelerometerArray

__all__ = ["BodyNoise", "Projection", "change_of_readings", "learn_motion_noise", "white_from_rows"]

_AGITATION_GRID = np.concatenate([[0.0], np.geomspace(2e-5, 2e-2, 31)])
_SLOPE_GRID = np.concatenate([[0.0], np.geomspace(1e-3, 3.0, 22)])
_FLOOR_GRID = np.concatenate([[0.0], np.geomspace(1e-2, 3e2, 19)])
_RATIO_SPREAD, _MODEL_ERROR = 0.5, 0.02
_WORTH = 30.0
_QUIET = 0.34
_FEWEST_QUIET = 200


@dataclass(frozen=True)
class BodyNoise:
    """Noise of a run.

    Parameters
    ----------
    white : ndarray, shape (c,)
        White noise per channel, m/s²; infinite for a channel without data.
    agitation : float
        Disagreement of the channels per rate of change of their readings, s.
    acceleration : float
        Error of the angular acceleration that the gyro gives, rad/s².
    acceleration_slope : float
        The part of it per rate of change of the readings, rad/s² per m/s³.
    flicker : float
        Rms of the bias instability, m/s².
    log_odds : float
        Log likelihood that the terms in proportion to d gain.
    """

    white: NDArray[np.float64]
    agitation: float = 0.0
    acceleration: float = 0.0
    acceleration_slope: float = 0.0
    flicker: float = 0.0
    log_odds: float = 0.0

    @property
    def typical(self) -> float:
        """Typical white noise, m/s²."""
        return float(np.median(self.white[np.isfinite(self.white)]))


class Projection:
    """Whitened combinations of the channels that the specific force can't move.

    The first three feel the angular acceleration with ``strength`` (per rad/s²), the others don't. ``sensed`` (c, 3) is
    what the channels read per specific force, where gains and cross-axis effects make that other than the axes.
    """

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
        self.strength = strength  # (3,)
        self.turn = turn  # (3, 3): rows i feels strength_i · turn_i · α
        self.to_force = np.linalg.pinv(axes) * self.inverse  # (3, c)
        # Gains near −1 leave no specific force to be sensed.
        self.force_covariance = np.linalg.pinv(axes.T @ axes, hermitian=True)
        self.alive = np.flatnonzero(np.linalg.norm(self.rows, axis=1) > 0)

    def variance(self, noise: BodyNoise, change: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the variance of every row, shape (n, c − 3), for changes of the readings (n,), m/s³."""
        common = 1.0 + (noise.agitation * change / noise.typical) ** 2
        out = np.repeat(common[:, None], len(self.rows), axis=1)
        lost = noise.acceleration**2 + (noise.acceleration_slope * change) ** 2
        out[:, :3] += np.outer(lost, self.strength**2)
        return out


def change_of_readings(readings: NDArray[np.float64], period: float, white: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how fast the readings change, shape (n,), m/s³: rms over the channels, noise taken off."""
    alive = np.isfinite(white)
    step = np.zeros_like(readings[:, alive])
    step[1:-1] = readings[2:, alive] - readings[:-2, alive]
    power = np.mean(step**2, axis=1) - 2 * np.mean(white[alive] ** 2)
    return np.asarray(np.sqrt(np.maximum(uniform_filter1d(power, 5), 0.0)) / (2 * period))


def white_from_rows(
    projected: NDArray[np.float64],
    projector: NDArray[np.float64],
    change: NDArray[np.float64],
    use: NDArray[np.bool_],
    expected: NDArray[np.float64],
) -> NDArray[np.float64]:
    """White noise of each channel from residuals r = P e of the quiet samples, shape (c,), m/s².

    With independent channels E r_i² = Σ_j P_ij² σ_j²; second differences in time leave white noise alone. Where few
    combinations are left the channels can't be told apart well: their ratios are held near those of the data sheet.
    """
    both = use[2:] & use[1:-1] & use[:-2]
    quiet = both & (change[1:-1] <= np.quantile(change[1:-1][both], _QUIET)) if both.any() else both
    if quiet.sum() < _FEWEST_QUIET:
        quiet = both
    second = np.diff(projected, 2, axis=0)[quiet]
    power = (np.median(np.abs(second), axis=0) / 0.6745) ** 2 / 6.0
    alive = power > 0
    mixing = projector[np.ix_(alive, alive)] ** 2 * expected[alive] ** 2
    scale = power[alive].sum() / mixing.sum()
    error = power[alive] * (np.sqrt(3.0 / max(int(quiet.sum()), 1)) + _MODEL_ERROR)
    count = len(error)
    design = np.vstack([scale * mixing / error[:, None], np.eye(count) / _RATIO_SPREAD])
    ratio, _ = nnls(design, np.concatenate([power[alive] / error, np.ones(count) / _RATIO_SPREAD]))
    found = np.zeros(len(power))
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
    typical = BodyNoise(white).typical
    free = np.setdiff1d(projection.alive, np.arange(3))
    power, count = np.sum(second[:, free] ** 2, axis=1), len(free)
    # Neighbouring second differences share samples: about half of them are news.
    values = [_likelihood(power, count, 1.0 + (tau * d / typical) ** 2) / 2 for tau in _AGITATION_GRID]
    best = int(np.argmax(values))
    if values[best] - values[0] < _WORTH:
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
    if table.max() - table[still, 0] < _WORTH:
        floor_place, slope_place = np.intp(still), np.intp(0)
    gain += float(table[floor_place, slope_place] - table[still, 0])
    return BodyNoise(
        white,
        agitation,
        float(floors[floor_place]),
        float(_SLOPE_GRID[slope_place]),
        log_odds=gain if agitation or slope_place else 0.0,
    )


def _likelihood(power: NDArray[np.float64], count: int, variance: NDArray[np.float64]) -> float:
    return float(-0.5 * np.sum(count * np.log(variance) + power / variance))
