"""What recordings can show before they are explained: quality of the data, and effects that the motion separates."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from gfimu.base.declared import Declared, Table, figure, table
from gfimu.base.errors import InputError
from gfimu.base.results import Panel, PlottedResult, Series, columns_of, text_column
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
from gfimu.model.world_model import WorldModel, is_linear, reads_place
from gfimu.recording import Recording, own_alignment
from gfimu.recording.doubts.judge import doubts_of

__all__ = ["CheckedRun", "EffectView", "RunCheck", "UsefulRun", "check_runs", "turns_one_way"]


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
    displaced : float
        Standard deviations [1] from which a reference is early or late.
    """

    duration: float = 30.0
    rate: float = 0.5
    speed: float = 0.01
    share: float = 0.05
    turns: float = 3.0
    displaced: float = 5.0


@dataclass(frozen=True)
class CheckedRun(Declared):
    """A recording: its length, and how it moves where its reference says that."""

    name: Annotated[str, figure("Its name.", head="run")]
    duration_s: Annotated[float, figure("Length.", "s", head="length")]
    sample_rate_hz: Annotated[float | None, figure("Sample rate.", "Hz", head="rate", absent=True)] = None
    fastest_rad_s: Annotated[float | None, figure("Largest rate.", "rad/s", absent=True)] = None
    largest_acceleration_rad_s2: Annotated[
        float | None, figure("Largest angular acceleration (99 % quantile).", "rad/s²", absent=True)
    ] = None
    fastest_m_s: Annotated[float | None, figure("Of a stage: largest speed.", "m/s", absent=True)] = None
    largest_acceleration_m_s2: Annotated[
        float | None, figure("Of a stage: largest acceleration (99 % quantile).", "m/s²", absent=True)
    ] = None
    turns: Annotated[float | None, figure("Turns, all directions summed.", head="turns", form=".3g", absent=True)] = (
        None
    )
    share_forwards: Annotated[float | None, figure("Share of the time that it turns forwards.", absent=True)] = None
    share_backwards: Annotated[float | None, figure("Share of the time that it turns backwards.", absent=True)] = None
    share_at_rest: Annotated[float | None, figure("Share of the time at rest.", absent=True)] = None
    lowest_degC: Annotated[float | None, figure("Lowest temperature.", "°C", absent=True)] = None
    highest_degC: Annotated[float | None, figure("Highest temperature.", "°C", absent=True)] = None

    @property
    def fastest(self) -> Annotated[str, figure("Largest rate or speed.", head="fastest", in_json=False)]:
        """Largest rate or speed with its unit."""
        return _with_unit(self.fastest_rad_s, "rad/s") or _with_unit(self.fastest_m_s, "m/s")

    @property
    def acceleration(self) -> Annotated[str, figure("Largest acceleration.", head="acceleration", in_json=False)]:
        """Largest acceleration with its unit."""
        angular, linear = self.largest_acceleration_rad_s2, self.largest_acceleration_m_s2
        return _with_unit(angular, "rad/s²") or _with_unit(linear, "m/s²")

    @property
    def shares(self) -> Annotated[str, figure("Shares.", head="forwards / backwards / rest", in_json=False)]:
        """Shares of the time in each direction and at rest, in percent."""
        shares = [one for one in (self.share_forwards, self.share_backwards, self.share_at_rest) if one is not None]
        return " / ".join(f"{100 * share:.0f}" for share in shares) + " %" if shares else ""

    @property
    def in_words(self) -> str:
        """The recording in one line."""
        parts = [
            f"{self.duration_s:.4g} s",
            self.sample_rate_hz and f"{self.sample_rate_hz:.4g} Hz",
            self.fastest and f"up to {self.fastest}",
            self.turns is not None and f"{self.turns:.3g} turns",
            self.shares and f"forwards / backwards / at rest {self.shares}",
        ]
        return f"{self.name}: {', '.join(part for part in parts if part)}."


def _with_unit(value: float | None, unit: str) -> str:
    return "" if value is None else f"{value:.3g} {unit}"


