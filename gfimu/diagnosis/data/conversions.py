"""When the chips of a run converted, as their marks say."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gfimu.base.short_repr import short_repr
from gfimu.diagnosis.data.time_grid import TimeGrid
from gfimu.recording import Recording
from gfimu.recording.timing.conversion_times import conversion_times

__all__ = ["Conversions"]


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
