"""The specific force that a unit sees on an erroneous two-axis stage, or on faces that are not level.

The chain is base, outer axis, inner axis, unit: R = B(tilt) · X(θ) · Y(ε) · Z(φ) · mounting, and the unit sees
Rᵀ (0, 0, g). The outer axis is horizontal (x of the base), the inner one across it; θ is the angle between the inner
axis and the vertical. Without errors the unit sees g times the wanted direction. Levelled faces are the same chain with
a tilt of their own in every pose and no errors of axes.

The error sources are those of Geist & Gaitan, J. Res. NIST 126, 126038 (2021), abstract: alignment of the gimbals and
step sizes of their rotation. Their magnitudes there are not in the text at hand.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.calibration.certificate.stage.stage import Stage

__all__ = ["SOURCES", "StageErrors", "axis_angles", "draw_errors", "specific_force"]

Floats = NDArray[np.float64]

SOURCES = {
    "pose_tilt_std_rad": "levelling, each pose by itself",
    "base_tilt_std_rad": "levelling of the base",
    "orthogonality_std_rad": "orthogonality of the stage's axes",
    "angle_setting_std_rad": "setting of the stage's angles",
    "angle_zero_std_rad": "zero of the stage's angles",
    "angle_step_std_rad": "step size of the stage's angles",
    "mounting_std_rad": "mounting of the unit",
    "gravity_std_m_s2": "local gravity",
    "resolution_m_s2": "resolution of the readings",
}
"""Keys of the stage file that a simulated calibration can suffer from, and what each is."""


@dataclass(frozen=True)
class StageErrors:
    """Errors of n simulated calibrations of p poses.

    Parameters
    ----------
    tilt : ndarray, shape (n, p, 2)
        Tilt of the base about its horizontal axes x and y in each pose, rad.
    angles : ndarray, shape (n, p, 2)
        Errors of the angles θ and φ, rad.
    orthogonality : ndarray, shape (n,)
        ε, rad.
    mounting : ndarray, shape (n, 3)
        Rotation vector of the unit against the inner table, rad.
    gravity : ndarray, shape (n,)
        True local gravity less the one that the calibration is given, m/s².
    reading : ndarray, shape (n, p, 3)
        Error of the mean readings of a pose, m/s².
    """

    tilt: Floats
    angles: Floats
    orthogonality: Floats
    mounting: Floats
    gravity: Floats
    reading: Floats


def axis_angles(directions: Floats) -> Floats:
    """Return the angles (θ, φ) of the outer and inner axis at which a unit sees g times a direction.

    Parameters
    ----------
    directions : ndarray, shape (p, 3)
        Unit vectors of the specific force in the axes of the unit.

    Returns
    -------
    ndarray, shape (p, 2)
        rad; θ from 0 to π.
    """
    x, y, z = directions.T
    return np.column_stack([np.arctan2(np.hypot(x, y), z), np.arctan2(x, y)])  # (p, 2)


def draw_errors(
    stage: Stage, directions: Floats, runs: int, rng: np.random.Generator, sources: Collection[str] | None = None
) -> StageErrors:
    """Draw the errors of ``runs`` calibrations; rounding is uniform, all others normal.

    Parameters
    ----------
    stage : Stage
        Standard uncertainties.
    directions : ndarray, shape (p, 3)
        Poses, as `axis_angles` takes them.
    runs : int
        n.
    rng : numpy.random.Generator
        Random number generator.
    sources : collection of str, optional
        Keys of `SOURCES` that act; all by default.
    """
    poses, acting = len(directions), SOURCES if sources is None else sources

    def normal(key: str, *shape: int) -> Floats:
        std = getattr(stage, key) or 0.0
        return rng.standard_normal((runs, *shape)) * std if key in acting and std > 0.0 else np.zeros((runs, *shape))

    step = normal("angle_step_std_rad", 1, 2) / (np.pi / 2.0) * axis_angles(directions)  # (n, p, 2)
    rounding = stage.resolution_m_s2 if "resolution_m_s2" in acting else 0.0
    return StageErrors(
        tilt=normal("base_tilt_std_rad", 1, 2) + normal("pose_tilt_std_rad", poses, 2),
        angles=normal("angle_zero_std_rad", 1, 2) + normal("angle_setting_std_rad", poses, 2) + step,
        orthogonality=normal("orthogonality_std_rad"),
        mounting=normal("mounting_std_rad", 3),
        gravity=normal("gravity_std_m_s2"),
        reading=rng.uniform(-0.5, 0.5, (runs, poses, 3)) * rounding,
    )


def specific_force(directions: Floats, errors: StageErrors, gravity: float) -> Floats:
    """Compute the specific force in the axes of the unit, m/s², shape (n, p, 3).

    Parameters
    ----------
    directions : ndarray, shape (p, 3)
        Wanted directions.
    errors : StageErrors
        Errors of n calibrations of these p poses.
    gravity : float
        Local gravity that the calibration is given, m/s².
    """
    runs, poses = errors.tilt.shape[:2]
    angles = axis_angles(directions) + errors.angles  # (n, p, 2)
    tilt, outer, inner = (
        Rotation.from_euler("xy", errors.tilt.reshape(-1, 2)),
        Rotation.from_euler("x", angles[..., 0].reshape(-1, 1)),
        Rotation.from_euler("z", angles[..., 1].reshape(-1, 1)),
    )
    skew = Rotation.from_euler("y", np.repeat(errors.orthogonality, poses)[:, None])
    mounting = Rotation.from_rotvec(np.repeat(errors.mounting, poses, axis=0))
    unit = (tilt * outer * skew * inner * mounting).inv().apply([0.0, 0.0, 1.0]).reshape(runs, poses, 3)
    return np.asarray(unit * (gravity + errors.gravity)[:, None, None], dtype=np.float64)
