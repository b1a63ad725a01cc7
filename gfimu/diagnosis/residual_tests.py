"""Tests of the residual where a smooth basis is blind: narrow lines, jumps, changing noise, a curve of a reading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln
from scipy.stats import chi2

from gfimu.diagnosis.causes import effects_of_run
from gfimu.diagnosis.evidence import log_evidence
from gfimu.diagnosis.fit import Fit
from gfimu.diagnosis.refinement import refine
from gfimu.diagnosis.search import EXTRA_CAUSE
from gfimu.diagnosis.segment import Segment
from gfimu.diagnosis.signatures import cause_columns
from gfimu.generic_basis import OF_READING, step_at
from gfimu.world_model import Effect

__all__ = ["REFERENCE", "LeftOver", "changing_noise", "judges_reference", "jumps", "lines", "one_curve"]

REFERENCE = "the reference"
"""What the tachometer, encoder or command is called beside the channels."""
_UNIT = 0.03
_FEWEST_DIFFERENCES = 200
_OF_READING = frozenset({"bias", "scale_factor", "quadratic"})
_JUMP_WIDTHS = (1.0, 2.0)
_FEWEST_JUMPS = 12
_FEWEST_IN_JUMP = 20
_NORMAL_MEDIAN = 0.6745
_STEADY_POWER = 0.25  # of the mean, from the quietest to the loudest of six parts


@dataclass(frozen=True)
class LeftOver:
    """The strongest term that is left.

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
        Functions (`gfimu.generic_basis`) beyond the usual ones that may describe it.
    dependence : str
        The function that it follows, where it follows one.
    """

    log_odds: float
    signature: str
    surrogate: dict[str, float]
    instead: bool = False
    hints: tuple[str, ...] = ()
    dependence: str = ""


def judges_reference(segment: Segment) -> bool:
    """Tell whether the reference leaves noise where nothing is amiss: a measurement, in steps finer than its noise.

    A command is followed as well as the motor can, and errors of coarse steps do not average out.
    """
    return segment.model.drive_source != "command" and not segment.rounding.reference


def lines(segment: Segment, known: Sequence[Effect], *, fit: Fit, channels: Sequence[str]) -> LeftOver:
    """Test for narrow lines on one channel, on the reference or on all, by the maximum of the periodogram."""
    # In its own basis, where a wandering bias has no jump between its ends.
    left = segment.basis.whitened(_left(segment, fit, known), segment.levels)  # (n, c + 1)
    if not judges_reference(segment):
        left = left[:, :-1]
    series = [*(f"channel {name}" for name in channels), REFERENCE]
    n = len(left)
    power = np.abs(np.fft.rfft(left, 2 * n, axis=0)) ** 2 / n
    frequency = np.fft.rfftfreq(2 * n, segment.run.sample_period)
    # Below this the slow noise and the drive have freedom of their own.
    power[frequency < max(1.0, 4.0 / segment.run.duration)] = 0.0
    level = np.median(power[frequency >= 1.0], axis=0) / np.log(2.0)
    power = power / np.maximum(level, 0.7)
    channel = int(np.argmax(power.max(axis=0)))
    place = int(np.argmax(power[:, channel]))
    one = float(power[place, channel]) - np.log(n * left.shape[1])
    summed = power[:, : len(channels)].sum(axis=1)
    peak = int(np.argmax(summed))
    every = -_log_tail(2 * float(summed[peak]), 2 * len(channels)) - np.log(n)
    if one >= every:
        name = series[channel]
        text = f"{name} has a tone at {frequency[place]:.3f} Hz"
        return LeftOver(one, text, {f"{name.removeprefix('channel ')}: tone at {frequency[place]:.4f} Hz": 1.0})
    return LeftOver(every, f"several channels share a tone at {frequency[peak]:.3f} Hz", {})


def jumps(segment: Segment, known: Sequence[Effect], *, fit: Fit, channels: Sequence[str]) -> LeftOver:
    """Test whether a channel jumps: means of some seconds before and after every instant.

    Bias instability is learnt from the residual and would take a jump for its own; so the difference is compared with
    its usual size in this run, by the median, which a jump does not move.
    """
    mask = segment.weight_mask[:, :-1]
    left = _left(segment, fit, known)[:, :-1] * mask
    sums = np.concatenate([np.zeros((1, left.shape[1])), np.cumsum(left, axis=0)])
    counts = np.concatenate([np.zeros((1, left.shape[1])), np.cumsum(mask, axis=0)])
    period, duration = segment.run.sample_period, segment.run.duration
    best = LeftOver(-np.inf, "", {})
    for width in _JUMP_WIDTHS:
        size = round(width / period)
        if size < _FEWEST_IN_JUMP or duration < _FEWEST_JUMPS * width:
            continue
        after, now, before = slice(2 * size, None), slice(size, -size), slice(None, -2 * size)
        enough = np.minimum(counts[after] - counts[now], counts[now] - counts[before]) >= 0.5 * size
        late = (sums[after] - sums[now]) / np.maximum(counts[after] - counts[now], 1)
        early = (sums[now] - sums[before]) / np.maximum(counts[now] - counts[before], 1)
        change = np.where(enough, late - early, np.nan)
        if not np.isfinite(change).any(axis=0).all():
            continue
        usual = np.nanmedian(np.abs(change), axis=0) / _NORMAL_MEDIAN
        usual = np.maximum(usual, np.sqrt(2.0 / size))
        # A channel's own median has few independent values; it is trusted half as the others'.
        usual = np.sqrt(usual * np.maximum(usual, np.median(usual)))
        power = np.nan_to_num((change / usual) ** 2)
        place, channel = divmod(int(np.argmax(power)), power.shape[1])
        odds = 0.5 * float(power[place, channel]) - np.log(2 * duration / width * len(channels) * len(_JUMP_WIDTHS))
        if odds > best.log_odds:
            when = float(segment.run.t[min(place + size, len(left) - 1)])
            size_si = float(change[place, channel] * segment.levels.white[channel])
            name = channels[channel]
            text = f"channel {name} jumps by {size_si:+.3g} m/s² at {when:.2f} s"
            coefficient = {f"{name}: step at {when:.2f} s": size_si}
            best = LeftOver(odds, text, coefficient, hints=(step_at(when - segment.start),))
    return best


def changing_noise(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> LeftOver:
    """Test whether the noise level follows the rate, the acceleration or time."""
    best = LeftOver(-np.inf, "", {})
    for segment, known in zip(segments, fixed, strict=True):
        left = np.diff(_left(segment, fit, known)[:, :-1], n=2, axis=0) / np.sqrt(6.0)
        mask = segment.weight_mask[:, :-1]
        use = mask[1:-1] & mask[:-2] & mask[2:]  # a second difference needs three samples
        power, count = np.where(use, left**2, 0.0).sum(axis=1), use.sum(axis=1)
        effects = [*known, *effects_of_run(fit.causes, segment.model.array, segment.index)]
        state = segment.motion(effects).at(segment.run.t[1:-1])
        for name, value in (
            ("the rate", np.abs(state.rate)),
            ("the angular acceleration", np.abs(state.acceleration)),
            ("time", segment.run.t[1:-1]),
        ):
            order = np.argsort(value, kind="stable")
            parts = np.array_split(order, 6)
            counts = np.array([count[part].sum() for part in parts])
            if counts.min() < _FEWEST_DIFFERENCES:
                continue
            means = np.array([power[part].sum() for part in parts]) / counts
            # Second differences of white noise: the mean square has about n/1.8 degrees of freedom per channel.
            freedom = counts / 1.8
            spread = means / means.mean()
            statistic = float(np.sum(freedom / 2 * (spread - 1) ** 2))
            # What changes less in power, a part's own noise does.
            if np.ptp(spread) > _STEADY_POWER:
                odds = -_log_tail(statistic, 5) - np.log(3.0 * len(segments))
                if odds > best.log_odds:
                    best = LeftOver(odds, f"the noise of all channels changes with {name}", {})
    return best


def one_curve(
    segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]], channels: Sequence[str]
) -> LeftOver:
    """Test whether one cubic of a channel's reading does what two or more named effects on that channel do together."""
    best = LeftOver(-np.inf, "", {})
    for number, channel in enumerate(channels):
        mine = [
            place
            for place, cause in enumerate(fit.causes)
            if cause.name in _OF_READING and np.abs(cause.mixing[number]).any()
        ]
        if len(mine) < 2 or not any(fit.causes[place].pattern == f"channel {channel}" for place in mine):
            continue
        priors = [fit.causes[place].log_prior for place in mine]
        others = [cause for place, cause in enumerate(fit.causes) if place not in mine]
        evidence, coefficient = _with_cubic(segments, refine(segments, others, fixed, drives=fit.drives), fixed, number)
        odds = evidence + max(priors) - fit.log_evidence - sum(priors) - EXTRA_CAUSE * (len(mine) - 1)
        if odds > best.log_odds:
            text = f"channel {channel} follows a curve of its reading that the library has not (cubic)"
            best = LeftOver(float(odds), text, {f"{channel}: reading³": coefficient}, instead=True, hints=(OF_READING,))
    return best


