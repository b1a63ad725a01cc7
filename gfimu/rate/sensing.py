"""What the rate estimators know about the errors of the sensors: from data sheets, or as a calibration leaves them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.part import white_noise_std
from gfimu.array.parts.part_file import PartFile
from gfimu.base.errors import InputError
from gfimu.base.short_repr import short_repr

__all__ = ["SensorErrors", "calibrated_bias_std", "step_of_readings"]

_LARGEST = 1e6  # numerical: m/s², far beyond any part
_LEAST_NOISE_LSB = 0.3  # LSB: below that equal readings prove nothing
_FOR_STEP = 20_000  # numerical: samples in which the step of the readings is looked for
_EQUAL_READINGS = 1e-7  # probability per sample at which equal readings count as a stuck channel


@dataclass(frozen=True)
class SensorErrors:
    """Errors of the sensors of an array that an estimator takes into account.

    Parameters
    ----------
    noise_std : ndarray, shape (c,)
        White noise of each channel per sample, m/s².
    bias_std : ndarray, shape (c,)
        Uncertainty of the constant bias of each channel before the run, m/s².
    scale_std : float
        Uncertainty of the scale factors, a ratio (0.01 is 1 %).
    axis_std : float
        Uncertainty of the directions of the channels, each by itself, rad.
    rotation_std : float
        Uncertainty of the direction of all chips together against the drawing, rad: what poses of a calibration can't
        see.
    placement_std : float
        Uncertainty of the positions, m.
    timing_std : float
        How far a channel's sampling times are from the stated ones, independently from sample to sample, s.
    full_range : ndarray, shape (c,)
        Readings at or beyond ± this are saturated, m/s².
    coarse_step : float
        Step of the readings where it is coarse beside the noise, m/s²; 0 where it is not.
    stuck_after : int
        So many equal readings in a row mean that a channel is stuck; 0 switches the check off.
    gyro_noise_std : float
        White noise of a gyro axis per sample, rad/s.
    gyro_bias_std : float
        Uncertainty of the constant bias of a gyro axis before the run, rad/s.

    Examples
    --------
    >>> import gfimu
    >>> errors = gfimu.SensorErrors.from_parts(gfimu.AccelerometerArray.load("cube12"), 100.0)
    >>> errors.noise_std.round(4)[:3]
    array([0.0307, 0.0307, 0.0435])
    """

    noise_std: NDArray[np.float64]
    bias_std: NDArray[np.float64]
    scale_std: float = 0.0
    axis_std: float = 0.0
    rotation_std: float = 0.0
    placement_std: float = 0.0
    timing_std: float = 0.0
    full_range: NDArray[np.float64] | None = None
    coarse_step: float = 0.0
    stuck_after: int = 0
    gyro_noise_std: float = 0.005
    gyro_bias_std: float = 0.35

    __repr__ = short_repr

    def __post_init__(self) -> None:
        for name in ("noise_std", "bias_std"):
            value = getattr(self, name)
            if value.ndim != 1 or not np.all(value <= _LARGEST) or np.any(value < 0):
                raise InputError(f"{name} must hold one number per channel, none negative or above {_LARGEST:g} m/s²")
        if np.any(self.noise_std <= 0):
            raise InputError("noise_std must be positive for every channel; a real sensor has noise, m/s²")
        for name in (
            "scale_std",
            "axis_std",
            "rotation_std",
            "placement_std",
            "timing_std",
            "coarse_step",
            "gyro_noise_std",
            "gyro_bias_std",
        ):
            if not 0 <= getattr(self, name) <= _LARGEST:
                raise InputError(f"{name} = {getattr(self, name)!r}: must be a number ≥ 0, at most {_LARGEST:g}")

    @classmethod
    def uniform(
        cls, array: AccelerometerArray, noise_std: ArrayLike, bias_std: ArrayLike = 0.0, **others: Any
    ) -> SensorErrors:
        """Build the same errors for all channels, or one number per channel; other fields by name."""
        c = array.n_channels
        try:
            noise = np.array(np.broadcast_to(np.asarray(noise_std, dtype=float), (c,)))
            bias = np.array(np.broadcast_to(np.asarray(bias_std, dtype=float), (c,)))
        except ValueError:
            raise InputError(f"noise_std and bias_std need one number, or {c}: one per channel") from None
        return cls(noise, bias, **others)

    @classmethod
    def from_parts(
        cls, array: AccelerometerArray, sample_rate: float, *, step: float = 0.0, **others: Any
    ) -> SensorErrors:
        """Take the errors from the data sheets of the array's parts (``models/parts``).

        White noise is the part's (`gfimu.array.parts.part.white_noise_std`), with the quantisation step's Δ²/12 added;
        bias is the typical deviation at switch-on. Other fields by name; ``noise_std`` is the white part. ``step``,
        m/s², is that of the readings, where it is coarser than the parts'.

        Raises
        ------
        InputError
            If a part is unknown or its file lacks a figure.
        """
        bias, limit, steps = [], [], []
        rms = white_noise_std(array, sample_rate)
        for chip in array.chips:
            part = PartFile.load(chip.part, array.part_files, needs=("offset_std_m_s2", "full_range_m_s2"))
            lsb, axes = part.lsb_m_s2, len(chip.axes)
            bias.append(np.array(part.offset_std_m_s2)[:axes])
            limit.append(np.full(axes, np.array(part.full_range_m_s2) - lsb))
            steps.append(np.full(axes, lsb))
        each = np.maximum(np.concatenate(steps), step)
        noise = [np.sqrt(rms**2 + each**2 / 12.0)]
        stuck = _equal_run(float((rms / each).min()))
        fields: dict[str, Any] = {
            "full_range": np.concatenate(limit),
            "stuck_after": stuck,
            "coarse_step": 0.0 if stuck else float(each.max()),
        } | others
        if "noise_std" in fields:
            white = np.broadcast_to(np.asarray(fields.pop("noise_std"), dtype=float), (array.n_channels,))
            noise = [np.sqrt(white**2 + each**2 / 12.0)]
        if "bias_std" in fields:
            bias = [np.broadcast_to(np.asarray(fields.pop("bias_std"), dtype=float), (array.n_channels,))]
        return cls(np.concatenate(noise), np.concatenate(bias), **fields)

    @classmethod
    def of_recording(
        cls,
        array: AccelerometerArray,
        metadata: Mapping[str, Any],
        sample_rate: float,
        *,
        step: float = 0.0,
        **others: Any,
    ) -> SensorErrors:
        """Take the errors that a recording's metadata state after a calibration, else those of the data sheets.

        A calibration states what it leaves of biases, gains, axes and positions. Directions that its poses left open
        are as uncertain as the parts' axes: those of each chip, or of all together their mean. Parameters are those of
        `from_parts`.
        """
        errors = cls.from_parts(array, sample_rate, step=step, **others)
        bias = calibrated_bias_std(metadata, array)
        if bias is None:
            return errors.with_part_gains(array)
        stated = metadata.get("calibration_std")
        left: Mapping[str, Any] = stated if isinstance(stated, Mapping) else {}
        scale, axis, place = (left.get(key, 0.0) for key in ("scale", "axis_rad", "placement_m"))
        if not all(isinstance(size, int | float) and 0.0 <= size <= _LARGEST for size in (scale, axis, place)):
            raise InputError(f"calibration_std in the recording's metadata is {left!r}; it holds numbers ≥ 0")
        turned = left.get("turned", "all")
        return replace(
            errors,
            bias_std=errors.bias_std if "bias_std" in others else bias,
            scale_std=scale,
            axis_std=float(np.hypot(axis, _turn_of_chips(array))) if turned == "each" else axis,
            rotation_std=_turn_of_chips(array) / np.sqrt(len(array.chips)) if turned == "all" else 0.0,
            placement_std=place,
        )

    def with_part_gains(self, array: AccelerometerArray) -> Self:
        """Return the errors of channels that were not calibrated: gains and axes as sure as the data sheets say."""
        parts = [PartFile.load(chip.part, array.part_files) for chip in array.chips]
        gain = max(part.sensitivity_std for part in parts)
        axis = max(float(np.hypot(part.cross_axis_std, part.misalignment_std_rad)) for part in parts)
        return replace(self, scale_std=max(self.scale_std, gain), axis_std=max(self.axis_std, axis))

    def of_channels(self, kept: NDArray[np.bool_]) -> Self:
        """Return the errors of the channels marked in ``kept`` (c,) alone."""
        limits = None if self.full_range is None else self.full_range[kept]
        return replace(self, noise_std=self.noise_std[kept], bias_std=self.bias_std[kept], full_range=limits)

    @property
    def gain_std(self) -> float:
        """Uncertainty of a reading in proportion to the specific force, along the channel and across."""
        return float(np.hypot(self.scale_std, self.axis_std))

    def noise_at_rest(self, noise_std: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the largest noise (c,) that channels of noise ``noise_std`` (c,), m/s², may have at rest.

        A channel that rests between two coarse steps reads either, with a variance of up to a fourth of the step²
        instead of a twelfth.
        """
        return np.asarray(np.sqrt(noise_std**2 + self.coarse_step**2 / 6.0))

    @property
    def limits(self) -> NDArray[np.float64]:
        """Saturation limit of each channel, shape (c,), m/s²; infinite where none is known."""
        return np.full(len(self.noise_std), np.inf) if self.full_range is None else np.asarray(self.full_range)


