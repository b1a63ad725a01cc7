"""What is odd about the accelerations of an unknown file: corrupt or missing values, rails, dead and noisy channels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["oddities"]

_NOISY = 3.0  # times the median noise of the channels of its kind
_PILE = 0.002  # of the samples, at an extreme, from which it is a rail
_LEAST_PILE = 8  # samples
_PILE_WIDTH = 12.0  # counts: an ADC that overshoots piles up beside the rail, too
_AT_ONE = 0.75  # of the samples near an extreme, that are at one count on a rail
_LEAST_VALUES = 50  # of a channel that moves
_CORRUPT = 1e6  # times the median size


def oddities(columns: dict[str, NDArray[np.float64]]) -> list[str]:
    """Return what is odd about accelerations: corrupt or missing values, rails, constant and noisy channels."""
    found, noise = [], {}
    for name, values in columns.items():
        known = values[np.isfinite(values)]
        if len(known) < _LEAST_PILE:
            found.append(f"{name} has no readings")
            continue
        size = float(np.median(np.abs(known))) or 1.0
        corrupt = np.abs(known) > _CORRUPT * size
        if corrupt.any():
            found.append(f"{name}: {int(corrupt.sum())} values that can be no reading, up to {np.abs(known).max():.3g}")
            known = known[~corrupt]
        if len(known) < len(values) - int(corrupt.sum()):
            found.append(f"{name}: {len(values) - len(known) - int(corrupt.sum())} of {len(values)} cells are empty")
        if known.min() == known.max():
            found.append(f"{name} reads {known[0]:g} throughout")
            continue
        found += _rails(name, known)
        noise[name] = float(np.median(np.abs(np.diff(known, 2)))) / (0.6745 * 6.0**0.5)
    usual = float(np.median(list(noise.values()))) if noise else 0.0
    for name, level in noise.items():
        if usual > 0.0 and level > _NOISY * usual:
            found.append(
                f"{name} is noisy: {level:.3g} per sample, {level / usual:.2g} times the median of the channels"
            )
    return found


def _rails(name: str, known: NDArray[np.float64]) -> list[str]:
    """Return the rails of a channel: values that pile up within a few counts of an extreme."""
    values = np.unique(known)
    if len(values) < _LEAST_VALUES:
        return []
    count = float(np.min(np.diff(values)))
    found = []
    for side, extreme in (("most", values[-1]), ("least", values[0])):
        near = np.abs(known - extreme) <= _PILE_WIDTH * count
        edge, counts = np.unique(known[near], return_counts=True)
        pile = edge[int(np.argmax(counts))]
        beside = np.abs(known - extreme) <= 3.0 * _PILE_WIDTH * count
        piled = int(np.sum(np.abs(known - pile) <= count))
        others = int(beside.sum() - near.sum())
        # Noise spreads a level that is held over several counts; a rail holds all but a few at one.
        at_one = float(counts.max()) / max(int(near.sum()), 1)
        if piled >= max(_PILE * len(known), _LEAST_PILE) and piled > 3 * max(others, 1) and at_one > _AT_ONE:
            found.append(f"{name}: {int(near.sum())} samples at its rail, {side} {pile:g} (clipped)")
    return found
