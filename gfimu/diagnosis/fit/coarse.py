"""A linearised stretch on averages of neighbouring rows, for what is slower than these: the same equations, shorter.

Rows are averaged within the blocks of the derivative by the drive and multiplied by the root of their number, so that
white noise keeps its level.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.fit.posterior import Posterior, posterior_of
from gfimu.diagnosis.terms.columns import Columns
from gfimu.diagnosis.terms.slow_modes import SlowModes, WeighedModes

__all__ = ["WHOLE", "Rows", "coarse"]

_Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Rows:
    """Groups of neighbouring rows: the first row of each, and how many it has; none where rows stay as they are."""

    starts: NDArray[np.intp]
    sizes: NDArray[np.intp]

    def means(self, values: _Floats) -> _Floats:
        """Return the mean of the rows (n, …) of each group."""
        if not len(self.starts):
            return values
        sums = np.add.reduceat(values, self.starts, axis=0)
        return np.asarray(sums / self.sizes.reshape(-1, *[1] * (values.ndim - 1)))

    def averaged(self, values: _Floats) -> _Floats:
        """Return rows (n, …) averaged in each group, times the root of its size."""
        return self.means(values) * self.roots.reshape(-1, *[1] * (values.ndim - 1))

    @property
    def roots(self) -> _Floats:
        """Root of the number of rows of each group, (m,); one where rows stay as they are."""
        return np.sqrt(self.sizes) if len(self.sizes) else np.ones(1)

    def of_columns(self, columns: Columns) -> Columns:
        """Return columns on the averaged rows."""
        return replace(columns, parts=tuple(map(self.averaged, columns.parts))) if len(self.starts) else columns


WHOLE = Rows(np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp))
"""Rows as they are. Numerical: no groups."""


class _AveragedModes(SlowModes):
    """The modes of slow noise on averaged rows."""

    def __init__(self, modes: SlowModes, rows: Rows) -> None:
        self._whole, self._rows = modes, rows

    @cached_property
    def share(self) -> _Floats:
        """s, shape (K, c + 1)."""
        return self._whole.share

    @cached_property
    def cosines(self) -> _Floats:
        """The cosines, shape (n, K)."""
        return self._rows.averaged(self._whole.cosines)


def coarse(posterior: Posterior, most: int) -> tuple[Posterior, Rows]:
    """Return a posterior on averages of up to ``most`` rows, and the groups that these are of.

    Where rounding weighs each sample by itself the rows stay as they are.
    """
    seen, jacobian = posterior.observed, posterior.jacobian
    if most < 2 or isinstance(seen.modes, WeighedModes):
        return posterior, WHOLE
    starts, blocks, done = [], [], 0
    for span, at, block in jacobian.blocks:
        mine = np.arange(span.start, span.stop, most)
        own = Rows(mine - span.start, np.diff(mine, append=span.stop))
        averaged = own.averaged(np.moveaxis(block, 1, 0))
        blocks.append((slice(done, done + len(mine)), at, np.moveaxis(averaged, 0, 1)))
        starts.append(mine)
        done += len(mine)
    first = np.concatenate(starts)
    rows = Rows(first, np.diff(first, append=len(seen.residual)))
    short = replace(
        seen,
        residual=rows.averaged(seen.residual),
        weight=rows.means(seen.weight),
        modes=_AveragedModes(seen.modes, rows),
    )
    return posterior_of(short, replace(jacobian, blocks=tuple(blocks)), posterior.drive), rows
