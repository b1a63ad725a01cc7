"""`gfimu live`: the rate filter on a stream of samples."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Annotated

import typer

from gfimu.cli.array_option import load_array

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="live")(_live)


def _live(
    rate: Annotated[float, typer.Option("--rate", help="Nominal sample rate, Hz.")],
    array: Annotated[
        str | None,
        typer.Option("--array", help="Array: a name, a .toml file or MJCF sites (.xml); else the stream's own."),
    ] = None,
    source: Annotated[
        str, typer.Option("--from", help="Where samples come from: - (standard input) or host:port of a TCP server.")
    ] = "-",
    scale_std: Annotated[
        float, typer.Option("--scale-std", help="Uncertainty of the scale factors, a ratio (0.01 is 1 %).")
    ] = 0.0,
    bias_std: Annotated[
        float | None, typer.Option("--bias-std", help="Uncertainty of the biases, m/s²; else the data sheets'.")
    ] = None,
    unknown_start: Annotated[bool, typer.Option("--unknown-start", help="The body may be spinning already.")] = False,
    gyro: Annotated[bool, typer.Option("--gyro", help="Fuse the stream's gyro columns.")] = False,
) -> None:
    """Estimate the angular rate while samples arrive: CSV lines in, one JSON line per sample out.

    The first line names the columns as in a recording (t_s, a11_m_s2, …). An estimate comes two samples after its own.
    The head of a recording (`# array_toml: …`) may come first; it carries the array.

    Example: tail -n +1 -f run.csv | gfimu live --rate 100
    """
    import numpy as np

    from gfimu.carried_array import carried_array
    from gfimu.errors import InputError
    from gfimu.rate.kalman import FilterSettings
    from gfimu.rate.sensing import SensorErrors
    from gfimu.rate.stream import filter_stream, read_head

    if not rate > 0:
        raise InputError(f"--rate {rate:g}: must be positive, Hz")
    lines = _lines(source)
    if array is not None:
        geometry = load_array(array)
    else:
        metadata, lines = read_head(lines)
        own = carried_array(metadata, source="the stream")
        if own is None:
            raise InputError("the stream does not carry its array (# array_toml: … before the columns); give --array")
        geometry = own
    biases = {} if bias_std is None else {"bias_std": bias_std}
    errors = SensorErrors.from_parts(geometry, rate, scale_std=scale_std, **biases)
    settings = FilterSettings(start_omega=None) if unknown_start else FilterSettings(start_omega=np.zeros(3))
    for line in filter_stream(lines, geometry, errors, 1.0 / rate, settings, fuse_gyro=gyro):
        sys.stdout.write(line + "\n")
        sys.stdout.flush()


def _lines(source: str) -> Iterator[str]:
    """Lines of the source as they arrive."""
    from gfimu.errors import InputError

    if source == "-":
        yield from iter(sys.stdin.readline, "")
        return
    import socket

    host, colon, port = source.removeprefix("socket://").rpartition(":")
    if not colon or not port.isdigit():
        raise InputError(f"--from {source!r}: give - for standard input, or host:port")
    try:
        connection = socket.create_connection((host, int(port)), timeout=10)
    except OSError as error:
        raise InputError(f"--from {source!r}: {error.strerror or error}; start the server first") from None
    connection.settimeout(None)
    with connection, connection.makefile("r", encoding="utf-8", errors="replace") as stream:
        yield from stream