@dataclass(frozen=True)
class EffectView(Declared):
    """How well the motion shows an effect of its usual size."""

    name: Annotated[str, figure("The effect.", head="effect")]
    detectability: Annotated[
        float,
        figure(
            "d′: its size in standard deviations, the motion unknown; below 5 it may be missed.", head="d′", form=".3g"
        ),
    ]
    confused_with: Annotated[tuple[str, ...], figure("Effects that explain it as well.")]
    remedy: Annotated[str, figure("What would separate it.")]

    @property
    def seen(self) -> bool:
        """Whether it is found nearly always."""
        return self.detectability >= Policy().seen

    @property
    def alike(self) -> Annotated[str, figure("The first of them.", head="not separable from", in_json=False)]:
        """The first of the effects that explain it as well."""
        return ", ".join(self.confused_with[:4])


@dataclass(frozen=True)
class RunCheck(Declared, PlottedResult):
    """What recordings can show: quality of the data, and effects that their motion shows and separates.

    Examples
    --------
    >>> import gfimu
    >>> seen = gfimu.check(gfimu.simulate("paper_run", seed=1), "cube12_turntable")
    >>> "bias" in [one.name for one in seen.effects if one.seen]
    True
    """

    runs: Annotated[tuple[CheckedRun, ...], figure("The recordings.")]
    findings: Annotated[tuple[str, ...], figure("What is odd about the data.")]
    effects: Annotated[
        tuple[EffectView, ...],
        figure("The twin's effects that have a size, the best seen first; none of a free body."),
    ]
    advice: Annotated[tuple[str, ...], figure("What one more minute of recording should be.")]

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per effect: how well the motion shows it, and what it is confounded with."""
        names = {"effect": text_column(effect.name for effect in self.effects)}
        confused = {"confused_with": text_column(", ".join(effect.confused_with) for effect in self.effects)}
        return names | columns_of(self.effects, "detectability seen") | confused

    def shown(self) -> Iterator[Table | str]:
        """Yield the tables and sentences that people read."""
        yield table("Recordings", self.runs, "name duration_s sample_rate_hz fastest acceleration turns shares")
        for run in self.runs:
            if run.lowest_degC is not None:
                yield f"Temperature of {run.name}: {run.lowest_degC:.4g} to {run.highest_degC:.4g} °C."
        yield self._data
        if self.effects:
            yield table(
                "What this motion shows of the simulation's effects, each in its usual size",
                self.effects,
                "name detectability alike",
                note="d′: size in standard deviations with the motion unknown; below 5 it may be missed.",
            )
        yield from self._advised

    def in_short(self) -> Iterator[str]:
        """Yield a few lines, to stand before a diagnosis."""
        yield from (run.in_words for run in self.runs)
        yield self._data
        if self.effects:
            alone = [effect for effect in self.effects if effect.seen and not effect.confused_with]
            yield f"This motion shows {len(alone)} of {len(self.effects)} effects alone, each in its usual size."
            if alike := [one.name for one in self.effects if one.confused_with]:
                yield f"Not separable from others by it: {', '.join(alike)}."
            if unseen := [one.name for one in self.effects if not one.seen]:
                yield f"May be missed in their usual size: {', '.join(unseen)}."
        yield from self._advised

    @property
    def _data(self) -> str:
        return f"Data: {'; '.join(self.findings) or 'nothing odd.'}"

    @property
    def _advised(self) -> list[str]:
        return [f"- {line}" for line in self.advice]

    def _heading(self) -> str:
        return "What the recordings can show"

    def _notes(self) -> tuple[str, ...]:
        return (*self.findings, *self.advice)

    def _panels(self) -> list[Panel]:
        names = tuple(effect.name for effect in self.effects)
        sizes = Series("", np.array([one.detectability for one in self.effects], dtype=float))
        return [
            Panel("detectability of effects of usual size", "d′, standard deviations", (sizes,), names, scale="zero")
        ]


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
        findings += [f"{name}: {one.text}" for one in doubts_of(recording, model.array)]
        findings += [f"{name}: {one}" for one in _times_of_reference(recording, model)]
    seen = tuple(_with_temperature(name, one) for name, one in zip(names, recordings, strict=True))
    if model.drive_source == "gyro":
        return RunCheck(seen, tuple(findings), (), ())
    runs = [prepare_run(one, model, name=name) for one, name in zip(recordings, names, strict=True)]
    seen = tuple(_with_motion(one, run, model, useful) for one, run in zip(seen, runs, strict=True))
    effects = _effects(runs, model)
    return RunCheck(seen, tuple(findings), effects, tuple(_advice(seen, effects, useful)))


def _times_of_reference(recording: Recording, model: WorldModel) -> list[str]:
    """Return where the reference does not fit the channels in time."""
    found = None if model.drive_source == "gyro" or is_linear(model) else own_alignment(recording)
    if found is None or found.doubts:
        return []
    late = found.apart(found.middle_s)
    if abs(late) < max(UsefulRun().displaced * found.offset_std, recording.sample_period):
        return []
    text = (
        f"the reference is {abs(late):.3g} ± {found.offset_std:.2g} s {'early' if late > 0.0 else 'late'} against the "
        "channels in the middle of the recording"
    )
    return [text]


def _with_motion(seen: CheckedRun, run: Run, model: WorldModel, useful: UsefulRun) -> CheckedRun:
    """Return a recording with its rate, speeds and, of what turns, turns."""
    known = run.reference_valid
    t, drive = run.t[known], run.reference[known]
    place = drive if is_linear(model) else np.unwrap(drive)
    rate = np.gradient(place, t) if reads_place(model) else drive
    fastest = float(np.max(np.abs(rate)))
    acceleration = float(np.quantile(np.abs(np.gradient(rate, t)), 0.99))
    slow = useful.speed if is_linear(model) else useful.rate
    found = replace(
        seen,
        duration_s=run.duration,
        sample_rate_hz=1.0 / run.sample_period,
        share_forwards=float(np.mean(rate > slow)),
        share_backwards=float(np.mean(rate < -slow)),
        share_at_rest=float(np.mean(np.abs(rate) < 0.1 * slow)),
    )
    if is_linear(model):
        return replace(found, fastest_m_s=fastest, largest_acceleration_m_s2=acceleration)
    turns = turns_one_way(rate, t)
    return replace(found, fastest_rad_s=fastest, largest_acceleration_rad_s2=acceleration, turns=turns)


def turns_one_way(rate: NDArray[np.float64], t: NDArray[np.float64]) -> float:
    """Return the most turns between two places of the table: turning back takes none away."""
    return float(np.ptp(cumulative_trapezoid(rate, t, initial=0.0)) / (2.0 * np.pi))


def _with_temperature(name: str, recording: Recording) -> CheckedRun:
    """Return a recording with the lowest and the highest temperature of the board, where it has any."""
    seen = CheckedRun(name, recording.duration)
    temperature = recording.reference.get("temperature_degC")
    if temperature is None or not np.isfinite(temperature).any():
        return seen
    return replace(seen, lowest_degC=float(np.nanmin(temperature)), highest_degC=float(np.nanmax(temperature)))


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
    contenders = [replace(contender, positive=np.zeros_like(contender.positive)) for contender in contenders]
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
    return [name for index, name in enumerate(found.effects) if close[index] and index != place]


def _advice(runs: Sequence[CheckedRun], effects: Sequence[EffectView], useful: UsefulRun) -> list[str]:
    """Return what one more recording should be."""
    advice = []
    if math.ceil(sum(run.duration_s for run in runs)) < useful.duration:
        advice.append(f"record longer: {useful.duration:.0f} s at least, a minute is better")
    turns = [one.turns for one in runs if one.turns is not None]
    ways = {
        "forwards": [one.share_forwards for one in runs],
        "backwards": [one.share_backwards for one in runs],
        "rest": [one.share_at_rest for one in runs],
    }
    missing = [way for way, shares in ways.items() if not any((share or 0.0) > useful.share for share in shares)]
    if missing and missing[0] != "rest":
        advice.append(
            f"{'turn' if turns else 'move'} {missing[0]} as well: what goes with the rate and with its size can't be "
            "separated otherwise"
        )
    if turns and max(turns) < useful.turns:
        advice.append("make several whole turns one way: an axis out of level and ripples show once per turn")
    if "rest" in missing:
        advice.append("begin with a few seconds of rest: biases are seen there")
    unseen = [effect for effect in effects if not effect.seen or effect.confused_with]
    remedies = dict.fromkeys(one.remedy for one in unseen if one.remedy)
    advice += [f"{remedy}, for {', '.join(_of(unseen, remedy))}" for remedy in list(remedies)[:4]]
    return advice


def _of(effects: Sequence[EffectView], remedy: str) -> list[str]:
    return [effect.name for effect in effects if effect.remedy == remedy]
