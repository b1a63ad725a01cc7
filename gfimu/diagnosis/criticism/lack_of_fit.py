"""Lack of fit: whether anything but noise remains beside the causes of a fit, and where.

Of a table it is an error that is free in time at a place, noise that changes with the motion, or many isolated samples.
Of a free body functions of the motion and time are tested on every channel, drives and causes projected out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.criticism.body import body_functions, motion_noise, tone
from gfimu.diagnosis.criticism.series_tests import LackOfFit, changing_noise
from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.evidence import SCALES, inverse, log_evidence, log_evidence_each
from gfimu.diagnosis.fit.gauss_newton import Fit
from gfimu.diagnosis.fit.linear import Point, linearise
from gfimu.diagnosis.fit.observed_at import observed_at
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.free_time import free_time
from gfimu.diagnosis.terms.cause import effects_of
from gfimu.diagnosis.terms.columns import Columns
from gfimu.diagnosis.terms.library import cause_columns
from gfimu.diagnosis.terms.located.policy import LOCATED

__all__ = ["LackOfFit", "lack_of_fit"]

UNIT = 0.03
"""What a function of order one is worth in the evidence, m/s²: usual white noise.

Numerical: the evidence averages over scales of a hundredth to thirty of it.
"""
_LEAST_INFORMATION = 1e-9  # numerical: of a function that is usable at all
_LEAST_RMS = 1e-6  # numerical: of a function that is not constant


def lack_of_fit(
    stretches: Sequence[Stretch], fit: Fit, *, spikes: int = 0, rounded: bool = False, policy: Policy = Policy()
) -> LackOfFit:
    """Find the strongest thing that the causes of a fit leave unexplained.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    fit : Fit
        Causes and drives, under the noise that they leave.
    spikes : int
        Isolated samples that the check of the samples took out.
    rounded : bool
        Whether readings are clipped or so coarse that their rounding follows the motion.
    policy : Policy
        Thresholds ``ambiguous``, ``steady``, ``sizeable``, ``spikes``, ``spike_share`` and ``lack_odds``.
    """
    if isinstance(stretches[0], BodyStretch):
        return _of_body(stretches, fit.point, policy)
    candidates = [_free(stretches, fit, policy)]
    if not rounded:
        states = [
            stretch.motion(effects_of(fit.causes, stretch.model.array, stretch.index), drive.spin).at(stretch.run.t)
            for stretch, drive in zip(stretches, fit.point.drives, strict=True)
        ]
        candidates.append(changing_noise(stretches, observed_at(stretches, fit.point), states, policy))
    if spikes > max(policy.spikes, policy.spike_share * sum(stretch.mask.size for stretch in stretches)):
        text = f"{spikes} isolated samples far off their neighbours"
        candidates.append(LackOfFit(policy.lack_odds * spikes, text))
    return max(candidates, key=lambda found: found.log_odds)


def _free(stretches: Sequence[Stretch], fit: Fit, policy: Policy) -> LackOfFit:
    """Return the place at which an error that is free in time makes the data most probable."""
    places = free_time(stretches, fit.point, policy)
    best = places[0]
    text = f"{best.where.words}, in time, with nothing else that is known"
    return LackOfFit(best.log_odds - (LOCATED.free_odds - policy.lack_odds), text, free=tuple(places))


def _of_body(stretches: Sequence[Any], point: Point, policy: Policy) -> LackOfFit:
    """Return the strongest of a dependence and a tone, and beside it the noise that grows with the motion."""
    tones = [tone(posterior, policy) for posterior in linearise(stretches, point).posteriors]
    found = max([_dependence_unexplained(stretches, point, policy), *tones], key=lambda one: one.log_odds)
    noise = motion_noise(stretches, point.levels, policy)
    if noise.noise_odds <= policy.lack_odds:
        return found
    if found.log_odds <= policy.lack_odds:
        return replace(noise, log_odds=found.log_odds)
    return replace(found, signature=f"{found.signature}; {noise.signature}", noise_odds=noise.noise_odds)


def _dependence_unexplained(stretches: Sequence[Any], point: Point, policy: Policy) -> LackOfFit:
    """Score every function on every channel, each on all channels, and all on each channel."""
    channels = stretches[0].model.array.channels
    names, gram, score = _products(stretches, point)
    count = len(names)
    total = count * len(channels)
    gram, score = gram[:total, :total], score[:total]
    information = np.maximum(gram.diagonal(), 0.0)
    places = np.flatnonzero(information > _LEAST_INFORMATION)
    if not len(places):
        return LackOfFit(-np.inf, "")

    def odds_of(some: NDArray[np.intp], looks: int) -> float:
        return log_evidence(gram[np.ix_(some, some)], score[some]) - float(np.log(looks)) if len(some) else -np.inf

    single = np.full(total, -np.inf)
    signs = np.zeros(len(places), dtype=bool)
    single[places] = log_evidence_each(information[places], score[places], signs) - np.log(total)
    best = int(np.argmax(single))
    found = LackOfFit(float(single[best]), f"channel {channels[best // count]} depends on {names[best % count]}")
    for number, function in enumerate(names):
        some = places[places % count == number]
        value = odds_of(some, count)
        if value > found.log_odds + policy.ambiguous:
            strength = np.abs(score[some]) / np.sqrt(information[some])
            strongest = ", ".join(channels[place // count] for place in some[np.argsort(-strength)[:4]])
            text = f"several channels (strongest {strongest}) depend on {function}"
            found = LackOfFit(value, text)
    for number, name in enumerate(channels):
        some = places[places // count == number]
        value = odds_of(some, len(channels))
        if value > found.log_odds + policy.steady:
            top = names[int(some[np.argmax(single[some])]) % count]
            text = (
                f"channel {name} depends on the motion or time in a way nothing in the library has (strongest: {top})"
            )
            found = LackOfFit(value, text)
    return found


def _products(
    stretches: Sequence[Any], point: Point
) -> tuple[tuple[str, ...], NDArray[np.float64], NDArray[np.float64]]:
    """Return the names of all functions, and G and b of them on each channel, drives, slow noise and causes out."""
    every = [body_functions(stretch, drive) for stretch, drive in zip(stretches, point.drives, strict=True)]
    names = tuple(every[0])
    values = [np.column_stack([*one.values()]) for one in every]
    mean, rms = (getattr(np.concatenate(values), name)(axis=0) for name in ("mean", "std"))
    scale = UNIT / np.maximum(rms, _LEAST_RMS) * (rms > _LEAST_RMS)
    of_stretch = {id(stretch): (one - mean) * scale for stretch, one in zip(stretches, values, strict=True)}

    def columns(stretch: Stretch, at: Any) -> Columns:
        named = cause_columns(stretch, at.observed, at.drive, point.causes)
        return Columns.together([named, _by_series(of_stretch[id(stretch)], at.observed.weight)])

    linear = linearise(stretches, point, columns, responses=False)
    named = sum(cause.unknowns for cause in point.causes)
    gram, score = linear.gram, linear.score
    if not named:
        return names, gram, score
    # The causes are free: they have the widest prior that a fit gives them.
    covariance = inverse(gram[:named, :named] + np.eye(named) / SCALES[-1] ** 2)
    gain = covariance @ gram[:named, named:]
    return names, gram[named:, named:] - gram[named:, :named] @ gain, score[named:] - gain.T @ score[:named]


def _by_series(values: NDArray[np.float64], weight: NDArray[np.float64]) -> Columns:
    """Return functions (n, k) as columns of each series, its samples weighted by (n, c + 1)."""
    series, count = weight.shape[1], values.shape[1]
    places = tuple(np.arange(index * count, (index + 1) * count) for index in range(series))
    return Columns(count * series, places, tuple(values * weight[:, [index]] for index in range(series)))
