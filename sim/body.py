"""What an array on a freely moving body reads, given its gyro and its specific force."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.array.kinematics import omega_products
from gfimu.motion.body_drive import BodyDrive
from sim.motions.motion import SpinState
from sim.world import SampleContext, World

__all__ = ["body_channels"]


def body_channels(
    world: World, drive: BodyDrive, t: NDArray[np.float64], temperature: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """Noise-free analogue readings of a free body at board times, shape (n, c), m/s².

    The gyro reads M ω(t − delay): the rate is M⁻¹ times the gyro ``delay`` later. Specific force and gravity are one
    thing here, the force that the drive gives.

    Parameters
    ----------
    world : World
        The world.
    drive : BodyDrive
        Specific force of the body's origin, and rate and angular acceleration as the gyro reads them.
    t : ndarray, shape (n,)
        Time on the board's clock, s: the samples of the drive.
    temperature : ndarray, shape (n,), optional
        Board temperature, °C.
    """
    array = world.array
    unread = np.linalg.inv(world.gyro_matrix).T
    delays = np.zeros(len(array.chips)) if world.chip_delay is None else np.asarray(world.chip_delay)
    readings = np.empty((len(t), array.n_channels))
    arms = array.regression_matrix[:, :3]
    for delay in np.unique(delays):
        mine = (delays == delay)[array.chip_of_channel]
        rate, acceleration = drive.rate_at(float(delay) + world.tacho_delay)
        rigid = drive.force_at(float(delay)) @ array.axes[mine].T
        rigid += acceleration @ (unread @ arms[mine].T)
        rigid += omega_products(rate @ unread) @ array.centripetal_matrix[mine].T
        readings[:, mine] = rigid
    nothing = np.full(len(t), np.nan)
    warm = np.full(len(t), world.temperature) if temperature is None else temperature
    return world.sense(readings, SampleContext(t, SpinState(nothing, nothing, nothing), warm, drive))
