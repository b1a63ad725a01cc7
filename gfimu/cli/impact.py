"""`gfimu impact`: one impact in a recording, as crash and head-impact tests report it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gfimu.cli import completion
from gfimu.cli.output import print_json, print_paths, print_table, print_text, progress
from gfimu.cli.shared_options import ForceOption, JsonOption, MapOption, MapSetOption, PictureOption, shared

if TYPE_CHECKING:
    from gfimu.crash.event import Impact

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="impact")(_impact)


def _impact(
    recording: Annotated[
        Path, typer.Argument(metavar="RUN", help="Recording with the impact: .csv, .parquet; another with --map.")
    ],
    array: Annotated[str | None, shared("--array", more="; else the recording's own")] = None,
    cfc: Annotated[
        float, typer.Option("--cfc", help="Channel frequency class: 1000 (head), 600, 180, 60, or another.")
    ] = 1000.0,
    standard: Annotated[
        str,
        typer.Option(
            "--standard",
            metavar="NAME",
            autocompletion=completion.words("sae", "iso"),
            help="Of the filter: sae (J211-1) or iso (6487).",
        ),
    ] = "sae",
    threshold_g: Annotated[float, typer.Option("--threshold-g", help="Change of a channel that counts, g.")] = 5.0,
    direction: Annotated[
        str, typer.Option("--direction", help="Where the body is accelerated (+x, -x, …): the polarity is checked.")
    ] = "",
    calibration: Annotated[Path | None, shared("--calibration")] = None,
    column_map: MapOption = None,
    map_set: MapSetOption = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", help="Recording to write (.csv, .parquet): channels zeroed and filtered, from time zero."
        ),
    ] = None,
    estimate: Annotated[
        Path | None, typer.Option("--estimate", help="Estimate to write (.csv, .parquet): p, α, ω.")
    ] = None,
    picture: PictureOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Measure one impact: channels zeroed and filtered to a class, time zero, polarity, peaks of p, α and ω.

    Examples
    --------
    gfimu impact drop.csv --array nap.toml --cfc 1000 --direction +x --picture drop.png
    # The filtered channels and the motion as files
    gfimu impact drop.csv --array nap.toml --cfc 180 --out drop_cfc180.csv --estimate drop_motion.csv
    """
    from gfimu.commands.impact import impact

    with progress("measuring the impact"):
        found = impact(
            recording,
            array,
            cfc=cfc,
            standard=standard,
            threshold_g=threshold_g,
            direction=direction,
            calibration=calibration,
            column_map=column_map,
            map_set=map_set or [],
            out=out,
            estimate=estimate,
            picture=picture,
            force=force,
        )
    named = (("recording", out), ("estimate", estimate), ("picture", picture))
    files = {name: path for name, path in named if path is not None}
    if json:
        print_json(found.to_dict() | {"files": files})
        return
    print_table(f"{recording}, {standard.upper()} class {cfc:g}", ("quantity", "value"), _rows(found))
    for warning in found.warnings:
        print_text(warning, style="yellow")
    print_paths(list(files.items()))


def _rows(found: Impact) -> list[tuple[str, str]]:
    from gfimu.units import STANDARD_GRAVITY

    after_ms = 1e3 * found.peak_alpha_time_s
    change = ", ".join(f"{value:.3g}" for value in found.velocity_change_m_s)
    return [
        ("time zero", f"{found.time_zero_s:.6f} s"),
        ("duration", f"{1e3 * found.duration_s:.2f} ms"),
        ("peak p", f"{found.peak_p_m_s2 / STANDARD_GRAVITY:.4g} g at {1e3 * found.peak_p_time_s:.2f} ms"),
        ("change of velocity", f"({change}) m/s"),
        (
            "peak α",
            f"{found.peak_alpha_rad_s2:.4g} ± {found.peak_alpha_std_rad_s2:.2g} rad/s² at {after_ms:.2f} ms",
        ),
        ("peak ω", f"{found.peak_omega_rad_s:.4g} rad/s"),
        ("HIC15", f"{found.hic15:.4g}"),
    ]
