"""Tables of the report with a row per channel: rms with bars, and the fingerprint with a colour per cell.

They are HTML instead of pictures: each value is written where it is shown, lines wrap or scroll on a narrow screen, and
a screen reader reads them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.colors import SymLogNorm, to_hex
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.results.colours import DIVERGING
from gfimu.diagnosis.criticism.views.dependence import Fingerprint
from gfimu.diagnosis.criticism.views.residuals import ResidualSize
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.report.plain_words import three_digits

__all__ = ["ChannelBars", "FingerprintCell", "FingerprintRow", "RmsRow", "channel_bars", "fingerprint_rows"]

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


@dataclass(frozen=True)
class FingerprintCell:
    """One cell: its number in standard deviations, and colours of ground and number; all empty within chance."""

    text: str
    ground: str
    ink: str


@dataclass(frozen=True)
class FingerprintRow:
    """Cells of one channel, one per term."""

    channel: str
    before: tuple[FingerprintCell, ...]
    after: tuple[FingerprintCell, ...]


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


def fingerprint_rows(fingerprint: Fingerprint) -> tuple[FingerprintRow, ...]:
    """Return how strongly each channel follows each basic term, before and after, in standard deviations of chance."""
    largest = max(10.0, *(float(np.abs(one).max(initial=0.0)) for one in (fingerprint.before, fingerprint.after)))
    norm = SymLogNorm(linthresh=Policy.noise_stds, vmin=-largest, vmax=largest)

    def cells(values: Sequence[NDArray[np.float64]]) -> tuple[FingerprintCell, ...]:
        return tuple(_cell(float(value), norm) for value in values)

    return tuple(
        FingerprintRow(name, cells(before), cells(after))
        for name, before, after in zip(fingerprint.channels, fingerprint.before, fingerprint.after, strict=True)
    )


def _cell(value: float, norm: SymLogNorm) -> FingerprintCell:
    if not abs(value) >= Policy.noise_stds:
        return FingerprintCell("", "", "")
    colour = np.array(mpl.colormaps[DIVERGING](norm(value)))[:3]
    linear = np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)  # sRGB
    light = float(linear @ [0.2126, 0.7152, 0.0722])
    ink = "#000000" if (light + 0.05) / 0.05 > 1.05 / (light + 0.05) else "#ffffff"  # the larger contrast, WCAG 2.2
    return FingerprintCell(f"{value:.0f}".replace("-", "−"), to_hex(tuple(colour)), ink)
