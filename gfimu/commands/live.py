"""Under `gfimu live`: the rate filter on a stream of samples."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.errors import InputError

if TYPE_CHECKING:
    from gfimu.array import AccelerometerArray

__all__ = ["live"]


def live(
    array: AccelerometerArray | str | Path,
    rate: float,
    *,
    source: str | Iterable[str] = "-",
    scale_std: float = 0.0,
    bias_std: float | None = None,
    unknown_start: bool = False,
    gyro: bool = False,
) -> Iterator[str]:
    """Estimate the angular rate while samples arrive: CSV lines in, one JSON line per sample out.

    Parameters
    ----------
    array : AccelerometerArray, str or Path
        The array, its name or file.
    rate : float
        Nominal sample rate, Hz.
    source : str or iterable of str
        Where samples come from (``--from``): ``-`` for standard input, ``host:port`` of a TCP server, or the lines.
    scale_std : float
        Uncertainty of the scale factors, a ratio.
    bias_std : float, optional
        Uncertainty of the biases, m/s²; the data sheets' by default.
    unknown_start : bool
        Whether the body may be spinning already.
    gyro : bool
        Whether to fuse the stream's gyro columns.

    Returns
    -------
    iterator of str
        JSON lines, as `gfimu.rate.stream.filter_stream`; an estimate comes two samples after its own.

    Raises
    ------
    InputError
        If the rate is not positive, the source can't be opened or its first line doesn't name the columns.
    """
    import numpy as np

    from gfimu.commands.opened import as_array
    from gfimu.rate.kalman import FilterSettings
    from gfimu.rate.sensing import SensorErrors
    from gfimu.rate.stream import filter_stream

    if not rate > 0:
        raise InputError(f"--rate {rate:g}: must be positive, Hz")
    geometry = as_array(array)
    biases = {} if bias_std is None else {"bias_std": bias_std}
    errors = SensorErrors.from_parts(geometry, rate, scale_std=scale_std, **biases)
    settings = FilterSettings(start_omega=None) if unknown_start else FilterSettings(start_omega=np.zeros(3))
    lines = _lines(source) if isinstance(source, str) else source
    return filter_stream(lines, geometry, errors, 1.0 / rate, settings, fuse_gyro=gyro)


def _lines(source: str) -> Iterator[str]:
    """Lines of the source as they arrive."""
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
