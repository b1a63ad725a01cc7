"""`gfimu live`: the rate filter on a stream of samples."""

from __future__ import annotations

from typing import Annotated

import typer

from gfimu.cli.axis_options import AxisOption, AxisPointOption, HubOption, InclinationOption
from gfimu.cli.shared_options import ForceOption, JsonOption, shared
from gfimu.cli.stop_signals import write_line

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="live")(_live)


def _live(
    array: Annotated[str | None, shared("--array", more="; else the stream's own")] = None,
    rate: Annotated[float | None, shared("--rate", more=", nominal; else the stream's own")] = None,
    source: Annotated[
        str,
        typer.Option(
            "--from", help="Where samples come from: - (standard input), a recording, or host:port of a TCP server."
        ),
    ] = "-",
    follow: Annotated[
        bool, typer.Option("--follow", help="With a recording: go on reading while gfimu record writes it.")
    ] = False,
    scale_std: Annotated[
        float, typer.Option("--scale-std", help="Uncertainty of the scale factors, a ratio (0.01 is 1 %).")
    ] = 0.0,
    bias_std_m_s2: Annotated[float | None, shared("--bias-std-m-s2", more="; else the data sheets'")] = None,
    unknown_start: Annotated[bool, shared("--unknown-start")] = False,
    gyro: Annotated[bool, shared("--gyro")] = False,
    axis: AxisOption = None,
    axis_point: AxisPointOption = (0.0, 0.0, 0.0),
    hub: HubOption = "fixed",
    inclination_rad: InclinationOption = None,
    keep_faulty: Annotated[bool, shared("--keep-faulty")] = False,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Estimate the angular rate while samples arrive: CSV lines in, one JSON line per sample out.

    The first line that is no comment names the columns as in a recording (t_s, a11_m_s2, … or raw counts, a11_lsb, …).
    Array and rate may stand in comment lines before it, as gfimu record writes them. An estimate comes two samples
    after its own. Where a channel contradicts the others, a line says which, how and since when; it is left out.

    Examples
    --------
    gfimu live --from run.parquet --follow
    # From another machine
    ssh pi cat /data/run.csv | gfimu live --array cube12 --rate 100
    # A wheel by two chips
    gfimu live --from socket://pi:4000 --array wheel.toml --axis z --hub free --unknown-start
    """
    from gfimu.commands.live import live

    del json  # every line is JSON in any case; with it an error is one too

    for line in live(
        array,
        rate,
        source=source,
        follow=follow,
        scale_std=scale_std,
        bias_std_m_s2=bias_std_m_s2,
        unknown_start=unknown_start,
        gyro=gyro,
        axis=axis,
        axis_point=axis_point,
        hub=hub,
        inclination_rad=inclination_rad,
        keep_faulty=keep_faulty,
        force=force,
    ):
        write_line(line)
