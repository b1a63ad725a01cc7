"""The constants of an array's mounting on an axis that are not known exactly, and how each changes the channels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.array.turning_axis import TurningAxis
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.rate.axis.channels import AxisChannels, axis_frame
from gfimu.rate.axis.recursion import Slopes

__all__ = ["Constant", "Mounting"]

_STEP = 1e-4  # m, rad, m/s²: numerical, of central differences of coefficients that are nearly linear
_FREE_TILT = 0.5  # rad: prior of an inclination that is to be estimated, wide beside what gravity says of it


@dataclass(frozen=True)
class Constant:
    """One uncertain constant.

    Parameters
    ----------
    name : str
        Name with its unit, as ``a1_lever_x_m``.
    kind : str
        ``point``, ``direction``, ``lever``, ``rotation``, ``bias`` or ``inclination``.
    place : int
        Index of its chip or channel; 0 for those of the axis.
    vector : ndarray, shape (3,)
        Its direction in the body frame; zero where it has none.
    std : float
        Standard deviation of its prior, about zero, in the unit of the name.
    """

    name: str
    kind: str
    place: int
    vector: NDArray[np.float64]
    std: float


@dataclass(frozen=True)
class Mounting:
    """An array on an axis with its uncertain constants.

    Levers along the axis are left out: no channel reads them.

    Parameters
    ----------
    array : AccelerometerArray
        The array as drawn.
    axis : TurningAxis
        The axis as drawn, with its uncertainty.
    inclination : float
        Angle between axis and vertical from which a free one is corrected, rad.
    constants : tuple of Constant
        What is uncertain.
    """

    array: AccelerometerArray
    axis: TurningAxis
    inclination: float
    constants: tuple[Constant, ...]

    @classmethod
    def of(
        cls, array: AccelerometerArray, axis: TurningAxis, inclination: float, *, free_inclination: bool
    ) -> Mounting:
        """Return the mounting with the constants that the axis's uncertainty names.

        Parameters
        ----------
        array, axis, inclination
            As those of the class.
        free_inclination : bool
            Whether the inclination is estimated too.
        """
        doubt = axis.uncertainty
        across, body = _across(axis.direction), list(zip("xyz", np.eye(3), strict=True))
        found = [
            *(Constant(f"axis_point_{name}_m", "point", 0, one, doubt.point_std_m) for name, one in across),
            *(
                Constant(f"axis_direction_{name}_rad", "direction", 0, one, doubt.direction_std_rad)
                for name, one in across
            ),
        ]
        for place, chip in enumerate(array.chips):
            found += [
                Constant(f"{chip.name}_lever_{name}_m", "lever", place, one, doubt.lever_std_m) for name, one in across
            ]
            found += [
                Constant(f"{chip.name}_rotation_{name}_rad", "rotation", place, one, doubt.rotation_std_rad)
                for name, one in body
            ]
        none = np.zeros(3)
        found += [
            Constant(f"{channel}_bias_m_s2", "bias", index, none, doubt.bias_std_m_s2)
            for index, channel in enumerate(array.channels)
        ]
        if free_inclination:
            found.append(Constant("inclination_rad", "inclination", 0, none, _FREE_TILT))
        return cls(array, axis, inclination, tuple(one for one in found if one.std > 0.0))

    @property
    def prior_std(self) -> NDArray[np.float64]:
        """Standard deviations of the priors, shape (m,)."""
        return np.array([constant.std for constant in self.constants])

    def channels(self, values: NDArray[np.float64]) -> AxisChannels:
        """Return what the channels read where the constants have given values, shape (m,)."""
        array = self.array
        point, turned = self.axis.point.copy(), np.zeros(3)
        levers, rotations = array.chip_positions.copy(), np.zeros((len(array.chips), 3))
        offset = np.zeros(array.n_channels)
        for one, value in zip(self.constants, values, strict=True):
            if one.kind == "point":
                point += value * one.vector
            elif one.kind == "direction":
                turned += value * one.vector
            elif one.kind == "lever":
                levers[one.place] += value * one.vector
            elif one.kind == "rotation":
                rotations[one.place] += value * one.vector
            elif one.kind == "bias":
                offset[one.place] += value
        chip = array.chip_of_channel
        axes = Rotation.from_rotvec(rotations)[chip].apply(array.axes)
        frame = axis_frame(self.axis.direction) @ Rotation.from_rotvec(turned).as_matrix().T
        return AxisChannels.at(axes, levers[chip] - point, frame, offset)

    def tilt(self, values: NDArray[np.float64]) -> float:
        """Return the angle between axis and vertical, rad."""
        free = [value for one, value in zip(self.constants, values, strict=True) if one.kind == "inclination"]
        return self.inclination + float(sum(free))

    def slopes(self, values: NDArray[np.float64]) -> Slopes:
        """Return the derivatives of the channels' coefficients by the constants."""
        m, c = len(self.constants), self.array.n_channels
        force, gravity = np.zeros((m, c, 3)), np.zeros((m, 2))
        acceleration, square, offset = np.zeros((m, c)), np.zeros((m, c)), np.zeros((m, c))
        tilt = self.tilt(values)
        for index, constant in enumerate(self.constants):
            if constant.kind == "inclination":
                gravity[index] = STANDARD_GRAVITY * np.array([-np.sin(tilt), np.cos(tilt)])
                continue
            step = np.zeros(m)
            step[index] = _STEP
            above, below = self.channels(values + step), self.channels(values - step)
            for slope, name in (
                (force, "force"),
                (acceleration, "by_acceleration"),
                (square, "by_square"),
                (offset, "offset"),
            ):
                slope[index] = (getattr(above, name) - getattr(below, name)) / (2.0 * _STEP)
        return Slopes(force, acceleration, square, offset, gravity)


def _across(direction: NDArray[np.float64]) -> list[tuple[str, NDArray[np.float64]]]:
    """Return two directions across the axis with their names: body axes where the axis is one, else e1 and e2."""
    along = int(np.argmax(np.abs(direction)))
    if np.isclose(abs(direction[along]), 1.0):
        return [("xyz"[index], np.eye(3)[index]) for index in range(3) if index != along]
    frame = axis_frame(direction)
    return [("e1", frame[1]), ("e2", frame[2])]
