"""Residuals of stretches at a point of a fit, its drives held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gfimu.diagnosis.data.cosine_basis import NoiseLevels
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.linear import Point
from gfimu.diagnosis.fit.parallel import over_segments
from gfimu.diagnosis.terms.cause import effects_of
from gfimu.diagnosis.terms.drive import Drive
from gfimu.diagnosis.terms.observed import Observed, observe

__all__ = ["observed_at"]


def observed_at(stretches: Sequence[Stretch], point: Point) -> tuple[Observed, ...]:
    """Return the weighed residuals of every stretch; a residue of the calibration is at its most probable values."""

    def one(stretch: Stretch, drive: Drive, levels: NoiseLevels) -> Observed:
        effects = effects_of(point.causes, stretch.model.array, stretch.index)
        return observe(stretch, stretch.predict(effects, drive.spin), levels)

    seen = over_segments(one, stretches, point.drives, point.levels)
    if point.residue is None:
        return tuple(seen)
    columns = point.residue.columns
    grams, scores = zip(*(one.products(own) for one, own in zip(seen, columns, strict=True)), strict=True)
    sizes = np.linalg.solve(np.sum(grams, axis=0) + np.eye(columns[0].count), np.sum(scores, axis=0))
    return tuple(replace(one, residual=one.residual - own.times(sizes)) for one, own in zip(seen, columns, strict=True))
