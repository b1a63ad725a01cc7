"""Self-test of the chips on a board: the shift of each axis against the data sheet's limits."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.frames.commands import Command, encode_command
from firmware_bridge.frames.decoder import SampleDecoder, Samples, Status, frame_format
from firmware_bridge.host.line_up import line_up
from firmware_bridge.host.link import DEFAULT_BAUD, Link
from gfimu.array.array import AccelerometerArray
from gfimu.base.declared import Declared, figure
from gfimu.base.errors import InputError

__all__ = ["LIMITS_G", "AxisSelfTest", "check_chips", "judge"]

LIMITS_G = np.array([[0.2, 2.1], [-2.1, -0.2], [0.3, 3.4]])
"""Least and greatest shift of x, y, z at 2.5 V, g (ADXL345 data sheet Rev. E, table 1)."""

_SUPPLY_SCALE = np.array([1.77, 1.77, 1.47])  # of the limits at 3.3 V (ibid., table 14)
_LARGEST_REST_STD_G = 0.05  # four times the noise at 100 Hz: more is motion
_COUNTS_PER_G = 256  # full resolution
_SPAN_S = 1.0
_SETTLE_S = 0.2  # the filter of the chip forgets the state before within four samples at 100 Hz
_SILENT_S = 3.0


@dataclass(frozen=True)
class AxisSelfTest(Declared):
    """Self-test of one sensing axis."""

    channel: Annotated[str, figure("The channel.", head="channel")]
    shift_g: Annotated[
        float, figure("Reading under self-test less reading without; null: no answer.", "g", head="shift", form="+.3f")
    ]
    least_g: Annotated[float, figure("Lower limit at the supply of the board.", "g", head="least", form="+.2f")]
    greatest_g: Annotated[float, figure("Upper limit at the supply of the board.", "g", head="most", form="+.2f")]
    noise_g: Annotated[
        float, figure("Standard deviation of the readings without self-test.", "g", head="noise", form=".4f")
    ]
    verdict: Annotated[
        str, figure("passed, failed, missing (no readings) or moved (the unit did not rest).", head="result")
    ]


def check_chips(port: str, *, baud: int | None = None, form: str = "lpc1768", array: str = "") -> list[AxisSelfTest]:
    """Switch the self-test of the chips on and off over a port while the unit rests.

    Parameters
    ----------
    port : str
        Port of the board.
    baud : int, optional
        Bits per second; by default as the board is.
    form : str
        Frame format; it needs a board that takes commands.
    array : str
        Array on the board; by default the format's. With fewer chips only those are tested.

    Raises
    ------
    InputError
        If no board answers, or it takes no commands.
    """
    layout = frame_format(form)
    dialogue = layout.dialogue
    if dialogue is None or layout.status_field is None:
        raise InputError(f"format {layout.name} has no command for the self-test; use a board that has")
    carried = AccelerometerArray.load(array or layout.array)
    layout = layout.for_array(carried)
    with Link(port, baud=baud or DEFAULT_BAUD) as link:
        found = line_up(link, layout, baud)
        if found is None or found[0].identity is None:
            raise InputError(f"{port}: no {layout.name} board answers; look for it with --find")
        decoder = SampleDecoder(layout)
        scale = found[0].identity.count_size
        if not found[0].identity.streaming:
            link.write(dialogue.start)
        runs = []
        try:
            for state in (False, True):
                link.write(encode_command(Command.SELF_TEST, int(state)))
                runs.append(_collect(link, decoder, on=state))
        finally:
            link.write(encode_command(Command.SELF_TEST, 0))
    off, on = (np.where(run.counts == layout.no_reading, np.nan, run.counts * (scale / _COUNTS_PER_G)) for run in runs)
    return judge(off, on, carried.channels, at_3v3=True)


def judge(
    off_g: NDArray[np.float64], on_g: NDArray[np.float64], channels: tuple[str, ...], *, at_3v3: bool = True
) -> list[AxisSelfTest]:
    """Compare readings without and under self-test, shapes (n, 3k) and (m, 3k), g, with the limits."""
    limits = LIMITS_G * _SUPPLY_SCALE[:, None] if at_3v3 else LIMITS_G
    rows = []
    for index, channel in enumerate(channels):
        least, greatest = sorted(float(limit) for limit in limits[index % 3])
        off, on = off_g[:, index], on_g[:, index]
        off, on = off[np.isfinite(off)], on[np.isfinite(on)]
        if len(off) < 2 or len(on) < 2:
            rows.append(AxisSelfTest(channel, np.nan, least, greatest, np.nan, "missing"))
            continue
        shift, noise = float(on.mean() - off.mean()), float(off.std(ddof=1))
        inside = least <= shift <= greatest
        still = max(noise, float(on.std(ddof=1))) <= _LARGEST_REST_STD_G
        verdict = "moved" if not still else "passed" if inside else "failed"
        rows.append(AxisSelfTest(channel, shift, least, greatest, noise, verdict))
    return rows


def _collect(link: Link, decoder: SampleDecoder, *, on: bool) -> Samples:
    """Return a second of settled samples in one state of the self-test."""
    parts: list[Samples] = []
    quiet_since = time.monotonic()
    begin: float | None = None
    hz = decoder.format.clock_hz
    while True:
        chunk = link.read()
        now = time.monotonic()
        if now - quiet_since > _SILENT_S:
            raise InputError(f"{link.port}: the board sends no samples {'under' if on else 'without'} self-test")
        if chunk is None:
            continue
        samples = decoder.feed(chunk.data)
        wanted = ((samples.status & Status.SELF_TEST) != 0) == on
        if not wanted.any():
            continue
        quiet_since = now
        begin = float(samples.ticks[wanted][0]) / hz if begin is None else begin
        settled = wanted & (samples.ticks / hz >= begin + _SETTLE_S)
        parts.append(samples.of(settled))
        if float(samples.ticks[-1]) / hz >= begin + _SETTLE_S + _SPAN_S:
            return Samples.join(parts)
