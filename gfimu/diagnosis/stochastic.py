"""Stochastic effects: biases that wander as a random walk, and more white noise than the part should have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from gfimu.diagnosis.causes import effects_of_run
from gfimu.diagnosis.coloured_noise import likeliest_flicker
from gfimu.diagnosis.fit import Fit
from gfimu.diagnosis.segment import Segment
from gfimu.diagnosis.slow_modes import WeighedPowers
from gfimu.units import STANDARD_GRAVITY
from gfimu.world_model import Effect

__all__ = [
    "LARGEST_USUAL_FLICKER",
    "UNEQUAL_WALK",
    "WALK_ODDS",
    "LoudestChannel",
    "Walk",
    "log_probability",
    "loudest_channel",
    "walk_strength",
    "white_factor",
]

WALK_ODDS = 10.0
"""Log odds that a random walk needs over bias instability alone."""
UNEQUAL_WALK = 14.0
"""`Walk.unequal` from which the channels do not wander alike: something else is taken for a walk."""
LARGEST_USUAL_FLICKER = 1.5e-3 * STANDARD_GRAVITY
"""Bias instability beyond which something else is left in the channels, m/s²."""
_LOUD = 4.0  # times the median of the others: right verdicts reach 3.0 (130 of them)
_BEYOND_DOUBT = 2.0  # log likelihood by which a level must beat that bound: two standard deviations
_WEAKEST_WALK = 3e-3
_WALK_GRID = np.geomspace(2e-3, 0.5, 28)
_DRIVE_TAKES = 0.08  # of the strength, as the unknown drive follows what wanders in the channels together
_MEDIAN_FACTOR = 1.3
_EVERY_FACTOR = 1.15


@dataclass(frozen=True)
class Walk:
    """A random walk common to all channels.

    Parameters
    ----------
    strength, std : float
        Strength and its standard deviation, m/s² per √s.
    log_odds : float
        Against bias instability of at most 1.5 mg without a walk.
    unequal : float
        Minus the log of the chance that channels which wander equally differ as much as these.
    """

    strength: float
    std: float
    log_odds: float
    unequal: float


@dataclass(frozen=True)
class LoudestChannel:
    """The channel with the largest slow noise.

    Parameters
    ----------
    name : str
        The channel.
    level : float
        Its bias instability as learnt, m/s².
    ratio : float
        That over the median of the other channels.
    log_odds : float
        Log likelihood of its level against the largest that the others allow, where its is larger; 0 otherwise.
    """

    name: str
    level: float
    ratio: float
    log_odds: float

    @property
    def stands_out(self) -> bool:
        """Whether it is beyond doubt more than the other channels have."""
        return self.ratio > _LOUD and self.log_odds > _BEYOND_DOUBT


def loudest_channel(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> LoudestChannel:
    """Return the channel with the largest slow noise beside what a fit explains.

    In a short run a level is known to a factor of two or so: the likelihood of what is left tells whether it can be as
    small as the others allow.
    """
    array = segments[0].model.array
    alive = np.any([segment.weight_mask[:, :-1].any(axis=0) for segment in segments], axis=0)
    levels = np.where(alive, segments[0].levels.flicker[:-1], 0.0)
    channel = int(np.argmax(levels))
    others = np.delete(levels, channel)[np.delete(alive, channel)]
    usual = float(np.median(others)) if len(others) else 0.0
    level = float(levels[channel])
    ratio = level / usual if usual > 0.0 else 1.0
    odds = 0.0
    for segment, known, drive in zip(segments, fixed, fit.drives, strict=True) if ratio > _LOUD else ():
        kept, segment.coefficients = segment.coefficients, drive
        left = segment.working_residual([*known, *effects_of_run(fit.causes, array, segment.index)])[:, :-1]
        segment.coefficients = kept
        slow = _slow_powers(segment, left)
        flicker, walk = (np.broadcast_to(one, slow.power.shape)[:, channel] for one in (slow.flicker, slow.walk))
        besides = segment.levels.white[channel] ** 2 + walk * segment.levels.walk**2
        own, allowed = (
            _whittle(slow.power[:, [channel]], (besides + flicker * size**2)[:, None])
            for size in (level, _LOUD * usual)
        )
        odds += float(own[0] - allowed[0])
    return LoudestChannel(array.channels[channel], level, ratio, odds)


def walk_strength(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> Walk:
    """Fit a random walk common to all channels to what a fit leaves."""
    array = segments[0].model.array
    totals = np.zeros((len(_WALK_GRID), array.n_channels))
    without = 0.0
    for segment, known, drive in zip(segments, fixed, fit.drives, strict=True):
        kept, segment.coefficients = segment.coefficients, drive
        left = segment.working_residual([*known, *effects_of_run(fit.causes, array, segment.index)])[:, :-1]
        segment.coefficients = kept
        slow = _slow_powers(segment, left)
        white = segment.levels.white[:-1]

        def spectrum(
            walk: float, slow: WeighedPowers = slow, white: NDArray[np.float64] = white
        ) -> NDArray[np.float64]:
            drift = slow.walk * walk**2
            flicker = np.minimum(likeliest_flicker(slow.power, white, slow.flicker, drift), LARGEST_USUAL_FLICKER)
            return np.asarray(white**2 + slow.flicker * flicker**2 + drift)

        without += float(_whittle(slow.power, spectrum(0.0)).sum())
        for place, strength in enumerate(_WALK_GRID):
            totals[place] += _whittle(slow.power, spectrum(strength))
    common = totals.sum(axis=1)
    best = int(np.argmax(common))
    weight = np.exp(common - common[best])
    mean = float(weight @ _WALK_GRID / weight.sum())
    std = float(np.sqrt(weight @ (_WALK_GRID - mean) ** 2 / weight.sum()))
    apart = 2.0 * float(totals.max(axis=0).sum() - common[best])
    unequal = -float(chi2.logsf(apart, array.n_channels - 1))
    odds = float(common[best] - without) if mean > _WEAKEST_WALK else 0.0
    return Walk(mean, float(np.hypot(std, _DRIVE_TAKES * mean)), odds, unequal)


def _slow_powers(segment: Segment, left: NDArray[np.float64]) -> WeighedPowers:
    """Return squared sizes of the slow modes in residuals (n, c), and what slow noise of unit size gives them."""
    if segment.rounding.channels:
        return WeighedPowers.of(segment.basis, left, segment.row_weight[:, :-1])
    basis = segment.basis
    power = basis.transform(left)[1 : len(basis.frequency)] ** 2  # (K, c)
    return WeighedPowers(power, basis.flicker_spectrum[1:, None], basis.walk_spectrum[1:, None])


def _whittle(power: NDArray[np.float64], spectrum: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the Whittle log likelihood of squared cosine coefficients (K, c) per channel."""
    return np.asarray(-0.5 * np.sum(np.log(spectrum) + power / spectrum, axis=0))


