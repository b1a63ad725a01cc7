"""Signatures: what each possible effect would do to the channels and the reference, by finite differences.

The columns come from the same simulation that is being judged, taken about the causes found so far; sizes that reach
different channels share one difference. Tones and orders are first looked for in the whitened residual.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from gfimu.diagnosis.causes import Cause, Signature, effects_of_run, per_run_mixing, wired
from gfimu.diagnosis.linearisation import Linearisation
from gfimu.diagnosis.segment import Segment
from gfimu.geometry.array import AccelerometerArray
from gfimu.world_model import Effect, EffectFamily

__all__ = [
    "ANGLES",
    "Hypothesis",
    "SignatureSet",
    "cause_columns",
    "hypotheses",
    "plan_signatures",
    "signature_columns",
]

_ORDERS = np.arange(1.0, 37.0)
_SCANNED = ("interference_tone", "cogging", "tacho_ripple", "resonance")
_PEAKS = {"interference_tone": 2, "cogging": 4, "tacho_ripple": 3, "resonance": 5}
# A mode bends the functions that the drive can follow, and so fits noise as one parameter alone can't: log evidence per
# spline coefficient that it gained on runs with nothing hidden, with a margin of a third.
_RESHAPED_DRIVE = 0.01
_DAMPINGS = (0.01, 0.03, 0.1)
_RESTRICTED = 0.5
_OF_MOTION = frozenset({"motion", "timing", "reference"})  # a table at rest says nothing about these
_SHAPE_STEP = 1e-5  # a tone of a thousand cycles must not turn by a sensible part of a cycle
ANGLES = frozenset({"direction_rad"})
"""Shape parameters that are angles; the others move in proportion."""
_SHAPE_BOUNDS = {"damping_ratio": (1e-3, 0.3), "time_constant_s": (1.0, 1e5), "width_m_s2": (1e-3, 20.0)}


@dataclass(frozen=True)
class Hypothesis:
    """An effect at a place in the normal equations.

    Parameters
    ----------
    signature : Signature
        Its columns.
    pattern : str
        Its place.
    mixing : ndarray, shape (m, k)
        Columns from coordinates.
    log_prior : float
        Log prior probability.
    positive : ndarray of bool, shape (k,)
        Coordinates of one sign.
    """

    signature: Signature
    pattern: str
    mixing: NDArray[np.float64]
    log_prior: float
    positive: NDArray[np.bool_]

    @property
    def family(self) -> EffectFamily:
        """The kind of effect."""
        return self.signature.family

    @property
    def name(self) -> str:
        """Contract name of the effect."""
        return str(self.signature.family.name)

    def cause(self, coordinates: NDArray[np.float64]) -> Cause:
        """Return the cause with these coordinates."""
        return Cause(
            self.signature.family,
            self.pattern,
            self.mixing,
            dict(self.signature.shape),
            self.log_prior,
            coordinates,
        )


@dataclass(frozen=True)
class SignatureSet:
    """All signatures about a base and the normal equations in their P columns, relative to no effects at all.

    Parameters
    ----------
    signatures : tuple of Signature
        Every effect in every shape.
    gram, score : ndarray
        G (P, P) and b (P,).
    hypotheses : tuple of Hypothesis
        Every effect at every place.
    base : ndarray, shape (P,)
        The base in the columns.
    responses : tuple of ndarray
        How the drive coefficients of every segment follow the columns, each (m, P).
    """

    signatures: tuple[Signature, ...]
    gram: NDArray[np.float64]
    score: NDArray[np.float64]
    hypotheses: tuple[Hypothesis, ...]
    base: NDArray[np.float64]
    responses: tuple[NDArray[np.float64], ...] = ()

    def drive_moves(self, causes: Sequence[Cause], members: Sequence[int]) -> list[NDArray[np.float64]]:
        """Return how far the drive of every segment would follow from the base to other causes in a linear world."""
        move = -self.base
        for cause, number in zip(causes, members, strict=True):
            move[self.hypotheses[number].signature.columns] += cause.mixing @ cause.coordinates
        return [response @ move for response in self.responses]


def plan_signatures(
    families: Mapping[str, EffectFamily],
    segments: Sequence[Segment],
    linear: Sequence[Linearisation],
    base: Sequence[Cause],
    runs: int,
) -> tuple[list[Signature], int]:
    """List the signatures to compute, with their columns; returns them and the number of columns."""
    array = segments[0].model.array
    duration = max(segment.run.t[-1] - segment.start for segment in segments)
    rate = 1.0 / segments[0].run.sample_period
    warm = any(segment.run.temperature is not None for segment in segments)
    still = all(segment.at_rest for segment in segments)
    base_shapes = {cause.name: cause.shape for cause in base}
    signatures: list[Signature] = []
    columns = 0
    for name, family in families.items():
        count = len(family.sizes(array))
        if count == 0 or (name == "bias_temperature" and not warm) or (still and family.place in _OF_MOTION):
            continue
        if name in base_shapes:
            shapes: Sequence[Mapping[str, float]] = [base_shapes[name]]
            penalty = next(-cause.log_prior for cause in base if cause.name == name)
        elif name in _SCANNED:
            shapes, looked = _scan(name, segments, linear)
            if name == "resonance":
                shapes = [*shapes, *family.shapes(duration, rate)]
            penalty = float(np.log(looked))
            if name == "resonance":
                penalty += _RESHAPED_DRIVE * sum(segment.spline.size for segment in segments)
        else:
            shapes = family.shapes(duration, rate)
            penalty = float(np.log(len(shapes)))
        width = count * (runs if family.per_run else 1)
        for shape in shapes:
            signatures.append(Signature(family, dict(shape), np.arange(columns, columns + width), penalty))
            columns += width
    return signatures, columns


def signature_columns(
    segment: Segment,
    signatures: Sequence[Signature],
    base: Sequence[Cause],
    fixed: Sequence[Effect],
    predicted: NDArray[np.float64] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Compute the columns (c + 1, P, n) of a segment and the numbers (P,) that they have in the whole set.

    ``predicted`` is what is predicted with the base, where it is at hand.
    """
    array = segment.model.array
    present = effects_of_run(base, array, segment.index)
    nominal = segment.predict([*fixed, *present]) if predicted is None else predicted
    numbers = []
    for signature in signatures:
        count = len(signature.family.sizes(array))
        block = segment.index if len(signature.columns) > count else 0
        numbers.append(signature.columns[block * count : (block + 1) * count])
    rows = nominal.shape[0]
    mask = segment.row_weight.T  # (c + 1, n)
    out = np.zeros((nominal.shape[1], sum(len(part) for part in numbers), rows))
    place = 0
    for signature in signatures:
        family = signature.family
        sizes = family.sizes(array)
        # Effects do not commute: one that is there already is varied in its place.
        at = next((number for number, effect in enumerate(present) if effect.name == family.name), len(present))
        before, after = [*fixed, *present[:at]], present[at + 1 :]
        zero = present[at].size_values(array) if at < len(present) else np.zeros(len(sizes))
        steps = np.array([size.step * size.prior_std for size in sizes])
        prior = np.array([size.prior_std for size in sizes])
        reach = wired(family.reach(array), [*segment.model.effects, *fixed], array)
        for group in _disjoint(reach, len(sizes)):
            moved = zero.copy()
            moved[group] += steps[group]
            effect = family.from_sizes(array, moved, signature.shape)
            change = (segment.predict([*before, effect, *after]) - nominal).T * mask  # (c + 1, n)
            for size in group:
                reached = slice(None) if reach is None else np.flatnonzero(reach[size])
                out[reached, place + size] = change[reached] * (prior[size] / steps[size])
        place += len(sizes)
    return out, np.concatenate(numbers)


