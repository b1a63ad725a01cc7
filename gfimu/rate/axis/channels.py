"""What the channels of an array read while it turns about one axis.

With u along the axis, r the place of a channel from a point of the axis and n its sensing axis, a channel reads

    n · [f + α u × r + Ω² (u (u · r) − r)] + b,

b its bias, f the specific force of that point. Where the axis stands still, f is gravity alone, which turns in the body
by −θ.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.turning_axis import TurningAxis

__all__ = ["AxisChannels", "Coefficients", "axis_frame"]


class Coefficients(NamedTuple):
    """Coefficients of the channels as compiled code takes them; see `AxisChannels`."""

    force: NDArray[np.float64]
    by_acceleration: NDArray[np.float64]
    by_square: NDArray[np.float64]
    offset: NDArray[np.float64]


@dataclass(frozen=True)
class AxisChannels:
    """Coefficients of the channels.

    Parameters
    ----------
    force : ndarray, shape (c, 3)
        Of the specific force along u, e₁ and e₂ (a right-handed frame of the body).
    by_acceleration : ndarray, shape (c,)
        Of the angular acceleration α, m.
    by_square : ndarray, shape (c,)
        Of the square of the rate Ω², m.
    offset : ndarray, shape (c,)
        Constant bias b, m/s².
    frame : ndarray, shape (3, 3)
        Rows u, e₁, e₂ in body axes.
    """

    force: NDArray[np.float64]
    by_acceleration: NDArray[np.float64]
    by_square: NDArray[np.float64]
    offset: NDArray[np.float64]
    frame: NDArray[np.float64]

    @classmethod
    def of(cls, array: AccelerometerArray, axis: TurningAxis) -> AxisChannels:
        """Return the coefficients of an array's channels, without biases."""
        levers = array.positions - axis.point
        return cls.at(array.axes, levers, axis_frame(axis.direction), np.zeros(array.n_channels))

    @classmethod
    def at(
        cls,
        axes: NDArray[np.float64],
        levers: NDArray[np.float64],
        frame: NDArray[np.float64],
        offset: NDArray[np.float64],
    ) -> AxisChannels:
        """Return the coefficients of channels with given sensing axes, places from the axis and biases.

        Parameters
        ----------
        axes, levers : ndarray, shape (c, 3)
            Sensing axes, and places from a point of the axis, m, body frame.
        frame : ndarray, shape (3, 3)
            Rows u, e₁, e₂ in body axes.
        offset : ndarray, shape (c,)
            Biases, m/s².
        """
        u = frame[0]
        tangential = np.cross(u, levers)  # (c, 3)
        centripetal = np.outer(levers @ u, u) - levers
        return cls(axes @ frame.T, np.sum(axes * tangential, axis=1), np.sum(axes * centripetal, axis=1), offset, frame)

    @property
    def coefficients(self) -> Coefficients:
        """What compiled code takes."""
        return Coefficients(
            np.ascontiguousarray(self.force), self.by_acceleration, self.by_square, np.asarray(self.offset, dtype=float)
        )

    def motion_matrix(self) -> NDArray[np.float64]:
        """Return the columns by α, Ω² and f along u, e₁, e₂, shape (c, 5)."""
        return np.column_stack([self.by_acceleration, self.by_square, self.force])


def axis_frame(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rows u, e₁, e₂ of a right-handed frame with u along an axis, shape (3, 3)."""
    helper = np.eye(3)[int(np.argmin(np.abs(direction)))]
    first = np.cross(direction, np.cross(helper, direction))
    first = first / np.linalg.norm(first)
    return np.array([direction, first, np.cross(direction, first)])
