"""Design of the next experiment: the turntable profile, within limits, that best distinguishes named effects.

The profile that maximises the smallest D_ij (`gfimu.diagnosis.design.distinguishability`) over all ordered pairs of
effects is searched by random starts and local search. Where no motion of an upright array can part two effects, the
proposal is to turn the array onto its side.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.diagnosis.data.run import MINIMUM_DURATION, Run
from gfimu.diagnosis.design.distinguishability import (
    Distinguishability,
    PlannedRun,
    distinguishability,
    normal_equations,
    plan_contenders,
)
from gfimu.diagnosis.design.planned_run import planned, recorded_stretches
from gfimu.diagnosis.design.profile_search import Limits, improve, plain_profile, profile_of, starting_points
from gfimu.diagnosis.design.proposal import SEPARATED, Proposal, in_words, scenario_of
from gfimu.diagnosis.design.table_profile import TableProfile
from gfimu.model.world_model import Effect, WorldModel, is_linear

__all__ = ["MOUNTINGS", "Limits", "Proposal", "design"]

MOUNTINGS: Mapping[str, tuple[float, float, float]] = {
    "on its side, turned by 90° about its x axis": (np.pi / 2, 0.0, 0.0),
    "on its side, turned by 90° about its y axis": (0.0, np.pi / 2, 0.0),
    "upside down, turned by 180° about its x axis": (np.pi, 0.0, 0.0),
}
"""Remountings that an array on a flat table allows: words and rotation vector from upright, rad."""

_SEARCH_RATE = 50.0
_INSEPARABLE = 1e-5
_STARTS = 12
_SHARE_OF_RANGE = 0.9

Report = Callable[[float, str], None]


def design(
    model: WorldModel,
    effects: Sequence[str | Effect],
    *,
    limits: Limits,
    rng: np.random.Generator,
    mountings: Mapping[str, tuple[float, float, float]] = MOUNTINGS,
    recorded: Sequence[Run] = (),
    sample_rate: float = 100.0,
    evaluations: int = 150,
    report: Report | None = None,
) -> Proposal:
    """Propose the experiment that best distinguishes effects.

    Parameters
    ----------
    model : WorldModel
        The simulation.
    effects : sequence of str or Effect
        Two or more; a name stands for the effect in its usual size, an effect for its own size.
    limits : Limits
        Largest rate and acceleration of the table, and length of the recording.
    rng : numpy.random.Generator
        Random number generator of the search.
    mountings : mapping of str to tuple
        How else the array may be mounted, by words; empty: upright only.
    recorded : sequence of Run
        Recordings that exist already and will be diagnosed together with the new one.
    sample_rate : float
        Sample rate of the recording, Hz.
    evaluations : int
        How many profiles to try.
    report : callable, optional
        Called with the share done and a line of text.

    Raises
    ------
    InputError
        If there are fewer than two effects, one is unknown or has no size, the twin is not driven by a table, or the
        limits leave no motion.
    """
    if len(effects) < 2:
        raise InputError("name at least two effects to distinguish, such as tacho_scale sensor_position")
    if model.drive_source == "gyro":
        raise InputError("the twin is a free body (drive source 'gyro'); a turntable profile needs source = \"tacho\"")
    if is_linear(model):
        raise InputError("the twin is a linear axis; gfimu check says what a recording of it shows")
    if limits.duration < MINIMUM_DURATION:
        raise InputError(
            f"duration {limits.duration:g} s is too short to diagnose; allow at least {MINIMUM_DURATION} s"
        )
    progress = report or _silent
    allowed = _within_range(model, limits)
    bench = _Bench(model, effects, recorded, allowed, sample_rate)
    plain = plain_profile(allowed)
    upright = _Plan(bench, [np.zeros(3)])
    before = upright.final(None if recorded else plain)

    points = starting_points(rng, _STARTS)
    tables = []
    for index, point in enumerate(points):
        progress(0.1 * index / len(points), "first profiles")
        tables.append(upright.table(profile_of(point, allowed)))
    ranked = [(_score(table), point) for table, point in zip(tables, points, strict=True)]
    inseparable = _never_parted(tables)
    words, plan, profile, after = "", upright, plain, before
    if not inseparable or not mountings:
        profile = improve(
            ranked, upright.score, allowed, rng, evaluations, lambda share: progress(0.1 + 0.5 * share, "upright")
        )
        after = upright.final(profile)
    if mountings and (inseparable or after.least_nats < SEPARATED):
        # The same profile upright and turned, unless an upright recording is at hand.
        first = [] if recorded else [np.zeros(3)]
        plans = {name: _Plan(bench, [*first, np.array(turn)]) for name, turn in mountings.items()}
        best = [point for _, point in sorted(ranked, key=lambda pair: -pair[0])[:2]]
        tested = {
            name: [(plans[name].score(profile_of(point, allowed)), point) for point in (*best, points[0])]
            for name in plans
        }
        name = max(tested, key=lambda name: max(value for value, _ in tested[name]))
        turned = improve(
            tested[name],
            plans[name].score,
            allowed,
            rng,
            evaluations // 2,
            lambda share: progress(0.6 + 0.4 * share, name),
        )
        remounted = plans[name].final(turned)
        if remounted.least_nats > max(2.0 * after.least_nats, 1.0):
            words, plan, profile, after = name, plans[name], turned, remounted
    x, y, z = (float(value) for value in plan.mountings[-1])
    text = in_words(before, after, words, inseparable, recorded=bool(recorded), limits=allowed, asked=limits)
    return Proposal(
        bench.names,
        (x, y, z),
        bool(words) and not recorded,
        profile,
        before,
        after,
        allowed,
        text,
        scenario_of(model, bench.names, profile, (x, y, z), sample_rate, text),
    )


def _silent(share: float, text: str) -> None:
    """Report nothing."""


class _Bench:
    """What every plan shares: the effects, the recordings at hand, the limits."""

    def __init__(
        self, model: WorldModel, effects: Sequence[str | Effect], recorded: Sequence[Run], limits: Limits, rate: float
    ) -> None:
        self.model, self.effects, self.recorded, self.limits = model, effects, recorded, limits
        self.sample_rate, self.search_rate = rate, min(_SEARCH_RATE, rate)
        self.names = tuple(effect if isinstance(effect, str) else str(effect.name) for effect in effects)


class _Plan:
    """The recordings at hand and one profile in each of some mountings: how well they part the effects."""

    def __init__(self, bench: _Bench, mountings: Sequence[NDArray[np.float64]]) -> None:
        self._bench, self.mountings = bench, mountings
        self._signatures, self._contenders = plan_contenders(
            bench.model,
            bench.effects,
            duration=bench.limits.duration,
            sample_rate=bench.search_rate,
            runs=len(bench.recorded) + len(mountings),
        )
        # Recordings at hand are the same under every profile.
        self._known = normal_equations(*recorded_stretches(bench.model, bench.recorded), self._signatures)[0]

    def table(self, profile: TableProfile | None, sample_rate: float | None = None) -> Distinguishability:
        """Return what a profile adds to the recordings at hand; None: those alone."""
        bench = self._bench
        gram = self._known
        if profile is not None:
            rate = bench.search_rate if sample_rate is None else sample_rate
            runs = [PlannedRun(profile, profile.duration, rate, mounting) for mounting in self.mountings]
            stretches = planned(bench.model, runs, first=len(bench.recorded), noise_rate=bench.sample_rate)
            gram = gram + normal_equations(*stretches, self._signatures)[0]
        return distinguishability(gram, self._contenders)

    def final(self, profile: TableProfile | None) -> Distinguishability:
        """Return the same at the sample rate of the recording."""
        return self.table(profile, self._bench.sample_rate)

    def score(self, profile: TableProfile) -> float:
        """Return what the search maximises."""
        return _score(self.table(profile))


def _score(table: Distinguishability) -> float:
    """Logarithm of the smallest D_ij, and a little of all, so that equal ones are distinguished."""
    logs = np.log(table.nats[~np.eye(len(table.effects), dtype=bool)] + 1e-9)
    return float(logs.min() + 0.02 * logs.mean())


def _never_parted(tables: Sequence[Distinguishability]) -> list[tuple[str, str]]:
    """Return the pairs of which the first, well visible, is explained in full by the second under every profile."""
    left = np.stack([table.energy for table in tables]).max(axis=0)  # (k, k)
    whole = np.stack([table.detectability for table in tables]).max(axis=0) ** 2  # (k,)
    names = tables[0].effects
    count = range(len(names))
    return [
        (names[i], names[j])
        for i in count
        for j in count
        if i != j and whole[i] > 1.0 and left[i, j] < _INSEPARABLE * whole[i]
    ]


def _within_range(model: WorldModel, limits: Limits) -> Limits:
    """Lower the largest rate to what the sensors read without clipping."""
    full_scale = model.expected_noise(100.0).full_scale
    t = np.arange(0.0, limits.duration, 0.05)
    rate = limits.rate
    for _ in range(60):
        within = Limits(rate, limits.acceleration, limits.duration)
        readings, _ = model.predict(plain_profile(within), t)
        if np.abs(readings).max() < _SHARE_OF_RANGE * full_scale:
            return within
        rate *= 0.9
    raise InputError("the twin's sensors clip at any rate of the table; check its range_g and cube_offset_m")
