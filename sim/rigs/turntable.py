"""Prescribed motion of the MuJoCo rig: specific force at the chips of a turntable, a carriage or a free body.

The rig reads the same `World` as the analytic forward model (`sim.forward`) and computes the rigid-body part of the
readings on its own: MuJoCo's tree, gravity and accelerometers instead of closed forms. Prescribed motion sets
position, velocity and acceleration and asks `mj_inverse` for the sensors of exactly that state. Motion by a motor:
`sim.rigs.driven`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.model import world_model
from sim.earth import earth_readings
from sim.forward import arm_growth, lean_states
from sim.motions.motion import BodyMotion, BodyState, SpinMotion
from sim.rigs.mujoco_warnings import mujoco_warnings
from sim.rigs.rig_model import (
    LEAN_JOINT,
    NOD_JOINT,
    SPIN_JOINT,
    across_axis,
    channel_places,
    free_spec,
    nod_axis,
    turntable_spec,
)
from sim.truth import cube_state
from sim.world import World

__all__ = ["prescribed_readings"]


@mujoco_warnings()
def prescribed_readings(world: World, motion: SpinMotion | BodyMotion, t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Specific force along each sensing axis under prescribed motion, by MuJoCo's inverse dynamics.

    Parameters
    ----------
    world : World
        The world; its clock and chip delays decide at which times each chip is asked.
    motion : SpinMotion or BodyMotion
        Motion of the cube: spin of the table, or free motion of the body.
    t : ndarray, shape (n,)
        Time on the board's clock, s.

    Returns
    -------
    ndarray, shape (n, c)
        Readings of ideal sensors, m/s², before the sensing chain.
    """
    free = isinstance(motion.at(t[:1]), BodyState)
    spec = free_spec(world) if free else turntable_spec(world)
    spec.compiler.fusestatic = spec.compiler.discardvisual = True  # what neither moves nor senses costs time only
    model = spec.compile()
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT  # motion is given: friction can't change it
    places = channel_places(model, world.array)
    chip_times = world.chip_times(t)  # (n, k)
    readings = np.empty((len(t), world.array.n_channels))
    delays = np.zeros(len(world.array.chips)) if world.chip_delay is None else np.asarray(world.chip_delay)
    for delay in np.unique(delays):
        together = delays == delay
        times = chip_times[:, int(np.argmax(together))]
        imposed = _imposed(world, model, motion, times)
        channels = together[world.array.chip_of_channel]
        ideal = _inverse(model, *imposed, gravity=_gravity(world, motion, times))[:, places]
        if world.earth_rate is not None:
            state = motion.at(times)
            body = state if isinstance(state, BodyState) else cube_state(world, state)
            ideal += earth_readings(world.array, world.earth_rate, body)
        readings[:, channels] = ideal[:, channels]
    return readings


def _imposed(
    world: World, model: mujoco.MjModel, motion: SpinMotion | BodyMotion, t: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Positions, velocities and accelerations of the joints for a motion."""
    state = motion.at(t)
    if isinstance(state, BodyState):
        return _free_state(state)
    first, second = arm_growth(world, cast("SpinMotion", motion), t) if world.moving_arms else (0.0, 0.0)
    return _table_state(world, model, state, first, second, lean_states(world, cast("SpinMotion", motion), t))


def _table_state(
    world: World,
    model: mujoco.MjModel,
    spin: world_model.SpinState,
    growth: NDArray[np.float64] | float,
    growing: NDArray[np.float64] | float,
    leaning: Sequence[NDArray[np.float64]] = (),
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Positions, velocities and accelerations of the rig's joints, each (n, nv), for a spin of the table.

    ``growth`` and ``growing`` are the first and second derivative of the arms' relative length, ``leaning`` each lean
    of the cube with its derivatives (3, n).
    """
    position, velocity, acceleration = (np.zeros((len(spin.angle), model.nv)) for _ in range(3))
    place = model.joint(SPIN_JOINT).dofadr[0]
    position[:, place], velocity[:, place], acceleration[:, place] = spin.angle, spin.rate, spin.acceleration
    if world.nod:
        place = model.joint(NOD_JOINT).dofadr[0]
        lean = (part @ nod_axis(world) for part in world.nod.lean(spin))
        position[:, place], velocity[:, place], acceleration[:, place] = lean
    for index, state in enumerate(leaning):
        place = model.joint(f"{LEAN_JOINT}{index}").dofadr[0]
        position[:, place], velocity[:, place], acceleration[:, place] = state
    if world.stretch:
        # Unless the arms are said to move, their own velocity is left out, as in the forward model.
        mount = Rotation.from_rotvec(world.mount_rotvec)
        arms = across_axis(mount.inv().apply(world.cube_offset) + world.array.chip_positions, mount)
        for chip, arm in zip(world.array.chips, np.linalg.norm(arms, axis=1), strict=True):
            if arm:
                place = model.joint(f"stretch_{chip.name}").dofadr[0]
                position[:, place] = arm * world.stretch * spin.rate**2
                velocity[:, place], acceleration[:, place] = arm * growth, arm * growing
    return position, velocity, acceleration


def _free_state(body: BodyState) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Position (n, 7), velocity and acceleration (n, 6) of a free joint: linear in world, angular in body axes."""
    quaternion = Rotation.from_matrix(body.rotation).as_quat(scalar_first=True)
    return (
        np.hstack([body.position, quaternion]),
        np.hstack([body.velocity, body.omega]),
        np.hstack([body.acceleration, body.alpha]),
    )


def _gravity(world: World, motion: SpinMotion | BodyMotion, t: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return gravity as a rig is under it that is shaken in the room, (n, 3), m/s²; None where nothing shakes it."""
    if not world.shakes:
        return None
    spin = cast("SpinMotion", motion).at(t)
    shaken = np.sum([shake(spin, t) for shake in world.shakes], axis=0)
    return np.asarray(np.array([0.0, 0.0, -world.gravity]) - shaken)


def _inverse(
    model: mujoco.MjModel,
    position: NDArray[np.float64],
    velocity: NDArray[np.float64],
    acceleration: NDArray[np.float64],
    *,
    gravity: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """Return the sensor data (n, s) in imposed states, under a gravity (n, 3) of each."""
    data = mujoco.MjData(model)
    qpos, qvel, qacc, sensors = data.qpos, data.qvel, data.qacc, data.sensordata  # views into the simulation
    log = np.empty((len(position), model.nsensordata))
    inverse = mujoco.mj_inverse
    for row, (q, v, a) in enumerate(zip(position, velocity, acceleration, strict=True)):
        qpos[:] = q
        qvel[:] = v
        qacc[:] = a
        if gravity is not None:
            model.opt.gravity[:] = gravity[row]
        inverse(model, data)
        log[row] = sensors
    return log
