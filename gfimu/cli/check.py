"""`gfimu check`: what recordings can show before they are explained."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gfimu.cli.output import print_json, print_table, print_text, progress
from gfimu.cli.shared_options import JsonOption, MapOption, MapSetOption, TwinOption

if TYPE_CHECKING:
    from gfimu.diagnosis.design.run_check import RunCheck

__all__ = ["print_check", "print_short_check", "register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="check")(_check)


def _check(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Recordings of one rig.")],
    twin: TwinOption,
    column_map: MapOption = None,
    map_set: MapSetOption = None,
    json: JsonOption = False,
) -> None:
    """Check recordings before a diagnosis: data quality, effects that their motion separates, what to record next.

    Writes nothing.

    Examples
    --------
    gfimu check run.parquet --twin cube12_turntable
    # Several recordings of one rig
    gfimu check slow.parquet fast.parquet --twin cube12_turntable
    """
    from gfimu.commands.check import check

    with progress("looking at the recordings"):
        found = check(runs, twin, column_map=column_map, map_set=map_set or [])
    if json:
        print_json(found.to_dict())
    else:
        print_check(found)


def print_short_check(found: RunCheck) -> None:
    """Print what recordings can show in a few lines, to stand before a diagnosis."""
    for one in found.runs:
        parts = [f"{one['duration_s']:.4g} s"]
        rate, fastest, _, turns, shares = _motion(one)
        if rate:
            parts += [rate, f"up to {fastest}"] + ([f"{turns} turns"] if turns else [])
            parts.append(f"forwards / backwards / at rest {shares}")
        print_text(f"{one['name']}: {', '.join(parts)}.")
    print_text("Data: " + ("; ".join(found.findings) if found.findings else "nothing odd."))
    if found.effects:
        alone = [one for one in found.effects if one.seen and not one.confused_with]
        alike = [one.name for one in found.effects if one.confused_with]
        unseen = [one.name for one in found.effects if not one.seen]
        print_text(f"This motion shows {len(alone)} of {len(found.effects)} effects alone, each in its usual size.")
        if alike:
            print_text(f"Not separable from others by it: {', '.join(alike)}.")
        if unseen:
            print_text(f"May be missed in their usual size: {', '.join(unseen)}.")
    for line in found.advice:
        print_text(f"- {line}")


def print_check(found: RunCheck) -> None:
    """Print a check for people."""
    rows = [
        (
            one["name"],
            f"{one['duration_s']:.4g} s",
            *_motion(one),
        )
        for one in found.runs
    ]
    print_table(
        "Recordings",
        ("run", "length", "rate", "fastest", "acceleration", "turns", "forwards / backwards / rest"),
        rows,
    )
    for one in found.runs:
        if "lowest_degC" in one:
            print_text(f"Temperature of {one['name']}: {one['lowest_degC']:.4g} to {one['highest_degC']:.4g} °C.")
    print_text("Data: " + ("; ".join(found.findings) if found.findings else "nothing odd."))
    if found.effects:
        print_table(
            "What this motion shows of the simulation's effects, each in its usual size",
            ("effect", "d′", "not separable from"),
            [(one.name, f"{one.detectability:.3g}", ", ".join(one.confused_with[:4])) for one in found.effects],
            left=1,
            note="d′: size in standard deviations with the motion unknown; below 5 it may be missed.",
        )
    for line in found.advice:
        print_text(f"- {line}")


def _motion(facts: Mapping[str, Any]) -> tuple[str, str, str, str, str]:
    """Return rate, fastest, acceleration, turns and shares of time of a run; empty where it has none."""
    if "share_at_rest" not in facts:
        return ("", "", "", "", "")
    unit = "rad" if "fastest_rad_s" in facts else "m"
    return (
        f"{facts['sample_rate_hz']:.4g} Hz",
        f"{facts[f'fastest_{unit}_s']:.3g} {unit}/s",
        f"{facts[f'largest_acceleration_{unit}_s2']:.3g} {unit}/s²",
        f"{facts['turns']:.3g}" if "turns" in facts else "",
        " / ".join(f"{100 * facts[f'share_{way}']:.0f}" for way in ("forwards", "backwards", "at_rest")) + " %",
    )
