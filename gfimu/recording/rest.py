"""Rest: the stretches of a recording in which nothing moved.

The statistic at a sample is the norm, over the channels, of the readings' variances in a window about it (Tedaldi,
Pretto & Menegatti, "A robust and easy to implement method for IMU calibration without external equipments", ICRA
2014, eq. 14). A sample is at rest when the statistic is below a threshold; the threshold is chosen by the data
unless given.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.base.short_repr import short_repr
from gfimu.recording.recording import Recording

__all__ = ["Rest", "detect_rest", "mean_variance_factor", "motion_statistic", "rest_threshold"]

_BINS_PER_DECADE = 20
_CLUSTER_SHARE = 0.05
_VALLEY_SHARE = 0.01
_STANDING_RATE = 0.05
_ROUNDING = 1e-13
_LONGEST = 1e9  # numerical: s
_BLOCKS = 10


@dataclass(frozen=True)
class Rest:
    """Stretches of rest.

    Parameters
    ----------
    start, stop : ndarray of int, shape (k,)
        First sample of each stretch and the sample after its last.
    threshold : float
        Threshold of the statistic, reading unit squared.
    chosen_by_data : bool
        Whether the data chose the threshold.
    window : int
        Samples in the window of the statistic.
    unit : str
        Reading unit.
    """

    start: NDArray[np.intp]
    stop: NDArray[np.intp]
    threshold: float
    chosen_by_data: bool
    window: int
    unit: str

    __repr__ = short_repr

    def __len__(self) -> int:
        return len(self.start)

    @property
    def lengths(self) -> NDArray[np.intp]:
        """Samples in each stretch, shape (k,)."""
        return self.stop - self.start


def motion_statistic(recording: Recording, window: int) -> NDArray[np.float64]:
    """Norm over the channels of the readings' variances in a centred window.

    Parameters
    ----------
    recording : Recording
        Readings with c channels; missing ones (NaN) are left out of their window.
    window : int
        Odd number of samples.

    Returns
    -------
    ndarray, shape (n,)
        Statistic in reading units squared; infinite where the window meets the end of the recording, a gap, or less
        than half its samples.
    """
    n, half = len(recording), window // 2
    squares = np.zeros(max(n - window + 1, 0))
    for column in recording.readings.T:
        present = np.isfinite(column)
        centred = np.where(present, column - np.median(column[present]) if present.any() else 0.0, 0.0)
        count = _window_sum(present.astype(float), window)
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = _window_sum(centred, window) / count
            variance = (_window_sum(centred**2, window) - count * mean**2) / (count - 1)
        rounding = _ROUNDING * np.ptp(centred) ** 2  # what running sums leave of a variance of zero
        variance = np.where(variance > rounding, variance, 0.0)
        squares += np.where(count > half, variance, np.inf) ** 2
    statistic = np.full(n, np.inf)
    statistic[half : n - half] = np.sqrt(squares)
    for gap in recording.gaps:
        statistic[max(gap + 1 - half, 0) : gap + 1 + half] = np.inf
    return statistic


def rest_threshold(statistic: NDArray[np.float64]) -> float:
    """Choose the threshold between rest and motion from the statistic itself.

    The logarithm of the statistic has a narrow cluster where nothing moves and a wide, higher one where something
    does. The threshold is the first valley above the lowest cluster that holds a twentieth of the samples, or where
    its density has fallen to a hundredth of its peak.

    Parameters
    ----------
    statistic : ndarray, shape (n,)
        Output of `motion_statistic`.

    Returns
    -------
    float
        Threshold in the unit of the statistic.
    """
    values = statistic[np.isfinite(statistic)]
    positive = values[values > 0.0]
    if len(positive) == 0:
        return 1.0  # perfectly still throughout: any threshold says rest
    if len(values) - len(positive) >= _CLUSTER_SHARE * len(values):
        return float(positive.min())  # readings without noise: rest is where nothing changes at all
    logs = np.log10(positive)
    edges = np.arange(logs.min() - 0.5, logs.max() + 0.5, 1.0 / _BINS_PER_DECADE)
    counts, edges = np.histogram(logs, edges)
    density = np.convolve(counts, np.ones(3) / 3.0, mode="same")
    reached = np.cumsum(counts)
    lowest = int(np.argmax(reached >= _CLUSTER_SHARE * len(values)))
    peak = lowest
    while True:  # climb to the top of the cluster, across small dents
        ahead = density[peak + 1 : peak + 1 + _BINS_PER_DECADE // 4]
        if len(ahead) == 0 or ahead.max() <= density[peak]:
            break
        peak += 1 + int(np.argmax(ahead))
    place = peak
    while place + 1 < len(density) and density[place] > _VALLEY_SHARE * density[peak]:
        ahead = density[place + 1 : place + 1 + _BINS_PER_DECADE // 2]
        if len(ahead) and ahead.min() > density[place]:
            break
        place += 1
    return float(10.0 ** edges[place + 1])


def detect_rest(
    recording: Recording,
    *,
    threshold: float | None = None,
    window_s: float = 1.0,
    min_duration_s: float = 1.0,
) -> Rest:
    """Find the stretches of a recording in which nothing moved.

    Parameters
    ----------
    recording : Recording
        Readings in any unit.
    threshold : float, optional
        Threshold of the statistic, reading unit squared; chosen by the data if not given.
    window_s : float
        Length of the window of the statistic, s.
    min_duration_s : float
        Shortest stretch kept, s.

    Returns
    -------
    Rest
        The stretches. Their ends are half a window away from motion.

    Raises
    ------
    InputError
        If the recording is shorter than the window or a value is not positive.
    """
    if not (0.0 < window_s < _LONGEST and 0.0 < min_duration_s < _LONGEST and (threshold is None or threshold > 0.0)):
        raise InputError("window, shortest rest and threshold must be positive")
    window = max(round(window_s * recording.sample_rate) | 1, 11)
    if len(recording) <= window:
        raise InputError(
            f"the recording has {len(recording)} samples, the rest window {window}; record longer or shorten the window"
        )
    statistic = motion_statistic(recording, window)
    limit = rest_threshold(statistic) if threshold is None else threshold
    still = statistic < limit
    if "tacho_rad_s" in recording.reference:
        # A steady spin about the vertical changes no reading: only the reference knows.
        still &= ~(np.abs(_window_mean(recording.reference["tacho_rad_s"], window)) > _STANDING_RATE)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    start, stop = edges[::2], edges[1::2]
    long = stop - start >= max(round(min_duration_s * recording.sample_rate), 2)
    return Rest(start[long], stop[long], float(limit), threshold is None, window, recording.unit)


def mean_variance_factor(stretches: Sequence[NDArray[np.float64]]) -> float:
    """Factor by which the variance of the means of stretches of rest exceeds that of white noise, at least 1.

    Parameters
    ----------
    stretches : sequence of ndarray, each of shape (n_i, c)
        Samples at rest of c channels.

    Returns
    -------
    float
        Variance of block means over that expected of white noise, pooled; 1 where it is not significantly more.
    """
    ratios = []
    for samples in stretches:
        size = len(samples) // _BLOCKS
        if size < 2:
            continue
        blocks = samples[: size * _BLOCKS].reshape(_BLOCKS, size, -1).mean(axis=1)
        white = samples.var(axis=0, ddof=1) / size
        good = white > 0.0
        ratios.extend((blocks.var(axis=0, ddof=1)[good] / white[good]).tolist())
    if not ratios:
        return 1.0
    factor = float(np.mean(ratios))
    spread = np.sqrt(2.0 / (_BLOCKS - 1) / len(ratios))
    return factor if factor > 1.0 + 3.0 * spread else 1.0


def _window_sum(values: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """Sum over every full window, shape (n − window + 1,)."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    return total[window:] - total[:-window]


def _window_mean(values: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """Mean over a centred window, missing samples left out; the ends repeat the nearest full window."""
    present = np.isfinite(values)
    count = np.maximum(_window_sum(present.astype(float), window), 1.0)
    mean = _window_sum(np.where(present, values, 0.0), window) / count
    half = window // 2
    return np.concatenate([np.full(half, mean[0]), mean, np.full(len(values) - half - len(mean), mean[-1])])
