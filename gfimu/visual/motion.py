"""What the picture of a run needs to know: the estimate, the known motion beside it, and the expected drift."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.motion.attitude import from_rotation, table_angle, to_rotation
from gfimu.recording import Recording

__all__ = ["ExpectedDrift", "KnownMotion", "MotionEstimate", "about_z", "table_axis"]

CUBE_HEIGHT = 0.06
"""Height of the cube's centre above the table where nothing else is known, m."""


class MotionEstimate(Protocol):
    """What the picture needs of an estimate (`gfimu.motion.estimation.Estimate` has it); body axes throughout."""

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
    def from_reference(cls, recording: Recording) -> KnownMotion | None:
        """Motion of the table from its encoder or, failing that, from its tachometer; None without either."""
        t = recording.t_s
        for column, name in (("angle_rad", "encoder"), ("tacho_rad_s", "∫ tacho")):
            values = recording.reference.get(column)
            if values is None or np.isfinite(values).sum() < 2:
                continue
            valid = np.isfinite(values)
            t, values = t[valid], values[valid]
            if column == "tacho_rad_s":
                values = table_angle(t, values[:, None] * np.array([0.0, 0.0, 1.0]))
            mounted = to_rotation(about_z(values)) * _mounting(recording)
            return cls(name, t, from_rotation(mounted), np.array([0.0, 0.0, CUBE_HEIGHT]), angle=values)
        return None


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


def table_axis(recording: Recording) -> NDArray[np.float64]:
    """Direction of the table's axis in body axes, shape (3,): the cube may have been turned before the run."""
    return np.asarray(_mounting(recording).inv().apply([0.0, 0.0, 1.0]))


def _mounting(recording: Recording) -> Rotation:
    return Rotation.from_rotvec(recording.mounting_rotvec)
