"""Where something is wrong, without when: at each place the evidence of an error that is free in time.

Such an error needs no dependence, so the place of footsteps, of a floor that shakes or of a bias that jumps is found.
It is modelled as independent from block to block, in time or in frequency, with a variance of its own in each:
½ n (v − 1 − ln v) nats for n samples of mean square v, less ½ ln n and a nat for having chosen v.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.data.cosine_basis import NoiseLevels
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.gauss_newton import FEW, fit
from gfimu.diagnosis.fit.linear import Point, linearise
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.cause import effects_of
from gfimu.diagnosis.terms.located.alternatives import channel_patterns, chip_groups
from gfimu.diagnosis.terms.located.policy import LOCATED
from gfimu.model.located.operators import Place, channel_place, rig_places
from gfimu.model.world_model import reads_place

__all__ = ["FreeTime", "free_time"]

_Floats = NDArray[np.float64]


@dataclass(frozen=True)
class FreeTime:
    """A place with the evidence of an error there that is free in time.

    Parameters
    ----------
    log_odds : float
        Evidence against none, nats.
    where : Place
        The place.
    pattern : str
        Which series share the error.
    """

    log_odds: float
    where: Place
    pattern: str


def free_time(stretches: Sequence[Stretch], point: Point, policy: Policy) -> list[FreeTime]:
    """Return the places of errors that are free in time beside the causes of a point, best first.

    The noise is the learnt one, but with the same slow noise in all channels, as that of one channel would take in what
    is looked for.
    """
    if point.residue is not None:
        known = point.residue.effects(stretches[0], linearise(stretches, point).residue)
        stretches = [replace(stretch, known=(*stretch.known, *known)) for stretch in stretches]
        point = replace(point, residue=None)
    levels = tuple(_alike(one, policy.largest_flicker) for one in point.levels)
    point = fit(stretches, replace(point, levels=levels), replace(policy, steps=FEW)).point
    totals: dict[str, FreeTime] = {}
    for index, posterior in enumerate(linearise(stretches, point, responses=False).posteriors):
        stretch = stretches[index]
        weights = posterior.observed.weights
        residual = posterior.whitened / np.sqrt(weights)
        for where, pattern, directions in _directions(stretch, point, index):
            chosen = float(np.log(len(directions)))  # each component that it takes
            gains = [_gained(residual, one * np.sqrt(weights), stretch.run.sample_period) for one in directions]
            value = sum(max(gain - chosen, 0.0) for gain in gains)
            if pattern == "own":  # it can do all that others do; the drive spreads a little of these over all channels
                value *= 1.0 - policy.small
            label = f"{where.what} {where.components}"
            before = totals[label].log_odds if label in totals else 0.0
            totals[label] = FreeTime(before + value, where, pattern)
    return sorted(totals.values(), key=lambda one: -one.log_odds)


def _alike(levels: NoiseLevels, largest: float) -> NoiseLevels:
    """Return noise levels whose bias instability is the median of the channels, up to a largest usual one, m/s²."""
    flicker = np.full_like(levels.flicker, min(float(np.median(levels.flicker[:-1])), largest))
    flicker[-1] = levels.flicker[-1]
    return replace(levels, flicker=flicker)


def _directions(stretch: Stretch, point: Point, index: int) -> Iterator[tuple[Place, str, list[_Floats]]]:
    """Yield places with how an error of each component shows, (n, c + 1)."""
    array = stretch.model.array
    state = stretch.state(effects_of(point.causes, array, stretch.index), point.drives[index].spin)
    places = rig_places(is_angle=reads_place(stretch.model), has_geometry=state.placed is not None)
    for what in sorted({"reads", "turns", "vibrates", "shakes", "heaves", "gain"} & places.keys()):
        parts = [next(p for p in reversed(one.parts) if p is not None) for one in places[what].operators(state)]
        yield places[what], "all", parts
    kinds = [("offset", pattern) for pattern in channel_patterns(array)]
    chips = zip(chip_groups(array), array.chips, strict=True)
    kinds += [("delay", ("clock", "chip", (chip,), (one.name,))) for chip, one in chips]
    for kind, (name, pattern, groups, labels) in kinds:
        where = channel_place(name, kind, groups, labels)
        yield (
            where,
            pattern,
            [operator.of_value for operator in where.operators(state) if operator.of_value is not None],
        )


def _gained(residual: _Floats, direction: _Floats, period: float) -> float:
    """Return the evidence of an error in one direction (n, c + 1), nats: the larger of blocks in time and frequency."""
    size = np.linalg.norm(direction, axis=1)
    if not size.max() > 0.0:
        return 0.0
    signal = np.sum(residual * direction, axis=1) / np.maximum(size, 1e-9 * size.max())  # numerical
    in_time = np.array_split(signal, max(int(len(signal) * period / LOCATED.block_s), 1))
    spectrum = np.fft.rfft(signal - signal.mean())[1:] / np.sqrt(len(signal))
    in_frequency = np.array_split(np.abs(spectrum), min(LOCATED.bands, len(spectrum)))
    return max(_evidence(in_time, 0.5), _evidence(in_frequency, 1.0))


def _evidence(blocks: Sequence[_Floats], share: float) -> float:
    """Return Σ share · n (v − 1 − ln v) − ½ ln n − 1 over blocks whose mean square v is above one, nats."""
    total = 0.0
    for block in blocks:
        power = max(float(np.mean(block**2)), 1.0)
        gained = share * len(block) * (power - 1.0 - np.log(power)) - 0.5 * np.log(len(block)) - 1.0
        total += max(float(gained), 0.0)
    return total
