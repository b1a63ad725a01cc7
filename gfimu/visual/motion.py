"""What the picture of a run needs to know: the estimate, the known motion beside it, and the expected drift."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.array.turning_axis import TurningAxis
from gfimu.motion.attitude import from_rotation, table_angle, to_rotation
from gfimu.recording import Recording
from gfimu.visual.rig.package import stand_height

__all__ = [
    "ExpectedDrift",
    "KnownMotion",
    "MotionEstimate",
    "about_axis",
    "about_z",
    "on_hub",
    "reference_rate",
    "spin_axis",
]


class MotionEstimate(Protocol):
    """What the picture needs of an estimate (`gfimu.motion.estimate.Estimate` has it); body axes throughout."""

    @property
    def t_s(self) -> NDArray[np.float64]:
        """Times, s, shape (n,)."""
        ...

    @property
    def p(self) -> NDArray[np.float64]:
        """Specific force of the body origin, m/s², shape (n, 3)."""
        ...

    @property
    def alpha(self) -> NDArray[np.float64]:
        """Angular acceleration, rad/s², shape (n, 3)."""
        ...

    @property
    def omega(self) -> NDArray[np.float64]:
        """Angular rate, rad/s, shape (n, 3)."""
        ...

    @property
    def omega_std(self) -> NDArray[np.float64]:
        """Standard deviation of the rate, rad/s, shape (n, 3)."""
        ...

    @property
    def quaternion(self) -> NDArray[np.float64]:
        """Attitude (w, x, y, z), body to world, shape (n, 4)."""
        ...

    @property
    def position(self) -> NDArray[np.float64] | None:
        """Position of the body origin in the world, m, shape (n, 3), where it was asked for."""
        ...

    @property
    def health(self) -> Mapping[str, NDArray[Any]] | None:
        """Health of each channel by name, shape (n,): `gfimu.rate.health.fault.HealthCode`; None where not watched."""
        ...


@dataclass(frozen=True)
class KnownMotion:
    """Motion that is known beside the estimate: a simulation's truth, or what the table's reference says.

    Parameters
    ----------
    name : str
        What the legend calls it: ``truth``, ``encoder``, ``∫ tacho``.
    t : ndarray, shape (n,)
        Times, s.
    quaternion : ndarray, shape (n, 4)
        Attitude (w, x, y, z), body to world.
    position : ndarray, shape (n, 3) or (3,)
        Position of the body origin in the world, m.
    omega, alpha, p : ndarray, shape (n, 3), optional
        Angular rate, rad/s, angular acceleration, rad/s², and specific force of the body origin, m/s², body axes.
    angle : ndarray, shape (n,), optional
        Angle of the table, rad; a free body has none.
    """

    name: str
    t: NDArray[np.float64]
    quaternion: NDArray[np.float64]
    position: NDArray[np.float64]
    omega: NDArray[np.float64] | None = None
    alpha: NDArray[np.float64] | None = None
    p: NDArray[np.float64] | None = None
    angle: NDArray[np.float64] | None = None

    @classmethod
    def from_reference(
        cls, recording: Recording, array: AccelerometerArray | None = None, estimate: MotionEstimate | None = None
    ) -> KnownMotion | None:
        """Motion from the encoder or, failing that, from the tachometer; None without either.

        Parameters
        ----------
        recording : Recording
            Its reference columns.
        array : AccelerometerArray, optional
            The array; it turns about its own axis where it has one, and a gyro's rate about that serves as well. By
            default the cube, which turns about the table's axis z.
        estimate : MotionEstimate, optional
            Its first attitude is where a rotation about an axis of the array starts, as no reference says that.
        """
        axis = None if array is None else array.turning_axis
        found = _reference_angle(recording, axis)
        if found is None:
            return None
        name, t, angle = found
        if array is None or axis is None:
            mounted = to_rotation(about_z(angle)) * _mounting(recording)
            return cls(name, t, from_rotation(mounted), np.array([0.0, 0.0, stand_height(array)]), angle=angle)
        start = about_axis(axis, np.zeros(1))[0]
        if estimate is not None and len(complete := np.flatnonzero(np.isfinite(estimate.quaternion).all(axis=1))):
            first = complete[0]
            turned = float(np.interp(estimate.t_s[first], t, angle))
            start = to_rotation(estimate.quaternion[first]) * Rotation.from_rotvec(-turned * axis.direction)
        attitude = start * Rotation.from_rotvec(np.outer(angle, axis.direction))
        return cls(name, t, from_rotation(attitude), on_hub(array, attitude), angle=angle)


@dataclass(frozen=True)
class ExpectedDrift:
    """Position error over time and what was to be expected of it.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times, s.
    error : ndarray, shape (n, 3)
        Position error of the estimate in the world, m.
    std : ndarray, shape (n,)
        Expected standard deviation of each horizontal component, m.
    """

    t: NDArray[np.float64]
    error: NDArray[np.float64]
    std: NDArray[np.float64]


def about_z(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternions (w, x, y, z) of turns about z by angles (n,), rad, shape (n, 4)."""
    zero = np.zeros_like(angle)
    return np.column_stack([np.cos(angle / 2), zero, zero, np.sin(angle / 2)])


