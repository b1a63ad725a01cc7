"""A surrogate for what nothing in the library explains: functions of the motion, the angle and time that predict it.

Functions of the generic basis are taken in one by one, each where it makes the data most probable, with the drive and
those before it projected out; then all are fitted with the full simulation and the noise is learnt from what they
leave. What a surrogate is worth is measured as for a cause: on data that its fit never saw.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.adequacy import series_products
from gfimu.diagnosis.causes import Cause, effects_of_run
from gfimu.diagnosis.evidence import log_evidence, log_evidence_each
from gfimu.diagnosis.fit import Fit, segments_at
from gfimu.diagnosis.long_run import MOST_SEARCHED, spread_over_runs
from gfimu.diagnosis.nuisances import learn_noise
from gfimu.diagnosis.refinement import refine
from gfimu.diagnosis.residual_tests import judges_reference
from gfimu.diagnosis.segment import Segment
from gfimu.generic_basis import FUNCTIONS, OF_READING, Motion, basis_function, is_of_time, ripples, tone
from gfimu.units import STANDARD_GRAVITY
from gfimu.world_model import BasisUnits, Effect

__all__ = ["Surrogate", "surrogates"]

_MOST_TERMS = 16
_MOST_PER_ROUND = 6
_ROUNDS = 3
_ITERATIONS = 3  # the terms are linear; only the drive is not
_LEAST_ODDS = 8.0
_COMPARABLE = 0.1  # of a round's best: what is weaker waits until that is fitted, for a large term is far from linear
_NEARLY_ALL = 0.9  # of what a function explains on all channels
_LEAST_SHARE = 0.03  # of what is left: a round that takes away less describes nothing
_LINES = 3
_HIGHEST_ORDER = 48
_FEWEST_CYCLES = 10  # of a tone in a run: what is slower the slow functions follow
_PADDED = 8
_UNIT = 0.03  # m/s²: what a function of order one is worth in the evidence


@dataclass(frozen=True)
class Surrogate:
    """Terms that describe without a name.

    Parameters
    ----------
    fit : Fit
        The terms, fitted.
    segments : tuple of Segment
        The data with their drives at the fit and the noise that it leaves.
    """

    fit: Fit
    segments: tuple[Segment, ...]


@dataclass(frozen=True)
class _Term:
    """A function on some series: numbers of channels, or the reference's, which is one more."""

    function: str
    series: tuple[int, ...]

    def is_in(self, others: Sequence[_Term]) -> bool:
        """Tell whether others hold it already."""
        return any(one.function == self.function and set(self.series) <= set(one.series) for one in others)


def surrogates(
    segments: Sequence[Segment], start: Fit, fixed: Sequence[Sequence[Effect]], hints: Sequence[str] = ()
) -> list[Surrogate]:
    """Describe what a fit without causes leaves, ever more richly; empty where no function predicts it.

    In long recordings the terms are chosen on some stretches and fitted to all, the poorest and the richest only.

    Parameters
    ----------
    segments : sequence of Segment
        The data; left as they are.
    start : Fit
        No cause; where the drives start.
    fixed : sequence of sequence of Effect
        Effects known beforehand, per segment.
    hints : sequence of str
        Functions of `gfimu.generic_basis` to look at besides its own.
    """
    units = _units(segments, start)
    chosen = spread_over_runs([segment.index for segment in segments], MOST_SEARCHED)
    if len(chosen) < len(segments):
        some = [segments[place] for place in chosen]
        found = _ever_richer(some, start.of(chosen), [fixed[place] for place in chosen], units, hints)
        ends = found if len(found) < 3 else [found[0], found[-1]]
        return [_everywhere(segments, one.fit.causes, start, fixed) for one in ends]
    return _ever_richer(segments, start, fixed, units, hints)


def _everywhere(
    segments: Sequence[Segment], causes: Sequence[Cause], start: Fit, fixed: Sequence[Sequence[Effect]]
) -> Surrogate:
    """Fit terms to all segments and learn the noise that they leave."""
    mine = segments_at(segments, start)
    fit = refine(mine, causes, fixed, drives=start.drives, iterations=_ITERATIONS)
    learn_noise(mine, fit, fixed)
    return Surrogate(fit, tuple(segments_at(mine, fit)))


