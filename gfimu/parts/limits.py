"""Errors of an array's channels by the data sheets (``models/parts``): limits and typical figures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.errors import InputError
from gfimu.files.model_files import find_model, read_toml
from gfimu.geometry.array import AccelerometerArray
from gfimu.parts.part import white_noise_std

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
        bias, gain, full_range, lsb, gain_std, axis_std, tempco = [], [], [], [], [], [], []
        slowest, fastest = 0.0, np.inf
        for chip in array.chips:
            path = find_model("parts", chip.part)
            part, axes = read_toml(path), len(chip.axes)
            try:
                bias.append(_bias_limit(part)[:axes])
                gain.append(np.full(axes, float(part.get("sensitivity_limit", _DEFAULT_GAIN))))
                full_range.append(np.full(axes, float(part["full_range_m_s2"])))
                lsb.append(np.full(axes, float(part["lsb_m_s2"])))
                gain_std.append(np.full(axes, float(part.get("sensitivity_std", 0.0))))
                aslant = float(np.hypot(part.get("cross_axis_std", 0.0), part.get("misalignment_std_rad", 0.0)))
                axis_std.append(np.full(axes, aslant))
                tempco.append(np.asarray(part.get("offset_tempco_m_s2_K", np.zeros(3)), dtype=float)[:axes])
            except KeyError as error:
                raise InputError(f"{path}: key {error.args[0]!r} is missing; add it") from None
            slowest = max(slowest, float(part.get("output_data_rate_min_hz", 0.0)))
            fastest = min(fastest, float(part.get("output_data_rate_max_hz", np.inf)))
        steps = np.concatenate(lsb)
        noise = np.sqrt(white_noise_std(array, sample_rate) ** 2 + steps**2 / 12.0)
        return cls(
            noise=noise,
            bias=np.concatenate(bias),
            gain=np.concatenate(gain),
            full_range=np.concatenate(full_range),
            lsb=steps,
            gain_std=np.concatenate(gain_std),
            axis_std=np.concatenate(axis_std),
            bias_tempco=np.concatenate(tempco),
            output_rate=(slowest, fastest),
        )


def _bias_limit(part: dict[str, Any]) -> NDArray[np.float64]:
    """Return the largest bias of each axis, shape (3,), m/s²."""
    if "offset_limit_m_s2" in part:
        limit = np.asarray(part["offset_limit_m_s2"], dtype=float)
    else:
        limit = _STANDARD_DEVIATIONS * np.asarray(part["offset_std_m_s2"], dtype=float)
    supplies = [table for table in part.values() if isinstance(table, dict) and "offset_m_s2" in table]
    shifts = [np.abs(supply["offset_m_s2"]) for supply in supplies]
    return limit + np.max(shifts, axis=0, initial=0.0) if shifts else limit
