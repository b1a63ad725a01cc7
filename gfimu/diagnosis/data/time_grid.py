"""Time stamps on a uniform grid: which samples were lost, and which were only stamped late.

A lost sample shifts every later stamp against the nominal grid; a late stamp does not. Steps alone can't separate the
two: a late stamp makes one long step and then a short one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

__all__ = ["TimeGrid", "time_grid"]

_EARLY = 0.75  # sample periods: a shorter step follows a late stamp, whatever was lost
_SMOOTH = 0.02  # sample periods: the least jitter that a residual is compared with
_OUTLIER = 12.0  # nats: what one stamp costs at most, so that a stalled host is no loss
_LOSS = 5.0  # nats: log prior odds against a loss between two samples (one in 150)
_MEMORY = 100  # samples over which the offset and the period of the grid are followed
_FIRST_MEMORY = 20  # samples, at the start
_SPANS = (8, 32)  # samples over which the period is measured, the scatter of single steps being large
_MOST_RATE = 5e-3  # how far the period may be from that
_KEPT = 10  # numbers of lost samples that are considered at a time
_FAR = 200.0  # nats behind the best at which a number of lost samples is given up


@dataclass(frozen=True)
class TimeGrid:
    """Samples of a recording on a uniform grid.

    Parameters
    ----------
    place : ndarray of int, shape (m,)
        Place of each sample on the grid; the first is 0.
    start : float
        Time of the first place, s.
    period : float
        Sample period, s.
    jitter : float
        Rms of the time stamps about the grid, s; 0 where they show none.
    """

    place: NDArray[np.intp]
    start: float
    period: float
    jitter: float = 0.0

    @property
    def size(self) -> int:
        """Number of places, n: samples there and lost."""
        return int(self.place[-1]) + 1

    @property
    def t(self) -> NDArray[np.float64]:
        """Times of the grid, shape (n,), s, lost samples included."""
        return np.asarray(self.start + self.period * np.arange(self.size))

    @property
    def lost(self) -> int:
        """Number of samples missing."""
        return self.size - len(self.place)

    @property
    def longest_gap(self) -> float:
        """Longest step between two samples on the grid, s."""
        return float(np.diff(self.place).max(initial=1) * self.period)


def time_grid(t_s: NDArray[np.float64]) -> TimeGrid:
    """Put time stamps (m,), s, strictly increasing, on the uniform grid that they were sampled on."""
    steps = np.diff(t_s)
    period = float(np.median(steps))
    apart = np.maximum(1, np.rint(steps / period).astype(int))
    if (apart > 1).any() and steps.min() < _EARLY * period:
        apart = _apart(steps / _period(t_s, period))
    place = np.concatenate([[0], np.cumsum(apart)])
    step, start = (float(one) for one in np.polyfit(place, t_s - t_s[0], 1))
    late = t_s - t_s[0] - start - step * place
    jitter = float(np.std(late - uniform_filter1d(late, _MEMORY)))  # a clock that varies slowly makes no jitter
    if steps.min() >= _EARLY * period:
        # The median step carries the rounding of the time stamps; the ends do not.
        ends = float(t_s[-1] - t_s[0]) / float(place[-1])
        return TimeGrid(place, float(t_s[0]), ends, jitter if jitter > _SMOOTH * period else 0.0)
    return TimeGrid(place, float(t_s[0]) + start, step, jitter)


@dataclass(frozen=True)
class _Loss:
    """A number of samples lost after a sample, and the loss before it."""

    after: int
    count: int
    before: _Loss | None


@dataclass(frozen=True)
class _Path:
    """One number of samples lost so far, with the grid that goes with it.

    ``phase`` and ``rate`` are where the grid is behind the stamps, and by how much more per sample, in sample periods;
    ``cost`` in nats; ``losses`` the last loss before.
    """

    phase: float
    rate: float
    cost: float
    losses: _Loss | None


def _period(t_s: NDArray[np.float64], period: float) -> float:
    """Return the sample period, s, from the rough one, over longer and longer spans."""
    for span in _SPANS:
        over = t_s[span:] - t_s[:-span]
        if len(over):
            period = float(np.median(over / np.maximum(np.rint(over / period), 1.0)))
    return period


def _apart(steps: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return how many places lie between samples, shape (m − 1,), from their steps in sample periods.

    The likeliest sequence of losses for stamps that scatter about a grid whose period is slowly followed: a beam search
    over the number of samples lost so far, with a bounded cost per stamp.
    """
    scatter = steps - np.maximum(1.0, np.rint(steps))
    spread = max(1.4826 * float(np.median(np.abs(scatter - np.median(scatter)))) / np.sqrt(2.0), _SMOOTH)
    paths = {0: _Path(0.0, 0.0, 0.0, None)}
    for index, step in enumerate(steps):
        memory = min(index + _FIRST_MEMORY, _MEMORY)
        gain, drift = 2.0 / memory, 1.0 / memory**2
        wanted: dict[int, _Path] = {}
        for lost, path in paths.items():
            # A stamp's error counts from the grid, not from the stamp before: `phase` is the error of that one.
            ahead = path.phase + step - 1.0 - path.rate
            for more in {0, max(round(ahead), 0)}:
                error = ahead - more
                cost = path.cost + min(0.5 * (error / spread) ** 2, _OUTLIER) + (_LOSS if more else 0.0)
                total = lost + more
                if total in wanted and wanted[total].cost <= cost:
                    continue
                # An outlier moves the grid no further than the spread would.
                limited = min(max(error, -3.0 * spread), 3.0 * spread)
                rate = min(max(path.rate + drift * limited, -_MOST_RATE), _MOST_RATE)
                losses = _Loss(index, more, path.losses) if more else path.losses
                wanted[total] = _Path(error - gain * limited, rate, cost, losses)
        best = min(path.cost for path in wanted.values())
        near = sorted((one for one in wanted.items() if one[1].cost < best + _FAR), key=lambda one: one[1].cost)
        paths = dict(near[:_KEPT])
    apart = np.ones(len(steps), dtype=np.intp)
    likeliest = min(paths.values(), key=lambda path: path.cost)
    # Where stamps scatter by half a period the search may lose its way; a whole line through all of them does not.
    count = np.arange(len(steps) + 1)
    stamps = np.concatenate([[0.0], np.cumsum(steps)])
    errors = stamps - np.polyval(np.polyfit(count, stamps, 1), count)
    if np.minimum(0.5 * (errors / spread) ** 2, _OUTLIER).sum() <= likeliest.cost:
        return apart
    last = likeliest.losses
    while last is not None:
        apart[last.after] += last.count
        last = last.before
    return apart
