"""What recordings can show before they are explained: quality of the data, and effects that the motion separates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from gfimu.diagnosis.data.run import Run, prepare_run
from gfimu.diagnosis.design.distinguishability import (
    Distinguishability,
    distinguishability,
    normal_equations,
    plan_contenders,
)
from gfimu.diagnosis.design.planned_run import recorded_stretches
from gfimu.diagnosis.design.proposal import SEPARATED
from gfimu.diagnosis.policy import Policy
from gfimu.errors import InputError
from gfimu.importing.oddities import oddities
from gfimu.recording import Recording
from gfimu.recording.checks import check_recording
from gfimu.results import Panel, PlottedResult, Series, text_column
from gfimu.world_model import WorldModel, is_linear, reads_place

__all__ = ["EffectView", "RunCheck", "UsefulRun", "check_runs", "turns_one_way"]


@dataclass(frozen=True)
class UsefulRun:
    """What a recording should have before a diagnosis asks for nothing more; all by choice.

    Parameters
    ----------
    duration : float
        Length of all runs together [s]: several held-out blocks (`Policy.block_duration`).
    rate : float
        Slowest rate that counts as motion [rad/s]; a tenth of it is rest. A table turns faster, a drift of it slower.
    speed : float
        Slowest speed of a carriage that counts as motion [m/s]; a tenth of it is rest.
    share : float
        Share of the time in each direction, and at rest, from which it is there [1].
    turns : float
        Whole turns one way [1], so that what returns once per turn is seen to return.
    """

    duration: float = 30.0
    rate: float = 0.5
    speed: float = 0.01
    share: float = 0.05
    turns: float = 3.0


@dataclass(frozen=True)
class EffectView:
    """How well the motion shows an effect of usual size.

    Parameters
    ----------
    name : str
        Effect.
    detectability : float
        d′: its size in standard deviations, the drive unknown.
    confused_with : tuple of str
        Effects that explain it as well: expected evidence below `SEPARATED`.
    remedy : str
        What would separate it.
    """

    name: str
    detectability: float
    confused_with: tuple[str, ...]
    remedy: str

    @property
    def seen(self) -> bool:
        """Whether it is found nearly always."""
        return self.detectability >= Policy().seen


@dataclass(frozen=True)
class RunCheck(PlottedResult):
    """Quality of recordings, and the effects that their motion can show and separate.

    Parameters
    ----------
    runs : tuple of dict
        Of each run: name, length, rate, speeds, turns.
    findings : tuple of str
        What is odd about the data.
    effects : tuple of EffectView
        The twin's effects that have a size, the best seen first; empty for a free body.
    advice : tuple of str
        What one more minute should be.

    Examples
    --------
    >>> import gfimu
    >>> seen = gfimu.check(gfimu.simulate("paper_run", seed=1), "cube12_turntable")
    >>> "bias" in [one.name for one in seen.effects if one.seen]
    True
    """

    runs: tuple[dict[str, Any], ...]
    findings: tuple[str, ...]
    effects: tuple[EffectView, ...]
    advice: tuple[str, ...]

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per effect: how well the motion shows it, and what it is confounded with."""
        return {
            "effect": text_column(one.name for one in self.effects),
            "detectability": np.array([one.detectability for one in self.effects], dtype=float),
            "seen": np.array([one.seen for one in self.effects], dtype=bool),
            "confused_with": text_column(", ".join(one.confused_with) for one in self.effects),
        }

    def _heading(self) -> str:
        return "What the recordings can show"

    def _notes(self) -> tuple[str, ...]:
        return (*self.findings, *self.advice)

    def _panels(self) -> list[Panel]:
        names = tuple(one.name for one in self.effects)
        sizes = Series("", np.array([one.detectability for one in self.effects], dtype=float))
        return [
            Panel("detectability of effects of usual size", "d′, standard deviations", (sizes,), names, scale="zero")
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return the check as JSON holds it."""
        return {
            "runs": list(self.runs),
            "findings": list(self.findings),
            "effects": [vars(one) for one in self.effects],
            "advice": list(self.advice),
        }


def check_runs(
    recordings: Sequence[Recording], model: WorldModel, names: Sequence[str], *, useful: UsefulRun = UsefulRun()
) -> RunCheck:
    """Look at recordings before a diagnosis.

    Parameters
    ----------
    recordings : sequence of Recording
        Runs of one rig.
    model : WorldModel
        Assumptions of the simulation about the rig.
    names : sequence of str
        Names of the runs, for people.
    useful : UsefulRun
        What a recording should have.

    Raises
    ------
    InputError
        If a run is too short, or lacks the reference that drives the twin.
    """
    findings: list[str] = []
    for recording, name in zip(recordings, names, strict=True):
        findings += [f"{name}: {one.text}" for one in check_recording(recording, model.array)]
        readings = recording.for_array(model.array)
        odd = oddities(dict(zip(model.array.channels, readings.T, strict=True)))
        findings += [f"{name}: {one}" for one in odd]
        if len(recording.gaps):
            findings.append(f"{name}: {len(recording.gaps)} gaps in its times")
    if model.drive_source == "gyro":
        facts = tuple(
            {"name": name, "duration_s": one.duration, **_temperature(one)}
            for name, one in zip(names, recordings, strict=True)
        )
        return RunCheck(facts, tuple(findings), (), ())
    runs = [prepare_run(one, model, name=name) for one, name in zip(recordings, names, strict=True)]
    facts = tuple(
        _facts(run, name, model, useful) | _temperature(one)
        for run, name, one in zip(runs, names, recordings, strict=True)
    )
    effects = _effects(runs, model)
    return RunCheck(facts, tuple(findings), effects, tuple(_advice(facts, effects, useful)))


def _facts(run: Run, name: str, model: WorldModel, useful: UsefulRun) -> dict[str, Any]:
    """Return length, rate, speeds and, of what turns, turns of a run."""
    known = np.isfinite(run.reference)
    t, drive = run.t[known], run.reference[known]
    place = drive if is_linear(model) else np.unwrap(drive)
    rate = np.gradient(place, t) if reads_place(model) else drive
    unit, slow = ("m", useful.speed) if is_linear(model) else ("rad", useful.rate)
    turns = {} if is_linear(model) else {"turns": turns_one_way(rate, t)}
    return {
        "name": name,
        "duration_s": run.duration,
        "sample_rate_hz": 1.0 / run.sample_period,
        f"fastest_{unit}_s": float(np.max(np.abs(rate))),
        f"largest_acceleration_{unit}_s2": float(np.quantile(np.abs(np.gradient(rate, t)), 0.99)),
        **turns,
        "share_forwards": float(np.mean(rate > slow)),
        "share_backwards": float(np.mean(rate < -slow)),
        "share_at_rest": float(np.mean(np.abs(rate) < 0.1 * slow)),
    }


def turns_one_way(rate: NDArray[np.float64], t: NDArray[np.float64]) -> float:
    """Return the most turns between two places of the table: turning back takes none away."""
    return float(np.ptp(cumulative_trapezoid(rate, t, initial=0.0)) / (2.0 * np.pi))


def _temperature(recording: Recording) -> dict[str, float]:
    """Return the lowest and the highest temperature of the board; empty if the recording has none."""
    temperature = recording.reference.get("temperature_degC")
    if temperature is None or not np.isfinite(temperature).any():
        return {}
    return {"lowest_degC": float(np.nanmin(temperature)), "highest_degC": float(np.nanmax(temperature))}


def _effects(runs: Sequence[Run], model: WorldModel) -> tuple[EffectView, ...]:
    """Return how well each effect of the twin that has a size would show in these runs."""
    families = model.families()
    stretches, point = recorded_stretches(model, runs)
    duration, period = max(run.duration for run in runs), min(run.sample_period for run in runs)
    names = []
    for name in families:
        try:
            plan_contenders(model, [name], duration=duration, sample_rate=1.0 / period, runs=len(runs))
        except InputError:
            continue  # wiring, lost samples: no size that a motion could make larger
        names.append(name)
    signatures, contenders = plan_contenders(model, names, duration=duration, sample_rate=1.0 / period, runs=len(runs))
    # Of either sign, which only makes effects look more alike: fits of one sign would take ten times as long.
    contenders = [replace(one, positive=np.zeros_like(one.positive)) for one in contenders]
    found = distinguishability(normal_equations(stretches, point, signatures)[0], contenders)
    order = np.argsort(-found.detectability)
    return tuple(
        EffectView(
            found.effects[place],
            float(found.detectability[place]),
            tuple(_rivals(found, int(place))),
            str(families[found.effects[place]].separated_by),
        )
        for place in order
    )


def _rivals(found: Distinguishability, place: int) -> list[str]:
    if found.detectability[place] < Policy().seen:
        return []
    close = found.nats[place] < SEPARATED
    return [name for number, name in enumerate(found.effects) if close[number] and number != place]


def _advice(facts: Sequence[dict[str, Any]], effects: Sequence[EffectView], useful: UsefulRun) -> list[str]:
    """Return what one more recording should be."""
    advice = []
    if math.ceil(sum(one["duration_s"] for one in facts)) < useful.duration:
        advice.append(f"record longer: {useful.duration:.0f} s at least, a minute is better")
    ways = {way: any(one[f"share_{way}"] > useful.share for one in facts) for way in ("forwards", "backwards")}
    if not all(ways.values()):
        missing = next(one for one, there in ways.items() if not there)
        way = "turn" if "turns" in facts[0] else "move"
        advice.append(
            f"{way} {missing} as well: what goes with the rate and with its size can't be separated otherwise"
        )
    if max(one.get("turns", useful.turns) for one in facts) < useful.turns:
        advice.append("make several whole turns one way: an axis out of level and ripples show once per turn")
    if not any(one["share_at_rest"] > useful.share for one in facts):
        advice.append("begin with a few seconds of rest: biases are seen there")
    unseen = [one for one in effects if not one.seen or one.confused_with]
    remedies = dict.fromkeys(one.remedy for one in unseen if one.remedy)
    advice += [f"{remedy}, for {', '.join(_of(unseen, remedy))}" for remedy in list(remedies)[:4]]
    return advice


def _of(effects: Sequence[EffectView], remedy: str) -> list[str]:
    return [one.name for one in effects if one.remedy == remedy]
