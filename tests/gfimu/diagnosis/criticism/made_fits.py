"""Short recordings of a table with something hidden in them, fitted with given causes on the new core."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from gfimu import AccelerometerArray
from gfimu.diagnosis import Cause, Policy, make_stretches, prepare, starting_point
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.gauss_newton import Fit, fit
from gfimu.diagnosis.fit.learn import learn_noise, learn_roughness
from gfimu.recording import Recording
from sim.effects import Effect
from sim.trials import Measurement, measure, random_profile
from sim.twin import Twin

Change = Callable[..., None]

POLICY = Policy()
DURATION = 24.0


@cache
def twin() -> Twin:
    return Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


def channel(name: str) -> int:
    return twin().array.channels.index(name)


def recorded(
    seed: int, change: Change | None = None, effects: Sequence[Effect] = (), duration: float = DURATION
) -> Recording:
    """A run whose readings and tachometer are changed by ``change(t, spin, readings, reference)`` after all else."""
    rng = np.random.default_rng(seed)
    motion = random_profile(rng, duration)
    run = measure(rng, twin(), effects, Measurement(duration=duration), motion=motion)
    readings, reference = run.readings.copy(), run.reference["tacho_rad_s"].copy()
    if change is not None:
        change(run.t_s, motion.at(run.t_s), readings, reference)
    columns = {**run.reference, "tacho_rad_s": reference}
    return Recording.from_arrays(run.t_s, readings, twin().array, reference=columns)


def cause(name: str, place: str = "", shape: Mapping[str, float] | None = None) -> Cause:
    """An effect of the library at a place, by default its freest one, without sizes."""
    family = twin().families()[name]
    patterns = family.patterns(twin().array)
    pattern = next((one for one in patterns if one.name == place), None) if place else patterns[0]
    assert pattern is not None
    return Cause(family, pattern.name, pattern.mixing, dict(shape or {}), np.zeros(pattern.mixing.shape[1]))


def fitted(*runs: Recording, causes: Sequence[Cause] = (), exact: bool = False) -> tuple[tuple[Stretch, ...], Fit]:
    """The stretches of runs and a fit of causes, noise and roughness learnt."""
    prepared = prepare(runs, twin(), [f"run {number}" for number in range(len(runs))])
    stretches = make_stretches(twin(), prepared.runs, prepared.effects)
    point = learn_roughness(stretches, replace(starting_point(stretches, POLICY.knots), causes=tuple(causes)), 2)
    first = fit(stretches, point, POLICY)
    point = learn_noise(stretches, learn_roughness(stretches, first.point))
    return stretches, fit(stretches, replace(point, exact=exact), POLICY)


@cache
def quiet() -> tuple[tuple[Stretch, ...], Fit]:
    """A run with nothing hidden, and its fit without causes."""
    return fitted(recorded(1))
