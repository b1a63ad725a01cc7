"""Strapdown navigation: velocity and position from specific force and attitude; levelling at rest.

World: z up, gravity (0, 0, −g). In the world v̇ = R(q) p + (0, 0, −g), with p the specific force of the body origin in
body axes. Where the latitude is given, the Coriolis acceleration −2 Ω × v of the turning Earth is added
(`gfimu.motion.earth`); the attitude is that to the turning world.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.integration import integrate_samples
from gfimu.base.errors import InputError
from gfimu.base.short_repr import short_repr
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.motion.attitude import to_rotation
from gfimu.motion.earth import EarthRotation
from gfimu.rate.path_start import upright

__all__ = ["NavigationResult", "level", "navigate"]


@dataclass(frozen=True)
class NavigationResult:
    """Motion of the body origin in the world.

    Parameters
    ----------
    t_s : ndarray, shape (n,)
        Sample times, s.
    quaternion : ndarray, shape (n, 4)
        Attitude (w, x, y, z), body to world.
    velocity : ndarray, shape (n, 3)
        Velocity in world axes, m/s.
    position : ndarray, shape (n, 3)
        Position in world axes, m.

    Rows of lost samples are NaN.
    """

    t_s: NDArray[np.float64]
    quaternion: NDArray[np.float64]
    velocity: NDArray[np.float64]
    position: NDArray[np.float64]

    __repr__ = short_repr


def level(p_at_rest: ArrayLike, *, heading: float = 0.0) -> NDArray[np.float64]:
    """Find the attitude of a body at rest from the direction of its specific force.

    Parameters
    ----------
    p_at_rest : array_like, shape (n, 3) or (3,)
        Specific force in body axes while at rest, m/s²; averaged over the rows without NaN.
    heading : float
        Angle of the body's x-axis about the world's z, rad; gravity doesn't show it.

    Returns
    -------
    ndarray, shape (4,)
        Attitude (w, x, y, z), body to world, that turns the mean specific force into world "up".

    Raises
    ------
    InputError
        If no row is complete, or the mean has no direction (free fall).

    Examples
    --------
    >>> import gfimu
    >>> gfimu.level([0.0, 0.0, 9.81])
    array([1., 0., 0., 0.])
    """
    rows = np.atleast_2d(np.asarray(p_at_rest, dtype=float))
    rows = rows[np.isfinite(rows).all(axis=1)]
    if len(rows) == 0:
        raise InputError("no complete sample of p to level with; give a stretch of rest without missing channels")
    mean = rows.mean(axis=0)
    if not np.linalg.norm(mean) > 0:
        raise InputError("the mean of p is zero: there is no up to level to; give a stretch of rest")
    return upright(mean, heading)


def navigate(
    t: ArrayLike,
    p: ArrayLike,
    quaternion: ArrayLike,
    *,
    gravity: float = STANDARD_GRAVITY,
    velocity0: ArrayLike = (0.0, 0.0, 0.0),
    position0: ArrayLike = (0.0, 0.0, 0.0),
    earth: EarthRotation | None = None,
    method: str = "runge_kutta",
) -> NavigationResult:
    """Integrate specific force to velocity and position (GF-IMU paper, step 10 (f)).

    Parameters
    ----------
    t : array_like, shape (n,)
        Sample times, s, strictly increasing.
    p : array_like, shape (n, 3)
        Specific force of the body origin in body axes, m/s². Rows with NaN count as lost samples.
    quaternion : array_like, shape (n, 4)
        Attitude (w, x, y, z), body to world.
    gravity : float
        Magnitude of gravity, m/s².
    velocity0, position0 : array_like, shape (3,)
        Velocity, m/s, and position, m, in world axes at the first valid sample.
    earth : EarthRotation, optional
        The Earth's rotation at the place; its Coriolis acceleration is left out by default.
    method : str
        Quadrature, as for `gfimu.array.integration.integrate_rate`.

    Returns
    -------
    NavigationResult
        Velocity and position in world axes.

    Raises
    ------
    InputError
        If the shapes don't fit, time does not increase, or the method is unknown.

    Examples
    --------
    >>> import numpy as np
    >>> import gfimu
    >>> t = np.arange(101) / 100.0
    >>> upright = np.tile([1.0, 0.0, 0.0, 0.0], (101, 1))
    >>> moved = gfimu.navigate(t, np.tile([1.0, 0.0, 9.80665], (101, 1)), upright)
    >>> moved.position[-1].round(3)
    array([0.5, 0. , 0. ])
    """
    times = np.asarray(t, dtype=float)
    force = np.asarray(p, dtype=float)
    attitude = np.asarray(quaternion, dtype=float)
    if times.ndim != 1 or force.shape != (len(times), 3) or attitude.shape != (len(times), 4):
        raise InputError(
            f"times have shape {times.shape}, p {force.shape}, quaternion {attitude.shape}; "
            "p needs three and the quaternion four numbers per time"
        )
    acceleration = np.full_like(force, np.nan)  # (n, 3), world
    valid = np.isfinite(force).all(axis=1) & np.isfinite(attitude).all(axis=1)
    if valid.any():
        acceleration[valid] = to_rotation(attitude[valid]).apply(force[valid])
    acceleration[:, 2] -= gravity
    velocity = integrate_samples(times, acceleration, velocity0, method=method)
    position = integrate_samples(times, velocity, position0, method=method)
    if earth is not None:  # to first order in Ω: the displacement without it is near enough
        velocity = velocity + earth.coriolis(position - np.asarray(position0, dtype=float))
        position = integrate_samples(times, velocity, position0, method=method)
    return NavigationResult(times, attitude, velocity, position)
