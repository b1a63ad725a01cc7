"""`gfimu join`: channels and a reference of two clocks in one recording."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gfimu.cli.output import print_json, print_paths, print_table, print_text, progress
from gfimu.cli.shared_options import JsonOption, MapOption, MapSetOption, ReferenceMapSetOption, shared

if TYPE_CHECKING:
    from gfimu.joining import Joined

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="join")(_join)


def _join(
    channels: Annotated[Path, typer.Argument(metavar="CHANNELS", help="Recording of the accelerometers.")],
    reference: Annotated[
        Path, typer.Argument(metavar="REFERENCE", help="File of the tachometer, encoder, command or gyro.")
    ],
    out: Annotated[Path, typer.Option("--out", help="Recording to write (.csv, .parquet).")],
    array: Annotated[str | None, shared("--array", more="; else the recording's own")] = None,
    column_map: MapOption = None,
    map_set: MapSetOption = None,
    reference_map: Annotated[str | None, shared("--reference-map")] = None,
    reference_map_set: ReferenceMapSetOption = None,
    most_rate_error: Annotated[
        float,
        typer.Option("--most-rate-error", help="Largest rate error between the clocks that is searched, a ratio."),
    ] = 0.02,
    force: Annotated[bool, shared("--force", more=", or the two don't seem to belong together")] = False,
    json: JsonOption = False,
) -> None:
    """Find the offset and the rate error between two clocks, and put channels and reference into one recording.

    Exit code 2 if the two files don't seem to belong together; --force writes them all the same.

    Examples
    --------
    gfimu join logger.csv tacho.csv --map klipper --array mine.toml --out run.parquet
    # A file of references of another layout
    gfimu join run.csv encoder.csv --reference-map encoder_map.toml --out joined.parquet
    """
    from gfimu.commands.join import join

    with progress("searching the offset between the clocks"):
        found = join(
            channels,
            reference,
            out=out,
            array=array,
            column_map=column_map,
            map_set=map_set or [],
            reference_map=reference_map,
            reference_map_set=reference_map_set or [],
            most_rate_error=most_rate_error,
            force=force,
        )
    if json:
        print_json(found.to_dict() | {"files": {"recording": out}})
        return
    _print(found)
    print_paths([("recording", out)])


def _print(found: Joined) -> None:
    one = found.alignment
    rows = [
        ("offset (time of the channels where the reference reads 0)", f"{one.offset:.6g} s"),
        ("its standard deviation, in the middle", f"{1e3 * one.offset_std:.2g} ms"),
        ("rate error of the clocks", f"{100 * one.rate_error:.4g} ± {100 * one.rate_error_std:.2g} %"),
        ("common time", f"{one.overlap_s:.5g} s"),
        ("variance of a channel explained, most", f"{100 * float(one.explained.max()):.3g} %"),
        ("log odds over the next offset", f"{found.odds_over_second:.0f} nats (at {one.second_offset:.5g} s)"),
        ("log odds over shuffled references", f"{found.odds_over_foreign:.0f} nats"),
    ]
    rows += [
        (f"distance of chip {chip} from the axis, by ω² and by α", f"{1e3 * a:.4g} and {1e3 * b:.4g} mm")
        for chip, (a, b) in found.levers_m.items()
    ]
    print_table("Two clocks", ("quantity", "value"), rows)
    for doubt in found.doubts:
        print_text(f"In doubt: {doubt}.")
