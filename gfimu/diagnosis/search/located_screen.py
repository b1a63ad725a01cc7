"""The screen of located terms: each alone beside the causes of a point, in the linear world about it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.coarse import Rows, coarse
from gfimu.diagnosis.fit.evidence import inverse, log_evidence
from gfimu.diagnosis.fit.gauss_newton import precision
from gfimu.diagnosis.fit.linear import Point, linearise
from gfimu.diagnosis.fit.parallel import each_apart
from gfimu.diagnosis.fit.posterior import Posterior
from gfimu.diagnosis.search.sets import Key
from gfimu.diagnosis.search.waves import wave_terms
from gfimu.diagnosis.terms.cause import Cause, effects_of
from gfimu.diagnosis.terms.columns import Columns
from gfimu.diagnosis.terms.library import cause_columns
from gfimu.diagnosis.terms.located.alternatives import (
    ChannelTerms,
    body_dependences,
    body_terms,
    channel_terms,
    dependences,
    rig_terms,
)
from gfimu.diagnosis.terms.located.policy import LOCATED
from gfimu.diagnosis.terms.located.term import LocatedBasis, LocatedTerm, located_columns
from gfimu.model.located.operators import channel_place
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


@dataclass(frozen=True)
class _AveragedStretch:
    """A stretch averaged over groups of rows: its posterior, the groups, the basis, and the columns of the causes."""

    posterior: Posterior
    rows: Rows
    basis: LocatedBasis
    present: Columns

    @cached_property
    def weight(self) -> _Floats:
        """What columns of means are multiplied by, (m, c + 1)."""
        return self.rows.roots[:, None] * self.posterior.observed.weight


@dataclass(frozen=True)
class _TermGroup:
    """A term whose normal equations are computed, and its members, whose equations follow by a mixing (None: the same).

    An error of every channel by itself has as members the errors of one channel, of a chip and of all channels.
    """

    term: LocatedTerm
    members: tuple[tuple[LocatedTerm, _Floats | None], ...]


@dataclass(frozen=True)
class _Batch:
    """Groups of terms whose normal equations are computed together, on averages of up to ``most`` rows."""

    most: int
    groups: tuple[_TermGroup, ...]


class LocatedScreen:
    """Normal equations of located terms at a point, drives, slow noise and the causes there integrated out.

    One screening serves the point and what it would be without some of its causes, in the linear world about it.
    """

    def __init__(self, stretches: Sequence[Stretch], point: Point) -> None:
        self._stretches, self._array = stretches, stretches[0].model.array
        self._posteriors = linearise(stretches, replace(point, residue=None), responses=False).posteriors
        self._states = [
            stretch.state(effects_of(point.causes, self._array, stretch.index), drive.spin)
            for stretch, drive in zip(stretches, point.drives, strict=True)
        ]
        residues = point.residue.columns if point.residue is not None else (None,) * len(stretches)
        self._present = [
            Columns.together(
                [*([] if own is None else [own]), cause_columns(stretch, at.observed, at.drive, point.causes)]
            )
            for stretch, at, own in zip(stretches, self._posteriors, residues, strict=True)
        ]
        first = 0 if residues[0] is None else residues[0].count
        self._precision = np.concatenate([np.ones(first), precision(point.causes)])
        ends = first + np.cumsum([0, *(cause.unknowns for cause in point.causes)])
        self._unknowns = {
            cause.key: np.arange(start, stop) for cause, start, stop in zip(point.causes, ends, ends[1:], strict=False)
        }
        self._is_body = isinstance(stretches[0], BodyStretch)
        self._fastest = max(float(np.abs(state.spin.rate).max()) for state in self._states)
        self._by_rows: dict[int, list[_AveragedStretch]] = {}
        self._sizes = np.zeros(len(self._precision))
        for cause in point.causes:
            self._sizes[self._unknowns[cause.key][: len(cause.coordinates)]] = cause.coordinates

    def leaders(self, without: Key = frozenset(), least: float = -np.inf) -> list[Leader]:
        """Return all terms from some log odds on, most probable first.

        Parameters
        ----------
        without : frozenset of (str, str)
            Effects and places of causes of the point that are left out.
        least : float
            Log odds, nats, of terms that are of interest.
        """
        return self.leaders_each([(without, least)])[0]

    def leaders_each(self, cases: Sequence[tuple[Key, float]]) -> list[list[Leader]]:
        """Return the same for several cases, each the causes that are left out and the least log odds."""
        of_rig, of_channels = self._terms()
        alone = [_TermGroup(term, ((term, None),)) for term in of_rig]
        batches = self._batches([*alone, *map(self._on_each_channel, of_channels)])
        found: list[list[Leader]] = [[] for _ in cases]
        for batch, estimates in zip(batches, each_apart(partial(self._estimates, cases), batches), strict=True):
            for case, index, member, estimate in estimates:
                term, _ = batch.groups[index].members[member]
                found[case].append(self._leader(term, estimate))
        return [sorted(leaders, key=lambda leader: -leader.log_odds) for leaders in found]

    def _estimates(
        self, cases: Sequence[tuple[Key, float]], batch: _Batch
    ) -> list[tuple[int, int, int, tuple[float, int, _Floats]]]:
        """Return the case, the number in a batch, the number among its members, and the estimate of each leader."""
        found = []
        for index, (gram, score) in enumerate(self._products(batch)):
            for case, (without, least) in enumerate(cases):
                inner, right = self._beside(gram, score, without)
                for number, (term, mixing) in enumerate(batch.groups[index].members):
                    own = (inner, right) if mixing is None else (mixing.T @ inner @ mixing, mixing.T @ right)
                    estimate = self._estimate(term, *own, least)
                    found += [(case, index, number, estimate)] if estimate is not None else []
        return found

    def _terms(self) -> tuple[list[LocatedTerm], list[ChannelTerms]]:
        """Return the terms of places in the rig, or on the body, and of channels."""
        if self._is_body:
            every = body_dependences(self._states)
            return body_terms(every), channel_terms(self._states, every, self._array)
        is_angle, every = reads_place(self._stretches[0].model), dependences(self._states)
        waves, of_channels = wave_terms(self._states, self._posteriors, self._array, is_angle=is_angle)
        of_rig = rig_terms(self._states, every, is_angle=is_angle)
        return [*of_rig, *waves], [*channel_terms(self._states, every, self._array), *of_channels]

    def refined(self, leader: Leader, without: Key = frozenset()) -> Leader:
        """Return a leader at the most probable frequency, damping or order nearby."""
        for width in LOCATED.widths:
            near = [replace(leader.term, dependence=dependence) for dependence in leader.term.dependence.near(width)]
            for batch in self._batches([_TermGroup(term, ((term, None),)) for term in near]):
                for _, index, _, estimate in self._estimates([(without, leader.log_odds)], batch):
                    other = self._leader(batch.groups[index].term, estimate)
                    leader = max(leader, other, key=lambda one: one.log_odds)
        return leader

    def _batches(self, groups: Iterable[_TermGroup]) -> list[_Batch]:
        """Return those that are not too wide in batches of which each needs the same averages."""
        found: list[_Batch] = []
        waiting: dict[int, list[_TermGroup]] = {}
        for group in groups:
            if group.term.count > LOCATED.widest:
                continue
            most = self._most(group.term)
            self._averaged(most)  # once, and not in each of several processes
            some = waiting.setdefault(most, [])
            if some and sum(one.term.count for one in some) + group.term.count > LOCATED.together:
                found.append(_Batch(most, tuple(some)))
                some.clear()
            some.append(group)
        return [*found, *(_Batch(most, tuple(some)) for most, some in waiting.items())]

    def _most(self, term: LocatedTerm) -> int:
        """Return how many rows may be averaged to see a term: a power of two; one of a body's, which are averages."""
        needed = max(LOCATED.averaged_hz, LOCATED.oversampled * term.dependence.highest_hz(self._fastest))
        whole = 1 if self._is_body else max(int(1.0 / (needed * self._stretches[0].run.sample_period)), 1)
        return int(2 ** (whole.bit_length() - 1))

    def _averaged(self, most: int) -> list[_AveragedStretch]:
        """Return the stretches averaged over groups of up to so many rows."""
        if most not in self._by_rows:
            self._by_rows[most] = []
            for state, posterior, present in zip(self._states, self._posteriors, self._present, strict=True):
                short, rows = coarse(posterior, most)
                basis = LocatedBasis(state, rows.means)
                self._by_rows[most].append(_AveragedStretch(short, rows, basis, rows.of_columns(present)))
        return self._by_rows[most]

    def _products(self, batch: _Batch) -> Iterator[tuple[_Floats, _Floats]]:
        """Yield G (P, P) and b (P,) of the causes' unknowns and each term's coefficients, relative to no sizes."""
        held, terms = len(self._sizes), [group.term for group in batch.groups]
        count = held + sum(term.count for term in terms)
        gram, score = np.zeros((count, count)), np.zeros(count)
        for stretch, seen in zip(self._stretches, self._averaged(batch.most), strict=True):
            columns = [located_columns(term, seen.basis, seen.weight, stretch.observed) for term in terms]
            own, right, _ = seen.posterior.products(Columns.together([seen.present, *columns]))
            gram, score = gram + own, score + right
        score += gram[:, :held] @ self._sizes
        start = held
        for term in terms:
            mine = np.append(np.arange(held), np.arange(start, start + term.count))
            start += term.count
            yield gram[np.ix_(mine, mine)], score[mine]

    def _beside(self, gram: _Floats, score: _Floats, without: Key) -> tuple[_Floats, _Floats]:
        """Return G and b of a term's coefficients, the causes but those left out integrated out."""
        count = len(self._sizes)
        kept = np.ones(count, dtype=bool)
        for key in without:
            kept[self._unknowns[key]] = False
        held = np.flatnonzero(kept)
        mine, right = gram[count:, count:], score[count:]
        if not len(held):
            return mine, right
        across = gram[held, count:]
        gain = inverse(gram[np.ix_(held, held)] + np.diag(self._precision[held])) @ across
        return mine - across.T @ gain, right - gain.T @ score[held]

    def _on_each_channel(self, some: ChannelTerms) -> _TermGroup:
        """Return an error of every channel by itself, from whose products those of all patterns follow."""
        channels, members = self._array.n_channels, []
        for term, groups in some.terms():
            if term.count <= LOCATED.widest:
                mixing = np.zeros((channels, len(groups)))
                for component, group in enumerate(groups):
                    mixing[list(group), component] = 1.0
                members.append((term, np.asarray(np.kron(mixing, np.eye(some.dependence.count)))))
        single = channel_place("channel", some.kind, tuple((c,) for c in range(channels)), self._array.channels)
        return _TermGroup(LocatedTerm(single, some.dependence), tuple(members))

    def _estimate(
        self, term: LocatedTerm, gram: _Floats, score: _Floats, least: float
    ) -> tuple[float, int, _Floats] | None:
        """Return the log odds, length scale and coordinates of a term; none where it is not seen or of no interest."""
        if not np.trace(gram) > LOCATED.least_information:
            return None
        best: tuple[float, int, _Floats] | None = None
        for length, root in enumerate(term.dependence.roots):
            inner, right = _mixed(gram, score, root)
            value = log_evidence(0.5 * (inner + inner.T), right) + self._log_prior(term)
            if np.isfinite(value) and value >= least and (best is None or value > best[0]):
                best = value, length, np.asarray(np.linalg.solve(inner + np.eye(len(right)), right))
        return best

    def _leader(self, term: LocatedTerm, estimate: tuple[float, int, _Floats]) -> Leader:
        log_odds, length, coordinates = estimate
        return Leader(log_odds, term, term.cause(length, coordinates, self._log_prior(term)))

    def _log_prior(self, term: LocatedTerm) -> float:
        alike = {"one": self._array.n_channels, "chip": len(self._array.chips)}.get(term.pattern, 1)
        return LOCATED.log_prior - term.dependence.looks - float(np.log(alike))


def _mixed(gram: _Floats, score: _Floats, root: _Floats) -> tuple[_Floats, _Floats]:
    """Return G and b of coordinates whose mixing is the same root (K, k) for each component of a term."""
    count, (functions, unknowns) = len(score) // len(root), root.shape
    half = (gram.reshape(-1, count, functions) @ root).reshape(count * functions, -1)
    inner = (half.T.reshape(-1, count, functions) @ root).reshape(count * unknowns, -1)
    return inner.T, (score.reshape(count, functions) @ root).ravel()
