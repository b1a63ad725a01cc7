"""The table of the report with a row per channel: rms with bars.

It is HTML instead of a picture: each value is written where it is shown, lines wrap or scroll on a narrow screen, and a
screen reader reads them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.diagnosis.criticism.views.residuals import ResidualSize
from gfimu.diagnosis.report.plain_words import three_digits

__all__ = ["ChannelBars", "RmsRow", "channel_bars"]

_DECADE_FROM = 20.0  # ratio of the largest rms to the least noise from which bars are logarithmic


@dataclass(frozen=True)
class RmsRow:
    """Rms of the residual of one channel; bars in percent of the full width.

    Parameters
    ----------
    channel : str
        Name of the channel.
    chip : int
        Number of its chip, from 0, which has a colour.
    before, after, noise : str
        Rms before and after, and of the noise, m/s²; a dash without a sample.
    bar_before, bar_after, bar_noise : float
        Lengths of the two bars and place of the mark of the noise, 0 to 100.
    """

    channel: str
    chip: int
    before: str
    after: str
    noise: str
    bar_before: float
    bar_after: float
    bar_noise: float


@dataclass(frozen=True)
class ChannelBars:
    """Rows of the table, and what the full length of a bar is, in words."""

    rows: tuple[RmsRow, ...]
    scale: str


def channel_bars(size: ResidualSize, array: AccelerometerArray) -> ChannelBars:
    """Return the rms of the residual of every channel, before and after, beside its noise.

    The bars are linear from zero, and logarithmic where the largest rms is more than twenty times the least noise.
    """
    table = np.column_stack([size.before, size.after, size.floor])  # (c, 3), m/s²
    known = table[np.isfinite(table) & (table > 0)]
    high = float(known.max(initial=0.0)) or 1.0
    low = 0.5 * float(known.min(initial=high))
    logarithmic = high > _DECADE_FROM * 2 * low
    if logarithmic:
        with np.errstate(divide="ignore"):
            lengths = np.log(np.maximum(table, 0.0) / low) / np.log(high / low)
    else:
        lengths = table / high
    bars = 100.0 * np.clip(np.nan_to_num(lengths), 0.0, 1.0)
    rows = tuple(
        RmsRow(
            name,
            int(chip),
            three_digits(float(values[0])),
            three_digits(float(values[1])),
            three_digits(float(values[2])),
            round(float(drawn[0]), 1),
            round(float(drawn[1]), 1),
            round(float(drawn[2]), 1),
        )
        for name, chip, values, drawn in zip(size.channels, array.chip_of_channel, table, bars, strict=True)
    )
    kind = f"logarithmic, from {three_digits(low)} to" if logarithmic else "linear, from 0 to"
    return ChannelBars(rows, f"{kind} {three_digits(high)} m/s²")
