"""A calibrated triad as the formats of others see it: readings in m/s² by the nominal scale of a count, in a body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray, Chip
from gfimu.array.parts.part import Part
from gfimu.base.errors import InputError, unknown_name
from gfimu.calibration.error_model import free_elements
from gfimu.calibration.parameter_names import parameter_names
from gfimu.calibration.result import Calibration
from gfimu.sensor_noise import RecordingNoise

__all__ = ["CalibratedChip", "ChipNoise", "calibrated_chips", "number", "numbers", "text"]

_AT_HZ = 100.0  # Hz, rate for which data sheets of parts state their noise


@dataclass(frozen=True)
class ChipNoise:
    """White noise and random walk of a chip, the root mean square over its axes; gains of one per cent don't count.

    Parameters
    ----------
    density : float
        Standard deviation of a sample over the square root of the sample rate, m/s²/√Hz: N of the Allan deviation.
    walk : float or None
        K of the Allan deviation, m/s³/√Hz; its 95 % limit where none was found; None if unknown.
    rate_hz : float
        Sample rate it was found at, Hz.
    source : str
        Where it comes from.
    """

    density: float
    walk: float | None
    rate_hz: float
    source: str

    @property
    def std(self) -> float:
        """Standard deviation of one sample, m/s²."""
        return self.density * float(np.sqrt(self.rate_hz))


@dataclass(frozen=True)
class CalibratedChip:
    """One triad: z = M f + b, with z its readings in m/s² and f the specific force along the drawing's sensing axes.

    Parameters
    ----------
    chip : Chip
        Name, place (m, body frame; fitted where the calibration fitted it) and sensing axes (rows, body frame).
    scale : float
        Nominal size of a count, m/s², by which counts become z; 1 where the calibration is for m/s².
    sensitivity : ndarray, shape (3, 3)
        M, a ratio.
    bias : ndarray, shape (3,)
        b, m/s².
    covariance : ndarray, shape (12, 12)
        Of M row by row, then b; zero for the elements of M that its gauge fixes.
    position_covariance : ndarray, shape (3, 3), or None
        Of the place, m²; None where it is the drawing's.
    noise : ChipNoise or None
        Of its readings z.
    """

    chip: Chip
    scale: float
    sensitivity: NDArray[np.float64]
    bias: NDArray[np.float64]
    covariance: NDArray[np.float64]
    position_covariance: NDArray[np.float64] | None
    noise: ChipNoise | None


def calibrated_chips(
    calibration: Calibration,
    array: AccelerometerArray | None = None,
    *,
    lsb_m_s2: float | None = None,
    noise: RecordingNoise | None = None,
    chip: str | None = None,
) -> list[CalibratedChip]:
    """Return the triads of a calibration.

    Parameters
    ----------
    calibration : Calibration
        Of accelerometers.
    array : AccelerometerArray, optional
        Where the chips are, and their axes and parts; a single chip is taken to be at the origin, along the body axes.
    lsb_m_s2 : float, optional
        Size of a count by which the driver of the sensor makes m/s² of counts; by default that of the array's part.
    noise : RecordingNoise, optional
        Noise of the calibrated channels, m/s²; by default that of the array's part.
    chip : str, optional
        The one chip that is wanted.

    Raises
    ------
    InputError
        If it is the calibration of a gyro, has several chips and no array, or is for counts of unknown size.
    """
    if calibration.unit == "rad_s":
        raise InputError("the calibration is that of a gyro; only those of accelerometers are exported")
    wanted = calibration.chips if chip is None else (chip,)
    if chip is not None and chip not in calibration.chips:
        raise unknown_name("chip", chip, calibration.chips)
    if array is None and len(wanted) > 1:
        raise InputError("the calibration does not say where its chips are; give the array with --array, or one --chip")
    drawn = {} if array is None else {one.name: one for one in calibration.calibrated_array(array).chips}
    missing = [name for name in wanted if array is not None and name not in drawn]
    if missing:
        raise InputError(
            f"array {array.name if array else ''!r} has no chip {', '.join(missing)}; give the right array"
        )
    return [_chip(calibration, drawn.get(name), name, array, lsb_m_s2, noise) for name in wanted]


def _chip(
    calibration: Calibration,
    drawn: Chip | None,
    name: str,
    array: AccelerometerArray | None,
    lsb_m_s2: float | None,
    noise: RecordingNoise | None,
) -> CalibratedChip:
    chip = drawn if drawn is not None else Chip(name, np.zeros(3), np.eye(3))
    if chip.axes.shape != (3, 3) or np.abs(chip.axes @ chip.axes.T - np.eye(3)).max() > 1e-6:
        raise InputError(f"chip {name} has not three axes at right angles, as this format needs")
    files: Mapping[str, str] | None = None if array is None else array.part_files
    part = None if array is None else Part.load(chip.part, files)
    scale = 1.0
    if calibration.unit == "lsb":
        scale = float("nan") if part is None else part.lsb
        scale = scale if lsb_m_s2 is None else lsb_m_s2
        if not 0.0 < scale < np.inf:
            raise InputError(
                "the calibration is for raw counts, and the format for m/s²: give the size of a count, by which the "
                "sensor's driver makes m/s² of counts, with --lsb-m-s2, or an array whose parts state it"
            )
    model = calibration.models[name]
    names = parameter_names(name, calibration.gauge)
    places = [calibration.names.index(one) for one in names]
    full = [3 * row + column for row, column in free_elements(calibration.gauge)] + [9, 10, 11]
    covariance = np.zeros((12, 12))
    covariance[np.ix_(full, full)] = scale**2 * calibration.covariance[np.ix_(places, places)]
    fitted = [f"{name}_r_{axis}" for axis in "xyz"]
    position_covariance = None
    if fitted[0] in calibration.names:
        at = [calibration.names.index(one) for one in fitted]
        position_covariance = calibration.covariance[np.ix_(at, at)]
    return CalibratedChip(
        chip,
        scale,
        scale * model.sensitivity,
        scale * model.bias,
        covariance,
        position_covariance,
        _noise(name, noise, part),
    )


def _noise(name: str, noise: RecordingNoise | None, part: Part | None) -> ChipNoise | None:
    """Return the noise of a chip as recorded, else by its data sheet."""
    if noise is not None:
        models = [model for channel, model in noise.accelerometers.items() if channel[:-1] == name]
        if not models:
            raise InputError(f"the recording of the noise has no channels of chip {name}; give one of this array")
        walks = [model["K"].value if model["K"].found else model["K"].high for model in models]
        found = all(model["K"].found for model in models)
        return ChipNoise(
            float(np.sqrt(np.mean([model["N"].value ** 2 for model in models]))),
            float(np.sqrt(np.mean(np.square(walks)))),
            noise.rate,
            f"Allan deviation over {noise.duration_s:.4g} s" + ("" if found else ", random walk: 95 % limit"),
        )
    if part is None:
        return None
    # A sample's standard deviation at 100 Hz: density times the root of the rate, not of half of it.
    density = float(np.sqrt(np.mean(part.noise_std_100_hz**2) / _AT_HZ))
    return ChipNoise(density, None, _AT_HZ, f"data sheet of {part.name}, at {_AT_HZ:g} Hz")


def number(value: float) -> str:
    """Return a number as every YAML parser reads it: YAML 1.1 takes 1e-05 for text, and 1.0e-05 for a number."""
    shortest = repr(float(value))
    mantissa, mark, exponent = shortest.partition("e")
    return f"{mantissa}.0e{exponent}" if mark and "." not in mantissa else shortest


def numbers(values: Sequence[float] | NDArray[np.float64]) -> str:
    """Return a list of numbers, or a list of such lists, in one line."""
    if np.ndim(values) == 2:
        return "[" + ", ".join(numbers(row) for row in np.asarray(values)) + "]"
    return "[" + ", ".join(number(value) for value in np.asarray(values, dtype=float)) + "]"


def text(value: str) -> str:
    """Return a text in double quotes."""
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ") + '"'
