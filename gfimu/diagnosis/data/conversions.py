"""When the chips of a run converted, where their marks alone do not say: by what their readings say of the motion."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.data.time_grid import TimeGrid
from gfimu.recording import Recording
from gfimu.recording.timing.conversion_times import conversion_times
from gfimu.short_repr import short_repr

if TYPE_CHECKING:
    from gfimu.diagnosis.data.run import Run

__all__ = ["Conversions", "settled"]


@dataclass(frozen=True)
class Conversions:
    """When k chips converted the samples of a run.

    Parameters
    ----------
    after : ndarray, shape (n, k)
        How long after its sample each chip converted its reading, s; negative before it.
    unknown : ndarray, shape (2, n, k)
        What one standard deviation of a chip's phase, and one of its rate, would add, s.
    """

    after: NDArray[np.float64]
    unknown: NDArray[np.float64]

    JUMP: ClassVar[float] = 0.1
    """Share of a sample period by which an age differs from the row before where it begins anew."""

    __repr__ = short_repr

    @classmethod
    def of(cls, recording: Recording, grid: TimeGrid, chips: int) -> Conversions | None:
        """Return those of a recording on its grid; None where it does not say when its chips convert."""
        found = conversion_times(recording, chips)
        if found is None:
            return None
        after, unknown = np.zeros((grid.size, chips)), np.zeros((2, grid.size, chips))
        after[grid.place] = found.times - grid.t[grid.place, None]
        unknown[:, grid.place] = found.unknown
        return cls(after, unknown)

    def rows(self, part: slice) -> Conversions:
        """Return those of some samples."""
        return Conversions(self.after[part], self.unknown[:, part])


def settled(run: Run, prediction: NDArray[np.float64], chip: NDArray[np.intp], rate: NDArray[np.float64]) -> Run:
    """Return a run whose chips converted when their readings agree best with a prediction.

    Only what the marks leave open is estimated, with its prior, and against the chips whose times are known: a lag that
    all share is not taken away. Of each channel's residual a constant and what depends on rate, its square and its
    derivative are left out: these are what wrong biases, gains and positions leave.

    Parameters
    ----------
    run : Run
        The run.
    prediction : ndarray, shape (n, c)
        What the simulation predicts for it, m/s².
    chip : ndarray of int, shape (c,)
        Chip of each channel.
    rate : ndarray, shape (n,)
        Rate of the table, rad/s.
    """
    times = run.conversions
    if times is None or not times.unknown.any():
        return run
    columns = [(mode, k) for mode in range(2) for k in range(times.after.shape[1]) if times.unknown[mode, :, k].any()]
    slopes = np.gradient(prediction, run.sample_period, axis=0)
    other = np.column_stack([np.ones(len(rate)), rate, rate**2, np.gradient(rate, run.sample_period)])
    normal, right = np.diag([0.0, *[1.0] * len(columns)]), np.zeros(len(columns) + 1)
    for channel, k in enumerate(chip):
        jump = np.abs(np.diff(times.after[:, k], prepend=times.after[0, k])) > Conversions.JUMP * run.sample_period
        used = run.valid[:, channel] & ~(jump | np.roll(jump, -1))
        slope = slopes[used, channel]
        mine = np.column_stack([slope, *(slope * times.unknown[mode, used, k] * (k == of) for mode, of in columns)])
        both = np.column_stack([mine, (run.readings - prediction)[used, channel]])
        both -= other[used] @ np.linalg.lstsq(other[used], both, rcond=None)[0]
        weighted = both / max(float(np.std(both[:, -1])), np.finfo(float).tiny)
        normal += weighted[:, :-1].T @ weighted[:, :-1]
        right += weighted[:, :-1].T @ weighted[:, -1]
    sizes = np.linalg.lstsq(normal, right, rcond=None)[0][1:]
    after = times.after.copy()
    for (mode, k), size in zip(columns, sizes, strict=True):
        after[:, k] += size * times.unknown[mode, :, k]
    return replace(run, conversions=replace(times, after=after, unknown=np.zeros_like(times.unknown)))
