"""`gfimu certificate`: a calibration stated in the terms of the standards, with its uncertainty budget."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gfimu.cli.output import print_json, print_paths, print_table, print_text, progress
from gfimu.cli.shared_options import JsonOption, shared

if TYPE_CHECKING:
    from gfimu.certification.certificate import Certificate, Term

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="certificate")(_certificate)


def _certificate(
    calibration: Annotated[Path, typer.Argument(metavar="CAL", help="Calibration file, from `gfimu calibrate`.")],
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder to write: certificate.json, certificate.html.")
    ] = None,
    compare: Annotated[
        Path | None,
        typer.Option("--compare", help="Another calibration or certificate of the same chips: E_n of each quantity."),
    ] = None,
    stage: Annotated[
        Path | None,
        typer.Option(
            "--stage", help="Errors of stage and gravity, for the budget (.toml); gfimu new stage writes one to edit."
        ),
    ] = None,
    array: Annotated[str | None, shared("--array", more=". Adds its sheet as an angular sensor (IEEE 671)")] = None,
    rest: Annotated[
        Path | None,
        typer.Option(
            "--rest", help="Recording at rest: noise and bias of that sheet; else the data sheets of the parts."
        ),
    ] = None,
    item: Annotated[str, typer.Option("--item", help="What was calibrated: part, serial number.")] = "",
    date: Annotated[str, typer.Option("--date", help="When it was calibrated.")] = "",
    json: JsonOption = False,
) -> None:
    """State a calibration in the terms of IEEE 1293 and NIST, with expanded uncertainties and their budget.

    Examples
    --------
    gfimu certificate calibration.json --item "cube no. 7" --date 2026-11-27 --out certificate
    # With the errors of the stage
    gfimu certificate calibration.json --stage plate.toml --out certificate
    # The array as an angular sensor
    gfimu certificate calibration.json --array cube12 --rest rest.parquet
    # Two laboratories
    gfimu certificate calibration.json --compare theirs.json
    """
    from gfimu.certification.page import FILES
    from gfimu.commands.certificate import certificate

    with progress("stating the calibration"):
        found = certificate(
            calibration, out=out, compare=compare, stage=stage, array=array, rest=rest, item=item, date=date
        )
    files = {} if out is None else {meaning: out / name for name, meaning in FILES.items()}
    if json:
        print_json(found.to_dict() | {"files": files})
        return
    _print(found)
    print_paths(list(files.items()))


def _print(found: Certificate) -> None:
    header = ("term", "value", "U (95 %)", "k", "unit")
    for chip in found.chips:
        stated = [term for term in (*chip.terms, *chip.intrinsic) if term.value is not None]
        print_table(f"{chip.chip}: {chip.frame_meaning}", header, [_row(term) for term in stated])
        missing = [term.name for term in (*chip.terms, *chip.intrinsic) if term.value is None]
        if missing:
            print_text(f"not determined: {', '.join(missing)}")
    if found.angular_sensor is not None:
        print_table(found.angular_sensor.title, header, [_row(term) for term in found.angular_sensor.terms])
        for name, text in found.angular_sensor.conditions.items():
            print_text(f"{name}: {text}")
    if found.comparison is not None:
        rows = [
            (
                row.name,
                f"{row.value:.6g} ± {row.expanded:.2g}",
                f"{row.other_value:.6g} ± {row.other_expanded:.2g}",
                row.unit,
                f"{row.e_n:+.2f}",
            )
            for row in found.comparison.rows
        ]
        print_table(f"compared with {found.comparison.other}", ("quantity", "this", "other", "unit", "E_n"), rows)
        print_text(found.comparison.summary)
        for text in found.comparison.left_out:
            print_text(f"not compared: {text}")
    for text in found.statements:
        print_text(f"note: {text}")
    for text in found.warnings:
        print_text(f"warning: {text}", style="yellow")


def _row(term: Term) -> tuple[str, str, str, str, str]:
    if term.value is None:
        return (term.name, term.note, "", "", term.unit)
    value = f"{term.value:.7g}"
    if term.expanded is None:
        return (term.name, value, term.note, "", term.unit)
    return (term.name, value, f"{term.expanded:.2g}", f"{term.coverage_factor:.2f}", term.unit)