def _disjoint(reach: NDArray[np.bool_] | None, count: int) -> list[list[int]]:
    """Group sizes whose reaches do not overlap."""
    if reach is None:
        return [[size] for size in range(count)]
    groups: list[tuple[list[int], NDArray[np.bool_]]] = []
    for size in range(count):
        for members, taken in groups:
            if not (taken & reach[size]).any():
                members.append(size)
                np.logical_or(taken, reach[size], out=taken)
                break
        else:
            groups.append(([size], reach[size].copy()))
    return [members for members, _ in groups]


def cause_columns(
    segment: Segment,
    causes: Sequence[Cause],
    fixed: Sequence[Effect],
    predicted: NDArray[np.float64] | None = None,
    *,
    shapes: bool,
) -> NDArray[np.float64]:
    """Compute the columns (c + 1, K, n) of the coordinates of a set of causes and, if asked, of their log shapes.

    ``predicted`` is what is predicted with the set, where it is at hand.
    """
    array = segment.model.array
    present = effects_of_run(causes, array, segment.index)
    nominal = segment.predict([*fixed, *present]) if predicted is None else predicted
    mask = segment.row_weight.T  # (c + 1, n)
    count = sum(len(cause.coordinates) + (len(cause.free_shape) if shapes else 0) for cause in causes)
    out = np.zeros((nominal.shape[1], count, nominal.shape[0]))
    first = 0
    for number, cause in enumerate(causes):
        # Effects do not commute: in another order the difference quotient would hold a commutator over a small step.
        before, after = [*fixed, *present[:number]], present[number + 1 :]
        sizes = cause.family.sizes(array)
        step = min(size.step for size in sizes)
        if any(size.step > 0.01 for size in sizes):
            # A tenth of the present size keeps one-sided, non-smooth effects on their side.
            step = max(step * 0.2, 0.05 * float(np.abs(cause.coordinates).max(initial=0.0)))
        reach = wired(cause.reach(array), [*segment.model.effects, *fixed], array)
        for group in _disjoint(reach, len(cause.coordinates)):
            moved = cause.coordinates.copy()
            moved[group] += step
            effect = cause.at(moved).effect(array, segment.index)
            change = (segment.predict([*before, effect, *after]) - nominal).T * (mask / step)
            for place in group:
                reached = slice(None) if reach is None else np.flatnonzero(reach[place])
                out[reached, first + place] = change[reached]
        first += len(cause.coordinates)
        if shapes:
            for key, value in cause.free_shape.items():
                moved_shape = {**cause.shape, key: shape_moved(key, value, _SHAPE_STEP)}
                effect = cause.at(cause.coordinates, moved_shape).effect(array, segment.index)
                out[:, first] = (segment.predict([*before, effect, *after]) - nominal).T * (mask / _SHAPE_STEP)
                first += 1
    return out


