"""A run with its predictions, as the views and the report show it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.base.short_repr import short_repr

__all__ = ["RunView"]


@dataclass(frozen=True)
class RunView:
    """A run as the report shows it; arrays of n samples and c channels.

    ``rate``, ``acceleration``, ``angle`` are the drive's posterior mean with the causes in; ``before`` is what the
    given twin predicts, ``after`` the extended one. ``white`` is the noise per channel. ``attitude``, shape (n, 4), is
    the quaternion (w, x, y, z), body to world, of a free body, which has no ``angle``. ``linear``: angle, rate and
    acceleration are place (m), speed (m/s) and acceleration (m/s²) of a carriage.
    """

    name: str
    t: NDArray[np.float64]
    measured: NDArray[np.float64]
    valid: NDArray[np.bool_]
    before: NDArray[np.float64]
    after: NDArray[np.float64]
    reference: NDArray[np.float64]
    reference_before: NDArray[np.float64]
    reference_after: NDArray[np.float64]
    angle: NDArray[np.float64]
    rate: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    temperature: NDArray[np.float64] | None
    white: NDArray[np.float64]
    attitude: NDArray[np.float64] | None = None
    linear: bool = False

    __repr__ = short_repr
