"""Errors of an array's channels by the data sheets (``models/parts``): limits and typical figures."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.part import white_noise_std
from gfimu.array.parts.part_file import PartFile

__all__ = ["PartLimits"]

_DEFAULT_GAIN = 0.10  # ratio, where a part file has no ``sensitivity_limit``: that of the ADXL345
_STANDARD_DEVIATIONS = 4.0  # of the typical bias, where a part file has no ``offset_limit_m_s2``


@dataclass(frozen=True)
class PartLimits:
    """Errors by the data sheets, per channel: the largest, and typical standard deviations.

    Parameters
    ----------
    noise : ndarray, shape (c,)
        White noise of one sample with the rounding of its counts, standard deviation, m/s².
    bias : ndarray, shape (c,)
        Largest bias at switch-on, with the shift by another supply voltage that the part file lists, m/s².
    gain : ndarray, shape (c,)
        Largest error of the scale factor, a ratio.
    full_range : ndarray, shape (c,)
        Largest reading of the widest range, m/s².
    lsb : ndarray, shape (c,)
        Size of one count, m/s².
    gain_std, axis_std : ndarray, shape (c,)
        Typical deviation of the scale factor, a ratio, and of the sensing axis to each side, rad.
    bias_tempco : ndarray, shape (c,)
        Change of the bias with temperature, m/s² per K; zero where the data sheet has none.
    output_rate : tuple of float
        Slowest and fastest output data rate that all the parts have, Hz.
    """

    noise: NDArray[np.float64]
    bias: NDArray[np.float64]
    gain: NDArray[np.float64]
    full_range: NDArray[np.float64]
    lsb: NDArray[np.float64]
    gain_std: NDArray[np.float64]
    axis_std: NDArray[np.float64]
    bias_tempco: NDArray[np.float64]
    output_rate: tuple[float, float]

    @classmethod
    def of(cls, array: AccelerometerArray, sample_rate: float) -> PartLimits:
        """Read the limits of an array's parts; ``sample_rate`` in Hz sets the noise.

        Raises
        ------
        InputError
            If a part is unknown or its file lacks a figure.
        """
        parts = {
            name: PartFile.load(name, array.part_files, needs=("full_range_m_s2", "offset_std_m_s2"))
            for name in {chip.part for chip in array.chips}
        }
        of_channel = [(parts[chip.part], axis) for chip in array.chips for axis in range(len(chip.axes))]

        def per_part(figure: Callable[[PartFile], float]) -> NDArray[np.float64]:
            return np.array([figure(part) for part, _ in of_channel])

        steps = per_part(lambda part: part.lsb_m_s2)
        noise = np.sqrt(white_noise_std(array, sample_rate) ** 2 + steps**2 / 12.0)
        return cls(
            noise=noise,
            bias=np.array([_bias_limit(part, axis) for part, axis in of_channel]),
            gain=per_part(lambda part: _DEFAULT_GAIN if part.sensitivity_limit is None else part.sensitivity_limit),
            full_range=per_part(lambda part: part.full_range_m_s2 or np.inf),
            lsb=steps,
            gain_std=per_part(lambda part: part.sensitivity_std),
            axis_std=per_part(lambda part: math.hypot(part.cross_axis_std, part.misalignment_std_rad)),
            bias_tempco=np.array([part.offset_tempco_m_s2_K[axis] for part, axis in of_channel]),
            output_rate=(
                max(part.output_data_rate_min_hz for part in parts.values()),
                min(part.output_data_rate_max_hz for part in parts.values()),
            ),
        )


def _bias_limit(part: PartFile, axis: int) -> float:
    """Return the largest bias of a sensing axis, m/s²."""
    typical = part.offset_std_m_s2 or (0.0, 0.0, 0.0)
    limit = part.offset_limit_m_s2 or tuple(_STANDARD_DEVIATIONS * value for value in typical)
    shift = 0.0 if part.supply_3_3_V is None else abs(part.supply_3_3_V.offset_m_s2[axis])
    return limit[axis] + shift
