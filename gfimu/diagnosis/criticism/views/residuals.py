"""Residuals: what a prediction leaves over, looked at from every side on which a cause can show.

Every view is data for a plot and at most one sentence, which is there only when the view shows more than chance would
once in a thousand times, all its looks together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct

from gfimu.diagnosis.criticism.views.error_form import ErrorForm, error_form
from gfimu.diagnosis.criticism.views.residual_spectrum import ResidualSpectrum, listed, order_spectrum, time_spectrum
from gfimu.diagnosis.criticism.views.run_view import RunView
from gfimu.diagnosis.criticism.views.whiteness import cumulative_periodogram, ljung_box, standardise, whitening_gain
from gfimu.diagnosis.policy import Policy

__all__ = ["ResidualSize", "ResidualViews", "Whiteness", "residual_views"]


@dataclass(frozen=True)
class ResidualSize:
    """Rms of the residual per channel against the noise, m/s², each (c,); NaN for a channel without data."""

    channels: tuple[str, ...]
    before: NDArray[np.float64]
    after: NDArray[np.float64]
    floor: NDArray[np.float64]
    sentence: str

    @property
    def furthest(self) -> NDArray[np.intp]:
        """The channels by how far they are above their noise, furthest first, those without data last, (c,)."""
        return np.argsort(-np.nan_to_num(self.before / self.floor, nan=-1.0, posinf=0.0), kind="stable")


@dataclass(frozen=True)
class Whiteness:
    """Whether the residual is noise, by the first 20 correlations and the cumulative periodogram of each channel.

    Parameters
    ----------
    frequency : ndarray, shape (m,)
        Frequencies of the cumulative periodograms, Hz.
    cumulative_before, cumulative_after : ndarray, shape (m, c)
        Cumulative periodograms from 0 to 1; a straight line for noise.
    looks : int
        Number of tests.
    sentence : str
        What matters, or empty.
    """

    frequency: NDArray[np.float64]
    cumulative_before: NDArray[np.float64]
    cumulative_after: NDArray[np.float64]
    looks: int
    sentence: str


@dataclass(frozen=True)
class ResidualViews:
    """All views of the residual of one run.

    Parameters
    ----------
    size : ResidualSize
        Against the noise.
    whiteness : Whiteness
        Against no correlation.
    form : ErrorForm or None
        What the error of one channel goes with; None where nothing orders it.
    spectrum : ResidualSpectrum
        In Hz.
    orders : ResidualSpectrum or None
        In cycles per revolution; None if the table hardly turns.
    """

    size: ResidualSize
    whiteness: Whiteness
    form: ErrorForm | None
    spectrum: ResidualSpectrum
    orders: ResidualSpectrum | None

    @property
    def sentences(self) -> tuple[str, ...]:
        """The sentences of all views that matter."""
        views = (self.size, self.whiteness, self.spectrum, self.orders)
        return tuple(view.sentence for view in views if view is not None and view.sentence)


def residual_views(run: RunView, channels: Sequence[str], *, bias_instability: float = 0.0) -> ResidualViews:
    """Look at the residuals of a run from every side.

    Parameters
    ----------
    run : RunView
        Measured and predicted channels, shape (n, c), and the drive.
    channels : sequence of str
        Names of the c channels.
    bias_instability : float
        Rms of the sensors' bias instability, m/s²: slow change that is noise and no discrepancy.
    """
    names = tuple(channels)
    before = np.where(run.valid, run.measured - run.before, 0.0)
    after = np.where(run.valid, run.measured - run.after, 0.0)
    period = float(run.t[1] - run.t[0])
    gain = whitening_gain(len(run.t), period, run.white, bias_instability)
    standard = tuple(standardise(dct(one, type=2, norm="ortho", axis=0) * gain) for one in (before, after))
    pair = (standard[0], standard[1])
    spectrum = time_spectrum(run, names, bias_instability, (before, after), pair)
    return ResidualViews(
        _size(run, names, bias_instability, before, after),
        _whiteness(names, period, *pair),
        error_form(run, names),
        spectrum,
        order_spectrum(run, names, (before, after), pair, spectrum.line_before),
    )


def _size(
    run: RunView,
    channels: tuple[str, ...],
    bias_instability: float,
    before: NDArray[np.float64],
    after: NDArray[np.float64],
) -> ResidualSize:
    count = run.valid.sum(axis=0).astype(float)
    count[count == 0] = np.nan
    old, new = (np.sqrt(np.sum(one**2, axis=0) / count) for one in (before, after))
    floor = np.hypot(run.white, bias_instability)
    large = np.flatnonzero(old > (1.0 + Policy.small) * floor)
    if not large.size:
        return ResidualSize(channels, old, new, floor, "")
    ratio = old / floor
    names = [channels[k] for k in large[np.argsort(-ratio[large])]]
    where = "every channel" if len(names) == len(channels) else listed(names)
    top = int(np.nanargmax(ratio))
    sentence = (
        f"Before, the residual is larger than the noise in {where}: up to {ratio[top]:.3g} times in {channels[top]}; "
        f"after: at most {np.nanmax(new / floor):.3g} times."
    )
    return ResidualSize(channels, old, new, floor, sentence)


def _whiteness(
    channels: tuple[str, ...], period: float, before: NDArray[np.float64], after: NDArray[np.float64]
) -> Whiteness:
    old_p, old_rho = ljung_box(before)
    new_p, new_rho = ljung_box(after)
    old_periodogram, old_cumulative = cumulative_periodogram(before)
    new_periodogram, new_cumulative = cumulative_periodogram(after)
    looks = 2 * len(channels)
    frequency = np.arange(1, len(old_cumulative) + 1) / (len(before) * period)
    coloured = (np.minimum(old_p, old_periodogram) < Policy.chance / looks) & (np.abs(old_rho) > Policy.dominant)
    still = (np.minimum(new_p, new_periodogram) < Policy.chance / looks) & (np.abs(new_rho) > Policy.dominant)
    sentence = ""
    if coloured.any() or still.any():
        parts = []
        if coloured.any():
            top = int(np.argmax(np.where(coloured, np.abs(old_rho), 0.0)))
            names = [channels[k] for k in np.argsort(-np.abs(old_rho)) if coloured[k]]
            where = "every channel" if len(names) == len(channels) else listed(names)
            parts.append(
                f"before, the residual is not noise: neighbouring samples err alike in {where} "
                f"(correlation {old_rho[top]:.2f} in {channels[top]})"
            )
        if still.any():
            parts.append(f"after: still so in {listed([channels[k] for k in np.flatnonzero(still)])}")
        elif coloured.any():
            parts.append("after: it is")
        sentence = "; ".join(parts) + "."
        sentence = sentence[0].upper() + sentence[1:]
    return Whiteness(frequency, old_cumulative, new_cumulative, looks, sentence)
