"""Hidden cases whose verdicts are pinned one by one (`hidden_pins`): what is hidden, in which world, what is right."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from gfimu.diagnosis import Diagnosis
from sim.effects import EFFECTS
from sim.study.cases import EXOTICS, Case, study_cases
from sim.study.outcome import HiddenWorld, outcome_of
from sim.study.tally import score

_GENERATORS = Path(__file__).resolve().parents[3] / "sim" / "benchmark" / "generators"
SOURCES = {
    "campaign": "",
    "independent": f"{_GENERATORS / 'independent_world.py'}:hide",
    "programmed": f"{_GENERATORS / 'independent_profiles.py'}:hide",
}
"""Generators of worlds: the project's own; one that shares no code with it; the same under programmed commands."""


@dataclass(frozen=True)
class HiddenCase:
    """A case of a group (``single``, ``pair``, ``outside``, ``null``, ``hard``) and the generator of its world."""

    group: str
    case: Case
    generator: str = "campaign"

    @property
    def source(self) -> str:
        """Generator as `sim.study.outcome.draw_world` takes it."""
        return SOURCES[self.generator]

    @property
    def outside(self) -> bool:
        """Whether what is hidden is in no library."""
        return bool(self.case.without) or bool(set(self.case.effects) & set(EXOTICS))

    @property
    def name(self) -> str:
        """Name of the case in the list of pins and in pytest's output."""
        hidden = "+".join(self.case.effects) or f"{self.case.bias_instability_mg:g}mg"
        size = f"-{self.case.size:.0f}" if self.case.size else ""
        return f"{self.group}-{hidden}{size}-{self.generator}-{self.case.seed}"

    def is_right(self, outcome: Mapping[str, Any]) -> bool:
        """Whether an outcome is right: the hidden names, alone or in a set that the data can't tell apart.

        Nothing where nothing is hidden, ``unknown`` outside the library, or the point of the grammar that it is.
        """
        judged = score(outcome)
        if IN_GRAMMAR.keys() & set(self.case.effects):
            return {cause["effect"] for cause in outcome["causes"]} == {IN_GRAMMAR[name] for name in self.case.effects}
        return judged["unknown"] if self.outside else judged["fair"]


def outcome_in(world: HiddenWorld, hidden: HiddenCase, found: Diagnosis) -> dict[str, Any]:
    """Return the outcome of a world that was drawn and diagnosed, as `sim.study.outcome.run_case` does of a case."""
    limits = {"reached": world.reached, "left_by": world.left_by, "drive_unknown": world.drive_unknown}
    return {"key": hidden.name, **hidden.case.to_dict(), **limits, **outcome_of(found, world.truth)}


IN_GRAMMAR = {"cubic_channel": "cubic"}
"""Points of the grammar by the name that an independent generator has for them."""

_SHORT = {"duration": 12.0}
_TAKEN_OUT = (
    *("table_tilt", "axis_wobble", "channel_skew", "clock_error", "tacho_ripple", "interference_tone", "cogging"),
)
_PAIRS = (
    ("table_tilt", "clock_error"),
    ("scale_factor", "interference_tone"),
    ("eccentricity", "sign_flip"),
    ("mount_tilt", "noise"),
    ("sensor_lag", "axis_wobble"),
    ("cross_axis", "tacho_ripple"),
    ("tacho_latency", "misalignment"),
    ("wrong_range", "channel_skew"),
    ("hysteresis", "table_tilt"),
    ("gain_drift", "sensor_position"),
    ("quadratic", "dropped_frames"),
    ("cogging", "tacho_scale"),
    ("vibration_rectification", "stuck_channel"),
    ("warm_up", "axis_swap"),
)


def _singles() -> list[HiddenCase]:
    """Every effect once; generators and sizes in turn.

    In so short a run of the campaign nothing reaches the clipping level and a mode is weakly excited, so these two are
    the other generator's.
    """
    return [
        HiddenCase(
            "single",
            Case("pinned", 100 + number, (name,), (60.0, 300.0, 1500.0)[number % 3], **_SHORT),
            "independent" if name in {"resonance", "saturation"} or number % 2 else "campaign",
        )
        for number, name in enumerate(EFFECTS)
    ]


def _outside() -> list[HiddenCase]:
    exotic = [
        HiddenCase("outside", Case("pinned", 400 + number, (name,), 600.0, **_SHORT), "independent")
        for number, name in enumerate(EXOTICS)
    ]
    return exotic + [
        HiddenCase(
            "outside",
            Case("pinned", 420 + number, (name,), 600.0, without=name, **_SHORT),
            ("campaign", "independent")[number % 2],
        )
        for number, name in enumerate(_TAKEN_OUT)
    ]


