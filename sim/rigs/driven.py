"""A table driven by its motor: many runs stepped together by MuJoCo's batch API, on as many threads as asked for.

Sensors and state are logged from before each step: MuJoCo computes its sensors once per step, at its beginning, so the
sensor data alone are a log in which truth and readings belong together. (After a step the sensors are those of the old
state; the acceleration of a Runge-Kutta step is that of its last stage.)
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, PPoly

from gfimu.base.errors import InputError
from gfimu.base.short_repr import short_repr
from gfimu.model import world_model
from sim.motions.motion import SpinMotion, SpinState, SplineSpin
from sim.rigs.dc_motor import MOTOR_FILE, DcMotor
from sim.rigs.mujoco_warnings import mujoco_warnings
from sim.rigs.rig_model import SPIN_JOINT, channel_places, turntable_spec
from sim.world import Nod, World

__all__ = ["LONGEST_STEP", "Drive", "DrivenRun", "drive", "drive_all"]

LONGEST_STEP = 1e-3
"""Usual physics step of a driven run, s."""

_MOST_STEPS = 20_000_000  # of a run, 3 GB of logs
_CHUNK = 4_000_000  # numbers of sensor data that are held at once, besides the logs
_ACCELERATION = "angular_acceleration"
_TORQUE = "torque"


@dataclass(frozen=True)
class Drive:
    """A run to drive: a world, a command, and what turns the table.

    Parameters
    ----------
    world : World
        The world. The nod of the axis, the leans of the cube and the stretch of the arms move no mass here.
    command : SpinMotion
        What the motor's controller is given, held over each step.
    duration : float
        Length of the run, s.
    step : float
        Physics step, s.
    motor : DcMotor, optional
        The motor; by default the speed controller of ``turntable.xml`` (proportional and integral, limited torque, dry
        and viscous friction), stepped by a Runge-Kutta method of fourth order. A `DcMotor` is stepped by Euler's.

    Raises
    ------
    InputError
        If the step is not positive, longer than the duration or too short for it, or the world is a linear axis.
    """

    world: World
    command: SpinMotion
    duration: float
    step: float = LONGEST_STEP
    motor: DcMotor | None = None

    __repr__ = short_repr

    def __post_init__(self) -> None:
        if not 0 < self.step <= self.duration:
            raise InputError(f"physics step {self.step} s: must be positive and at most the duration {self.duration} s")
        if self.duration / self.step > _MOST_STEPS:
            raise InputError(
                f"physics step {self.step:g} s: {self.duration:g} s take more than {_MOST_STEPS:g}; give a longer step"
            )
        if self.world.slide is not None:
            raise InputError("a linear axis has no motor here: it moves as commanded")

    @property
    def times(self) -> NDArray[np.float64]:
        """Times of the steps, s, (n,); one beyond the duration."""
        return np.arange(int(np.floor(self.duration / self.step * (1 + 1e-12))) + 2, dtype=float) * self.step

    def model(self) -> mujoco.MjModel:
        """Return the compiled model of the rig with sensors for everything that is logged.

        Raises
        ------
        InputError
            If MuJoCo refuses a figure of the motor.
        """
        world = self.world.changed(nod=Nod(), stretch=0.0, leans=())
        spec = turntable_spec(world) if self.motor is None else turntable_spec(world, MOTOR_FILE)
        of_table = {"objtype": mujoco.mjtObj.mjOBJ_XBODY, "objname": "table"}
        of_joint = {"objtype": mujoco.mjtObj.mjOBJ_JOINT, "objname": SPIN_JOINT}
        spec.add_sensor(name=_ACCELERATION, type=mujoco.mjtSensor.mjSENS_FRAMEANGACC, **of_table)
        spec.add_sensor(name=_TORQUE, type=mujoco.mjtSensor.mjSENS_JOINTACTFRC, **of_joint)
        spec.option.timestep = self.step
        spec.compiler.fusestatic = spec.compiler.discardvisual = True  # what neither moves nor senses costs time only
        try:
            if self.motor is not None:
                self.motor.fit(spec)
            return spec.compile()
        except ValueError as error:
            raise InputError(f"motor: {' '.join(str(error).split())}") from None

    def controls(self, wanted: world_model.SpinState) -> NDArray[np.float64]:
        """Return the control inputs of the model for commanded states, (n, inputs)."""
        if self.motor is None:
            return np.column_stack([wanted.rate, wanted.rate])
        if self.motor.control == "voltage":
            return np.asarray(self.motor.constant * wanted.rate[:, None])
        return np.column_stack([wanted.angle, wanted.rate])


@dataclass(frozen=True)
class DrivenRun:
    """What a motor-driven table did, logged from the states before steps.

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
        Torque on the table by the motor after its limit, with its cogging and LuGre friction, N·m.
    euler : bool
        Whether each angle follows from the one before by the new rate (MuJoCo's Euler step).
    """

    t: NDArray[np.float64]
    state: SpinState
    readings: NDArray[np.float64]
    tacho: NDArray[np.float64]
    torque: NDArray[np.float64]
    euler: bool = False

    __repr__ = short_repr

    @property
    def motion(self) -> SplineSpin:
        """The run as a motion: rate and acceleration pass through the logged ones.

        So does the angle of a Runge-Kutta run. That of an Euler run is the integral of the rate: the logged one differs
        from it by half a step times the change of the rate since the start.
        """
        start, angle = float(self.t[0]), float(self.state.angle[0])
        if self.euler:
            spline = CubicHermiteSpline(self.t, self.state.rate, self.state.acceleration)
            return SplineSpin(PPoly(spline.c, self.t), start=start, angle_at_start=angle)
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
        return SplineSpin(PPoly(coefficients, self.t), start=start, angle_at_start=angle)


def drive(
    world: World,
    command: SpinMotion,
    duration: float,
    *,
    step: float = LONGEST_STEP,
    motor: DcMotor | None = None,
) -> DrivenRun:
    """Drive the table with its motor after a commanded motion, against inertia and friction.

    A tilted axis and an eccentric cube load the motor with gravity. Arguments are the fields of `Drive`.

    Raises
    ------
    InputError
        As `Drive`, or if the run does not stay finite.
    """
    (run,) = drive_all([Drive(world, command, duration, step, motor)])
    if isinstance(run, InputError):
        raise run
    return run


def drive_all(
    drives: Iterable[Drive],
    *,
    threads: int = 1,
    every: int = 1,
    progress: Callable[[float], None] | None = None,
) -> list[DrivenRun | InputError]:
    """Drive many tables; those with models of one layout and one number of steps advance together (`mujoco.batch`).

    Parameters
    ----------
    drives : iterable of Drive
        The runs.
    threads : int
        Threads; the result is the same, bit by bit, whatever their number.
    every : int
        Every how many steps a state is logged; of an Euler run `DrivenRun.motion` is then a spline through these.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    list of DrivenRun or InputError
        A result per run, in order; an error where a model is refused or a run does not stay finite.

    Raises
    ------
    InputError
        If there is not at least one thread, or not every so many steps a state.
    """
    if threads < 1 or every < 1:
        raise InputError(f"threads {threads}, every {every}: give at least 1 of each")
    runs = list(drives)
    results: list[DrivenRun | InputError] = [InputError("not run")] * len(runs)
    groups: dict[tuple[int, ...], list[tuple[int, mujoco.MjModel]]] = {}
    for place, run in enumerate(runs):
        try:
            with mujoco_warnings():
                model = run.model()
        except InputError as error:
            results[place] = error
            continue
        groups.setdefault((len(run.times), *_layout(model)), []).append((place, model))
    total, done = sum(len(run.times) for run in runs), 0.0
    report = progress or (lambda share: None)
    for (steps, *_), group in groups.items():
        places, models = [place for place, _ in group], [model for _, model in group]
        part = len(group) * steps / total
        with _unsaid_warnings():
            found = _step_together(
                [runs[place] for place in places],
                models,
                threads,
                every,
                lambda share, part=part, done=done: report(done + part * share),  # type: ignore[misc]
            )
        for place, result in zip(places, found, strict=True):
            results[place] = result
        done += part
    return results


@contextmanager
def _unsaid_warnings() -> Iterator[None]:
    """Keep MuJoCo from writing its warnings to a file: their counters say which run failed."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _layout(model: mujoco.MjModel) -> tuple[int, ...]:
    """Return the sizes that models of one batch share: all that MuJoCo has."""
    sizes = (getattr(model, name) for name in sorted(dir(model)) if name.startswith("n"))
    return tuple(size for size in sizes if isinstance(size, int))


def _step_together(
    drives: Sequence[Drive],
    models: Sequence[mujoco.MjModel],
    threads: int,
    every: int,
    report: Callable[[float], None],
) -> list[DrivenRun | InputError]:
    """Step runs of one layout and length; return a result for each."""
    times = [run.times for run in drives]
    wanted = [run.command.at(t) for run, t in zip(drives, times, strict=True)]
    batch = Batch(models[0], len(drives), min(threads, len(drives)))
    batch.set_models(models)
    qpos, qvel, act = batch.bind("qpos"), batch.bind("qvel"), batch.bind("act")
    for place, (run, state) in enumerate(zip(drives, wanted, strict=True)):
        qpos[place, 0], qvel[place, 0] = state.angle[0], state.rate[0]
        if run.motor is None:
            act[place] = state.angle[0]  # the integral of the commanded rate
    steps = len(times[0])
    controls = [run.controls(state) for run, state in zip(drives, wanted, strict=True)]
    logs = np.empty((len(drives), -(-steps // every), models[0].nsensordata))
    rows = max(every, _CHUNK // (len(drives) * models[0].nsensordata) // every * every)
    warned, stopped = batch.warning[:, :, 1].copy(), np.zeros(len(drives), dtype=bool)
    for first in range(0, steps, rows):
        count = min(rows, steps - first)
        control = np.stack([one[first : first + count] for one in controls])
        sensors = np.empty((len(drives), count, models[0].nsensordata))
        try:
            batch.rollout(count, control, record=("sensordata",), out={"sensordata": sensors})
        except SimulationError as error:
            stopped[error.ids] = True  # the others ran to the end
        kept = sensors[:, ::every]
        logs[:, first // every : first // every + kept.shape[1]] = kept
        report((first + count) / steps)
    failed = stopped | (batch.warning[:, :, 1] != warned).any(axis=1)
    return [
        InputError(
            f"the driven table did not stay finite with a physics step of {run.step:g} s; "
            "give a shorter step_s, or a softer motor"
        )
        if failed[index]
        else _logged(run, models[index], times[index][::every], logs[index])
        for index, run in enumerate(drives)
    ]


def _logged(run: Drive, model: mujoco.MjModel, t: NDArray[np.float64], sensors: NDArray[np.float64]) -> DrivenRun:
    """Return a run from its sensor data, (n, s)."""

    def column(name: str) -> NDArray[np.float64]:
        return sensors[:, int(model.sensor(name).adr[0])]

    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    axis = data.xaxis[model.joint(SPIN_JOINT).id]
    first = int(model.sensor(_ACCELERATION).adr[0])
    acceleration = np.asarray(sensors[:, first : first + 3] @ axis)
    return DrivenRun(
        t,
        SpinState(column("encoder"), column("tachometer"), acceleration),
        sensors[:, channel_places(model, run.world.array)],
        column("tachometer"),
        column(_TORQUE),
        euler=model.opt.integrator == mujoco.mjtIntegrator.mjINT_EULER,
    )
