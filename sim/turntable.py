"""The MuJoCo rig: a turntable (or a free body) with the sensor cube, prescribed or driven.

The rig reads the same `World` as the analytic forward model (`sim.forward`) and computes the rigid-body part of the
readings on its own: MuJoCo's tree, gravity and accelerometers instead of closed forms. Prescribed motion sets
position, velocity and acceleration and asks `mj_inverse` for the sensors of exactly that state. Driven motion steps
the motor and its friction; truth and sensors are logged together from the state before each step, because after it
MuJoCo's sensors still belong to the old state, position and velocity to the new one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly
from scipy.spatial.transform import Rotation

from gfimu import world_model
from gfimu.errors import InputError
from gfimu.files.model_files import find_model
from gfimu.geometry.array import AccelerometerArray
from gfimu.short_repr import short_repr
from sim.earth import earth_readings
from sim.forward import arm_growth, lean_states
from sim.motion import BodyMotion, BodyState, SpinMotion, SpinState, SplineSpin
from sim.mujoco_warnings import mujoco_warnings
from sim.truth import cube_state
from sim.world import Nod, World

__all__ = ["DrivenRun", "drive", "free_model", "prescribed_readings", "turntable_model"]

_NOD_JOINT = "nod"
_LEAN_JOINT = "lean"
_SPIN_JOINT = "spin"
_LONGEST_STEP = 1e-3  # physics step of a driven run, s


@dataclass(frozen=True)
class DrivenRun:
    """What a motor-driven table did, logged at every physics step from the state before the step.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Time, s.
    state : SpinState
        Angle, rate and angular acceleration at these times.
    readings : ndarray, shape (n, c)
        Specific force along each sensing axis at these times, m/s².
    tacho : ndarray, shape (n,)
        MuJoCo's rate sensor, rad/s.
    torque : ndarray, shape (n,)
        Motor torque after its limit, N·m.
    """

    t: NDArray[np.float64]
    state: SpinState
    readings: NDArray[np.float64]
    tacho: NDArray[np.float64]
    torque: NDArray[np.float64]

    __repr__ = short_repr

    @property
    def motion(self) -> SplineSpin:
        """The run as a motion: angle, rate and acceleration pass through the logged ones."""
        step = np.diff(self.t)
        rate, gain = self.state.rate, step * self.state.acceleration[:-1]
        # Rate within a step: ω + hα u + c₂u² + c₃u³ + c₄u⁴, u from 0 to 1; its end, end slope and integral are given.
        conditions = np.array([[1, 1, 1], [2, 3, 4], [1 / 3, 1 / 4, 1 / 5]])
        missing = np.stack(
            [
                np.diff(rate) - gain,
                step * np.diff(self.state.acceleration),
                np.diff(self.state.angle) / step - rate[:-1] - gain / 2,
            ]
        )  # (3, n - 1)
        c2, c3, c4 = np.linalg.solve(conditions, missing)
        coefficients = np.stack([c4 / step**4, c3 / step**3, c2 / step**2, gain / step, rate[:-1]])
        return SplineSpin(
            PPoly(coefficients, self.t), start=float(self.t[0]), angle_at_start=float(self.state.angle[0])
        )


@mujoco_warnings()
def turntable_model(world: World) -> mujoco.MjModel:
    """Compile the turntable of ``models/mjcf/turntable.xml`` for a world.

    The world decides the chips, the cube's place and attitude on the table, the tilt of the axis and gravity. A
    nodding axis gets a hinge of its own, and stretching arms a slide for each chip; prescribed motion moves both. On a
    linear axis the table slides.
    """
    return _turntable(world).compile()


@mujoco_warnings()
def free_model(world: World) -> mujoco.MjModel:
    """Compile the free cube of ``models/mjcf/free_cube.xml`` with the chips and the gravity of a world."""
    return _free_cube(world).compile()


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
    spec = _free_cube(world) if free else _turntable(world)
    spec.compiler.fusestatic = spec.compiler.discardvisual = True  # what neither moves nor senses costs time only
    model = spec.compile()
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT  # motion is given: friction can't change it
    chip_times = world.chip_times(t)  # (n, k)
    readings = np.empty((len(t), world.array.n_channels))
    delays = np.zeros(len(world.array.chips)) if world.chip_delay is None else np.asarray(world.chip_delay)
    for delay in np.unique(delays):
        together = delays == delay
        times = chip_times[:, int(np.argmax(together))]
        imposed = _imposed(world, model, motion, times)
        channels = together[world.array.chip_of_channel]
        ideal = _inverse(model, *imposed, gravity=_gravity(world, motion, times))
        if world.earth_rate is not None:
            state = motion.at(times)
            body = state if isinstance(state, BodyState) else cube_state(world, state)
            ideal += earth_readings(world.array, world.earth_rate, body)
        readings[:, channels] = ideal[:, channels]
    return readings


@mujoco_warnings()
def drive(world: World, command: SpinMotion, duration: float, *, step: float = _LONGEST_STEP) -> DrivenRun:
    """Drive the table with its motor after a commanded rate, against inertia and friction.

    The motor's speed controller (proportional and integral, limited torque), dry and viscous friction and inertias
    stand in ``turntable.xml``; a tilted axis and an eccentric cube load the motor with gravity. The nod of the axis
    and the stretch of the arms move no mass here.

    Parameters
    ----------
    world : World
        The world.
    command : SpinMotion
        The command; its rate is what the controller is given, held over each step.
    duration : float
        Length of the run, s.
    step : float
        Physics step, s (fourth-order Runge-Kutta).

    Raises
    ------
    InputError
        If the step is not positive or longer than the duration.
    """
    if not 0 < step <= duration:
        raise InputError(f"physics step {step} s: must be positive and at most the duration {duration} s")
    model = turntable_model(world.changed(nod=Nod(), stretch=0.0, leans=()))
    model.opt.timestep = step
    data = mujoco.MjData(model)
    t: NDArray[np.float64] = np.arange(int(np.floor(duration / step * (1 + 1e-12))) + 2, dtype=float) * step
    wanted = command.at(t)
    data.qpos[0], data.qvel[0] = wanted.angle[0], wanted.rate[0]
    data.act[:] = wanted.angle[0]
    accelerometers, tacho = _accelerometers(model), model.sensor("tachometer").adr[0]
    log = np.empty((len(t), 4))
    sensors = np.empty((len(t), model.nsensordata))
    for row, rate in enumerate(wanted.rate):
        data.ctrl[:] = rate
        # After a Runge-Kutta step qacc is the last stage's, sensordata the first's: log both before the step.
        mujoco.mj_forward(model, data)
        log[row] = data.qpos[0], data.qvel[0], data.qacc[0], data.qfrc_actuator[0]
        sensors[row] = data.sensordata
        mujoco.mj_step(model, data)
    return DrivenRun(
        t, SpinState(log[:, 0], log[:, 1], log[:, 2]), sensors[:, accelerometers], sensors[:, tacho], log[:, 3]
    )


def _turntable(world: World) -> mujoco.MjSpec:
    spec = mujoco.MjSpec.from_file(str(find_model("mjcf", "turntable", suffix=".xml")))
    axis = spec.body("axis")
    axis.quat = _quaternion(Rotation.from_rotvec(world.axis_rotvec))
    if world.slide is not None:
        carried = spec.joint(_SPIN_JOINT)
        carried.type, carried.axis = mujoco.mjtJoint.mjJNT_SLIDE, world.slide
    if world.nod:
        axis.add_joint(name=_NOD_JOINT, type=mujoco.mjtJoint.mjJNT_HINGE, axis=_nod_axis(world))
    mount = Rotation.from_rotvec(world.mount_rotvec)
    arms = mount.inv().apply(world.cube_offset) + world.array.chip_positions  # from the axis, in cube axes
    cube = spec.body("cube")
    cube.pos, cube.quat = world.cube_offset, _quaternion(mount)
    foot = mount.inv().apply(-world.cube_offset)  # of the cube on the axis, in cube axes
    for number, lean in enumerate(world.leans):
        axis = mount.inv().apply(lean.vector / np.linalg.norm(lean.vector))
        cube.add_joint(name=f"{_LEAN_JOINT}{number}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis, pos=foot)
    _fit_chips(spec, world.array, _across(arms, mount) if world.stretch else None)
    spec.option.gravity = [0.0, 0.0, -world.gravity]
    return spec


def _across(arms: NDArray[np.float64], mount: Rotation) -> NDArray[np.float64]:
    """Return the parts of arms (k, 3), in cube axes, across the axis of the table: there the load is."""
    axis = mount.inv().apply([0.0, 0.0, 1.0])
    return np.asarray(arms - np.outer(arms @ axis, axis))


def _nod_axis(world: World) -> NDArray[np.float64]:
    """Return the axis of the hinge that nods."""
    if (direction := world.nod.direction) is None:
        raise InputError("MuJoCo's axis nods about one line; give axis_wobble effects of one direction_rad")
    return np.array([np.cos(direction), np.sin(direction), 0.0])


def _free_cube(world: World) -> mujoco.MjSpec:
    spec = mujoco.MjSpec.from_file(str(find_model("mjcf", "free_cube", suffix=".xml")))
    spec.body("cube").pos = np.zeros(3)
    _fit_chips(spec, world.array, None)
    spec.option.gravity = [0.0, 0.0, -world.gravity]
    return spec


def _fit_chips(spec: mujoco.MjSpec, array: AccelerometerArray, arms: NDArray[np.float64] | None) -> None:
    """Replace the chips drawn in the MJCF by those of the array; with ``arms`` (k, 3) each can slide along its own."""
    cube = spec.body("cube")
    for body in list(cube.bodies):
        spec.delete(body)
    looks = [spec.find_default("board"), spec.find_default("package")]
    for place, chip in enumerate(array.chips):
        body = cube.add_body(name=chip.name, pos=chip.position)
        if arms is not None and np.any(arms[place]):
            axis = arms[place] / np.linalg.norm(arms[place])
            body.add_joint(name=f"stretch_{chip.name}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        for look in looks:
            body.add_geom(look)
        for channel, sensing in zip(chip.channels, chip.axes, strict=True):
            body.add_site(name=channel, quat=_quaternion(_with_x_along(sensing)))
            spec.add_sensor(
                name=channel,
                type=mujoco.mjtSensor.mjSENS_ACCELEROMETER,
                objtype=mujoco.mjtObj.mjOBJ_SITE,
                objname=channel,
            )


def _with_x_along(axis: NDArray[np.float64]) -> Rotation:
    """Rotation of a site whose x axis is the sensing axis."""
    x = axis / np.linalg.norm(axis)
    helper = np.eye(3)[np.argmin(np.abs(x))]
    y = np.cross(helper, x)
    y /= np.linalg.norm(y)
    return Rotation.from_matrix(np.column_stack([x, y, np.cross(x, y)]))


def _quaternion(rotation: Rotation) -> NDArray[np.float64]:
    return np.asarray(rotation.as_quat(scalar_first=True))


def _accelerometers(model: mujoco.MjModel) -> NDArray[np.intp]:
    """Places of the accelerometers' x components in the sensor data, in channel order."""
    return np.asarray(model.sensor_adr[model.sensor_type == mujoco.mjtSensor.mjSENS_ACCELEROMETER], dtype=np.intp)


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
    place = model.joint(_SPIN_JOINT).dofadr[0]
    position[:, place], velocity[:, place], acceleration[:, place] = spin.angle, spin.rate, spin.acceleration
    if world.nod:
        place = model.joint(_NOD_JOINT).dofadr[0]
        lean = (part @ _nod_axis(world) for part in world.nod.lean(spin))
        position[:, place], velocity[:, place], acceleration[:, place] = lean
    for number, state in enumerate(leaning):
        place = model.joint(f"{_LEAN_JOINT}{number}").dofadr[0]
        position[:, place], velocity[:, place], acceleration[:, place] = state
    if world.stretch:
        # Unless the arms are said to move, their own velocity is left out, as in the forward model.
        mount = Rotation.from_rotvec(world.mount_rotvec)
        arms = _across(mount.inv().apply(world.cube_offset) + world.array.chip_positions, mount)
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
    """Return the readings (n, c) of the accelerometers in imposed states, under a gravity (n, 3) of each."""
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
    return log[:, _accelerometers(model)]
