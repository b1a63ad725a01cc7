"""Spectra of the residual, over time (Hz) and over the table's angle (cycles per revolution: order tracking).

A line is a peak above its neighbourhood: the power of each frequency, divided by the median power around it, is summed
over the channels and compared with chance (a gamma distribution) after counting every frequency as one look.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import rfft
from scipy.signal import welch
from scipy.stats import gamma

from gfimu.diagnosis.criticism.views.run_view import RunView
from gfimu.diagnosis.data.cosine_basis import CosineBasis
from gfimu.diagnosis.policy import Policy

__all__ = ["ResidualSpectrum", "SpectralLine", "listed", "order_spectrum", "time_spectrum"]

_CELLS_PER_TURN = 64  # numerical: four cells in a cycle of the highest order
_FEWEST_TURNS = 3.0  # numerical: two cycles per revolution are then well apart
_SLOWEST_ORDER, _HIGHEST_ORDER = 0.9, 16.0  # numerical: cycles per revolution that are looked at
_FEWEST_CYCLES = 10  # numerical: of a tone in a run; slow functions follow what is slower
_NEIGHBOURS = 50  # numerical: frequencies whose median is the level of the noise
_NARROW, _WIDE = 2, 16  # numerical: frequencies on either side that a line and a hump are
_LONGEST_WINDOW = 2048  # numerical: samples of a periodogram that is averaged


def listed(names: Sequence[str], most: int = 4) -> str:
    """Return names in words: the first few, and how many more."""
    if len(names) > most:
        return f"{', '.join(names[:most])} and {len(names) - most} more"
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


@dataclass(frozen=True)
class SpectralLine:
    """The strongest line: place (Hz or cycles per revolution), amplitude per channel, m/s², (c,), and chance."""

    place: float
    amplitude: NDArray[np.float64]
    p_value: float

    @property
    def significant(self) -> bool:
        """Whether chance explains it less than once in a thousand such spectra."""
        return self.p_value < Policy.chance


@dataclass(frozen=True)
class ResidualSpectrum:
    """Spectrum of the residual before and after.

    Parameters
    ----------
    unit : {"Hz", "cycles per revolution"}
        Unit of ``at``.
    quantity : str
        What ``before`` and ``after`` are, with unit.
    at : ndarray, shape (m,)
        Frequencies or orders.
    before, after : ndarray, shape (m,)
        Root mean square over the channels.
    noise : ndarray, shape (m,)
        The same of noise alone.
    line_before, line_after : SpectralLine or None
        Strongest line; None where the strongest peak is a broad hump.
    looks : int
        Number of frequencies looked at.
    sentence : str
        What matters, or empty.
    """

    unit: str
    quantity: str
    at: NDArray[np.float64]
    before: NDArray[np.float64]
    after: NDArray[np.float64]
    noise: NDArray[np.float64]
    line_before: SpectralLine | None
    line_after: SpectralLine | None
    looks: int
    sentence: str


def time_spectrum(
    run: RunView,
    channels: Sequence[str],
    bias_instability: float,
    residuals: tuple[NDArray[np.float64], NDArray[np.float64]],
    standard: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> ResidualSpectrum:
    """Amplitude spectral density in m/s²/√Hz over frequency, and the strongest tone.

    Parameters
    ----------
    run : RunView
        The run.
    channels : sequence of str
        Names of the c channels.
    bias_instability : float
        Rms of the bias instability, m/s².
    residuals : tuple of ndarray, each (n, c)
        Before and after, m/s²; zero where invalid.
    standard : tuple of ndarray, each (n, c)
        The same, divided by the noise's spectrum.
    """
    n, period = len(run.t), float(run.t[1] - run.t[0])
    segment = int(min(_LONGEST_WINDOW, max(n // 4, 64), n))
    alive = run.valid.any(axis=0)
    densities = []
    for residual in residuals:
        at, power = welch(residual[:, alive], 1 / period, nperseg=segment, detrend="constant", axis=0)
        densities.append(np.sqrt(power.mean(axis=1))[1:])
    frequency = at[1:]
    basis = CosineBasis(n, period)
    slow = np.interp(frequency, basis.frequency[1:], basis.flicker_spectrum[1:] * bias_instability**2, right=0.0)
    noise = np.sqrt(2 * period * (np.mean(run.white[alive] ** 2) + slow))
    scale = 2.0 / np.sqrt(n) * run.white
    lines = [
        _strongest_line(np.abs(rfft(one, axis=0)) / np.sqrt(n), 1 / (n * period), scale, _FEWEST_CYCLES)
        for one in standard
    ]
    return ResidualSpectrum(
        unit="Hz",
        quantity="amplitude density, m/s²/√Hz",
        at=frequency,
        before=densities[0],
        after=densities[1],
        noise=noise,
        line_before=lines[0],
        line_after=lines[1],
        looks=n // 2,
        sentence=_sentence("{:.4g} Hz", "a line at a fixed frequency", channels, lines),
    )


def order_spectrum(
    run: RunView,
    channels: Sequence[str],
    residuals: tuple[NDArray[np.float64], NDArray[np.float64]],
    standard: tuple[NDArray[np.float64], NDArray[np.float64]],
    tone: SpectralLine | None,
) -> ResidualSpectrum | None:
    """Amplitude in m/s² over cycles per revolution, and the strongest order; None if the table hardly turns.

    Residuals are collected in cells of the table's angle, so that a ripple locked to the angle is one line whatever
    the rate does. Parameters as of `time_spectrum`; a louder ``tone`` casts a shadow here and silences the sentence.
    """
    start, stop = float(run.angle.min()), float(run.angle.max())
    turns = (stop - start) / (2 * np.pi)
    if not np.isfinite(turns) or turns < _FEWEST_TURNS:
        return None
    cells = _CELLS_PER_TURN * int(np.ceil(turns + 1e-9))  # whole turns, so that whole orders are on the grid
    place = ((run.angle - start) / (2 * np.pi) * _CELLS_PER_TURN).astype(int)
    # Each sample counts by the angle it covers: ∫ r exp(−inθ) |dθ|; a table at rest adds nothing.
    weight = np.abs(run.rate)[:, None] * run.valid  # (n, c)
    total_weight = np.maximum(weight.sum(axis=0), 1e-300)
    orders = np.arange(cells // 2 + 1) * (_CELLS_PER_TURN / cells)
    shown = (orders >= 2.0 / turns) & (orders <= _HIGHEST_ORDER)
    alive = run.valid.any(axis=0)

    def spectrum(series: NDArray[np.float64]) -> NDArray[np.float64]:
        # A constant per channel would leak from uneven coverage of the angle.
        centred = (series - (weight * series).sum(axis=0) / total_weight) * weight
        total = np.array([np.bincount(place, one, cells) for one in centred.T]).T  # (cells, c)
        return np.abs(rfft(total, axis=0))[shown]  # (m, c)

    scale = 2.0 / total_weight
    old, new = (np.sqrt(np.mean((scale * spectrum(residual))[:, alive] ** 2, axis=1)) for residual in residuals)
    spread = np.sqrt(np.maximum(np.sum(weight**2, axis=0), 1e-300))
    first = int(np.searchsorted(orders[shown], _SLOWEST_ORDER))
    noise_scale = scale * spread * run.white
    lines = [_strongest_line(spectrum(one) / spread, 1.0, noise_scale, first) for one in standard]
    placed = [
        None if line is None else SpectralLine(float(orders[shown][round(line.place)]), line.amplitude, line.p_value)
        for line in lines
    ]
    level = float(np.sqrt(np.mean(noise_scale[alive] ** 2)))
    noise = np.full(int(shown.sum()), level)
    sentence = _sentence("{:.3g} cycles per revolution", "a ripple locked to the table's angle", channels, placed)
    loudest = placed[0]
    if tone is not None and tone.significant and loudest and tone.amplitude.max() > loudest.amplitude.max():
        sentence = ""
    return ResidualSpectrum(
        unit="cycles per revolution",
        quantity="amplitude, m/s²",
        at=np.asarray(orders[shown], dtype=float),
        before=np.asarray(old),
        after=np.asarray(new),
        noise=noise,
        line_before=placed[0],
        line_after=placed[1],
        looks=int(shown.sum()),
        sentence=sentence,
    )


def _strongest_line(
    magnitude: NDArray[np.float64], step: float, scale: NDArray[np.float64], first: int
) -> SpectralLine | None:
    """Return the strongest peak above its neighbourhood of magnitudes (m, c) of unit noise."""
    m = len(magnitude)
    if m < 16:
        return None
    power = magnitude**2
    total = np.sum(power / np.maximum(_neighbourhood(power), 1.0), axis=1)
    total[:first] = 0.0
    top = int(np.argmax(total))
    excess = np.maximum(power.sum(axis=1) - power.shape[1], 0.0)
    near, wide = (excess[max(top - width, 0) : top + width + 1].sum() for width in (_NARROW, _WIDE))
    if near < wide - near:
        return None  # a hump, not a line: most of its power is farther off
    chance = float(gamma.sf(total[top], power.shape[1]))
    amplitude = magnitude[top] * scale
    return SpectralLine(top * step, amplitude, min(1.0, chance * m))


def _neighbourhood(power: NDArray[np.float64]) -> NDArray[np.float64]:
    """Median power around each frequency as a mean of noise, shape (m, c)."""
    m, c = power.shape
    blocks = max(m // _NEIGHBOURS, 1)
    size = m // blocks
    medians = np.median(power[: blocks * size].reshape(blocks, size, c), axis=1) / np.log(2.0)
    centres = (np.arange(blocks) + 0.5) * size
    return np.column_stack([np.interp(np.arange(m), centres, medians[:, k]) for k in range(c)])


def _sentence(form: str, what: str, channels: Sequence[str], lines: Sequence[SpectralLine | None]) -> str:
    before, after = lines
    if before is not None and before.significant:
        loud = np.flatnonzero(before.amplitude > Policy.sizeable * before.amplitude.max())
        names = [channels[k] for k in loud[np.argsort(-before.amplitude[loud])]]
        where = "all channels" if len(names) == len(channels) else listed(names)
        left = _left(form, after)
        return (
            f"Before, the residual has {what}, strongest at {_placed(form, before)} "
            f"(amplitude up to {before.amplitude.max():.2g} m/s², in {where}); {left or 'after: gone'}."
        )
    if after is not None and after.significant:
        return f"The residual has {what}; {_left(form, after)}."
    return ""


def _left(form: str, after: SpectralLine | None) -> str:
    if after is None or not after.significant:
        return ""
    return f"after: {after.amplitude.max():.2g} m/s² left at {_placed(form, after)}"


def _placed(form: str, line: SpectralLine) -> str:
    text = form.format(line.place)
    return text.replace("cycles", "cycle") if text.startswith("1 ") else text
