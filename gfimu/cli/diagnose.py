"""`gfimu diagnose`: what the simulation gets wrong against recordings, and why."""

from __future__ import annotations

import contextlib
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gfimu.cli.output import print_json, print_paths, print_table, print_text, progress
from gfimu.cli.shared_options import (
    ForceOption,
    JsonOption,
    MapOption,
    MapSetOption,
    ReferenceMapSetOption,
    TwinOption,
    shared,
)
from gfimu.cli.stop_signals import INTERRUPTED
from gfimu.errors import InputError

if TYPE_CHECKING:
    from gfimu.diagnosis.design.run_check import RunCheck
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
    twin: TwinOption,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", help="Folder to write: verdict.json, twin.toml with its array, report.html, diagnosis.rrd."
        ),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Only look at the recordings, as `gfimu check`: no diagnosis, no --out.")
    ] = False,
    held_out: Annotated[
        list[Path] | None,
        typer.Option("--held-out", metavar="RUN", help="Recording kept for measuring the gain; may be repeated."),
    ] = None,
    calibration: Annotated[Path | None, shared("--calibration")] = None,
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
    reference_map: Annotated[str | None, shared("--reference-map")] = None,
    reference_map_set: ReferenceMapSetOption = None,
    json: JsonOption = False,
) -> None:
    """Compare recordings with a simulation: name the causes of the difference, extend the simulation, measure the gain.

    Writes the verdict, the extended twin, a report for people and a rerun recording to a folder. The exit code is 0
    whatever the verdict. After Ctrl-C the result is what had been found by then, and the exit code 130.

    Examples
    --------
    gfimu diagnose run.parquet --twin cube12_turntable --out diagnosis
    # What the recording can show, first
    gfimu diagnose run.parquet --twin cube12_turntable --check
    # A rig known to be unusual
    gfimu diagnose run.parquet --twin cube12_turntable --grammar --out diagnosis
    # Two loggers with two clocks
    gfimu diagnose accel.csv --map mine.toml --reference tacho.csv --twin rig.toml --out diagnosis
    # A unit fresh from the bench
    gfimu diagnose run.parquet --twin cube12_turntable --calibration cal.json --out diagnosis
    """
    if check:
        from gfimu.cli.check import print_check
        from gfimu.commands.check import check as look

        with progress("looking at the recordings"):
            seen = look(runs, twin, column_map=column_map, map_set=map_set or [])
        print_json(seen.to_dict()) if json else print_check(seen)
        return
    if out is None:
        raise InputError("--out is missing: the folder for the diagnosis; --check needs none")
    from gfimu.commands.diagnose import diagnose, written_files

    interrupted = False

    def report(share: float, text: str | None = None) -> None:
        nonlocal interrupted
        interrupted = interrupted or text == "interrupted"
        done(share, text)

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
            report=report,
            grammar=grammar,
            force=force,
        )
    written = written_files(found, out)
    if json:
        print_json(found.to_dict() | {"files": written})
    else:
        _print(found, runs, twin, column_map, map_set or [])
        print_paths(written.items())
    if interrupted:
        print_text("gfimu: interrupted; the result is what had been found by then", stderr=True)
        raise SystemExit(INTERRUPTED)


def _print(found: Diagnosis, runs: list[Path], twin: str, column_map: str | None, map_set: list[str]) -> None:
    """Print what the recordings show, and the diagnosis."""
    from gfimu.cli.check import print_short_check

    with progress("looking at the recordings"):
        seen = _what_shows(runs, twin, column_map, map_set)
    if seen is not None:
        print_short_check(seen)
    print_diagnosis(found)


def _what_shows(runs: list[Path], twin: str, column_map: str | None, map_set: list[str]) -> RunCheck | None:
    """Return the data's quality and what the motion can show; None where that can't be read."""
    from gfimu.commands.check import check as look

    with warnings.catch_warnings(), contextlib.suppress(InputError):  # the diagnosis reports both itself
        warnings.simplefilter("ignore")
        return look(runs, twin, column_map=column_map, map_set=map_set)
    return None


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
        three_digits,
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
    error = [
        (
            "prediction error, rms",
            f"{three_digits(residual.rms_before)} m/s²",
            f"{three_digits(residual.rms_after)} m/s²",
        )
    ]
    error += [(f"validation data: {what}", before, after) for what, before, after in gain_rows(found)]
    share = percent(gain.share_of_excess_removed)
    note = f"the sensors' own noise: {three_digits(residual.noise_floor)} m/s²"
    if share != "–":
        note += f"; on validation data ({gain.held_out}) {share} of the error beyond noise is gone"
    print_table("Error before and after", ("", "before", "after"), error, note=note)
    if found.rivals:
        rivals = [(" + ".join(one.effects) or "nothing", one.why, odds(one.log_odds)) for one in found.rivals[:5]]
        print_table("Other explanations, and why they lost", ("explanation", "why it lost", "odds"), rivals, left=2)
    for step in next_steps(found):
        print_text(f"next: {step}")
