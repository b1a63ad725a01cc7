"""Signatures of faults from several onsets: begun, thinned out, carried to the next block, and compared.

Equation (3) is that of `gfimu.integrity.recursion.steps`. The slots in use are the first ones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.integrity.recursion.isolation import deflate, strongest
from gfimu.integrity.recursion.state import MonitorState, MonitorTuning

__all__ = ["carry_signatures", "new_slot", "strongest_slot"]

_LARGEST = 1e12  # numerical: statistics of a filter that has run away


def new_slot(state: MonitorState, oldest: float) -> None:
    """Begin an onset with this block; of too many the one goes whose neighbours are nearest, on a scale of log age."""
    ages = state.ages
    used = np.count_nonzero(ages)
    if used == len(ages):
        younger = np.append(ages[2:], 0.0)
        gaps = np.concatenate([[1e8 if ages[0] < oldest else -1.0], (ages[:-1] - younger) / (ages[1:] + 1.0)])
        drop = int(np.argmin(gaps))
        used -= 1
        for part in (ages, state.signature, state.information, state.score):
            part[drop:used] = part[drop + 1 :].copy()
    for part in (state.signature, state.information, state.score):
        part[used] = 0.0
    ages[used] = 0.5  # half of the step before lies behind the onset; set to 1 after this block


def carry_signatures(state: MonitorState, transition: NDArray[np.float64], gain: NDArray[np.float64]) -> None:
    """Carry the effect of every fault on the state over to this block, (3), with Φ_ω (3, 3) and T A (3, c)."""
    used = np.count_nonzero(state.ages)
    new = state.ages[:used] == 0.5
    g = state.signature[:used]
    g[:, :3] = transition @ g[:, :3] + gain - gain @ g[:, 3:]
    g[new, :3] = 0.5 * gain
    state.ages[:used] = np.where(new, 1.0, state.ages[:used] + 1.0)


def strongest_slot(
    state: MonitorState, tuning: MonitorTuning, model_std: NDArray[np.float64], watched: NDArray[np.bool_]
) -> int:
    """Return the slot in which a channel exceeds the threshold most, beyond what model errors explain; −1 if none."""
    raw = strongest(state.information, state.score, watched)  # (slots,)
    slots = np.flatnonzero((state.ages >= 2.0) & (raw > tuning.screen * tuning.threshold) & (raw < _LARGEST))
    if not slots.size:
        return -1
    values = strongest(*deflate(state.information[slots], state.score[slots], model_std), watched)
    state.largest[0] = max(state.largest[0], values.max())
    return int(slots[np.argmax(values)]) if values.max() > tuning.threshold else -1