def _ever_richer(
    segments: Sequence[Segment],
    start: Fit,
    fixed: Sequence[Sequence[Effect]],
    units: BasisUnits,
    hints: Sequence[str],
) -> list[Surrogate]:
    observations = sum(int(segment.weight_mask.sum()) for segment in segments)
    mine = segments_at(segments, start)
    fit = start
    terms: list[_Term] = []
    found: list[Surrogate] = []
    for _ in range(_ROUNDS):
        more = _strongest(mine, fit, fixed, units, hints, terms)[: _MOST_TERMS - len(terms)]
        if not more:
            break
        known = {term: cause for term, cause in zip(terms, fit.causes, strict=True) if not term.is_in(more)}
        terms = [*known, *more]
        causes = [*known.values(), *(_cause(mine[0], term, units) for term in more)]
        before = fit.objective
        fit = refine(mine, causes, fixed, drives=fit.drives, iterations=_ITERATIONS)
        if not before - fit.objective > _LEAST_SHARE * max(before - observations, 0.0):
            break
        learn_noise(mine, fit, fixed)
        fit = refine(mine, fit.causes, fixed, drives=fit.drives, iterations=_ITERATIONS)
        mine = segments_at(mine, fit)
        found.append(Surrogate(fit, tuple(mine)))
    return found


def _units(segments: Sequence[Segment], fit: Fit) -> BasisUnits:
    """Return the largest rate and acceleration of all runs, and the longest run."""
    states = [segment.spline.spin(drive).at(segment.run.t) for segment, drive in zip(segments, fit.drives, strict=True)]
    return BasisUnits(
        max(1e-6, *(float(np.abs(state.rate).max()) for state in states)),
        max(1e-6, *(float(np.abs(state.acceleration).max()) for state in states)),
        max(float(segment.run.t[-1] - segment.start) for segment in segments),
    )


def _cause(segment: Segment, term: _Term, units: BasisUnits) -> Cause:
    """Return a term as a cause whose size is still nothing."""
    channels = segment.model.array.n_channels
    of_reference = term.series == (channels,)
    family = segment.model.unnamed(term.function, units, of_reference=of_reference)
    mixing = np.ones((1, 1)) if of_reference else np.eye(channels)[:, list(term.series)]
    return Cause(family, term.function, mixing, {}, 0.0, np.zeros(mixing.shape[1]))


def _strongest(
    segments: Sequence[Segment],
    fit: Fit,
    fixed: Sequence[Sequence[Effect]],
    units: BasisUnits,
    hints: Sequence[str],
    taken: Sequence[_Term],
) -> list[_Term]:
    """Take functions in, each where it makes the data most probable, until none does."""
    array = segments[0].model.array
    names = list(dict.fromkeys(["constant", *FUNCTIONS, *_lines(segments, fit, fixed), *hints]))
    gram: NDArray[np.float64] | None = None
    score: NDArray[np.float64] | None = None
    for segment, known in zip(segments, fixed, strict=True):
        effects = [*known, *effects_of_run(fit.causes, array, segment.index)]
        line = segment.linearise(effects)
        motion = Motion.of(line.state, segment.run.t - segment.start, units)
        shared = np.column_stack([_UNIT * basis_function(n)(motion) for n in names if n != OF_READING])  # (n, k)
        basis = shared if len(shared.T) == len(names) else _with_cubes(shared, segment.predict(effects))
        part, right = series_products(segment, line, basis, fit.causes, known)
        gram = part if gram is None else gram + part
        score = right if score is None else score + right
    assert gram is not None
    assert score is not None
    return _greedy(segments, names, gram, score, taken)


