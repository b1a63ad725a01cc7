"""What a good calibration leaves everywhere: small errors of every bias, gain, axis and position at once.

They are no cause but a nuisance parameter: their columns are integrated out with a Gaussian prior. How large they
usually are, each effect declares (`EffectFamily.tolerance`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.terms.cause import Cause
from gfimu.diagnosis.terms.columns import Columns
from gfimu.diagnosis.terms.drive import Drive
from gfimu.diagnosis.terms.library import family_columns
from gfimu.diagnosis.terms.observed import Observed
from gfimu.model.world_model import Effect, EffectFamily

__all__ = ["Residue"]


@dataclass(frozen=True)
class Residue:
    """Residue of a calibration, common to all stretches.

    Parameters
    ----------
    scale : float
        Its size in units of the tolerances.
    columns : tuple of Columns
        What its numbers add to each stretch, for one standard deviation of the prior each.
    """

    scale: float
    columns: tuple[Columns, ...]

    @classmethod
    def beside(
        cls,
        scale: float,
        stretches: Sequence[Stretch],
        seen: Sequence[Observed],
        drives: Sequence[Drive],
        causes: Sequence[Cause],
    ) -> Residue:
        """Linearise a residue about causes and drives."""
        columns = []
        for stretch, one, drive in zip(stretches, seen, drives, strict=True):
            parts = []
            for family in _families(stretch):
                part = family_columns(stretch, one, drive, causes, family, {})
                parts.append(part.scaled(np.full(part.count, scale * _tolerance(family, stretch.model.array))))
            columns.append(Columns.together(parts))
        return cls(scale, tuple(columns))

    @staticmethod
    def is_possible(stretch: Stretch) -> bool:
        """Whether the library has effects that a calibration leaves a residue of."""
        return bool(_families(stretch))

    def effects(self, stretch: Stretch, sizes: np.ndarray) -> tuple[Effect, ...]:
        """Return the effects that sizes (q,), in standard deviations, are."""
        array, found, place = stretch.model.array, [], 0
        for family in _families(stretch):
            count = len(family.sizes(array))
            values = self.scale * _std(family) * sizes[place : place + count]
            found.append(family.from_sizes(array, values, {}))
            place += count
        return tuple(found)


def _families(stretch: Stretch) -> list[EffectFamily]:
    return [family for family in stretch.model.families().values() if _std(family) > 0.0]


def _tolerance(family: EffectFamily, array: AccelerometerArray) -> float:
    """Return the standard deviation of the sizes in units of their prior."""
    return float(_std(family) / family.sizes(array)[0].prior_std)


def _std(family: EffectFamily) -> float:
    """Return what a good calibration leaves of each size of a family, in its unit; others need not say so."""
    return float(getattr(family, "tolerance", 0.0))
