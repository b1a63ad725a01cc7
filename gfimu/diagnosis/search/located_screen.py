"""The screen of located terms: each alone beside the causes of a point, in the linear world about it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.evidence import SCALES, inverse, log_evidence
from gfimu.diagnosis.fit.linear import Point, linearise
from gfimu.diagnosis.search.waves import wave_terms
from gfimu.diagnosis.terms.cause import Cause, effects_of
from gfimu.diagnosis.terms.columns import Columns
from gfimu.diagnosis.terms.library import cause_columns
from gfimu.diagnosis.terms.located.alternatives import ChannelTerms, channel_terms, dependences, rig_terms
from gfimu.diagnosis.terms.located.operators import channel_place
from gfimu.diagnosis.terms.located.policy import LOCATED
from gfimu.diagnosis.terms.located.term import LocatedTerm, located_columns
from gfimu.model.world_model import reads_place

__all__ = ["Leader", "LocatedScreen"]

_Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Leader:
    """A located term with the log odds, prior included, that it adds in a linear world.

    Parameters
    ----------
    log_odds : float
        Log evidence and log prior, nats.
    term : LocatedTerm
        The term.
    cause : Cause
        The term at its linear estimate, under its most probable length scale.
    """

    log_odds: float
    term: LocatedTerm
    cause: Cause


class LocatedScreen:
    """Normal equations of located terms at a point, drives, slow noise and the causes there integrated out."""

    def __init__(self, stretches: Sequence[Stretch], point: Point) -> None:
        self._stretches, self._array = stretches, stretches[0].model.array
        self._posteriors = linearise(stretches, point, responses=False).posteriors
        self._states = [
            stretch.state(effects_of(point.causes, self._array, stretch.index), drive.spin)
            for stretch, drive in zip(stretches, point.drives, strict=True)
        ]
        self._present = [
            cause_columns(stretch, at.observed, at.drive, point.causes)
            for stretch, at in zip(stretches, self._posteriors, strict=True)
        ]

    def leaders(self) -> list[Leader]:
        """Return all terms, most probable first."""
        is_angle = reads_place(self._stretches[0].model)
        every = dependences(self._states)
        waves, of_channels = wave_terms(self._states, self._posteriors, self._array, is_angle=is_angle)
        terms = [*rig_terms(self._states, every, is_angle=is_angle), *waves]
        found = [self._judged(term, *self._products(term)) for term in terms if term.count <= LOCATED.widest]
        for some in (*channel_terms(self._states, every, self._array), *of_channels):
            found += self._of_channels(some)
        seen = [leader for leader in found if leader is not None and np.isfinite(leader.log_odds)]
        seen.sort(key=lambda leader: -leader.log_odds)
        shaped = [leader for leader in seen[: LOCATED.refined] if leader.term.dependence.near(1.0)]
        return sorted([*map(self._refined, shaped), *seen], key=lambda leader: -leader.log_odds)

    def _refined(self, leader: Leader) -> Leader:
        """Return a leader at the most probable frequency, damping or order nearby."""
        for width in LOCATED.widths:
            for dependence in leader.term.dependence.near(width):
                term = replace(leader.term, dependence=dependence)
                other = self._judged(term, *self._products(term))
                if other is not None and other.log_odds > leader.log_odds:
                    leader = other
        return leader

    def _products(self, term: LocatedTerm) -> tuple[_Floats, _Floats]:
        """Return G (P, P) and b (P,) of a term's coefficients."""
        held = self._present[0].count
        gram, score = np.zeros((held + term.count,) * 2), np.zeros(held + term.count)
        for state, present, posterior in zip(self._states, self._present, self._posteriors, strict=True):
            columns = located_columns(term, state, posterior.observed.weight)
            own, right, _ = posterior.products(Columns.together([present, columns]))
            gram, score = gram + own, score + right
        if not held:
            return gram, score
        gain = inverse(gram[:held, :held] + np.eye(held) / SCALES[-1] ** 2) @ gram[:held, held:]
        return gram[held:, held:] - gram[held:, :held] @ gain, score[held:] - gain.T @ score[:held]

    def _of_channels(self, some: ChannelTerms) -> Iterator[Leader | None]:
        """Judge all patterns of an error of channels by the products of every channel by itself."""
        single = tuple((channel,) for channel in range(self._array.n_channels))
        every = LocatedTerm(channel_place("channel", some.kind, single, self._array.channels), some.dependence)
        gram, score = self._products(every)
        count = some.dependence.count
        for term, groups in some.terms():
            if term.count > LOCATED.widest:
                continue
            mixing = np.zeros((len(single), len(groups)))
            for component, group in enumerate(groups):
                mixing[list(group), component] = 1.0
            whole = np.kron(mixing, np.eye(count))
            yield self._judged(term, whole.T @ gram @ whole, whole.T @ score)

    def _judged(self, term: LocatedTerm, gram: _Floats, score: _Floats) -> Leader | None:
        """Return a term at its most probable length scale; None where it is not seen."""
        if not np.trace(gram) > LOCATED.least_information:
            return None
        prior = self._log_prior(term)
        best: tuple[float, int, _Floats] | None = None
        for length in range(len(term.dependence.roots)):
            mixing = term.mixing(length)
            inner, right = mixing.T @ gram @ mixing, mixing.T @ score
            value = log_evidence(0.5 * (inner + inner.T), right)
            if best is None or value > best[0]:
                best = value, length, np.asarray(np.linalg.solve(inner + np.eye(len(right)), right))
        assert best is not None
        value, length, coordinates = best
        return Leader(value + prior, term, term.cause(length, coordinates, prior))

    def _log_prior(self, term: LocatedTerm) -> float:
        alike = {"one": self._array.n_channels, "chip": len(self._array.chips)}.get(term.pattern, 1)
        return LOCATED.log_prior - term.dependence.looks - float(np.log(alike))
