"""`gfimu diagnose`: what the simulation gets wrong against recordings, and why."""

from __future__ import annotations

import contextlib
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gfimu.cli.mapped import ForceOption, MapOption, MapSetOption, ReferenceMapSetOption
from gfimu.cli.output import JsonOption, print_json, print_paths, print_table, print_text, progress
from gfimu.errors import InputError

if TYPE_CHECKING:
    from gfimu.diagnosis.verdict.verdict import Diagnosis

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="diagnose")(_diagnose)


def _diagnose(
    runs: Annotated[
        list[Path],
        typer.Argument(metavar="RUN...", help="Recordings of one rig: .csv, .parquet, .bin; fitted together."),
    ],
    twin: Annotated[str, typer.Option("--twin", help="What the simulation believes: a name, or a twin file (.toml).")],
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for verdict.json, twin.toml, report.html, diagnosis.rrd.")
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Only look at the recordings, as `gfimu check`: no diagnosis, no --out.")
    ] = False,
    held_out: Annotated[
        list[Path] | None,
        typer.Option("--held-out", metavar="RUN", help="Recording kept for measuring the gain; may be repeated."),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option("--calibration", help="Calibration of the unit, applied first (JSON, from `gfimu calibrate`)."),
    ] = None,
    grammar: Annotated[
        bool,
        typer.Option(
            "--grammar", help="Search the wider library of effects at once, not only where the usual one fails."
        ),
    ] = False,
    force: ForceOption = False,
    column_map: MapOption = None,
    map_set: MapSetOption = None,
    reference: Annotated[
        Path | None,
        typer.Option(
            "--reference", help="Reference of the first run on a clock of its own; aligned as by `gfimu join`."
        ),
    ] = None,
    reference_map: Annotated[
        str | None, typer.Option("--reference-map", metavar="MAP", help="Column map of that file.")
    ] = None,
    reference_map_set: ReferenceMapSetOption = None,
    json: JsonOption = False,
) -> None:
    """Show what a simulation gets wrong against recordings, name the cause, extend the simulation, measure the gain.

    Writes the verdict, the extended twin, a report for people and a rerun recording to a folder.

    Example: gfimu diagnose run.parquet --twin cube12_turntable --out diagnosis

    What the recording can show, first: gfimu diagnose run.parquet --twin cube12_turntable --check

    A rig known to be unusual: gfimu diagnose run.parquet --twin cube12_turntable --grammar --out diagnosis

    Two loggers of two clocks: gfimu diagnose accel.csv --map mine.toml --reference tacho.csv --twin rig.toml --out d

    A unit fresh from the bench: gfimu diagnose run.parquet --twin cube12_turntable --calibration cal.json --out d
    """
    if check:
        from gfimu.cli.check import print_check
        from gfimu.commands.check import check as look

        seen = look(runs, twin, column_map=column_map, map_set=map_set or [])
        print_json(seen.to_dict()) if json else print_check(seen)
        return
    if out is None:
        raise InputError("--out is missing: the folder for the diagnosis; --check needs none")
    from gfimu.commands.diagnose import diagnose
    from gfimu.diagnosis.report.folder import files_to_write

    with progress("diagnosing", total=1.0) as done:
        found = diagnose(
            runs,
            twin,
            out=out,
            held_out=held_out or [],
            column_map=column_map,
            map_set=map_set or [],
            reference=reference,
            reference_map=reference_map,
            reference_map_set=reference_map_set or [],
            calibration=calibration,
            report=done,
            grammar=grammar,
            force=force,
        )
    written = {meaning: out / name for name, meaning in files_to_write().items()}
    if json:
        print_json(found.to_dict() | {"files": written})
        return
    _print_what_shows(runs, twin, column_map, map_set or [])
    print_diagnosis(found)
    print_paths(written.items())


def _print_what_shows(runs: list[Path], twin: str, column_map: str | None, map_set: list[str]) -> None:
    """Print the data's quality and what the motion can show, before the verdict; nothing where that can't be read."""
    from gfimu.cli.check import print_short_check
    from gfimu.commands.check import check as look

    with warnings.catch_warnings(), contextlib.suppress(InputError):  # the diagnosis reports both itself
        warnings.simplefilter("ignore")
        print_short_check(look(runs, twin, column_map=column_map, map_set=map_set))


def print_diagnosis(found: Diagnosis) -> None:
    """Print a diagnosis for people."""
    from gfimu.diagnosis.report.plain_words import (
        gain_rows,
        headline,
        next_steps,
        odds,
        parameter_texts,
        parameter_units,
        percent,
        story,
        summary,
    )

    print_text(headline(found), style="bold")
    print_text(story(found))
    if found.causes:
        rows = []
        for cause in found.causes:
            texts = parameter_texts(cause, parameter_units(found, cause))
            texts = [one for one in texts if one.significant] or texts
            rows += [(cause.effect, summary(found, cause), percent(cause.probability))]
            rows += [
                (f"  {one.name}", f"{one.value}{f' = {one.familiar}' if one.familiar else ''}", "") for one in texts
            ]
        print_table(
            f"Verdict: {found.verdict.replace('_', ' ')}",
            ("cause", "what is so in the world", "probability"),
            rows,
            left=2,
        )
    residual, gain = found.residual, found.gain
    error = [("prediction error, rms", f"{residual.rms_before:.3g} m/s²", f"{residual.rms_after:.3g} m/s²")]
    error += [(f"unseen data: {what}", before, after) for what, before, after in gain_rows(found)]
    share = percent(gain.share_of_excess_removed)
    note = f"the sensors' own noise: {residual.noise_floor:.3g} m/s²"
    if share != "–":
        note += f"; on unseen data ({gain.held_out}) {share} of the error beyond noise is gone"
    print_table("Error before and after", ("", "before", "after"), error, note=note)
    if found.rivals:
        rivals = [(" + ".join(one.effects) or "nothing", one.why, odds(one.log_odds)) for one in found.rivals[:5]]
        print_table("Other explanations, and why they lost", ("explanation", "why it lost", "odds"), rivals, left=2)
    for step in next_steps(found):
        print_text(f"next: {step}")
