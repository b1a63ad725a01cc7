"""Measurements of the motion beside the readings: a gyro, a tachometer, a table's axis and encoder, positions.

A reference has values at every sample that are linear in the state of the filter, with white noise and with errors that
stay the same over a run, which the filter estimates with everything else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.base.errors import InputError
from gfimu.rate.filter_state import CHANGE, CONSTANT, RATE, ReferenceRows
from gfimu.rate.path import ANGLE, POSITION, TILT
from gfimu.rate.sensing import SensorErrors

__all__ = ["Measured", "Reference", "ReferencePolicy", "rows_of"]


@dataclass(frozen=True)
class ReferencePolicy:
    """How far references of a table or of positions are trusted.

    Parameters
    ----------
    gain_std : float
        Uncertainty of a tachometer's gain: that of a DC tachometer or of a pulse counter's clock and gear, 1 %.
    delay_std_s : float
        Uncertainty of the time at which a tachometer or an encoder was read, s: a sample of 100 Hz.
    axis_std : float
        Uncertainty of the direction of the axis in the body, rad: a degree of mounting.
    wobble_std : float
        Rate across the axis that bearings leave, rad/s.
    least_noise : float
        Least noise of a value, rad/s, rad or m: that of a good tachometer, a 16-bit encoder, optical tracking.
    unknown_offset : float
        Uncertainty of the offset of an encoder or of positions whose value at the first sample is missing, rad or m.
    """

    gain_std: float = 0.01
    delay_std_s: float = 0.01
    axis_std: float = 0.0175
    wobble_std: float = 0.01
    least_noise: float = 1e-4
    unknown_offset: float = 1e3


class _Error(NamedTuple):
    """A constant error of a reference: of which value, what it is multiplied by, and how large it may be."""

    value: int
    grows_with: int
    std: float


@dataclass(frozen=True)
class Reference:
    """What the values of a reference measure: ``weights`` · x[first : first + 3], with noise and errors.

    Parameters
    ----------
    name : str
        Name for messages.
    first : int
        Component of the filter's state that the first weight is of.
    weights : ndarray, shape (k, 3)
        Weights of each value.
    noise_std : float
        White noise of a value, in its unit.
    errors : tuple
        Its constant errors.
    """

    name: str
    first: int
    weights: NDArray[np.float64]
    noise_std: float
    errors: tuple[_Error, ...] = ()

    @classmethod
    def gyro(cls, errors: SensorErrors) -> Reference:
        """Return a gyro's three values, rad/s, each with a bias."""
        biases = tuple(_Error(axis, CONSTANT, errors.gyro_bias_std) for axis in range(3))
        return cls("gyro", 0, np.eye(3), errors.gyro_noise_std, biases)

    @classmethod
    def tachometer(cls, axis: ArrayLike, noise_std: float, policy: ReferencePolicy = ReferencePolicy()) -> Reference:
        """Return a rate about an axis (3,) of the body, rad/s, with an error of its gain and a delay."""
        errors = (_Error(0, RATE, policy.gain_std), _Error(0, CHANGE, policy.delay_std_s))
        return cls("tacho", 0, np.atleast_2d(np.asarray(axis, dtype=float)), noise_std, errors)

    @classmethod
    def fixed_axis(cls, axis: ArrayLike, policy: ReferencePolicy = ReferencePolicy()) -> Reference:
        """Return that the body turns about an axis (3,) of its own only: two values that are zero, rad/s."""
        across = np.linalg.svd(np.atleast_2d(np.asarray(axis, dtype=float)))[2][1:]
        errors = tuple(_Error(value, RATE, policy.axis_std) for value in range(2))
        return cls("axis", 0, across, policy.wobble_std, errors)

    @classmethod
    def encoder(
        cls, noise_std: float, *, first_known: bool = True, policy: ReferencePolicy = ReferencePolicy()
    ) -> Reference:
        """Return an angle about the table's axis, rad, less its first value, with a delay.

        ``first_known``: the first value is that of the first sample, where the angle of the run is zero.
        """
        offset = noise_std if first_known else policy.unknown_offset
        errors = (_Error(0, CONSTANT, offset), _Error(0, RATE, policy.delay_std_s))
        return cls("angle", ANGLE, np.eye(1, 3), noise_std, errors)

    @classmethod
    def position(
        cls, noise_std: float, *, first_known: bool = True, policy: ReferencePolicy = ReferencePolicy()
    ) -> Reference:
        """Return positions of the origin, m, in the axes of the world, less the first; ``first_known`` as `encoder`."""
        offset = noise_std if first_known else policy.unknown_offset
        errors = tuple(_Error(axis, CONSTANT, offset) for axis in range(3))
        return cls("position", POSITION, np.eye(3), noise_std, errors)

    @property
    def of_path(self) -> bool:
        """Whether it measures the path, and not the rate."""
        return self.first >= TILT

    def measured(self, values: ArrayLike, samples: int) -> Measured:
        """Return the reference with its values at so many samples, shape (n, k); NaN where there is none.

        Raises
        ------
        InputError
            If the shape doesn't fit.
        """
        rows = np.asarray(values, dtype=float)
        if rows.shape != (samples, len(self.weights)):
            raise InputError(
                f"{self.name} has shape {rows.shape}; {samples} times need ({samples}, {len(self.weights)})"
            )
        return Measured(self, rows)


class Measured(NamedTuple):
    """A reference and its values at the samples of a run, (n, k), NaN where there is none."""

    reference: Reference
    values: NDArray[np.float64]


def rows_of(references: Sequence[Reference]) -> tuple[ReferenceRows, NDArray[np.float64]]:
    """Return the rows of all values, and the standard deviations (e,) of their errors."""
    sizes = [len(one.weights) for one in references]
    begins = np.cumsum([0, *sizes])
    errors = [
        error._replace(value=error.value + int(begin))
        for one, begin in zip(references, begins, strict=False)
        for error in one.errors
    ]
    rows = ReferenceRows(
        np.repeat([one.first for one in references], sizes).astype(np.int64),
        np.concatenate([np.zeros((0, 3)), *(one.weights for one in references)]),
        np.repeat([one.noise_std**2 for one in references], sizes).astype(float),
        np.array([error.value for error in errors], dtype=np.int64),
        np.array([error.grows_with for error in errors], dtype=np.int64),
    )
    return rows, np.array([error.std for error in errors])
