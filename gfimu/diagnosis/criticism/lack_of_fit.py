"""Lack of fit: whether the residual holds anything but noise beside the causes of a fit, and what it depends on.

A generic basis of the motion, the angle and time is tested on every channel and on the reference by the same evidence
as the named effects, drives and causes projected out. What smooth functions do not show has tests of its own
(`series_tests`, `reading_curve`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.criticism.body import body_functions, motion_noise, tone
from gfimu.diagnosis.criticism.drive_noise import expected_score
from gfimu.diagnosis.criticism.generic import (
    LEAST_INFORMATION,
    REFERENCE,
    UNIT,
    basis_units,
    functions_at,
    judges_reference,
    motion_of,
    series_products,
)
from gfimu.diagnosis.criticism.reading_curve import reading_curve
from gfimu.diagnosis.criticism.series_tests import LackOfFit, changing_noise, jumps, lines
from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.data.table.spins import State
from gfimu.diagnosis.fit.evidence import log_evidence, log_evidence_each
from gfimu.diagnosis.fit.gauss_newton import Fit
from gfimu.diagnosis.fit.linear import Point, linearise
from gfimu.diagnosis.fit.observed_at import observed_at
from gfimu.diagnosis.fit.parallel import over_segments
from gfimu.diagnosis.fit.posterior import Posterior
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.cause import effects_of
from gfimu.diagnosis.terms.drive import Drive
from gfimu.model.generic_basis import FUNCTIONS
from gfimu.model.world_model import BasisUnits, SpinState, memory_of

__all__ = ["JERK", "LackOfFit", "dependence_unexplained", "lack_of_fit"]

JERK = "jerk"
"""Derivative of the angular acceleration, beside the functions of `gfimu.model.generic_basis`."""
_NAMES = (*FUNCTIONS, JERK)
_LEAST_RMS, _LEAST_JERK = 1e-6, 1e-12  # numerical: of a function that is not constant
_RIDGE = 1e-2  # numerical: of the coefficients that are reported
_LEAST_COEFFICIENT = 1e-3  # numerical: in units of UNIT


def lack_of_fit(
    stretches: Sequence[Stretch],
    fit: Fit,
    *,
    spikes: int = 0,
    rounded: bool = False,
    smooth: bool = True,
    policy: Policy = Policy(),
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
    smooth : bool
        Whether smooth functions are tested too, which takes the most time.
    policy : Policy
        Thresholds ``ambiguous``, ``steady``, ``sizeable``, ``spikes``, ``spike_share`` and ``lack_odds``.
    """
    candidates = [dependence_unexplained(stretches, fit.point, policy)] if smooth else []
    if isinstance(stretches[0], BodyStretch):
        return _of_body(stretches, fit.point, candidates, policy)
    if smooth:
        candidates.append(reading_curve(stretches, fit, policy))
    seen = observed_at(stretches, fit.point)
    # Of a random walk over coarse steps the modes lack the quickest part, which is nothing but jumps.
    cut = any(one.steps.channels and own.levels.walk > 0.0 for one, own in zip(stretches, seen, strict=True))
    for test in (lines,) if cut else (lines, jumps):
        each = over_segments(test, stretches, seen)
        # Each stretch is one more place to find something by chance.
        candidates += [replace(one, log_odds=one.log_odds - float(np.log(len(stretches)))) for one in each]
    if not rounded:
        states = [motion_of(one, fit.point, drive) for one, drive in zip(stretches, fit.point.drives, strict=True)]
        candidates.append(changing_noise(stretches, seen, states, policy))
    if spikes > max(policy.spikes, policy.spike_share * sum(stretch.mask.size for stretch in stretches)):
        text = f"{spikes} isolated samples far off their neighbours"
        candidates.append(LackOfFit(policy.lack_odds * spikes, text, {}))
    return max(candidates, key=lambda found: found.log_odds)


def _of_body(stretches: Sequence[Any], point: Point, candidates: Sequence[LackOfFit], policy: Policy) -> LackOfFit:
    """Return the strongest of a dependence and a tone, and beside it the noise that grows with the motion."""
    tones = [tone(posterior, policy) for posterior in linearise(stretches, point).posteriors]
    found = max([*candidates, *tones], key=lambda one: one.log_odds)
    noise = motion_noise(stretches, point.levels, policy)
    if noise.noise_odds <= policy.lack_odds:
        return found
    if found.log_odds <= policy.lack_odds:
        return replace(noise, log_odds=found.log_odds)
    signature, surrogate = f"{found.signature}; {noise.signature}", {**found.surrogate, **noise.surrogate}
    return replace(found, signature=signature, surrogate=surrogate, noise_odds=noise.noise_odds)


