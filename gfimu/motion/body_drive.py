"""Motion of a free body: rate and angular acceleration from its gyro, specific force as estimated so far."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

__all__ = ["BodyDrive"]


@dataclass(frozen=True)
class BodyDrive:
    """What drives the twin of a free body; all in body axes, at samples joined by cubic splines.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Sample times, s.
    rate : ndarray, shape (n, 3)
        Angular rate as the gyro reads it, rad/s.
    force : ndarray, shape (n, 3)
        Specific force of the body's origin, m/s².
    """

    t: NDArray[np.float64]
    rate: NDArray[np.float64]
    force: NDArray[np.float64]

    @cached_property
    def acceleration(self) -> NDArray[np.float64]:
        """Angular acceleration at the samples, rad/s², shape (n, 3)."""
        return np.asarray(CubicSpline(self.t, self.rate)(self.t, 1))

    def with_force(self, force: NDArray[np.float64]) -> BodyDrive:
        """Return the drive with another specific force."""
        moved = BodyDrive(self.t, self.rate, force)
        for name in ("acceleration", "_rate_series", "_acceleration_series"):
            if name in self.__dict__:
                moved.__dict__[name] = self.__dict__[name]
        return moved

    def force_at(self, delay: float = 0.0) -> NDArray[np.float64]:
        """Return the specific force later than the samples by a delay, s; shape (n, 3), m/s²."""
        return self.force if delay == 0.0 else self._force_series.at(delay)

    def rate_at(self, delay: float = 0.0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return rate, rad/s, and angular acceleration, rad/s², later by a delay; each of shape (n, 3)."""
        if delay == 0.0:
            return self.rate, self.acceleration
        return self._rate_series.at(delay), self._acceleration_series.at(delay)

    @cached_property
    def _force_series(self) -> _Series:
        return _Series.of(self.t, self.force)

    @cached_property
    def _rate_series(self) -> _Series:
        return _Series.of(self.t, self.rate)

    @cached_property
    def _acceleration_series(self) -> _Series:
        return _Series.of(self.t, self.acceleration)


@dataclass(frozen=True)
class _Series:
    """A cubic spline about its own samples: exact within a sample period, and much faster than evaluating it."""

    value: NDArray[np.float64]
    slope: NDArray[np.float64]
    bend: NDArray[np.float64]
    later: NDArray[np.float64]
    earlier: NDArray[np.float64]

    @classmethod
    def of(cls, t: NDArray[np.float64], values: NDArray[np.float64]) -> _Series:
        spline = CubicSpline(t, values)
        third = 6.0 * spline.c[0]  # (n − 1, 3), one per piece
        return cls(values, spline(t, 1), spline(t, 2), np.vstack([third, third[-1:]]), np.vstack([third[:1], third]))

    def at(self, delay: float) -> NDArray[np.float64]:
        third = self.later if delay > 0 else self.earlier
        return np.asarray(self.value + delay * (self.slope + delay / 2 * (self.bend + delay / 3 * third)))
