"""Local gravity from latitude and height: the normal gravity of the WGS 84 ellipsoid.

Source: National Imagery and Mapping Agency, TR8350.2, "Department of Defense World Geodetic System 1984", eqs 4-1
(Somigliana's closed formula) and 4-3 (its continuation to a height above the ellipsoid, the free-air correction to
second order). Local anomalies of the real Earth reach a few 1e-4 m/s² and are not in it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gfimu.base.errors import InputError

__all__ = ["EARTH_RATE", "Latitude", "local_gravity"]

EARTH_RATE = 7.292115e-5
"""Angular rate of the Earth against the stars (WGS 84), rad/s."""

_EQUATORIAL_GRAVITY = 9.7803253359
_SOMIGLIANA_K = 0.00193185265241
_ECCENTRICITY_SQUARED = 6.69437999013e-3
_SEMI_MAJOR_AXIS = 6378137.0
_FLATTENING = 1.0 / 298.257223563
_CENTRIFUGAL_RATIO = 0.00344978650684  # m = ω² a² b / GM
_HEIGHT_LIMIT = 100_000.0


@dataclass(frozen=True)
class Latitude:
    """A place on or near the ground, from which follow gravity and the Earth's rate.

    Parameters
    ----------
    deg : float
        Geodetic latitude, degrees.
    height_m : float
        Height above the ellipsoid, m.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.calibrate("multi-position", "poses.csv", gravity=gfimu.Latitude(52.3, 80.0))  # doctest: +SKIP
    """

    deg: float
    height_m: float = 0.0

    @property
    def gravity(self) -> float:
        """Gravity there, m/s²; raises as `local_gravity`."""
        return local_gravity(self.deg, self.height_m)


def local_gravity(latitude_deg: float, height_m: float = 0.0) -> float:
    """Compute the gravity at a place on or near the ground.

    Parameters
    ----------
    latitude_deg : float
        Geodetic latitude, degrees, −90 to 90.
    height_m : float
        Height above the ellipsoid, m, −1000 to 100 000.

    Returns
    -------
    float
        Normal gravity, m/s².

    Raises
    ------
    InputError
        If the latitude or height is outside its range.

    Examples
    --------
    >>> import gfimu
    >>> print(f"{gfimu.local_gravity(52.0, 80.0):.4f} m/s²")
    9.8122 m/s²
    """
    if not -90.0 <= latitude_deg <= 90.0:
        raise InputError(f"latitude {latitude_deg:g}° is outside −90…90; give it in degrees")
    if not -1000.0 <= height_m <= _HEIGHT_LIMIT:
        raise InputError(f"height {height_m:g} m is outside −1000…{_HEIGHT_LIMIT:g}; give it in metres")
    sin2 = math.sin(math.radians(latitude_deg)) ** 2
    surface = (
        _EQUATORIAL_GRAVITY * (1.0 + _SOMIGLIANA_K * sin2) / math.sqrt(1.0 - _ECCENTRICITY_SQUARED * sin2)
    )  # eq. 4-1
    ratio = height_m / _SEMI_MAJOR_AXIS
    slope = 1.0 + _FLATTENING + _CENTRIFUGAL_RATIO - 2.0 * _FLATTENING * sin2
    return surface * (1.0 - 2.0 * slope * ratio + 3.0 * ratio**2)  # eq. 4-3
