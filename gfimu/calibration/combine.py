"""Calibrations of several chips, made one by one, as the calibration of an array."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gfimu.base.errors import InputError
from gfimu.calibration.result import Calibration

__all__ = ["combine"]


def combine(calibrations: Sequence[Calibration]) -> Calibration:
    """Join independent calibrations of several chips into one; their covariance is block-diagonal.

    Raises
    ------
    InputError
        If they differ in method, unit, gauge or gravity.
    """
    first = calibrations[0]
    if len(calibrations) == 1:
        return first
    for other in calibrations[1:]:
        if (other.method, other.unit, other.gauge, other.gravity) != (
            first.method,
            first.unit,
            first.gauge,
            first.gravity,
        ):
            raise InputError("calibrations of different method, unit, gauge or gravity can't be joined")
    sizes = [len(item.names) for item in calibrations]
    ends = np.cumsum(sizes)
    covariance = np.zeros((ends[-1], ends[-1]))
    null_space = np.zeros((ends[-1], sum(item.null_space.shape[1] for item in calibrations)))
    column = 0
    for item, end, size in zip(calibrations, ends, sizes, strict=True):
        block = slice(end - size, end)
        covariance[block, block] = item.covariance
        null_space[block, column : column + item.null_space.shape[1]] = item.null_space
        column += item.null_space.shape[1]
    statistics: dict[str, float | str] = {}
    for item in calibrations:
        statistics |= {f"{item.chips[0]}_{key}": value for key, value in item.statistics.items()}
    return replace(
        first,
        channels=tuple(channel for item in calibrations for channel in item.channels),
        names=tuple(name for item in calibrations for name in item.names),
        values=np.concatenate([item.values for item in calibrations]),
        covariance=covariance,
        null_space=null_space,
        statements=_merged({item.chips[0]: item.statements for item in calibrations}),
        warnings=_merged({item.chips[0]: item.warnings for item in calibrations}),
        statistics=statistics,
    )


def _merged(texts: Mapping[str, tuple[str, ...]]) -> tuple[str, ...]:
    """Join the sentences of several chips: once where all say the same, else with the chip's name."""
    groups = list(texts.values())
    return tuple(
        dict.fromkeys(
            text if all(text in group for group in groups) else f"{chip}: {text}"
            for chip, group in texts.items()
            for text in group
        )
    )
