"""Drawing worlds of the benchmark from their cases: the recording, the truth, and a fresh motion for the judge."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.units import MILLI_G
from sim.effects import Effect, make_effect
from sim.motions.motion import SpinMotion, SplineSpin
from sim.rigs.dc_motor import DcMotor
from sim.rigs.driven import drive
from sim.trials.benchmark.generators import foreign_effects, foreign_world, independent_profiles
from sim.trials.benchmark.generators import independent_effects as table_effects
from sim.trials.benchmark.generators import independent_table as table
from sim.trials.benchmark.generators import independent_world as table_world
from sim.trials.benchmark.release import Case
from sim.trials.benchmark.unlisted import UNLISTED_TRUTH
from sim.trials.benchmark.world import FreshMotion, Task, Truth, World
from sim.trials.worlds.elsewhere import recorded_elsewhere
from sim.trials.worlds.hidden import (
    FORMLESS,
    Measurement,
    clipped_motion,
    detectability,
    hidden_effect,
    measure,
    random_profile,
    temperature_course,
)
from sim.twin import Twin

__all__ = ["draw", "fresh_motion", "nominal_twin"]

Floats = NDArray[np.float64]

_IN_THE_DRIVE = frozenset({"cogging", "bearing_friction"})
"""Effects that change the motion itself: in a recording of another generator they are part of it."""

_ARRAY = "cube12"
_FRESH_S = 20.0  # length of a fresh motion
_FRESH = 99  # its stream of chance, apart from the recording's
_LEAD = 1.5  # s that the motor runs before the recording begins
_MOTOR_STEP = 5e-4  # physics step of the motor, s
_TOP_ON_MOTOR = 8.0  # rad/s, which a motor of 24 V reaches


def nominal_twin(case: Case) -> Twin:
    """Return the simulation of a case, which lacks what is hidden."""
    return Twin(AccelerometerArray.load(_ARRAY), array_name=_ARRAY, sample_rate=case.sample_rate)


def draw(case: Case, attempt: int = 0) -> World:
    """Draw the world of a case.

    Parameters
    ----------
    case : Case
        The case.
    attempt : int
        Which draw: 0, or a further one where what is hidden could not be seen in those before.

    Returns
    -------
    World
        Task, truth without ties, and the true motion.
    """
    twin = nominal_twin(case)
    if case.generator in {"campaign", "dcmotor"}:
        return _of_campaign(case, twin, case.seed(attempt))
    module = {"table": table_world, "programmed": independent_profiles, "foreign": foreign_world}[case.generator]
    recording, run = recorded_elsewhere(
        cast(Any, module).hide, case.seed(attempt), case.effects, case.size, twin.array, _setting(case)
    )
    motion = SplineSpin.through(recording.t_s, recording.reference["tacho_rad_s"])
    if case.set_name == "unlisted":
        known = UNLISTED_TRUTH[case.effects[0]]
        truth = Truth(_plain(run.truth), (), {}, known.place, known.right, known.near, _finite(run.detectability))
    else:
        truth = Truth(_plain(run.truth), distance=_finite(run.detectability))
    return World(Task(case.world, recording, twin), truth, motion)


def _of_campaign(case: Case, twin: Twin, seed: int) -> World:
    """Draw a world of the project's own simulation, on a drawn profile or on one that a motor made of it."""
    rng = np.random.default_rng(seed)
    setting = _setting(case)
    drawn = partial(_motion, rng, case, twin, case.duration)
    motion = clipped_motion(drawn, twin, setting) if "saturation" in case.effects else drawn()
    hidden = [hidden_effect(rng, twin, name, motion, case.size, setting) for name in case.effects]
    recording = measure(rng, twin, hidden, setting, motion=motion)
    sizes = [detectability(twin, [one], motion, setting) for one in hidden if one.name not in FORMLESS]
    truth = Truth(
        _plain([(one.name, one.parameters) for one in hidden]),
        ("cogging",) if case.generator == "dcmotor" else (),
        distance=min(sizes, default=float("nan")),
    )
    return World(Task(case.world, recording, twin), truth, motion)


def _motion(rng: np.random.Generator, case: Case, twin: Twin, duration: float) -> SpinMotion:
    """Draw a motion of the table; that of a motor has its cogging, friction and servo error in it."""
    if case.generator != "dcmotor":
        return random_profile(rng, duration)
    command = _Later(random_profile(rng, duration + 2 * _LEAD, top_rate=_TOP_ON_MOTOR), 0.0)
    motor = DcMotor(
        cogging=float(rng.uniform(0.002, 0.01)),
        cogging_periods=int(rng.choice([12, 24, 36])),
        cogging_phase=float(rng.uniform(-np.pi, np.pi)),
        coulomb=(coulomb := float(rng.uniform(0.01, 0.03))),
        static=1.4 * coulomb,
        stiffness=float(rng.uniform(4.0, 10.0)),
    )
    run = drive(twin.world(), command, duration + 2 * _LEAD, step=_MOTOR_STEP, motor=motor)
    return _Later(run.motion, _LEAD)


