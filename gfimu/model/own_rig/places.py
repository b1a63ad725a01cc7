"""Sizes of an effect, and the places where it can occur: those that a chip, a channel or a sensing axis shares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray

__all__ = ["Pattern", "Size", "channel_patterns", "chip_patterns"]


@dataclass(frozen=True)
class Size:
    """One linear coordinate of an effect; the effect vanishes when all its sizes are zero.

    Parameters
    ----------
    key : str
        Name of the coordinate, ending in its unit where it has one.
    unit : str
        The unit as people read it, such as ``"m/s²"``; `gfimu.model.parameter_units.RATIO` for a small relative number.
    prior_std : float
        Size that would surprise nobody in the field, in that unit.
    positive : bool
        True where physics allows one sign only.
    step : float
        Finite-difference step as a share of ``prior_std``; large for effects that are not smooth in their size.
    most : float
        Largest size that physics allows, in that unit.
    bound : float
        Size beyond which a unit is not the one that was assumed (another array file, other axes, other units), in
        that unit: several times what the data sheet or the rig allows.
    """

    key: str
    unit: str
    prior_std: float
    positive: bool = False
    step: float = 1e-3
    most: float = np.inf
    bound: float = np.inf


@dataclass(frozen=True)
class Pattern:
    """Sizes that move together: one place or structure in which an effect can occur.

    Parameters
    ----------
    name : str
        For people, such as ``"channel a13"``, ``"chip a2"``, ``"all channels alike"``.
    mixing : ndarray, shape (m, k)
        The m sizes from k free ones.
    """

    name: str
    mixing: NDArray[np.float64]


def channel_patterns(array: AccelerometerArray) -> tuple[Pattern, ...]:
    """Patterns of one size per channel: all free, all alike, per chip, per sensing axis, single channels."""
    n = array.n_channels
    unit = np.eye(n)
    axis = np.concatenate([np.arange(len(chip.axes)) for chip in array.chips])
    patterns = [Pattern("all channels", unit)]
    patterns += [
        Pattern(f"chip {chip.name}", unit[:, array.chip_of_channel == k])
        for k, chip in enumerate(array.chips)
        if len(chip.axes) > 1
    ]
    if len(set(axis)) > 1:
        patterns += [Pattern(f"sensing axis {j + 1} of every chip", unit[:, axis == j]) for j in sorted(set(axis))]
    patterns += [Pattern(f"channel {name}", unit[:, [k]]) for k, name in enumerate(array.channels)]
    return tuple(patterns)


def chip_patterns(array: AccelerometerArray, per_chip: int) -> tuple[Pattern, ...]:
    """Patterns of ``per_chip`` sizes per chip: all free, or one chip."""
    unit = np.eye(per_chip * len(array.chips))
    patterns = [Pattern("all chips", unit)]
    patterns += [
        Pattern(f"chip {chip.name}", unit[:, per_chip * k : per_chip * (k + 1)]) for k, chip in enumerate(array.chips)
    ]
    return tuple(patterns)