def _nulls() -> list[HiddenCase]:
    """Nothing hidden, at the settings of the studies."""
    settings: list[tuple[str, dict[str, Any]]] = [
        ("campaign", {"bias_instability_mg": 0.05}),
        ("independent", {"bias_instability_mg": 0.15}),
        ("campaign", {"bias_instability_mg": 0.5}),
        ("independent", {"bias_instability_mg": 0.15, "tacho_noise": 0.05}),
        ("campaign", {"duration": 20.0, "sample_rate": 25.0}),
        ("independent", {"duration": 20.0, "sample_rate": 50.0, "bias_instability_mg": 0.5}),
        ("campaign", {"encoder_counts": 4096}),
        ("campaign", {"array": "corners8", "bias_instability_mg": 0.05}),
        ("campaign", {"array": "p3_three_plus_one"}),
        ("independent", {"sample_rate": 200.0, "bias_instability_mg": 0.05}),
        ("programmed", {}),
        ("programmed", {"duration": 20.0, "bias_instability_mg": 0.5}),
        ("programmed", {"duration": 20.0, "sample_rate": 50.0, "tacho_noise": 0.01}),
        ("campaign", {"residue": True, "duration": 20.0}),
    ]
    return [
        HiddenCase("null", Case("pinned", 200 + number, **{**_SHORT, **setting}), generator)
        for number, (generator, setting) in enumerate(settings)
    ]


def _hard() -> list[HiddenCase]:
    """Cases that were answered wrongly once, each for a reason of its own; their remarks say which."""
    by_key = {case.key: case for study in ("singles", "coarse_steps") for case in study_cases(study)}
    pair = {"duration": 40.0, "sample_rate": 200.0, "bias_instability_mg": 0.045, "tacho_noise": 0.0326}
    cases = [
        # A drive that has the state of the instant only named a mode, a lag and a slow clock for the rest of a play.
        ("campaign", Case("pinned", 91_003, ("hysteresis",), 1000.0, duration=40.0)),
        # The width of a narrow play is known no better than readings are estimated: 11 standard deviations off once.
        ("independent", Case("pinned", 970_003, ("hysteresis",), 30.0)),
        # The servo's answer to a ripple is uncertain: 4.2 standard deviations off with the covariance alone.
        ("independent", by_key["singles/10046"]),
        # Two servos that differ leave a ripple of the same order, which was unknown.
        ("independent", by_key["singles/10048"]),
        # No listed time constant is near enough to compete with a temperature that rises much alike.
        ("independent", Case("pinned", 872_024, ("warm_up", "scale_factor"), 791.6, **pair)),
        # A mode that pushes its table back bends the drive to ring itself.
        ("independent", Case("pinned", 511, ("resonance",), 600.0, duration=20.0)),
        # A candidate that several rivals have is listed once.
        ("campaign", by_key["singles/10180"]),
        # Where an offset would meet other edges of coarse steps, slow noise comes through.
        ("campaign", by_key["coarse_steps/993012"]),
        # Slow sampling is no discrepancy.
        ("independent", Case("pinned", 251, ("eccentricity",), 300.0, duration=20.0, sample_rate=25.0)),
        # An encoder of few counts instead of a tachometer.
        ("campaign", Case("pinned", 252, ("table_tilt",), 300.0, duration=20.0, encoder_counts=360)),
        # A calibration residue beside an effect.
        ("campaign", Case("pinned", 253, ("axis_wobble",), 1500.0, duration=20.0, residue=True)),
        # Programmed motion, under which any function of the angle explains a part of a swing.
        ("programmed", Case("pinned", 254, ("cross_axis",), 600.0, duration=20.0)),
    ]
    return [HiddenCase("hard", case, generator) for generator, case in cases]


@cache
def hidden_cases() -> tuple[HiddenCase, ...]:
    """Return every pinned case, in the order of the pins."""
    pairs = [
        HiddenCase(
            "pair",
            Case("pinned", 300 + number, names, 300.0, **_SHORT),
            "campaign" if number % 2 else "independent",
        )
        for number, names in enumerate(_PAIRS)
    ]
    return (*_singles(), *pairs, *_outside(), *_nulls(), *_hard())


def group(name: str) -> list[HiddenCase]:
    """Return the pinned cases of a group."""
    return [hidden for hidden in hidden_cases() if hidden.group == name]
