"""Hidden cases whose verdicts are pinned one by one, and the check that compares an outcome with its pin.

The pins stand in ``hidden_cases.toml``. They are written again, for a review as a diff, by

    python tests/gfimu/diagnosis/hidden_cases.py [--workers 2] [PART OF A NAME ...]

What a right answer is follows from what is hidden; a case that is answered otherwise is a known miss and needs a reason
there.
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from sim.effects import EFFECTS
from sim.study.cases import EXOTICS, Case, study_cases
from sim.study.outcome import run_case
from sim.study.report import visible
from sim.study.runner import open_executor

PINS = Path(__file__).with_suffix(".toml")
_TESTS = Path(__file__).resolve().parents[2]
SOURCES = {
    "campaign": "",
    "independent": f"{_TESTS / 'independent_world.py'}:hide",
    "programmed": f"{_TESTS / 'independent_profiles.py'}:hide",
}
"""Generators of worlds: the project's own; one that shares no code with it; the same under commands as people program."""

WITHIN = 3.0
"""Standard deviations within which the parameters of a rightly named cause must lie."""
LEAST_REMOVED = 0.9
"""Share of the excess error on held-out data that a right extension removes, of effects of d′ 300 and more."""
_GROSS = 300.0


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

    @property
    def right(self) -> str:
        """What is to be reported: the hidden names alone, nothing where nothing is hidden, ``unknown`` outside."""
        if not self.case.effects:
            return "nothing_found"
        return "unknown" if self.outside else f"explained: {' + '.join(sorted(self.case.effects))}"


def reported(outcome: Mapping[str, Any]) -> str:
    """Return verdict and names of an outcome as text; names beside what is unknown belong to it."""
    names = sorted({cause["effect"] for cause in outcome["causes"]})
    link = " or " if outcome["verdict"] == "ambiguous" else " + "
    return f"{outcome['verdict']}: {link.join(names)}" if names else str(outcome["verdict"])


def far_off(outcome: Mapping[str, Any]) -> list[str]:
    """Return the parameters of rightly named causes that lie beyond three standard deviations."""
    return sorted(
        f"{cause['effect']}.{key}"
        for cause in outcome["causes"]
        if cause["effect"] in outcome["effects"]
        for key, z in cause["z"].items()
        if abs(z) >= WITHIN
    )


@dataclass(frozen=True)
class Pins:
    """What is pinned: reports by case, the misses among them with a reason each, documented estimates far off."""

    reports: Mapping[str, str]
    misses: Mapping[str, Mapping[str, str]]
    far_off: Mapping[str, Sequence[str]]

    @classmethod
    def load(cls) -> Pins:
        """Read the pins."""
        table = tomllib.loads(PINS.read_text(encoding="utf-8")) if PINS.exists() else {}
        return cls(table.get("right", {}), table.get("known_misses", {}), table.get("beyond_three_sigma", {}))

    def of(self, name: str) -> str:
        """Return what is reported of a case."""
        return self.misses[name]["reported"] if name in self.misses else self.reports[name]


def problems(hidden: HiddenCase, outcome: Mapping[str, Any], pins: Pins) -> list[str]:
    """Compare an outcome with its pin; returns what is otherwise, empty where it is as pinned."""
    told, pinned = reported(outcome), pins.of(hidden.name)
    found = []
    if told != pinned:
        found.append(f"reported {told!r}, pinned {pinned!r} {outcome.get('error', '')}".rstrip())
    beyond, documented = far_off(outcome), list(pins.far_off.get(hidden.name, []))
    if told == hidden.right and beyond != documented:
        found.append(f"beyond {WITHIN:g} standard deviations: {beyond}, documented {documented}")
    removed = outcome.get("share_of_excess_removed")
    if removed is not None and removed > 1.0:
        found.append(f"share of the excess removed {removed} > 1")
    if not hidden.case.effects and removed is not None:
        found.append(f"share of the excess removed {removed} where nothing is hidden")
    if hidden.case.size >= _GROSS and told == hidden.right and not hidden.outside:
        if removed is not None and removed < LEAST_REMOVED:
            found.append(f"share of the excess removed {removed} < {LEAST_REMOVED} under the right name")
        if outcome["unexplained"]:
            found.append(f"something unexplained beside the right name: {outcome['signature']}")
    return found