def log_probability(segments: Sequence[Segment], fit: Fit) -> float:
    """Return the log posterior of a fit with all that depends on the noise and on the drive's prior.

    To compare fits under different noise, or with a calibration residue and without.
    """
    total = fit.log_posterior
    for segment in segments:
        total -= segment.drive_prior.log_roughness
        if not segment.rounding.channels:  # coarse readings have probabilities, and their misfit all of the noise
            total -= 0.5 * segment.modes.log_determinant
    return total


def white_factor(segments: Sequence[Segment]) -> tuple[float, float] | None:
    """Return how much more white noise the chips have than the model expects, and its standard deviation.

    None where the level is within what parts of a kind differ by.
    """
    segment = segments[0]
    expected = segment.model.expected_noise(1.0 / segment.run.sample_period)
    measured = segment.levels.white[:-1]
    ratio = measured / (expected.analogue if segment.rounding.channels else expected.white)
    if np.median(ratio) < _MEDIAN_FACTOR or ratio.min() < _EVERY_FACTOR:
        return None
    analogue = (
        measured if segment.rounding.channels else np.sqrt(np.maximum(measured**2 - expected.quantum**2 / 12.0, 0.0))
    )
    factors = analogue / np.maximum(expected.analogue, 1e-6)
    factor = float(np.median(factors))
    return factor, factor / np.sqrt(len(segment.run.t) * len(ratio) / 4.0) + 0.01 * factor