def _equal_run(noise_in_lsb: float) -> int:
    """Count equal readings in a row that noise of this size, rounded to whole LSB, hardly ever gives; 0 for no limit.

    At rest in the middle of a step that is coarse beside the noise, a channel reads the same for as long as it likes.
    """
    if noise_in_lsb < _LEAST_NOISE_LSB:
        return 0
    # Two readings round to the same count with a probability of about 1/(2 √π σ), σ in LSB (at most near 1).
    probability = min(0.9, 1.0 / (2.0 * np.sqrt(np.pi) * max(noise_in_lsb, 1e-3)))
    return int(np.ceil(np.log(_EQUAL_READINGS) / np.log(probability))) + 1


def _turn_of_chips(array: AccelerometerArray) -> float:
    """Return how far the axes of a chip together are turned against the drawing, rad, one standard deviation."""
    parts = [PartFile.load(chip.part, array.part_files) for chip in array.chips]
    squares = [part.misalignment_std_rad**2 + part.cross_axis_std**2 / 2.0 for part in parts]
    return float(np.sqrt(np.mean(squares)))


def calibrated_bias_std(metadata: Mapping[str, Any], array: AccelerometerArray) -> NDArray[np.float64] | None:
    """Return how exactly a calibration knows the biases of a recording's channels, shape (c,), m/s².

    None where the metadata state no calibration of every channel (``bias_std_m_s2``).
    """
    stated = metadata.get("bias_std_m_s2")
    values = [stated.get(name) for name in array.channels] if isinstance(stated, Mapping) else [None]
    if not all(isinstance(value, int | float) and 0.0 <= value <= _LARGEST for value in values):
        return None
    return np.array(values, dtype=float)


def step_of_readings(readings: NDArray[np.float64]) -> float:
    """Return the step of the readings (n, c), m/s²: the least difference of two values, the median of the channels."""
    steps = []
    for column in readings[:_FOR_STEP].T:
        values = np.unique(column[np.isfinite(column)])
        if len(values) > 1:
            steps.append(float(np.diff(values).min()))
    return float(np.median(steps)) if steps else 0.0