def about_axis(axis: TurningAxis, angle: NDArray[np.float64]) -> Rotation:
    """Attitudes, body to world, of a body turned about an axis by angles (n,), rad; its heading is a choice."""
    upright, _ = Rotation.align_vectors([[0.0, 0.0, 1.0]], [axis.direction])
    tilted = Rotation.from_rotvec([0.0, axis.inclination or 0.0, 0.0])
    return tilted * Rotation.from_rotvec(np.outer(angle, [0.0, 0.0, 1.0])) * upright


def on_hub(array: AccelerometerArray, attitude: Rotation) -> NDArray[np.float64]:
    """Positions of the body's origin, m, (n, 3), for attitudes about the array's axis, which stands still."""
    point = np.zeros(3) if array.turning_axis is None else array.turning_axis.point
    return np.asarray(np.array([0.0, 0.0, stand_height(array)]) - attitude.apply(point))


def spin_axis(recording: Recording, array: AccelerometerArray) -> NDArray[np.float64]:
    """Direction of the axis of rotation in body axes, shape (3,): the array's own, else that of the table.

    The cube may have been turned on the table before the run.
    """
    if array.turning_axis is not None:
        return array.turning_axis.direction
    return np.asarray(_mounting(recording).inv().apply([0.0, 0.0, 1.0]))


def reference_rate(recording: Recording, axis: NDArray[np.float64]) -> tuple[str, NDArray[np.float64]] | None:
    """Name and rate about an axis, rad/s, (n,), of the tachometer or, failing that, of a gyro; None without either."""
    tacho = recording.reference.get("tacho_rad_s")
    if tacho is not None:
        return "tacho", tacho
    gyro = [recording.reference.get(f"gyro_{name}_rad_s") for name in "xyz"]
    parts = [axis[index] * one for index, one in enumerate(gyro) if one is not None and abs(axis[index]) > 1e-9]
    missing = any(one is None and abs(axis[place]) > 1e-9 for place, one in enumerate(gyro))
    return None if missing else ("gyro", np.sum(parts, axis=0))


def _reference_angle(
    recording: Recording, axis: TurningAxis | None
) -> tuple[str, NDArray[np.float64], NDArray[np.float64]] | None:
    """Name, times and angle, rad, of the best reference of the rotation about one axis."""
    candidates = []
    if (encoder := recording.reference.get("angle_rad")) is not None:
        candidates.append(("encoder", encoder))
    if axis is not None:
        rate = reference_rate(recording, axis.direction)
        candidates += [] if rate is None else [(f"∫ {rate[0]}", rate[1])]
    elif (tacho := recording.reference.get("tacho_rad_s")) is not None:
        candidates.append(("∫ tacho", tacho))
    for name, values in candidates:
        valid = np.isfinite(values)
        if valid.sum() < 2:
            continue
        t, angle = recording.t_s[valid], values[valid]
        if name != "encoder":
            angle = table_angle(t, angle[:, None] * np.array([0.0, 0.0, 1.0]))
        return name, t, angle
    return None


def _mounting(recording: Recording) -> Rotation:
    return Rotation.from_rotvec(recording.mounting_rotvec)
