"""A surrogate for what nothing in the library explains: functions of the motion, the angle and time that predict it.

Functions of the generic basis are taken in one by one, each where it makes the data most probable, with the drive and
those before it projected out; then all are fitted with the full simulation and the noise is learnt from the residual.
What a surrogate is worth is measured as for a cause: on validation data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.base.units import STANDARD_GRAVITY
from gfimu.diagnosis.criticism.generic import (
    FEWEST_CYCLES,
    LEAST_INFORMATION,
    UNIT,
    basis_units,
    functions_at,
    judges_reference,
    motion_of,
    series_products,
)
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.evidence import log_evidence, log_evidence_each
from gfimu.diagnosis.fit.gauss_newton import FEW, Fit, fit
from gfimu.diagnosis.fit.learn import learn_noise
from gfimu.diagnosis.fit.linear import Point
from gfimu.diagnosis.fit.observed_at import observed_at
from gfimu.diagnosis.fit.posterior import Posterior
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.cause import Cause
from gfimu.model.generic_basis import FUNCTIONS, OF_READING, basis_function, is_of_time, ripples, tone
from gfimu.model.world_model import BasisUnits

__all__ = ["Surrogate", "surrogates"]

_HIGHEST_ORDER = 48  # numerical: cycles per revolution
_PADDED = 8  # numerical: zero padding of a periodogram


@dataclass(frozen=True)
class Surrogate:
    """Terms that describe without a name.

    Parameters
    ----------
    fit : Fit
        The terms, fitted, under the noise that they leave.
    """

    fit: Fit

    @property
    def terms(self) -> tuple[Cause, ...]:
        """The terms; the place of each is the name of its function."""
        return self.fit.causes


@dataclass(frozen=True)
class _Term:
    """A function on some series: numbers of channels, or the number of channels for the reference."""

    function: str
    series: tuple[int, ...]

    def is_in(self, others: Sequence[_Term]) -> bool:
        """Whether others hold it already."""
        return any(one.function == self.function and set(self.series) <= set(one.series) for one in others)

    def cause(self, stretch: Stretch, units: BasisUnits) -> Cause:
        """Return the term as a cause without sizes."""
        channels = stretch.model.array.n_channels
        of_reference = self.series == (channels,)
        family = stretch.model.unnamed(self.function, units, of_reference=of_reference)
        mixing = np.ones((1, 1)) if of_reference else np.eye(channels)[:, list(self.series)]
        return Cause(family, self.function, mixing, {}, np.zeros(mixing.shape[1]))


def surrogates(
    stretches: Sequence[Stretch], nothing: Fit, policy: Policy = Policy(), hints: Sequence[str] = ()
) -> list[Surrogate]:
    """Describe the residual of a fit without causes, ever more richly; empty where no function predicts it.

    In long recordings the terms are chosen on some stretches and fitted to all, the poorest and the richest only.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    nothing : Fit
        No cause.
    policy : Policy
        Thresholds of fits, and ``beam``, ``extra_odds``, ``small``, ``dominant`` and ``most_searched``.
    hints : sequence of str
        Functions of `gfimu.model.generic_basis` to look at besides its own.
    """
    point = _without_walk(stretches, nothing.point)
    units = basis_units(stretches, point)
    chosen = _spread([stretch.index for stretch in stretches], policy.most_searched)
    if len(chosen) == len(stretches):
        return _ever_richer(stretches, point, policy, units, hints)
    residue = point.residue
    some = replace(
        point,
        drives=tuple(point.drives[place] for place in chosen),
        levels=tuple(point.levels[place] for place in chosen),
        residue=residue and replace(residue, columns=tuple(residue.columns[place] for place in chosen)),
    )
    found = _ever_richer([stretches[place] for place in chosen], some, policy, units, hints)
    ends = found if len(found) < 3 else [found[0], found[-1]]
    return [Surrogate(_settled(stretches, replace(point, causes=end.terms), policy)) for end in ends]


def _without_walk(stretches: Sequence[Stretch], point: Point) -> Point:
    """Return a point whose biases walk as the twin says only: what has no name may look like a random walk."""
    own = tuple(stretch.first_levels.walk for stretch in stretches)
    if all(one.walk == walk for one, walk in zip(point.levels, own, strict=True)):
        return point
    levels = tuple(replace(one, walk=walk) for one, walk in zip(point.levels, own, strict=True))
    return learn_noise(stretches, replace(point, levels=levels))


def _spread(runs: Sequence[int], most: int) -> list[int]:
    """Pick about so many places of stretches, given the run of each: evenly spread, one of every run at least."""
    chosen: list[int] = []
    for run in dict.fromkeys(runs):
        mine = [index for index, number in enumerate(runs) if number == run]
        count = min(max(round(most * len(mine) / len(runs)), 1), len(mine))
        chosen += [mine[int(place)] for place in np.linspace(0, len(mine) - 1, count).round()]
    return chosen


def _ever_richer(
    stretches: Sequence[Stretch], start: Point, policy: Policy, units: BasisUnits, hints: Sequence[str]
) -> list[Surrogate]:
    """Choose terms and fit them, round by round; returns the surrogate of every round."""
    observations = sum(stretch.observations for stretch in stretches)
    present = fit(stretches, start, replace(policy, steps=FEW))
    terms: list[_Term] = []
    found: list[Surrogate] = []
    for _ in range(FEW):
        more = _strongest(stretches, present.point, terms, policy, units, hints)
        if not more:
            break
        kept = {term: cause for term, cause in zip(terms, present.causes, strict=True) if not term.is_in(more)}
        terms = [*kept, *more]
        causes = (*kept.values(), *(term.cause(stretches[0], units) for term in more))
        point = replace(present.point, causes=causes)
        unexplained = max(present.objective - observations, 0.0)
        try:
            richer = fit(stretches, point, replace(policy, steps=FEW))
            if not present.objective - richer.objective > policy.dominant * unexplained:
                break
            present = _settled(stretches, richer.point, policy)
        except np.linalg.LinAlgError:  # functions that can't be solved for describe nothing
            break
        found.append(Surrogate(present))
    return found


def _settled(stretches: Sequence[Stretch], point: Point, policy: Policy) -> Fit:
    """Fit terms, learn the noise that they leave, and fit them again under it."""
    few = replace(policy, steps=FEW)
    first = fit(stretches, point, few)
    return fit(stretches, learn_noise(stretches, first.point), few)


def _strongest(
    stretches: Sequence[Stretch],
    point: Point,
    taken: Sequence[_Term],
    policy: Policy,
    units: BasisUnits,
    hints: Sequence[str],
) -> list[_Term]:
    """Take functions in, each where it makes the data most probable, until none does."""
    names = list(dict.fromkeys(["constant", *FUNCTIONS, *_line_functions(stretches, point), *hints]))

    def values_of(stretch: Stretch, at: Posterior) -> NDArray[np.float64]:
        motion = functions_at(stretch, motion_of(stretch, point, at.drive), units)
        shared = np.column_stack([basis_function(name)(motion) for name in names if name != OF_READING])  # (n, k)
        if OF_READING not in names:
            return UNIT * shared
        # The cube of each channel's reading as predicted: that of a measured one would follow its noise.
        cubes = (at.observed.prediction.T / STANDARD_GRAVITY) ** 3  # (c + 1, n)
        cubes[-1] = 0.0
        every = np.broadcast_to(shared, (len(cubes), *shared.shape))
        return UNIT * np.insert(every, names.index(OF_READING), cubes, axis=2)

    gram, score = series_products(stretches, point, values_of)
    count, channels = len(names), stretches[0].model.array.n_channels
    reference = judges_reference(stretches) and not stretches[0].is_angle
    usable = gram.diagonal() > LEAST_INFORMATION
    usable[channels * count :] &= [reference and name != OF_READING and not is_of_time(name) for name in names]
    for term in taken:
        usable[[place * count + names.index(term.function) for place in term.series if term.function in names]] = False
    return _greedy(names, channels, gram, score, usable, policy)


def _greedy(
    names: Sequence[str],
    channels: int,
    gram: NDArray[np.float64],
    score: NDArray[np.float64],
    usable: NDArray[np.bool_],
    policy: Policy,
) -> list[_Term]:
    """Choose terms from the normal equations of all functions on all series."""
    count, usable = len(names), usable.copy()
    chosen: list[_Term] = []
    first = 0.0
    for _ in range(policy.beam):
        single = log_evidence_each(np.maximum(gram.diagonal(), 0.0), score, np.zeros(len(score), dtype=bool))
        single = np.where(usable, single - np.log(len(score)), -np.inf)
        odds, best = float(single.max()), [int(np.argmax(single))]
        for function in range(count):
            places = np.arange(channels) * count + function
            if usable[places].any():
                value = log_evidence(gram[np.ix_(places, places)], score[places]) - np.log(count)
                if value > odds and (1.0 - policy.small) * value > single.max():
                    odds, best = value, places.tolist()
        first = max(first, odds)
        if odds < max(policy.extra_odds, policy.small * first):
            break
        chosen.append(_Term(names[best[0] % count], tuple(place // count for place in best)))
        gain = np.linalg.solve(gram[np.ix_(best, best)] + np.eye(len(best)), gram[best])
        score = score - gain.T @ score[best]
        gram = gram - gain.T @ gram[best]
        usable[best] = False
    return [one for index, one in enumerate(chosen) if not one.is_in([*chosen[:index], *chosen[index + 1 :]])]


def _line_functions(stretches: Sequence[Stretch], point: Point) -> list[str]:
    """Return the functions of the strongest lines in the residual of the longest stretch, in time and in angle."""
    longest = max(range(len(stretches)), key=lambda place: len(stretches[place].run.t))
    stretch, seen = stretches[longest], observed_at(stretches, point)[longest]
    residual = (seen.residual / seen.levels.white)[:, :-1]
    angle = motion_of(stretch, point, point.drives[longest]).angle
    orders = np.arange(1, _HIGHEST_ORDER + 1)
    power = np.sum(np.abs(np.exp(1j * np.outer(orders, angle)) @ residual) ** 2, axis=1)
    found = [name for order in orders[np.argsort(-power)[:FEW]] for name in ripples(int(order))]
    padded = _PADDED * len(residual)
    power = np.abs(np.fft.rfft(residual * np.hanning(len(residual))[:, None], padded, axis=0)) ** 2
    frequency = np.fft.rfftfreq(padded, stretch.run.sample_period)
    summed = np.where(frequency > FEWEST_CYCLES / stretch.run.duration, power.sum(axis=1), 0.0)
    for _ in range(FEW):
        place = int(np.clip(np.argmax(summed), 1, len(summed) - 2))
        low, top, high = np.log(np.maximum(summed[place - 1 : place + 2], 1e-300))
        # The vertex of the parabola through the logs of a peak and its neighbours.
        shift = 0.5 * (low - high) / min(low - 2 * top + high, -1e-12)
        peak = float(frequency[place] + np.clip(shift, -0.5, 0.5) * frequency[1])
        found += [tone(peak, wave) for wave in ("sine", "cosine")]
        summed[max(place - 3 * _PADDED, 0) : place + 3 * _PADDED] = 0.0
    return found
