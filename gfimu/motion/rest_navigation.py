"""Strapdown navigation that uses rest: gravity shows the tilt, and the velocity is zero.

Between rests attitude, velocity and position are integrated as in `gfimu.motion.navigation`. At each rest the mean
specific force, turned into the world, should point up and measure g: the tilt that it shows is taken out of the
attitude from the start of that rest on, what is left of it is the bias of p until the next rest, and the velocity
starts anew from zero. Heading can't be seen by gravity; it keeps what the rate made of it. The position keeps what it
gathered.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from gfimu.base.errors import InputError
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.motion.attitude import from_rotation, to_rotation
from gfimu.motion.earth import EarthRotation
from gfimu.motion.navigation import NavigationResult, navigate

__all__ = ["navigate_with_rest"]


def navigate_with_rest(
    t: ArrayLike,
    p: ArrayLike,
    quaternion: ArrayLike,
    rest: ArrayLike,
    *,
    gravity: float = STANDARD_GRAVITY,
    earth: EarthRotation | None = None,
) -> NavigationResult:
    """Integrate specific force to velocity and position, levelled and stopped at each rest.

    Parameters
    ----------
    t : array_like, shape (n,)
        Sample times, s.
    p : array_like, shape (n, 3)
        Specific force of the body origin in body axes, m/s².
    quaternion : array_like, shape (n, 4)
        Attitude (w, x, y, z), body to world, as integrated from the rate.
    rest : array_like of bool, shape (n,)
        Samples at rest, as the rate filter recognised them.
    gravity : float
        Magnitude of gravity, m/s².
    earth : EarthRotation, optional
        As for `gfimu.motion.navigation.navigate`.

    Returns
    -------
    NavigationResult
        Attitude corrected from each rest on; velocity zero during rest.

    Raises
    ------
    InputError
        If the shapes don't fit.
    """
    times, force = np.asarray(t, dtype=float), np.array(p, dtype=float)
    attitude, still = np.array(quaternion, dtype=float), np.asarray(rest, dtype=bool)
    if still.shape != times.shape or force.shape != (len(times), 3) or attitude.shape != (len(times), 4):
        raise InputError(
            f"times have shape {times.shape}, p {force.shape}, quaternion {attitude.shape}, rest {still.shape}; "
            "one row per time is needed"
        )
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    stretches = list(zip(edges[::2], edges[1::2], strict=True))
    for index, (start, stop) in enumerate(stretches):
        _level_from(force, attitude, int(start), int(stop), gravity)
        until = stretches[index + 1][0] if index + 1 < len(stretches) else len(times)
        seen = _seen(force[start:stop], attitude[start:stop])
        if seen.any():
            up = to_rotation(attitude[start:stop][seen]).inv().apply([0.0, 0.0, gravity])
            force[start:until] -= np.mean(force[start:stop][seen] - up, axis=0)
    free = navigate(times, force, attitude, gravity=gravity, earth=earth)
    velocity, position = free.velocity.copy(), free.position.copy()
    for start, stop in stretches:
        drift = velocity[stop - 1].copy()
        jump = position[stop - 1] - position[start]
        velocity[start:stop] = 0.0
        velocity[stop:] -= drift
        position[start:stop] = position[start]
        position[stop:] -= jump + drift * (times[stop:] - times[stop - 1])[:, None]
    return NavigationResult(times, attitude, velocity, position)


def _seen(force: NDArray[np.float64], attitude: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mark the samples (n,) whose specific force (n, 3) and attitude (n, 4) are both known."""
    return np.asarray(np.isfinite(np.hstack([force, attitude])).all(axis=1), dtype=np.bool_)


def _level_from(
    force: NDArray[np.float64], attitude: NDArray[np.float64], start: int, stop: int, gravity: float
) -> None:
    """Turn the attitude from ``start`` on so that the mean specific force of the rest points up; in place."""
    seen = _seen(force[start:stop], attitude[start:stop])
    if not seen.any():
        return
    mean = to_rotation(attitude[start:stop][seen]).apply(force[start:stop][seen]).mean(axis=0)
    length = float(np.linalg.norm(mean))
    if not length > 0.5 * gravity:  # falling, or no sense in it
        return
    axis = np.cross(mean / length, [0.0, 0.0, 1.0])
    size = float(np.linalg.norm(axis))
    angle = float(np.arctan2(size, mean[2] / length))
    if size > 0.0:
        turn = Rotation.from_rotvec(axis / size * angle)
        rows = np.flatnonzero(np.isfinite(attitude[start:]).all(axis=1)) + start
        attitude[rows] = from_rotation(turn * to_rotation(attitude[rows]))