class _Later:
    """A motion seen from a later zero of time, its angle zero there."""

    def __init__(self, spin: SpinMotion, begin: float) -> None:
        self._spin, self._begin = spin, begin
        self._angle = float(spin.at(np.array([begin])).angle[0])

    def at(self, t: Any) -> Any:
        """State of the motion at times ``t``, s, shape (n,)."""
        state = self._spin.at(np.asarray(t, dtype=float) + self._begin)
        return replace(cast(Any, state), angle=state.angle - self._angle)


def _setting(case: Case) -> Measurement:
    return Measurement(case.duration, case.sample_rate, case.bias_instability_mg * MILLI_G, case.tacho_noise)


def fresh_motion(case: Case, truth: Truth, seed: int) -> FreshMotion | None:
    """Return another motion of a world without noise; None where what is hidden has no noise-free form there.

    Parameters
    ----------
    case : Case
        The case.
    truth : Truth
        What is hidden in its world.
    seed : int
        Seed of the draw that made it.
    """
    names = [name for name, _ in truth.hidden]
    own = case.generator in {"campaign", "dcmotor"}
    if FORMLESS & set(names) or (not own and _IN_THE_DRIVE & set(names)):
        return None
    twin = nominal_twin(case)
    t = np.arange(round(_FRESH_S * case.sample_rate)) / case.sample_rate
    rng = np.random.default_rng([seed, _FRESH])
    if own:
        spin, warm = _motion(rng, case, twin, _FRESH_S), temperature_course(rng, t)
        effects = [make_effect(name, parameters) for name, parameters in truth.hidden]
        channels, reference = twin.predict(spin, t, effects=effects, temperature=warm)
    elif case.generator == "foreign":
        spin, warm, channels, reference = _fresh_foreign(case, truth, seed)
    else:
        spin, warm, channels, reference = _fresh_table(case, truth, rng)
    white = twin.expected_noise(case.sample_rate).white
    return FreshMotion(t, spin, warm, channels, reference, white, case.tacho_noise)


def _fresh_table(case: Case, truth: Truth, rng: np.random.Generator) -> tuple[SpinMotion, Floats, Floats, Floats]:
    """Return motion, temperature, channels and reference of the independent generator in another run."""
    world = cast(Any, table_world)
    hidden = dict(truth.hidden)
    plan = world.Setting(duration=_FRESH_S, sample_rate=case.sample_rate, tacho_noise_rad_s=case.tacho_noise)
    rig = cast(Any, table_effects).rig_with(hidden)
    command = cast(Any, table).random_command(rng, _FRESH_S, 25.0 if "saturation" in hidden else 15.0)
    temperature = world.draw_temperature(rng, _FRESH_S)
    run = cast(Any, table).drive_table(command, rig, _FRESH_S)
    t, channels, reference = world.noise_free(run, plan, temperature, hidden, rig, run.readings)
    wired = _without_rounding(channels, t, hidden)
    return SplineSpin.through(run.t, run.rate, angle_at_start=run.angle[0]), temperature(t), wired, reference


def _without_rounding(channels: Floats, t: Floats, hidden: Mapping[str, Any]) -> Floats:
    """Return channels (n, 12) after clipping, ranges and wiring, in steps too fine to matter."""
    wiring = {name: one for name, one in hidden.items() if name not in FORMLESS}
    fine = {**wiring, "coarse_resolution": {"step_m_s2": 1e-9}}
    return np.asarray(cast(Any, table_effects).digital(channels, t, fine, np.random.default_rng(0))[0])


def _fresh_foreign(case: Case, truth: Truth, seed: int) -> tuple[SpinMotion, Floats, Floats, Floats]:
    """Return motion, temperature, channels and reference of a foreign world in another run."""
    world, hidden = cast(Any, foreign_world), dict(truth.hidden)
    plan = world.Setting(duration=_FRESH_S, sample_rate=case.sample_rate, tacho_noise_rad_s=case.tacho_noise)
    run, temperature = world.table_motion(seed, 1, plan)
    _, _, channels, reference = cast(Any, foreign_effects).noise_free(run, world.sample_times(plan), hidden)
    spin = SplineSpin.through(run.t, run.rate, angle_at_start=run.angle[0])
    return spin, temperature(world.sample_times(plan)), channels, reference


def _finite(value: float) -> float:
    return float(value) if np.isfinite(value) else float("nan")


def _plain(hidden: Sequence[tuple[str, Mapping[str, Any]]]) -> tuple[tuple[str, dict[str, Any]], ...]:
    """Return names and parameters as plain numbers, names and lists."""
    return tuple((name, {key: _number(value) for key, value in one.items()}) for name, one in hidden)


def _number(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    return list(value) if isinstance(value, tuple | list | np.ndarray) else value


def effects_of(truth: Truth) -> list[Effect]:
    """Return the hidden effects of a world of the library."""
    return [make_effect(name, parameters) for name, parameters in truth.hidden]
