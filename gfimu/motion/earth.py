"""The Earth's rotation: what it adds to the rate of a body, and what a world that turns with it sees.

The world (z up) turns with the Earth at Ω = Ω_E (cos φ n + sin φ u), with φ the latitude, n the direction of north and
u that of up. An array of accelerometers, as a gyro, measures the rate against the stars, ω + Rᵀ Ω, where ω is the rate
against the world and R the attitude, body to world. At rest that is Ω_E, 15.04 °/h.

With gravity as a plumb line shows it (the centrifugal acceleration included), the motion in the world obeys
v̇ = R p + g − 2 Ω × v (Coriolis). Source: Titterton & Weston, "Strapdown Inertial Navigation Technology", 2nd ed.,
section 3.5, eq. 3.23 without the transport rate, for runs that stay at one place.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.gravity import EARTH_RATE
from gfimu.base.errors import InputError
from gfimu.base.short_repr import short_repr
from gfimu.motion.attitude import from_rotation, to_rotation

__all__ = ["EarthRotation"]


@dataclass(frozen=True)
class EarthRotation:
    """The Earth's rotation at a place.

    Parameters
    ----------
    latitude_deg : float
        Geodetic latitude, degrees, −90 to 90.
    north_rad : float
        Direction of north from the world's x-axis, about up, rad. A levelled body starts with heading zero, so there
        it is north as seen from the body's x-axis.

    Raises
    ------
    InputError
        If the latitude is outside its range, or north is not a number.

    Examples
    --------
    >>> import gfimu
    >>> earth = gfimu.EarthRotation(52.0)
    >>> print(f"{1e5 * earth.horizontal_rate:.2f}e-5 rad/s")
    4.49e-5 rad/s
    """

    latitude_deg: float
    north_rad: float = 0.0

    __repr__ = short_repr

    def __post_init__(self) -> None:
        if not -90.0 <= self.latitude_deg <= 90.0:
            raise InputError(f"latitude {self.latitude_deg:g}° is outside −90…90; give it in degrees")
        if not math.isfinite(self.north_rad):
            raise InputError(f"the direction of north is {self.north_rad}; give an angle, rad")

    @property
    def rate(self) -> NDArray[np.float64]:
        """Ω in world axes, shape (3,), rad/s."""
        latitude = math.radians(self.latitude_deg)
        level = EARTH_RATE * math.cos(latitude)
        return np.array(
            [level * math.cos(self.north_rad), level * math.sin(self.north_rad), EARTH_RATE * math.sin(latitude)]
        )

    @property
    def horizontal_rate(self) -> float:
        """Ω_E cos φ, rad/s, the part that tilts a unit that takes the Earth for still."""
        return EARTH_RATE * math.cos(math.radians(self.latitude_deg))

    def to_dict(self) -> dict[str, Any]:
        """Return the place by key, as recordings and estimates hold it."""
        return {"latitude_deg": self.latitude_deg, "north_rad": self.north_rad}

    def in_body(self, quaternion: ArrayLike) -> NDArray[np.float64]:
        """Rᵀ Ω in body axes at attitudes (n, 4) or (4,), rad/s: the rate of a body at rest; NaN where unknown."""
        return _where_known(quaternion, lambda attitude: attitude.inv().apply(self.rate))

    def attitude_in_world(self, t: ArrayLike, quaternion: ArrayLike) -> NDArray[np.float64]:
        """Take the world's own turn off attitudes that were integrated from the rate against the stars.

        Parameters
        ----------
        t : array_like, shape (n,)
            Times, s; at the first both attitudes are the same.
        quaternion : array_like, shape (n, 4)
            Attitude (w, x, y, z), body to the world as it stood at the first time.

        Returns
        -------
        ndarray, shape (n, 4)
            Attitude, body to the world as it stands at each time: exp(−Ω t) q.
        """
        since = np.asarray(t, dtype=float) - np.asarray(t, dtype=float)[0]
        q = np.asarray(quaternion, dtype=float)
        known = np.isfinite(q).all(axis=1)
        result = np.full_like(q, np.nan)
        turn = Rotation.from_rotvec(-np.outer(since[known], self.rate))
        result[known] = from_rotation(turn * to_rotation(q[known])) if known.any() else q[known]
        return result

    def coriolis(self, displacement: ArrayLike) -> NDArray[np.float64]:
        """Velocity that the Coriolis acceleration has added, −2 Ω × (r − r₀), in world axes (n, 3), m/s."""
        return -2.0 * np.cross(self.rate, np.asarray(displacement, dtype=float))


def _where_known(quaternion: ArrayLike, of: Any) -> NDArray[np.float64]:
    q = np.asarray(quaternion, dtype=float)
    if q.ndim == 1:
        return np.asarray(of(to_rotation(q)))
    known = np.isfinite(q).all(axis=1)
    result = np.full((len(q), 3), np.nan)
    if known.any():
        result[known] = of(to_rotation(q[known]))
    return result
