"""How a ripple of the drive's torque answers the drive: angle, rate and acceleration per coefficient of its spline.

Where in its turn a ripple is depends on the table's angle, and the servo that takes it back remembers: a drive that is
moved at one instant has the table ripple otherwise for a second, or for as long as a strong ripple holds it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array

from gfimu.diagnosis.drive import AngleSpline
from gfimu.world_model import RippledMotion

__all__ = ["RippleResponse", "Rippling"]


@dataclass(frozen=True)
class RippleResponse:
    """Derivative of angle, rate and acceleration at n times with respect to m coefficients, sparse by columns.

    Parameters
    ----------
    values : ndarray, shape (3, e)
        Of angle, rate and acceleration.
    rows, ends : ndarray of int, shape (e,) and (m + 1,)
        Time of each value, and where each coefficient's values end.
    count : int
        n.
    """

    values: NDArray[np.float64]
    rows: NDArray[np.intp]
    ends: NDArray[np.intp]
    count: int

    def matrix(self, slopes: NDArray[np.float64]) -> csr_array:
        """Return the matrix (n, m) from the coefficients to Σ slopes · (angle, rate, acceleration); slopes (3, n)."""
        values = np.einsum("se,se->e", slopes[:, self.rows], self.values)
        return csr_array(csc_array((values, self.rows, self.ends), shape=(self.count, len(self.ends) - 1)))


@dataclass(frozen=True)
class Rippling:
    """Derivative of what a ripple adds to a table's motion with respect to the coefficients of the drive's spline.

    Parameters
    ----------
    spline : AngleSpline
        The drive's spline.
    motion : RippledMotion
        The table's motion.
    """

    spline: AngleSpline
    motion: RippledMotion
    _known: dict[bytes, RippleResponse] = field(default_factory=dict, init=False, repr=False, compare=False)

    def response(self, t: NDArray[np.float64]) -> RippleResponse:
        """Return what the ripple adds to angle, rate and acceleration at times (n,), s, per coefficient."""
        key = t.tobytes()  # channels and the reference are often sampled together
        if key not in self._known:
            first, (angle, rate, _) = self.spline.local(self.motion.grid)
            found = self.motion.derivative(first, angle, rate, self.spline.size, t)
            self._known[key] = RippleResponse(*found, len(t))
        return self._known[key]
