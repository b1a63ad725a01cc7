"""What the Earth's rotation adds to the readings of accelerometers on a body that moves in a turning world.

With Ω the Earth's rate and e = Rᵀ Ω in body axes, the rate against the stars is ω + e, its derivative α − ω × e (Ω is
constant in the world), and the body origin is accelerated by the Coriolis acceleration 2 Ω × v more. The centrifugal
acceleration of the place is part of its gravity; that of the lever arms is in the products of ω + e.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.kinematics import omega_products, specific_force
from sim.motions.motion import BodyState

__all__ = ["earth_in_body", "earth_readings"]


def earth_in_body(earth_rate: NDArray[np.float64], body: BodyState) -> NDArray[np.float64]:
    """Return Rᵀ Ω at n states, shape (n, 3), rad/s."""
    return np.einsum("nji,j->ni", body.rotation, earth_rate)


def earth_readings(array: AccelerometerArray, earth_rate: NDArray[np.float64], body: BodyState) -> NDArray[np.float64]:
    """Return what the Earth's rotation adds to the readings.

    Parameters
    ----------
    array : AccelerometerArray
        The array in body axes.
    earth_rate : ndarray, shape (3,)
        Ω in world axes, rad/s.
    body : BodyState
        Motion of the body in the world at n times.

    Returns
    -------
    ndarray, shape (n, c)
        m/s².
    """
    earth = earth_in_body(earth_rate, body)  # (n, 3)
    coriolis = np.einsum("nji,nj->ni", body.rotation, 2.0 * np.cross(earth_rate, body.velocity))
    turning = specific_force(array, coriolis, -np.cross(body.omega, earth), body.omega + earth)  # (n, c)
    return turning - omega_products(body.omega) @ array.centripetal_matrix.T