def shape_moved(key: str, value: float, step: float) -> float:
    """Move a shape parameter by a step in its natural coordinate: log, or linear for angles."""
    if key in ANGLES:
        return value + step
    low, high = _SHAPE_BOUNDS.get(key, (0.0, np.inf))
    return float(np.clip(value * np.exp(step), low, high))


def hypotheses(signatures: Sequence[Signature], array: AccelerometerArray, runs: int) -> list[Hypothesis]:
    """List every effect at every place it can take, with its prior."""
    names = {signature.family.name for signature in signatures}
    out = []
    for signature in signatures:
        family = signature.family
        patterns = family.patterns(array)
        sign = np.array([size.positive for size in family.sizes(array)])
        for place, pattern in enumerate(patterns):
            # Half of the prior goes to the freest pattern, the rest is shared by the places.
            share = _RESTRICTED if place == 0 else (1 - _RESTRICTED) / (len(patterns) - 1)
            if len(patterns) == 1:
                share = 1.0
            mixing = per_run_mixing(pattern, runs) if len(signature.columns) > len(sign) else pattern.mixing
            rows = np.tile(sign, len(mixing) // len(sign))
            positive = (np.abs(mixing[rows]) > 0).any(axis=0)
            log_prior = -np.log(len(names)) + np.log(share) - signature.penalty
            out.append(Hypothesis(signature, pattern.name, mixing, float(log_prior), positive))
    return out


def _scan(
    name: str, segments: Sequence[Segment], linear: Sequence[Linearisation]
) -> tuple[list[dict[str, float]], int]:
    """Find the strongest tones or orders in the whitened residual; returns shapes and how many were looked at."""
    if name == "interference_tone":
        return _scan_tones(segments, linear)
    if name == "resonance":
        return _scan_resonances(segments, linear)
    power = np.zeros(len(_ORDERS))
    for segment, line in zip(segments, linear, strict=True):
        left = segment.whitened_residual(line)
        state = line.state
        if name == "cogging":
            per_acceleration = _acceleration_pattern(segment)
            signal = left[:, :-1] @ per_acceleration
            weight = float(np.sum(per_acceleration**2 * segment.inverse_variance[:-1]))
            envelope = np.ones_like(state.rate) * weight
        else:
            signal = left[:, -1] * state.rate
            envelope = state.rate**2 * segment.inverse_variance[-1]
        turns = np.exp(1j * np.outer(_ORDERS, state.angle))  # (orders, n)
        power += np.abs(turns @ signal) ** 2 / (0.5 * envelope.sum() + 1e-12)
    best = _peaks(power, _PEAKS[name])
    return [{"order": float(_ORDERS[place])} for place in best], len(_ORDERS)


def _scan_tones(segments: Sequence[Segment], linear: Sequence[Linearisation]) -> tuple[list[dict[str, float]], int]:
    longest = max(range(len(segments)), key=lambda place: len(segments[place].run.t))
    segment = segments[longest]
    total = segment.whitened_residual(linear[longest])[:, :-1].sum(axis=1)
    padded = 8 * len(total)
    power = np.abs(np.fft.rfft(total, padded)) ** 2
    frequency = np.fft.rfftfreq(padded, segment.run.sample_period)
    power[frequency < 4.0 / segment.run.duration] = 0.0
    best = _peaks(power, _PEAKS["interference_tone"], apart=16)
    return [{"frequency_hz": float(frequency[place])} for place in best], len(total) // 2


def _scan_resonances(
    segments: Sequence[Segment], linear: Sequence[Linearisation]
) -> tuple[list[dict[str, float]], int]:
    """Ring modes of every frequency and damping with the drive; correlate with what is left along the tangent."""
    period = segments[0].run.sample_period
    top = 0.45 / period
    modes = []
    for damping in _DAMPINGS:
        count = int(np.log(top / 1.5) / (1.5 * damping + 0.01)) + 1
        modes += [(float(f), damping) for f in np.geomspace(1.5, top, count)]
    power = np.zeros(len(modes))
    energy = np.full(len(modes), 1e-30)
    for segment, line in zip(segments, linear, strict=True):
        pattern = _acceleration_pattern(segment)
        weight = float(np.sum(pattern**2 * segment.inverse_variance[:-1]))
        signal = segment.whitened_residual(line)[:, :-1] @ pattern
        push = line.state.acceleration
        for place, (frequency, damping) in enumerate(modes):
            ring = _ring(push, frequency, damping, period)
            power[place] += float(ring @ signal)
            energy[place] += weight * float(ring @ ring)
    gain = np.array(power**2 / energy)
    shapes = []
    for _ in range(_PEAKS["resonance"]):
        place = int(np.argmax(gain))
        frequency, damping = modes[place]
        shapes.append({"frequency_hz": frequency, "damping_ratio": damping})
        for other, (f, _) in enumerate(modes):
            if abs(np.log(f / frequency)) < 0.05 and abs(np.log(modes[other][1] / damping)) < 0.1:
                gain[other] = -1.0
    return shapes, 60


def _ring(push: NDArray[np.float64], frequency: float, damping: float, period: float) -> NDArray[np.float64]:
    """Acceleration of a mode against its base, by the bilinear transform with the frequency pre-warped."""
    # s²/(s² + 2ζω₀s + ω₀²) at s = (2/T)(1 − z⁻¹)/(1 + z⁻¹), in units of 2/T.
    natural = np.tan(np.pi * frequency * period)
    numerator = [1.0, -2.0, 1.0]
    denominator = [
        1.0 + 2 * damping * natural + natural**2,
        2.0 * (natural**2 - 1.0),
        1.0 - 2 * damping * natural + natural**2,
    ]
    return np.asarray(lfilter(numerator, denominator, push - push[0]))


def _peaks(power: NDArray[np.float64], count: int, apart: int = 1) -> list[int]:
    """Return the places of the highest values that are apart from each other."""
    left = power.copy()
    found = []
    for _ in range(count):
        place = int(np.argmax(left))
        found.append(place)
        left[max(place - apart, 0) : place + apart + 1] = -1.0
    return found


def _acceleration_pattern(segment: Segment) -> NDArray[np.float64]:
    """Return what each channel reads per angular acceleration, shape (c,), m."""
    array = segment.model.array
    return np.asarray(array.regression_matrix[:, 2])
