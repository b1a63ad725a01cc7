"""What a free body leaves: a tone, and noise that grows with the motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from gfimu.diagnosis.criticism.series_tests import SLOWEST_LINE, LackOfFit
from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.hand.noise import BodyNoise
from gfimu.diagnosis.terms.hand.posterior import HandPosterior

__all__ = ["motion_noise", "tone"]

_WINDOW = 1024  # numerical: samples in which an oscillator that is not steady is a line
_NEIGHBOURS = 41  # numerical: frequencies about a line that give its background


def motion_noise(stretches: Sequence[BodyStretch], levels: Sequence[BodyNoise], policy: Policy) -> LackOfFit:
    """Return the noise that grows with the motion, which no effect of the library is."""
    noise = max(levels, key=lambda one: one.log_odds)
    if noise.log_odds <= policy.lack_odds:
        return LackOfFit(-np.inf, "")
    parts = []
    if noise.agitation:
        parts.append(
            "the channels disagree from sample to sample in proportion to how fast their readings change, as if each "
            f"were sampled at an instant of its own, {1e3 * noise.agitation:.2g} ms rms apart"
        )
    if noise.acceleration_slope:
        fast = [s.change[s.use & ~s.run.rest] for s in stretches]
        typical = noise.acceleration_slope * float(np.sqrt(np.mean(np.concatenate(fast) ** 2)))
        parts.append(
            f"the angular acceleration differs from what the gyro's samples say by {typical:.2g} rad/s² rms in motion"
        )
    return LackOfFit(-np.inf, "; ".join(parts), noise_odds=noise.log_odds)


def tone(at: HandPosterior, policy: Policy) -> LackOfFit:
    """Test every channel for a narrow line, over the whole run and, as frequencies drift, over short windows.

    A line stands out of its neighbourhood and of what the noise of the gyro, smoothed, makes of the readings.
    """
    stretch = at.stretch
    spread = np.sqrt(at.levels.common(stretch.change_in_motion))
    left = np.where(stretch.use[:, None], at.without_errors / spread[:, None], 0.0)[:, stretch.alive]
    channels = [name for name, alive in zip(stretch.model.array.channels, stretch.alive, strict=True) if alive]
    found = LackOfFit(-np.inf, "")
    for length in {len(left), min(_WINDOW, len(left))}:
        count = len(left) // length
        pieces = left[: count * length].reshape(count, length, -1)
        power = np.abs(np.fft.rfft(pieces - pieces.mean(axis=1, keepdims=True), axis=1)) ** 2 / length
        frequency = np.fft.rfftfreq(length, stretch.run.sample_period)
        high = frequency >= max(SLOWEST_LINE, 8.0 / (length * stretch.run.sample_period))
        power = power[:, high]
        level = np.maximum(np.median(power, axis=1, keepdims=True) / np.log(2.0), 1e-12)
        # A line stands out of its neighbourhood; a motion that is not fully followed raises whole bands.
        around = median_filter(power, size=(1, _NEIGHBOURS, 1), mode="nearest") / np.log(2.0)
        by_gyro = _gyro_power(at, spread, np.asarray(frequency[high], dtype=np.float64), length)[
            :count, :, stretch.alive
        ]
        ratio = power / (np.maximum(level, around) + by_gyro)
        odds = ratio - np.log(ratio.size)
        window, place, channel = np.unravel_index(int(np.argmax(odds)), odds.shape)
        if odds[window, place, channel] > found.log_odds:
            amplitude = 2 * np.sqrt(power[window, place, channel] / length)
            one = frequency[high][place]
            text = f"channel {channels[channel]} has a tone at {one:.2f} Hz, about {amplitude:.2g} m/s²"
            if count > 1:
                tops = frequency[high][np.argmax(ratio[:, :, channel], axis=1)]
                sure = odds[:, :, channel].max(axis=1) > policy.lack_odds
                low, top = tops[sure].min(initial=one), tops[sure].max(initial=one)
                text += f", varying from {low:.3g} to {top:.3g} Hz" if top - low > 4 * frequency[1] else ""
            found = LackOfFit(float(odds[window, place, channel]), text)
    return found


def _gyro_power(
    at: HandPosterior, spread: NDArray[np.float64], frequency: NDArray[np.float64], length: int
) -> NDArray[np.float64]:
    """Return the power that the error of the smoothed gyro has in the residual over windows, (windows, f, c).

    Its derivative acts on the arms; about a known axis its product with the rate does as well (`rate_error`).
    """
    stretch, array = at.stretch, at.stretch.model.array
    count = len(spread) // length
    weight = np.where(stretch.use, 1.0 / spread, 0.0)[: count * length]
    arms, squared = (at.beside_force(one) for one in (array.regression_matrix[:, :3].T, at.jacobian.squared_rate[None]))
    error = stretch.run.smooth.error_power(np.pi * frequency * stretch.run.sample_period)  # (f, 3)
    each = np.mean(weight.reshape(count, length) ** 2, axis=1)[:, None, None]
    power = each * (((2.0 * np.pi * frequency[:, None]) ** 2 * error) @ arms**2)
    moved = np.mean((weight * stretch.rate_error[: count * length]).reshape(count, length) ** 2, axis=1)
    passed = error.sum(axis=1) / max(float(np.sum(stretch.run.smooth.noise**2)), 1e-300)  # (f,)
    return np.asarray(power + moved[:, None, None] * passed[:, None] * squared**2)
