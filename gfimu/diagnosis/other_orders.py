"""Whether a torque ripple is locked to the table's angle, or whether a motion that was asked for passes for one.

The drive is known to be smooth, and not what it was told to be: of a table that swings, say, any function of the angle
explains a part as a ripple does. Orders between the whole ones, which nothing on a shaft has, tell how much.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gfimu.diagnosis.causes import Cause, Signature, effects_of_run
from gfimu.diagnosis.fit import Fit, segments_at
from gfimu.diagnosis.segment import Segment
from gfimu.diagnosis.signatures import signature_columns
from gfimu.world_model import Effect

__all__ = ["is_ripple", "power_at_other_orders"]

_APART = (-1.5, -0.5, 0.5, 1.5)  # of a revolution's harmonics, from the order in question


def is_ripple(cause: Cause) -> bool:
    """Tell whether a cause moves the table by a torque that is locked to its angle."""
    return cause.family.place == "motion" and "order" in cause.shape


def power_at_other_orders(
    segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]], ripple: Cause
) -> float:
    """Return the most misfit that a ripple at an order between the whole ones takes off.

    Parameters
    ----------
    segments : sequence of Segment
        The data.
    fit : Fit
        The other causes, refined without the ripple.
    fixed : sequence of sequence of Effect
        Effects known beforehand, per segment.
    ripple : Cause
        The ripple in question, whose neighbours are looked at.
    """
    orders = [ripple.shape["order"] + apart for apart in _APART if ripple.shape["order"] + apart > 0.0]
    columns = np.arange(len(orders) * len(ripple.mixing)).reshape(len(orders), -1)
    others = [
        Signature(ripple.family, {**ripple.shape, "order": order}, places)
        for order, places in zip(orders, columns, strict=True)
    ]
    gram, score = np.zeros((columns.size, columns.size)), np.zeros(columns.size)
    for segment, known in zip(segments_at(segments, fit), fixed, strict=True):
        line = segment.linearise([*known, *effects_of_run(fit.causes, segment.model.array, segment.index)])
        changes, _ = signature_columns(segment, others, fit.causes, known, line.prediction)
        part, part_score, _ = segment.whitened_products(line, changes)
        gram, score = gram + part, score + part_score
    return max(
        float(score[places] @ np.linalg.lstsq(gram[np.ix_(places, places)], score[places], rcond=None)[0])
        for places in columns
    )
