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
    array: Annotated[
        str, typer.Option("--array", help="Array: a name, a .toml file or MJCF sites (.xml); else the stream's own.")
    ] = "",
    rate: Annotated[
        float | None, typer.Option("--rate", help="Nominal sample rate, Hz; else the stream's own.")
    ] = None,
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
    bias_std: Annotated[
        float | None, typer.Option("--bias-std", help="Uncertainty of the biases, m/s²; else the data sheets'.")
    ] = None,
    unknown_start: Annotated[bool, typer.Option("--unknown-start", help="The body may be spinning already.")] = False,
    gyro: Annotated[bool, typer.Option("--gyro", help="Fuse the stream's gyro columns.")] = False,
) -> None:
    """Estimate the angular rate while samples arrive: CSV lines in, one JSON line per sample out.

    The first line that is no comment names the columns as in a recording (t_s, a11_m_s2, … or raw counts, a11_lsb, …).
    Array and rate may stand in comment lines before it, as gfimu record writes them. An estimate comes two samples
    after its own.

    Example: gfimu live --from run.parquet --follow

    Example: ssh pi cat /data/run.csv | gfimu live --array cube12 --rate 100
    """
    import numpy as np

    from gfimu.errors import InputError
    from gfimu.rate.kalman import FilterSettings
    from gfimu.rate.sensing import SensorErrors
    from gfimu.rate.stream import filter_stream, read_head

    metadata, lines = read_head(_lines(source, follow=follow))
    if rate is None:
        rate = metadata.get("sample_rate_hz", metadata.get("time_stamp_rate_hz"))
    array = array or str(metadata.get("array", ""))
    if not array:
        raise InputError("--array is missing, and the stream does not state its array; give it")
    if rate is None:
        raise InputError("--rate is missing, and the stream does not state its sample rate; give it")
    if not isinstance(rate, int | float) or not rate > 0:
        raise InputError(f"--rate {rate}: must be positive, Hz")
    geometry = load_array(array)
    biases = {} if bias_std is None else {"bias_std": bias_std}
    errors = SensorErrors.from_parts(geometry, rate, scale_std=scale_std, **biases)
    settings = FilterSettings(start_omega=None) if unknown_start else FilterSettings(start_omega=np.zeros(3))
    for line in filter_stream(lines, geometry, errors, 1.0 / rate, settings, fuse_gyro=gyro):
        sys.stdout.write(line + "\n")
        sys.stdout.flush()


def _lines(source: str, *, follow: bool) -> Iterator[str]:
    """Lines of the source as they arrive."""
    from pathlib import Path

    from gfimu.errors import InputError
    from gfimu.rate.stream_source import recording_lines

    if source == "-":
        return iter(sys.stdin.readline, "")
    if Path(source).is_file():
        return recording_lines(source, follow=follow)
    host, colon, port = source.removeprefix("socket://").rpartition(":")
    if not colon or not port.isdigit():
        raise InputError(f"--from {source!r}: no such file; give a recording, - for standard input, or host:port")
    return _socket_lines(source, host, int(port))


def _socket_lines(source: str, host: str, port: int) -> Iterator[str]:
    """Lines that a TCP server sends."""
    import socket

    from gfimu.errors import InputError

    try:
        connection = socket.create_connection((host, port), timeout=10)
    except OSError as error:
        raise InputError(f"--from {source!r}: {error.strerror or error}; start the server first") from None
    connection.settimeout(None)
    with connection, connection.makefile("r", encoding="utf-8", errors="replace") as stream:
        yield from stream
