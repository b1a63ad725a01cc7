"""Which effects are confounded with which, in the standard motions and in experiments that separate them.

Computed by what `gfimu check` and `gfimu design` use: the normal equations of all effects, the drive and the slow noise
marginalised (`gfimu.diagnosis.design.distinguishability`). No measured data are needed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.base.errors import InputError
from gfimu.diagnosis.data.body.run import prepare_body_run
from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.data.run import prepare_run
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.design.distinguishability import (
    Contender,
    distinguishability,
    normal_equations,
    plan_contenders,
)
from gfimu.diagnosis.design.planned_run import PlannedRun, planned, recorded_stretches
from gfimu.diagnosis.fit.evidence import SCALES
from gfimu.diagnosis.fit.learn import starting_point
from gfimu.diagnosis.fit.linear import Point, linearise
from gfimu.diagnosis.policy import Policy
from sim.effects import make_effect
from sim.motions.motion import SplineSpin
from sim.motions.pose_sequence import PoseSequence
from sim.scenarios import Scenario
from sim.simulation import simulate
from sim.twin import Twin
from sim.world import World

__all__ = ["BODY", "CARRIAGE", "TABLE", "Rig", "Table", "data_table", "experiment_tables", "motion_tables", "table_of"]

SIDE = np.array([np.pi / 2, 0.0, 0.0])
SEED = 1


class HeatedRest(PlannedRun):
    """A rest during which the unit is warmed by 10 K and cools again."""

    def stretch(self, model: Twin, index: int) -> Stretch:
        """Return the run as diagnosis would see it, with this temperature."""
        plain = super().stretch(model, index)
        warmth = np.sin(np.pi * plain.run.t / self.duration) ** 2
        return replace(plain, run=replace(plain.run, temperature=25.0 + 10.0 * warmth))


@dataclass(frozen=True)
class Table:
    """What one experiment says of all effects of a rig.

    Parameters
    ----------
    names : tuple of str
        Effects, k.
    detectability : ndarray, shape (k,)
        d′ of each in its usual size.
    explained : ndarray, shape (k, k)
        Share of effect i that the best size of effect j explains; NaN where i does not show.
    nats : ndarray, shape (k, k)
        Expected log likelihood of i over j.
    """

    names: tuple[str, ...]
    detectability: NDArray[np.float64]
    explained: NDArray[np.float64]
    nats: NDArray[np.float64]

    def of(self, name: str) -> dict[str, Any] | None:
        """Return d′ of an effect, and share and nats by rival; None where this rig has no such effect."""
        if name not in self.names:
            return None
        place = self.names.index(name)
        rivals = {
            other: (float(self.explained[place, number]), float(self.nats[place, number]))
            for number, other in enumerate(self.names)
            if number != place
        }
        return {"detectability": float(self.detectability[place]), "rivals": rivals}


@dataclass(frozen=True)
class Rig:
    """A kind of rig: its twin, its standard motions and the experiments it allows, each one or several runs.

    Parameters
    ----------
    twin : Twin
        The simulation.
    motions, experiments : mapping of str to tuple
        Runs by name: planned runs, or scenarios with changes.
    """

    twin: Twin
    motions: Mapping[str, Sequence[Any]]
    experiments: Mapping[str, Sequence[Any]]


def steady(rate: float, duration: float) -> SplineSpin:
    """Return a spin at one rate, rad/s, without start or stop."""
    return SplineSpin.through(np.linspace(-2.0, duration + 2.0, 60), np.full(60, rate))


def _table_rig() -> Rig:
    sweep = Scenario.load("speed_sweep")
    rest = steady(0.0, 130.0)
    poses = PoseSequence("faces_edges")
    middles = 0.5 * poses.rest + (poses.rest + poses.turn) * np.arange(18)
    held = poses.at(middles).rotation
    mountings = Rotation.from_matrix(held).inv().as_rotvec()
    upright, side = PlannedRun(sweep.motion, sweep.duration), PlannedRun(sweep.motion, sweep.duration, mounting=SIDE)
    by_hand = tuple(PlannedRun(rest, poses.rest, mounting=one) for one in mountings)
    heated = HeatedRest(rest, 120.0)
    return Rig(
        Twin.load("cube12_turntable"),
        {
            "constant spin": (PlannedRun(steady(4.0, 30.0), 30.0),),
            "speed sweep": (upright,),
            "tilted rest": (PlannedRun(rest, 60.0, mounting=SIDE / 3.0),),
            "calibration poses": by_hand,
        },
        {
            "sweep": (upright,),
            "sweep + side": (upright, side),
            "sweep + poses": (upright, *by_hand),
            "sweep + heated rest": (upright, heated),
            "all": (upright, side, *by_hand, heated),
        },
    )


def _body_rig() -> Rig:
    twin = replace(Twin.load("cube12_turntable"), drive_source="gyro")
    return Rig(
        twin,
        {"tumble": (("tumble", ()),), "in the hand": (("hand", ()),)},
        {"tumble": (("tumble", ()),), "hand": (("hand", ()),), "tumble + hand": (("tumble", ()), ("hand", ()))},
    )


def _carriage_rig() -> Rig:
    upright, side = ("linear_axis", ()), ("linear_axis", ("mounting_rotvec_rad=[1.5707963, 0.0, 0.0]",))
    return Rig(
        Twin.load("linear_axis"),
        {"strokes of a linear axis": (upright,)},
        {"strokes": (upright,), "strokes + side": (upright, side)},
    )


TABLE, BODY, CARRIAGE = _table_rig(), _body_rig(), _carriage_rig()


def motion_tables(rig: Rig) -> dict[str, Table]:
    """Return what each standard motion of a rig says of its effects."""
    return {name: table_of(rig.twin, runs) for name, runs in rig.motions.items()}


def experiment_tables(rig: Rig) -> dict[str, Table]:
    """Return what each experiment says of the effects of a rig."""
    return {name: table_of(rig.twin, runs) for name, runs in rig.experiments.items()}


def table_of(twin: Twin, runs: Sequence[Any]) -> Table:
    """Return what some runs, diagnosed together, say of the effects of a twin."""
    stretches, point, duration, rate = _seen(twin, runs)
    names = _sized(twin, duration, rate, len(runs))
    signatures, contenders = plan_contenders(twin, names, duration=duration, sample_rate=rate, runs=len(runs))
    found = distinguishability(normal_equations(stretches, point, signatures)[0], _of_either_sign(contenders))
    return Table(found.effects, found.detectability, 1.0 - found.unexplained, found.nats)


def _sized(twin: Twin, duration: float, rate: float, runs: int) -> list[str]:
    """Return the effects that have a size which a motion can enlarge."""
    names = []
    for name in twin.families():
        try:
            plan_contenders(twin, [name], duration=duration, sample_rate=rate, runs=runs)
        except InputError:
            continue
        names.append(name)
    return names


def _of_either_sign(contenders: Sequence[Contender]) -> list[Contender]:
    """As `gfimu check` does: fits of one sign would take ten times as long."""
    return [replace(one, positive=np.zeros_like(one.positive)) for one in contenders]


def _seen(twin: Twin, runs: Sequence[Any]) -> tuple[Sequence[Stretch], Point, float, float]:
    """Return runs as a diagnosis sees them, with their length, s, and sample rate, Hz."""
    if isinstance(runs[0], PlannedRun):
        longest, slowest = max(run.duration for run in runs), min(run.sample_rate for run in runs)
        return *planned(twin, runs), longest, slowest
    ideal = ("sensor.errors=false", "sensor.bandwidth=false")
    recordings = [simulate(Scenario.load(name, changes=[*ideal, *changes]), seed=SEED) for name, changes in runs]
    if twin.drive_source == "gyro":
        bodies = [prepare_body_run(one, twin, name="run") for one in recordings]
        stretches = tuple(BodyStretch(twin, run, number, float(run.t[0])) for number, run in enumerate(bodies))
        prepared, point = bodies, starting_point(stretches, Policy().knots)
    else:
        prepared = [prepare_run(one, twin, name="run") for one in recordings]
        stretches, point = recorded_stretches(twin, prepared)
    period = min(run.sample_period for run in prepared)
    return stretches, point, max(run.duration for run in prepared), 1.0 / period


def data_table(name: str, parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return the same for a fault of the samples, which has no size: what each effect explains of its example.

    The speed sweep is simulated without noise, with the fault in it. The share is that of the misfit, the drive and the
    slow noise at their best, which one effect alone takes away, linear in its sizes; an effect that would need a size
    beyond its limit explains nothing.
    """
    (run,) = TABLE.experiments["sweep"]
    twin = TABLE.twin
    (plain,), point = planned(twin, [run])
    world = make_effect(name, parameters, twin.array).apply(World(twin.array))
    faulty, rng = plain.run.readings, np.random.default_rng(SEED)
    for step in world.data_steps:
        faulty = step(plain.run.t, faulty, rng)
    stretch = replace(plain, run=replace(plain.run, readings=faulty))
    names = _sized(twin, run.duration, run.sample_rate, 1)
    signatures, contenders = plan_contenders(twin, names, duration=run.duration, sample_rate=run.sample_rate)
    gram, score = normal_equations((stretch,), point, signatures)
    whole = float(linearise((stretch,), point).objective - linearise((plain,), point).objective)
    families, rivals = twin.families(), {}
    for one in contenders:
        sizes = families[one.name].sizes(twin.array)
        limits = np.array([size.bound / size.prior_std for size in sizes])
        best = 0.0
        for columns in one.alternatives:
            inner = gram[np.ix_(columns, columns)] + np.eye(len(columns)) / SCALES[-1] ** 2
            size = np.linalg.solve(inner, score[columns])
            if np.all(np.abs(size) <= limits):
                best = max(best, float(score[columns] @ size))
        rivals[one.name] = (best / whole, 0.5 * max(whole - best, 0.0))
    return {"detectability": float(np.sqrt(whole)), "rivals": rivals}