def _with_cubes(shared: NDArray[np.float64], predicted: NDArray[np.float64]) -> NDArray[np.float64]:
    """Add the cube of each channel's reading, as predicted, to functions (n, k) for a basis (c + 1, n, k + 1).

    The cube of a measured reading would follow the noise in it.
    """
    cubes = _UNIT * (predicted.T / STANDARD_GRAVITY) ** 3  # (c + 1, n)
    cubes[-1] = 0.0
    every = np.broadcast_to(shared, (len(cubes), *shared.shape))
    return np.concatenate([every, cubes[:, :, None]], axis=2)


def _greedy(
    segments: Sequence[Segment],
    names: Sequence[str],
    gram: NDArray[np.float64],
    score: NDArray[np.float64],
    taken: Sequence[_Term],
) -> list[_Term]:
    """Choose terms from the normal equations of all functions on all series."""
    count, channels = len(names), segments[0].model.array.n_channels
    reference = all(judges_reference(segment) for segment in segments) and not segments[0].is_angle
    usable = np.ones(len(score), dtype=bool)
    usable[channels * count :] = [reference and name != OF_READING and not is_of_time(name) for name in names]
    usable &= gram.diagonal() > 1e-9
    for term in taken:
        usable[[place * count + names.index(term.function) for place in term.series if term.function in names]] = False
    chosen: list[_Term] = []
    first = 0.0
    for _ in range(_MOST_PER_ROUND):
        single = log_evidence_each(np.maximum(gram.diagonal(), 0.0), score, np.zeros(len(score), dtype=bool))
        single = np.where(usable, single - np.log(len(score)), -np.inf)
        odds, best = float(single.max()), [int(np.argmax(single))]
        for function in range(count):
            places = np.arange(channels) * count + function
            if usable[places].any():
                value = log_evidence(gram[np.ix_(places, places)], score[places]) - np.log(count)
                if value > odds and _NEARLY_ALL * value > single.max():
                    odds, best = value, places.tolist()
        first = max(first, odds)
        if odds < max(_LEAST_ODDS, _COMPARABLE * first):
            break
        term = _Term(names[best[0] % count], tuple(place // count for place in best))
        chosen.append(term)
        inner = gram[np.ix_(best, best)] + np.eye(len(best))
        gain = np.linalg.solve(inner, gram[best])
        score = score - gain.T @ score[best]
        gram = gram - gain.T @ gram[best]
        usable[best] = False
    return [one for place, one in enumerate(chosen) if not one.is_in([*chosen[:place], *chosen[place + 1 :]])]


def _lines(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> list[str]:
    """Return the functions of the strongest lines of the longest residual, in time and in angle."""
    longest = max(range(len(segments)), key=lambda place: len(segments[place].run.t))
    segment = segments[longest]
    effects = [*fixed[longest], *effects_of_run(fit.causes, segment.model.array, segment.index)]
    left = segment.working_residual(effects)[:, :-1] / segment.levels.white[:-1]
    angle = segment.motion(effects).at(segment.run.t).angle
    orders = np.arange(1, _HIGHEST_ORDER + 1)
    found: list[str] = []
    power = np.sum(np.abs(np.exp(1j * np.outer(orders, angle)) @ left) ** 2, axis=1)
    for order in orders[np.argsort(-power)[:_LINES]]:
        found += ripples(int(order))
    power = np.abs(np.fft.rfft(left * np.hanning(len(left))[:, None], _PADDED * len(left), axis=0)) ** 2
    frequency = np.fft.rfftfreq(_PADDED * len(left), segment.run.sample_period)
    summed = np.where(frequency > _FEWEST_CYCLES / segment.run.duration, power.sum(axis=1), 0.0)
    for _ in range(_LINES):
        place = int(np.clip(np.argmax(summed), 1, len(summed) - 2))
        low, top, high = np.log(np.maximum(summed[place - 1 : place + 2], 1e-300))
        # The vertex of the parabola through the logs of a peak and its neighbours.
        shift = 0.5 * (low - high) / min(low - 2 * top + high, -1e-12)
        peak = float(frequency[place] + np.clip(shift, -0.5, 0.5) * frequency[1])
        found += [tone(peak, wave) for wave in ("sine", "cosine")]
        summed[max(place - 3 * _PADDED, 0) : place + 3 * _PADDED] = 0.0
    return found
