"""What the channels of an array read while it turns about one axis.

With u along the axis, r the place of a channel from a point of the axis and n its sensing axis, a channel reads

    n · [f + α u × r + Ω² (u (u · r) − r)],

f the specific force of that point. Where the axis stands still, f is gravity alone, which turns in the body by −θ.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.geometry.array import AccelerometerArray
from gfimu.geometry.turning_axis import TurningAxis

__all__ = ["AxisChannels"]


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
    frame : ndarray, shape (3, 3)
        Rows u, e₁, e₂ in body axes.
    """

    force: NDArray[np.float64]
    by_acceleration: NDArray[np.float64]
    by_square: NDArray[np.float64]
    frame: NDArray[np.float64]

    @classmethod
    def of(cls, array: AccelerometerArray, axis: TurningAxis) -> AxisChannels:
        """Return the coefficients of an array's channels."""
        u = axis.direction
        helper = np.eye(3)[int(np.argmin(np.abs(u)))]
        first = np.cross(u, np.cross(helper, u))
        first = first / np.linalg.norm(first)
        frame = np.array([u, first, np.cross(u, first)])
        lever = array.positions - axis.point  # (c, 3)
        tangential = np.cross(u, lever)  # (c, 3)
        centripetal = np.outer(lever @ u, u) - lever
        n = array.axes
        return cls(n @ frame.T, np.sum(n * tangential, axis=1), np.sum(n * centripetal, axis=1), frame)

    def motion_matrix(self) -> NDArray[np.float64]:
        """Return the columns by α, Ω² and f along u, e₁, e₂, shape (c, 5)."""
        return np.column_stack([self.by_acceleration, self.by_square, self.force])