_SHORT = {"duration": 12.0}
_TAKEN_OUT = (
    *("table_tilt", "axis_wobble", "channel_skew", "clock_error", "hysteresis", "interference_tone", "cogging"),
    *("tacho_ripple", "tacho_scale"),
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

    In so short a run of the campaign nothing reaches the clipping level and a mode is hardly rung, so these two are the
    other generator's.
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
        # A strong ripple drives the table: steps of a drive without that ended 0.8 rad off in phase.
        ("campaign", Case("pinned", 709, ("cogging",), 1500.0, duration=20.0)),
        # No listed time constant is near enough to compete with a temperature that rises much alike.
        ("independent", Case("pinned", 872_024, ("warm_up", "scale_factor"), 791.6, **pair)),
        # A mode that pushes its table back bends the drive to ring itself.
        ("campaign", Case("pinned", 511, ("resonance",), 600.0, duration=20.0)),
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


def _line(key: str, value: str) -> str:
    return f'"{key}" = {value}\n'


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def write_pins(outcomes: Mapping[str, Mapping[str, Any]], old: Pins) -> str:
    """Return the text of the pins from outcomes by name; reasons are kept, and pins of cases that were not run."""
    reports, misses, far = dict(old.reports), dict(old.misses), dict(old.far_off)
    for hidden in hidden_cases():
        if hidden.name not in outcomes:
            continue
        for table in (reports, misses, far):
            table.pop(hidden.name, None)  # type: ignore[attr-defined]
        outcome = outcomes[hidden.name]
        told = reported(outcome)
        if told == hidden.right or (hidden.outside and outcome["verdict"] == "unknown"):
            reports[hidden.name] = told
        else:
            why = old.misses.get(hidden.name, {}).get("why", "")
            misses[hidden.name] = {"reported": told, "why": why}
        if told == hidden.right and far_off(outcome):
            far[hidden.name] = far_off(outcome)
    names = [hidden.name for hidden in hidden_cases()]
    text = (
        "# What the diagnosis reports of every hidden case of hidden_cases.py, written by that file and reviewed by eye.\n"
        "# A name has the group, what is hidden, its size d', the generator of the world and the seed.\n\n[right]\n"
    )
    text += "".join(_line(name, _quoted(reports[name])) for name in names if name in reports)
    text += "\n# Answered otherwise than it should be today. An improvement fails here too: move its line.\n[known_misses]\n"
    text += "".join(
        _line(name, f"{{ reported = {_quoted(misses[name]['reported'])}, why = {_quoted(misses[name]['why'])} }}")
        for name in names
        if name in misses
    )
    text += "\n# Parameters of a right cause that lie more than three standard deviations off.\n[beyond_three_sigma]\n"
    text += "".join(_line(name, f"[{', '.join(map(_quoted, far[name]))}]") for name in names if name in far)
    return text


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the cases and write their pins; returns the exit code."""
    parser = argparse.ArgumentParser(description="Run the hidden cases and write what is reported into their pins.")
    parser.add_argument("parts", nargs="*", metavar="PART", help="only cases whose name contains one of these")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args(arguments)
    wanted = [
        hidden for hidden in hidden_cases() if not options.parts or any(part in hidden.name for part in options.parts)
    ]
    if not wanted:
        sys.stderr.write(f"no case has {' or '.join(options.parts)} in its name; see {PINS}\n")
        return 2
    old, outcomes = Pins.load(), {}
    with open_executor(options.workers) as executor:
        futures = {hidden.name: executor.submit(run_case, hidden.case, hidden.source) for hidden in wanted}
        for hidden in wanted:
            outcome = outcomes[hidden.name] = futures[hidden.name].result()
            pinned = {**old.reports, **{name: miss["reported"] for name, miss in old.misses.items()}}
            told = reported(outcome)
            mark = " " if told == pinned.get(hidden.name) else "*"
            seen = "" if visible(outcome) else f" (d' {outcome['reached']:.1f}: not to be seen)"
            sys.stdout.write(
                f"{mark} {hidden.name:60s} {told}{seen} {' '.join(far_off(outcome))} "
                f"removed {outcome.get('share_of_excess_removed')} ({outcome['processor_s']:.1f} s)\n"
            )
            sys.stdout.flush()
    PINS.write_text(write_pins(outcomes, old), encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