def _with_cubic(
    segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]], channel: int
) -> tuple[float, float]:
    """Return the log evidence of a fit and a cubic of one channel's reading besides, and the cubic, s⁴/m²."""
    effects = [
        [*known, *effects_of_run(fit.causes, segment.model.array, segment.index)]
        for segment, known in zip(segments, fixed, strict=True)
    ]
    cubes = []
    for segment, mine, drive in zip(segments, effects, fit.drives, strict=True):
        kept, segment.coefficients = segment.coefficients, drive
        cubes.append(segment.predict(mine)[:, channel] ** 3 * segment.row_weight[:, channel])
        segment.coefficients = kept
    unit = _UNIT / max(float(np.sqrt(np.mean(np.concatenate(cubes) ** 2))), 1e-12)
    values = np.concatenate([*(cause.coordinates for cause in fit.causes), [0.0]])
    gram, score, objective, volume = np.zeros((len(values), len(values))), np.zeros(len(values)), 0.0, 0.0
    for segment, mine, known, cube, drive in zip(segments, effects, fixed, cubes, fit.drives, strict=True):
        kept, segment.coefficients = segment.coefficients, drive
        line = segment.linearise(mine)
        causes = cause_columns(segment, fit.causes, known, line.prediction, shapes=False)  # (c + 1, K, n)
        column = np.zeros((causes.shape[0], 1, causes.shape[2]))
        column[channel, 0] = cube * unit
        part, right, _ = segment.whitened_products(line, np.concatenate([causes, column], axis=1))
        segment.coefficients = kept
        gram, score, objective = gram + part, score + right, objective + line.drive.objective
        volume += line.drive.log_volume()
    nothing = objective + 2 * float(score @ values) + float(values @ gram @ values)
    score = score + gram @ values
    size = np.linalg.solve(gram + 1e-6 * np.eye(len(values)), score)[-1] * unit
    return volume - 0.5 * nothing + log_evidence(gram, score), float(size)


def _log_tail(value: float, freedom: int) -> float:
    """Return the log of the probability that χ² exceeds a value, far beyond the smallest number too."""
    tail = float(chi2.logsf(value, freedom))
    if np.isfinite(tail):
        return tail
    half, x = 0.5 * freedom, 0.5 * value
    # Γ(a, x) ~ x^(a−1) e^(−x) (1 + (a − 1)/x), Abramowitz and Stegun 6.5.32.
    return float((half - 1.0) * np.log(x) - x + np.log1p((half - 1.0) / x) - gammaln(half))


def _left(segment: Segment, fit: Fit, known: Sequence[Effect]) -> NDArray[np.float64]:
    """Return the residual in units of white noise, shape (n, c + 1)."""
    residual = segment.working_residual([*known, *effects_of_run(fit.causes, segment.model.array, segment.index)])
    return residual / segment.levels.white
