"""Tolerances of an array: limits of machining, and standard deviations of chip errors from the data sheets."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.part import white_noise_std
from gfimu.array.parts.part_file import PartFile
from gfimu.base.declared import Declared, figure
from gfimu.base.errors import InputError
from gfimu.base.short_repr import short_repr

__all__ = ["CAUSES", "SHAPES", "ChipErrors", "Tolerances"]

Floats = NDArray[np.float64]

CAUSES = (
    "placement",
    "angles",
    "bias",
    "gain",
    "cross-axis",
    "nonlinearity",
    "temperature",
    "noise",
    "calibration",
)
"""What an error can come from; the last is the uncertainty of a calibration's own parameters."""

SHAPES: Mapping[str, float] = {"uniform": math.sqrt(3.0), "normal": 3.0}
"""Distributions of a machining error inside its limit, and the limit over the standard deviation of each."""

_LARGEST = {"placement_m": 1.0, "angle_rad": 1.0, "temperature_K": 500.0}  # numerical: beyond any array


@dataclass(frozen=True)
class ChipErrors:
    """Standard deviations of the errors of one channel of the chips; what is None is taken from the data sheets.

    Parameters
    ----------
    bias_m_s2 : float, optional
        Constant bias, m/s².
    gain : float, optional
        Relative error of the scale factor.
    cross_axis : float, optional
        Pick-up of each other axis of the same chip, a ratio: coupling and misalignment inside the chip.
    nonlinearity : float, optional
        Deviation from a straight line at full scale, relative to full scale.
    noise_m_s2_rthz : float, optional
        White noise, one-sided density, m/s²/√Hz.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.ChipErrors(bias_m_s2=0.05).bias_m_s2
    0.05
    """

    bias_m_s2: float | None = None
    gain: float | None = None
    cross_axis: float | None = None
    nonlinearity: float | None = None
    noise_m_s2_rthz: float | None = None

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value is not None and not 0.0 <= value <= 1e3:
                raise InputError(f"{name} is {value!r}: give a standard deviation of zero or above")


@dataclass(frozen=True)
class Tolerances(Declared):
    """Tolerances that were assumed of an array of c channels; lists are by channel.

    ``full_range`` is that of the channels, m/s²; ``from_data_sheet`` has fields of `ChipErrors`.
    """

    placement_m: Annotated[float, figure("Limit of each chip's position error along each axis.", "m")]
    angle_rad: Annotated[float, figure("Limit of each chip's rotation about each axis.", "rad")]
    shape: Annotated[str, figure("uniform (between the limits) or normal (limits are 3 σ).")]
    bias: Annotated[Floats, figure("Bias, 1 σ.", "m/s²", key="bias_std_m_s2")]
    gain: Annotated[Floats, figure("Relative gain error, 1 σ.", key="gain_std")]
    cross_axis: Annotated[Floats, figure("Pick-up of each other axis of the chip, 1 σ, a ratio.", key="cross_axis_std")]
    nonlinearity: Annotated[
        Floats,
        figure("Non-linearity at full scale, relative to it, 1 σ.", key="nonlinearity_full_scale_std"),
    ]
    noise: Annotated[Floats, figure("White noise per sample.", "m/s²", key="noise_std_m_s2")]
    full_range: Floats
    bias_tempco: Annotated[
        Floats, figure("Temperature coefficient of the bias, 1 σ.", "m/s²/K", key="bias_tempco_std_m_s2_K")
    ]
    gain_tempco: Annotated[Floats, figure("Temperature coefficient of the gain, 1 σ.", "1/K", key="gain_tempco_std_K")]
    temperature_K: Annotated[float, figure("Temperature of the run less that of the calibration, 25 °C.", "K")]
    from_data_sheet: Annotated[tuple[str, ...], figure("Which of these are the data sheets'.")] = field(default=())

    __repr__ = short_repr

    @classmethod
    def of(
        cls,
        array: AccelerometerArray,
        sample_rate: float,
        *,
        placement_m: float,
        angle_rad: float,
        shape: str = "uniform",
        chip: ChipErrors | None = None,
        temperature_K: float = 0.0,
    ) -> Tolerances:
        """Take the errors of the chips from the data sheets, where ``chip`` does not state them.

        Raises
        ------
        InputError
            If a tolerance is negative or no number, or a part is unknown or lacks a figure.
        """
        for name, value in (("placement_m", placement_m), ("angle_rad", angle_rad), ("temperature_K", temperature_K)):
            if not 0.0 <= value <= _LARGEST[name]:
                raise InputError(f"{name} is {value!r}: give a number of 0 to {_LARGEST[name]:g}")
        if shape not in SHAPES:
            raise InputError(f"unknown shape {shape!r}; valid: {', '.join(SHAPES)}")
        stated = chip or ChipErrors()
        parts = {
            one.part: PartFile.load(one.part, array.part_files, needs=("offset_std_m_s2", "full_range_m_s2"))
            for one in array.chips
        }
        of_channel = [(parts[one.part], axis) for one in array.chips for axis in range(len(one.axes))]

        def figure(given: float | None, sheet: list[float]) -> Floats:
            return np.array(sheet, dtype=float) if given is None else np.full(array.n_channels, given)

        density = stated.noise_m_s2_rthz
        noise = white_noise_std(array, sample_rate)
        if density is not None:  # white up to half the output data rate
            noise = density * np.sqrt(array.output_data_rates(sample_rate) / 2.0)
        return cls(
            placement_m=placement_m,
            angle_rad=angle_rad,
            shape=shape,
            bias=figure(stated.bias_m_s2, [(part.offset_std_m_s2 or (0.0,) * 3)[axis] for part, axis in of_channel]),
            gain=figure(stated.gain, [part.sensitivity_std for part, _ in of_channel]),
            noise=noise,
            cross_axis=figure(
                stated.cross_axis,
                [math.hypot(part.cross_axis_std, part.misalignment_std_rad) for part, _ in of_channel],
            ),
            nonlinearity=figure(stated.nonlinearity, [part.nonlinearity_full_scale for part, _ in of_channel]),
            full_range=np.array([part.full_range_m_s2 or np.inf for part, _ in of_channel]),
            bias_tempco=np.array([part.offset_tempco_m_s2_K[axis] for part, axis in of_channel]),
            gain_tempco=np.array([part.sensitivity_tempco_K for part, _ in of_channel]),
            temperature_K=temperature_K,
            from_data_sheet=tuple(name for name, value in vars(stated).items() if value is None),
        )

    @property
    def placement_std(self) -> float:
        """Standard deviation of the position error of a chip along one axis, m."""
        return self.placement_m / SHAPES[self.shape]

    @property
    def angle_std(self) -> float:
        """Standard deviation of the rotation of a chip about one axis, rad."""
        return self.angle_rad / SHAPES[self.shape]

    @property
    def quadratic(self) -> Floats:
        """Standard deviation of the quadratic coefficient of each channel's reading, shape (c,), s²/m."""
        return self.nonlinearity / self.full_range
