"""Tests of the residual for what smooth functions do not show: narrow lines, jumps, changing noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln
from scipy.stats import chi2, norm

from gfimu.diagnosis.criticism.generic import REFERENCE, judges_reference
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.observed import Observed
from gfimu.model.generic_basis import step_at
from gfimu.model.world_model import SpinState

__all__ = ["NOTHING", "SLOWEST_LINE", "LackOfFit", "changing_noise", "jumps", "lines"]

SLOWEST_LINE = 1.0  # numerical: Hz; below it slow noise and the drive are free
_LEAST_LINE_LEVEL = 0.7  # numerical: white noise in its own units has a level of 1
_WIDTHS = (1.0, 2.0)  # numerical: s, of the means that are compared at a jump
_FEWEST_WIDTHS = 12  # numerical: in a stretch, for the usual size of such differences
_FEWEST_IN_MEAN = 20  # numerical: samples
_PARTS = 6  # numerical: into which samples are ordered for their noise
_FEWEST_DIFFERENCES = 200  # numerical: in each of them


@dataclass(frozen=True)
class LackOfFit:
    """The strongest term that a fit does not explain.

    Parameters
    ----------
    log_odds : float
        Log odds against chance, all that was looked at accounted for.
    signature : str
        Channels and dependence, in words.
    surrogate : dict of str to float
        Coefficients of the data-driven term by ``"channel: basis function"``, m/s² per unit basis function; of the
        reference, in its own unit.
    instead : bool
        Whether it takes the place of named causes, which then are a compromise, instead of adding to them.
    hints : tuple of str
        Functions (`gfimu.model.generic_basis`) beyond the usual ones that may describe it.
    dependence : str
        The function that it follows, where it follows one.
    noise_odds : float
        Log odds of noise that grows with the motion, which speaks against no cause.
    """

    log_odds: float
    signature: str
    surrogate: dict[str, float]
    instead: bool = False
    hints: tuple[str, ...] = ()
    dependence: str = ""
    noise_odds: float = -np.inf


NOTHING = LackOfFit(-np.inf, "", {})
"""What a test that shows nothing returns."""


def lines(stretch: Stretch, seen: Observed) -> LackOfFit:
    """Test for narrow lines on one channel, on the reference or on all, by the maximum of the periodogram.

    Parameters
    ----------
    stretch : Stretch
        The data.
    seen : Observed
        Their residuals.
    """
    channels = stretch.model.array.channels
    # In the basis of the slow noise, in which a random walk has no jump between its ends.
    whitened = stretch.basis.whitened(seen.residual / seen.levels.white, seen.levels)  # (n, c + 1)
    if not judges_reference([stretch]):
        whitened = whitened[:, :-1]
    series = [*(f"channel {name}" for name in channels), REFERENCE]
    n = len(whitened)
    power = np.abs(np.fft.rfft(whitened, 2 * n, axis=0)) ** 2 / n
    frequency = np.fft.rfftfreq(2 * n, stretch.run.sample_period)
    power[frequency < max(SLOWEST_LINE, 4.0 / stretch.run.duration)] = 0.0
    level = np.median(power[frequency >= SLOWEST_LINE], axis=0) / np.log(2.0)
    power = power / np.maximum(level, _LEAST_LINE_LEVEL)
    place, number = np.unravel_index(int(np.argmax(power)), power.shape)
    one = float(power[place, number]) - float(np.log(n * power.shape[1]))
    summed = 2.0 * power[:, : len(channels)].sum(axis=1)
    peak = int(np.argmax(summed))
    every = -_log_tail(float(summed[peak]), 2 * len(channels)) - float(np.log(n))
    if one < every:
        return LackOfFit(every, f"several channels share a tone at {frequency[peak]:.3f} Hz", {})
    name, at = series[number], float(frequency[place])
    key = f"{name.removeprefix('channel ')}: tone at {at:.4f} Hz"
    return LackOfFit(one, f"{name} has a tone at {at:.3f} Hz", {key: 1.0})


def jumps(stretch: Stretch, seen: Observed) -> LackOfFit:
    """Test whether a channel jumps: means of some seconds before and after every instant.

    The bias instability is learnt from the residual, so that a jump raises it. Therefore differences are compared with
    their usual size in this stretch, by the median, which one jump does not move.

    Parameters
    ----------
    stretch : Stretch
        The data.
    seen : Observed
        Their residuals.
    """
    channels = stretch.model.array.channels
    mask = stretch.mask[:, :-1]
    residual = (seen.residual / seen.levels.white)[:, :-1] * mask
    period, duration = stretch.run.sample_period, stretch.run.duration
    best = NOTHING
    for width in _WIDTHS:
        size = round(width / period)
        if size < _FEWEST_IN_MEAN or duration < _FEWEST_WIDTHS * width:
            continue
        change = _steps(residual, mask, size)
        if not np.isfinite(change).any(axis=0).all():
            continue
        usual = np.maximum(np.nanmedian(np.abs(change), axis=0) / norm.ppf(0.75), np.sqrt(2.0 / size))
        # A channel's own median has few independent values: half of its weight is the other channels'.
        usual = np.sqrt(usual * np.maximum(usual, np.median(usual)))
        power = np.nan_to_num((change / usual) ** 2)
        place, channel = np.unravel_index(int(np.argmax(power)), power.shape)
        looks = 2 * duration / width * len(channels) * len(_WIDTHS)
        odds = 0.5 * float(power[place, channel]) - float(np.log(looks))
        if odds > best.log_odds:
            when = float(stretch.run.t[min(int(place) + size, len(mask) - 1)])
            jump, name = float(change[place, channel] * seen.levels.white[channel]), channels[channel]
            text = f"channel {name} jumps by {jump:+.3g} m/s² at {when:.2f} s"
            key, hint = f"{name}: step at {when:.2f} s", step_at(when - stretch.start)
            best = LackOfFit(odds, text, {key: jump}, hints=(hint,))
    return best


def _steps(residual: NDArray[np.float64], mask: NDArray[np.bool_], size: int) -> NDArray[np.float64]:
    """Return the mean of the ``size`` samples after an instant minus that before it; NaN where half are missing."""
    start = np.zeros((1, residual.shape[1]))
    sums = np.concatenate([start, np.cumsum(residual, axis=0)])
    counts = np.concatenate([start, np.cumsum(mask, axis=0)])
    total, count = (one[size:] - one[:-size] for one in (sums, counts))
    means = np.where(count >= 0.5 * size, total / np.maximum(count, 1.0), np.nan)
    return np.asarray(means[size:] - means[:-size])


def changing_noise(
    stretches: Sequence[Stretch], seen: Sequence[Observed], states: Sequence[SpinState], policy: Policy = Policy()
) -> LackOfFit:
    """Test whether the noise level depends on the rate, the acceleration or time, by second differences.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    seen : sequence of Observed
        Their residuals.
    states : sequence of SpinState
        The table's motion at their samples.
    policy : Policy
        Threshold ``sizeable``.
    """
    best = NOTHING
    for stretch, mine, state in zip(stretches, seen, states, strict=True):
        left = np.diff((mine.residual / mine.levels.white)[:, :-1], n=2, axis=0) / np.sqrt(6.0)
        mask = stretch.mask[:, :-1]
        use = mask[1:-1] & mask[:-2] & mask[2:]  # a second difference needs three samples
        power, count = np.where(use, left**2, 0.0).sum(axis=1), use.sum(axis=1)
        for name, value in (
            ("the rate", np.abs(state.rate[1:-1])),
            ("the angular acceleration", np.abs(state.acceleration[1:-1])),
            ("time", stretch.run.t[1:-1]),
        ):
            parts = np.array_split(np.argsort(value, kind="stable"), _PARTS)
            counts = np.array([count[part].sum() for part in parts])
            if counts.min() < _FEWEST_DIFFERENCES:
                continue
            means = np.array([power[part].sum() for part in parts]) / counts
            spread = means / means.mean()
            if np.ptp(spread) <= policy.sizeable:
                continue
            # The mean square of second differences of white noise has about n/1.8 degrees of freedom per channel.
            statistic = float(np.sum(counts / 1.8 / 2 * (spread - 1) ** 2))
            odds = -_log_tail(statistic, _PARTS - 1) - float(np.log(3.0 * len(stretches)))
            if odds > best.log_odds:
                best = LackOfFit(odds, f"the noise of all channels changes with {name}", {})
    return best


def _log_tail(value: float, freedom: int) -> float:
    """Return the log of the probability that χ² exceeds a value, also where the probability underflows."""
    tail = float(chi2.logsf(value, freedom))
    if np.isfinite(tail):
        return tail
    half, x = 0.5 * freedom, 0.5 * value
    # Γ(a, x) ~ x^(a−1) e^(−x) (1 + (a − 1)/x), Abramowitz and Stegun 6.5.32.
    return float((half - 1.0) * np.log(x) - x + np.log1p((half - 1.0) / x) - gammaln(half))