def dependence_unexplained(stretches: Sequence[Stretch], point: Point, policy: Policy = Policy()) -> LackOfFit:
    """Score every function on every channel and the reference, each on all channels, and all on each series.

    A cause with a memory (``memory_s``), as a mode on the table, acts back on the table. A drive whose prior is
    smoother than that motion is too smooth by a share of its jerk, which the reference shows: beside such a cause the
    jerk of the reference is no sign of anything else. The fit has to be at its optimum, which beside a long memory
    only the exact derivative reaches (`Point.exact`).
    """
    channels = stretches[0].model.array.channels
    names, gram, score = _products(stretches, point)
    series = [f"channel {name}" for name in channels]
    if judges_reference(stretches):
        series.append(REFERENCE)
    count = len(names)
    total = count * len(series)
    gram, score = gram[:total, :total], score[:total]
    information = np.maximum(gram.diagonal(), 0.0)
    usable = information > LEAST_INFORMATION
    if series[-1] == REFERENCE and _has_memory(stretches, point):
        usable[(len(series) - 1) * count + names.index(JERK)] = False
    places = np.flatnonzero(usable)
    if not len(places):
        return LackOfFit(-np.inf, "", {})

    def odds_of(some: NDArray[np.intp], looks: int) -> float:
        return log_evidence(gram[np.ix_(some, some)], score[some]) - float(np.log(looks)) if len(some) else -np.inf

    single = np.full(total, -np.inf)
    signs = np.zeros(len(places), dtype=bool)
    single[places] = log_evidence_each(information[places], score[places], signs) - np.log(total)
    best = int(np.argmax(single))
    function = names[best % count]
    found = LackOfFit(float(single[best]), f"{series[best // count]} depends on {function}", {}, dependence=function)
    chosen = np.array([best])
    for number, function in enumerate(names):
        some = places[(places % count == number) & (places < len(channels) * count)]
        value = odds_of(some, count)
        if value > found.log_odds + policy.ambiguous:
            strength = np.abs(score[some]) / np.sqrt(information[some])
            strongest = ", ".join(channels[place // count] for place in some[np.argsort(-strength)[:4]])
            text = f"several channels (strongest {strongest}) depend on {function}"
            found, chosen = LackOfFit(value, text, {}, dependence=function), some
    for number, name in enumerate(series):
        some = places[places // count == number]
        value = odds_of(some, len(series))
        if value > found.log_odds + policy.steady:
            top = names[int(some[np.argmax(single[some])]) % count]
            text = f"{name} depends on the motion or time in a way nothing in the library has (strongest: {top})"
            found, chosen = LackOfFit(value, text, {}), some
    values = np.linalg.solve(gram[np.ix_(chosen, chosen)] + _RIDGE * np.eye(len(chosen)), score[chosen])
    surrogate = {
        f"{series[place // count].removeprefix('channel ')}: {names[place % count]}": float(value * UNIT)
        for place, value in zip(chosen, values, strict=True)
        if abs(value) > _LEAST_COEFFICIENT
    }
    return replace(found, surrogate=surrogate)


def _products(
    stretches: Sequence[Stretch], point: Point
) -> tuple[tuple[str, ...], NDArray[np.float64], NDArray[np.float64]]:
    """Return the names of all functions, and G and b of them, of unit rms over all stretches, on each series."""
    if isinstance(stretches[0], BodyStretch):
        names = tuple(body_functions(stretches[0], point.drives[0]))

        def functions(stretch: Any, drive: Any) -> NDArray[np.float64]:
            return np.column_stack([*body_functions(stretch, drive).values()])

    else:
        names, units = _NAMES, basis_units(stretches, point)

        def functions(stretch: Any, drive: Any) -> NDArray[np.float64]:
            return _functions(stretch, point, drive, units)

    sums, squares, samples = np.zeros(len(names)), np.zeros(len(names)), 0
    for stretch, drive in zip(stretches, point.drives, strict=True):
        values = functions(stretch, drive)
        sums, squares, samples = sums + values.sum(axis=0), squares + np.sum(values**2, axis=0), samples + len(values)
    mean = sums / samples
    rms = np.sqrt(np.maximum(squares / samples - mean**2, 0.0))
    least = np.array([_LEAST_RMS if name != JERK else _LEAST_JERK for name in names])
    scale = UNIT / np.maximum(rms, least) * (rms > least)

    def values_of(stretch: Stretch, at: Posterior) -> NDArray[np.float64]:
        return np.asarray((functions(stretch, at.drive) - mean) * scale)

    if isinstance(stretches[0], BodyStretch):
        return names, *series_products(stretches, point, values_of)

    def expected_of(stretch: Stretch, at: Posterior) -> NDArray[np.float64]:
        gain = stretch.gain(effects_of(point.causes, stretch.model.array, stretch.index))

        def of_drive(spin: SpinState, jerk: NDArray[np.float64]) -> NDArray[np.float64]:
            return _values(
                stretch, State(*(one / gain for one in (spin.angle, spin.rate, spin.acceleration))), jerk / gain, units
            )

        return scale * expected_score(stretch, at, of_drive)

    return names, *series_products(stretches, point, values_of, expected_of)


def _functions(stretch: Stretch, point: Point, drive: Drive, units: BasisUnits) -> NDArray[np.float64]:
    """Return the functions at the samples of a stretch, shape (n, k)."""
    spin = motion_of(stretch, point, drive)
    return _values(stretch, spin, np.gradient(spin.acceleration, stretch.run.sample_period), units)


def _values(stretch: Stretch, spin: SpinState, jerk: NDArray[np.float64], units: BasisUnits) -> NDArray[np.float64]:
    """Return the functions (n, k) of a spin and its jerk (n,), rad/s³."""
    motion = functions_at(stretch, spin, units)
    columns = [function(motion) for function in FUNCTIONS.values()]
    return np.column_stack([*columns, jerk * (stretch.run.sample_period / units.acceleration)])


def _has_memory(stretches: Sequence[Stretch], point: Point) -> bool:
    first = stretches[0]
    present = (*first.model.effects, *effects_of(point.causes, first.model.array, first.index))
    return any(memory_of(effect) > 0.0 for effect in present)
