"""The search for causes: screen linearly, refine with the full simulation, relearn the noise, until nothing changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from gfimu.diagnosis.adequacy import LEFT_OVER_ODDS, left_over
from gfimu.diagnosis.calibration_residue import tolerance_of
from gfimu.diagnosis.causes import Cause, effects_of_run
from gfimu.diagnosis.explanation import Explanation
from gfimu.diagnosis.far_starts import every_mode, from_far, with_honest_mode
from gfimu.diagnosis.fit import Fit, Start, segments_at
from gfimu.diagnosis.nuisances import STEADY_NOISE, learn_noise, sharpen_drives, tune_drives, uncut_drives, widen_drives
from gfimu.diagnosis.parallel import each_apart, over_segments
from gfimu.diagnosis.pruning import RIVALS, near_rivals, prune
from gfimu.diagnosis.refinement import FAIR_FIT, refine, refine_each
from gfimu.diagnosis.screening import screen
from gfimu.diagnosis.search import MOST_CAUSES, Blocks, Candidate, log_odds_beside_residue, search, swapped
from gfimu.diagnosis.segment import Segment
from gfimu.diagnosis.signatures import SignatureSet
from gfimu.world_model import Effect

__all__ = ["Instead", "Report", "explain"]

Report = Callable[[float, str], None]
Instead = Callable[[Sequence[Segment], Fit, Sequence[Sequence[Effect]]], bool]
_Found = tuple[list[Candidate], list[Candidate], Blocks]

_ROUNDS = 6
_REFINED = 6
_CLOSE = 12.0
_GROSS = 150.0
_WORTH_REFINING = -6.0
_ITERATIONS = 7
_RIPPLED = 12  # iterations with a drive that knows how a strong ripple answers it
_FEWEST_ROUNDS = 2  # before a search that explains more than it leaves may be given up
_SURELY_WRONG = 1.02  # misfit per observation
_MUCH, _LITTLE, _SHARE = 500.0, 10.0, 0.1  # nats that are left: at least; to those of a round; to the misfit explained
_SHARE_AT_END = 0.02  # no cause is believed then (`conclusion.is_dominant`)
_STALLED, _WORTH_FINDING = 0.1, 100.0  # share of what is left that a round may bring to be the last; nats, at least
_MOST_RUNG = 4.0  # misfit per observation of a right mode whose ringing the drive does not know; 2.2 was seen
_FAINT = 500.0  # log odds of a mode whose frequency may not be settled
_RESIDUE = 12.0  # log odds for a calibration residue over all that a round may find; at most 0 was seen without one
_PLAIN = 20.0  # standard deviations; modes at a false frequency had 4 to 8


def _posterior(fit: Fit) -> float:
    return fit.log_posterior


def explain(
    segments: Sequence[Segment],
    fixed: Sequence[Sequence[Effect]],
    runs: int,
    *,
    start: Sequence[Cause] = (),
    instead: Instead | None = None,
    report: Report | None = None,
) -> Explanation:
    """Find the most probable set of causes.

    Parameters
    ----------
    segments : sequence of Segment
        The data.
    fixed : sequence of sequence of Effect
        Effects known beforehand, per segment.
    runs : int
        Number of runs.
    start : sequence of Cause
        Causes to start from.
    instead : callable, optional
        Called with segments, fit and fixed effects where the first round leaves much: whether to leave the search for
        wandering biases, which it does not look for. Where this is given the search is left for a calibration residue
        too.
    report : callable, optional
        Called with the share done and a line of text.
    """
    tell = report or (lambda share, text: None)
    search = _Search(segments, fixed, runs, start)
    for number in range(_ROUNDS):
        tell(0.1 + 0.8 * number / _ROUNDS, f"search {number + 1}")
        found = search.look()
        if number > 0 and instead is not None and search.is_left_for_residue(found):
            break
        settled = search.round(found, first=number == 0, tell=tell)
        if number == 0 and not settled and instead is not None and search.is_left_for_walk(instead):
            break
        if search.ends(number, settled=settled) and not search.hears_mode_ring():
            break
    tell(0.85, "prune")
    best, without, rivals = search.judged()
    tell(0.9, "compare")
    believed = best.causes and not search.left_for
    nothing = refine(segments, (), fixed, drives=best.drives, iterations=8) if believed else best
    for segment, drive in zip(segments, best.drives, strict=True):
        segment.coefficients = drive
    return Explanation(
        best,
        tuple(sorted(rivals, key=_posterior, reverse=True)),
        nothing,
        without,
        tuple(segments),
        tuple(tuple(known) for known in fixed),
        search.screened(best),
        search.given_up,
        left_for=search.left_for,
    )


class _Search:
    """The best set so far and what was tried.

    Parameters
    ----------
    segments, fixed, runs, start
        As `explain` takes them.
    """

    def __init__(
        self, segments: Sequence[Segment], fixed: Sequence[Sequence[Effect]], runs: int, start: Sequence[Cause]
    ) -> None:
        self._segments, self._fixed, self._runs, self._start = segments, fixed, runs, start
        for segment in segments:
            segment.prepare_weights()
        self._observations = sum(int(segment.weight_mask.sum()) for segment in segments)
        best = refine(segments, start, fixed, iterations=6 if start else 0)
        fitted = refine(segments, start, fixed, iterations=8)
        self._fair = self._is_fair(fitted)
        self._cut_by_reference = not self._fair and any(over_segments(Segment.sharpen_by_reference, segments))
        if self._cut_by_reference:
            best = refine(segments, start, fixed, iterations=6 if start else 0)
            fitted = refine(segments, start, fixed, iterations=8)
            self._fair = self._is_fair(fitted)
        if self._fair:
            # The channels sharpen the drive unless something gross twists it.
            tune_drives(segments, fitted, fixed)
            fitted = sharpen_drives(segments, fitted, fixed)
            best = fitted = refine(segments, start, fixed, drives=fitted.drives, iterations=8)
        self._best, self._fitted = best, fitted
        self._tried: dict[frozenset[tuple[str, str]], Fit] = {}
        # How far each set was behind, under the noise that both were judged by.
        self._behind: dict[frozenset[tuple[str, str]], float] = {}
        self._settled = self.given_up = self._outweighed = False
        self.left_for = ""
        self._ahead: SignatureSet | None = None
        # What is left is judged once a residue of the calibration is held.
        self._loose = any(segment.calibration_residue is not None for segment in segments)
        self._gained = np.inf

    def _is_fair(self, fit: Fit) -> bool:
        return fit.objective < FAIR_FIT * self._observations

    def look(self) -> _Found:
        """Screen about the best set and search the normal equations; returns what `search` does."""
        self._signatures = self._ahead or self._screen()
        self._screened, self._ahead = self._best.key, None
        return search(self._signatures, most=max(2, min(len(self._best.causes) + 1, MOST_CAUSES)))

    def round(self, found: _Found, *, first: bool, tell: Report) -> bool:
        """Refine what leads, relearn the noise; tells whether nothing changes any more."""
        segments, fixed = self._segments, self._fixed
        fits = self._refined_leaders(found)
        # A start has been through this.
        if first and not self._start and not any(self._is_fair(fit) for fit in fits.values()):
            tell(0.1, "large sizes")
            far = [hypothesis for hypothesis in self._signatures.hypotheses if hypothesis.family.starts]
            for large in from_far(segments, far, fixed, self._best.drives):
                fits[large.key] = max(fits.get(large.key, large), large, key=_posterior)
        self._tried |= fits
        winner = max(fits.values(), key=_posterior)
        self._behind |= {key: winner.log_posterior - fit.log_posterior for key, fit in fits.items()}
        settled = winner.key == self._best.key
        self._gained = winner.log_posterior - fits[self._best.key].log_posterior
        wider = widen_drives(segments, winner, fixed)
        if wider is not winner:
            winner, settled = wider, False
            self._fitted = refine(segments, self._start, fixed, drives=winner.drives, iterations=8)
        if not self._is_fair(winner):
            winner = self._rippled(winner)
        # What a gross misfit leaves is no bias instability.
        change = learn_noise(segments, winner, fixed, slow=self._is_fair(winner))
        tune_drives(segments, winner, fixed)
        self._best = refine(segments, winner.causes, fixed, drives=winner.drives, iterations=6)
        if not self._fair and self._is_fair(winner):
            self._fair, settled = True, False
            if self._cut_by_reference and any("order" in cause.shape for cause in self._best.causes):
                # What bent the drive of the reference was no motion but its ripple.
                self._best = self._rippled(uncut_drives(segments, self._best, fixed))
            sharper = sharpen_drives(segments, self._best, fixed)
            # On the same knots, and under the same prior of the drive, as what it is compared with.
            self._best = refine(segments, sharper.causes, fixed, drives=sharper.drives, iterations=6)
            self._fitted = refine(segments, self._start, fixed, drives=self._best.drives, iterations=8)
        done = settled and (self._settled or change < STEADY_NOISE)
        self._settled = settled
        return done

    def is_left_for_walk(self, instead: Instead) -> bool:
        """Tell whether the search is left for wandering biases, as much is left."""
        poor = self._best.objective > _SURELY_WRONG * self._observations
        if poor and instead(segments_at(self._segments, self._best), self._best, self._fixed):
            self.given_up, self.left_for = True, "walk"
        return bool(self.left_for)

    def is_left_for_residue(self, found: _Found) -> bool:
        """Tell whether the search is left for a calibration residue, which is better than all that was found."""
        candidates, _, blocks = found
        array = self._segments[0].model.array
        tolerance = tolerance_of(self._segments[0].model.families())
        # What a mode or a strong ripple leaves that the drives do not know answering them passes for anything.
        if not (tolerance and self._fair) or self._may_hear_mode_ring or self._ripples(self._best):
            return False
        if any(segment.rounding.channels for segment in self._segments):
            return False
        places = {(one.name, one.pattern): number for number, one in enumerate(blocks.hypotheses)}
        if any(cause.key not in places for cause in self._best.causes):
            return False
        members = [places[cause.key] for cause in self._best.causes]
        beside = log_odds_beside_residue(self._signatures, members, tolerance, array)
        if beside > candidates[0].log_odds + _RESIDUE:
            self.given_up, self.left_for = True, "residue"
        return bool(self.left_for)

    def ends(self, number: int, *, settled: bool) -> bool:
        """Tell whether the search is over: nothing changes, little of what is left is found, or it is given up.

        It is given up where too much is left: after a first round more than is explained, later far more than a round
        brought.
        """
        good = self._best.objective < _SURELY_WRONG * self._observations
        # The usual end, without a look at the residuals.
        if self._loose or (settled and good):
            return settled
        first = not settled and number == 0
        smooth = not (first and good and self._best.causes)
        # What the next round begins with, or the end asks for, is computed beside.
        ahead: list[Callable[[], Any]] = [self._screen, partial(self._left, self._best, smooth=smooth), self._explained]
        self._ahead, left, explained = each_apart(lambda work: work(), ahead)
        stalled = number > 0 and self._gained < _STALLED * left and left > _WORTH_FINDING
        early = not (settled or stalled) and number < _FEWEST_ROUNDS
        share = _SHARE_AT_END if settled or stalled else _SHARE
        # Right sets that still lacked a cause left a third of what they explained at most.
        enough = explained if early else max(_LITTLE * self._gained, share * explained)
        self.given_up = left > max(_MUCH, enough)
        self._outweighed = left > explained
        return settled or stalled or self.given_up

    def hears_mode_ring(self) -> bool:
        """Let the drives know how a mode rings on, once, where the best set has one and leaves something.

        Without that the drive is bent to ring itself, perhaps at another frequency: the mode is looked for at all, and
        the knots are chosen anew. Tells whether the search has to go on.
        """
        heard = self._may_hear_mode_ring and self._left(self._best) > LEFT_OVER_ODDS
        if heard:
            self._let_mode_ring()
        return heard

    @property
    def _may_hear_mode_ring(self) -> bool:
        # What leaves more than this, or than all that was found explains, is not the ringing of a mode.
        near = self._best.objective < _MOST_RUNG * self._observations
        if not near or (self.given_up and self._outweighed):
            return False
        if self._loose or self._segments[0].ringing or "resonance" not in self._best.names:
            return False
        # Beside a cause whose model is rough a mode that explains less than that leaves would be dropped at last.
        noise = self._segments[0].levels.of_reading
        mode = next(cause for cause in self._best.causes if cause.name == "resonance")
        return mode.power > sum(cause.inexactness(noise) * cause.power for cause in self._best.causes)

    def _let_mode_ring(self) -> None:
        """Fit the best set anew with drives that know how its mode rings on."""
        segments, fixed = self._segments, self._fixed
        for segment in segments:
            segment.ringing, segment.knots_chosen = True, False
        fit = refine(segments, self._best.causes, fixed, drives=self._best.drives, iterations=2 * _ITERATIONS)
        if not self._is_plain(fit):
            fit = every_mode(segments, fit, fixed, misfit=True)
        fit = sharpen_drives(segments, fit, fixed)
        learn_noise(segments, fit, fixed, slow=self._is_fair(fit))
        tune_drives(segments, fit, fixed)
        self._best = refine(segments, fit.causes, fixed, drives=fit.drives, iterations=6)
        self._fitted = refine(segments, self._start, fixed, drives=self._best.drives, iterations=8)
        self._tried, self._behind = {}, {}
        self._ahead, self._settled, self.given_up = None, False, False

    def _is_plain(self, fit: Fit) -> bool:
        """Tell whether a fit whose drives know how its mode rings on leaves no doubt of the mode's frequency."""
        mode = next(cause for cause in fit.causes if cause.name == "resonance")
        sure = mode.power > _PLAIN**2
        return sure and fit.objective < _SURELY_WRONG * self._observations and self._left(fit) < LEFT_OVER_ODDS

    def _rippled(self, fit: Fit) -> Fit:
        """Fit a set anew with drives that know how a torque ripple of it answers them, where it has a strong one."""
        if not self._ripples(fit):
            return fit
        return refine(self._segments, fit.causes, self._fixed, drives=fit.drives, iterations=_RIPPLED, rippling=True)

    def _ripples(self, fit: Fit) -> bool:
        """Tell whether the torque of a set's table ripples strongly."""
        segment = self._segments[0]
        present = effects_of_run(fit.causes, segment.model.array, segment.index)
        return segment.felt_ripple([*self._fixed[0], *present]) is not None

    def _explained(self) -> float:
        """Return how much the best set takes off the misfit of the start, under the noise that it leaves."""
        if self._best.key == self._fitted.key:
            return 0.0
        segments = segments_at(self._segments, self._fitted)
        start = refine(segments, self._fitted.causes, self._fixed, drives=self._fitted.drives, iterations=2)
        return start.objective - self._best.objective

    def _screen(self, about: Fit | None = None) -> SignatureSet:
        """Return the signatures about a set, the best one by default."""
        base = about or self._best
        return screen(segments_at(self._segments, base), base, self._fixed, self._runs)

    def _refined_leaders(self, found: _Found) -> dict[frozenset[tuple[str, str]], Fit]:
        """Refine the sets that lead the linear list; returns them and the best set so far by their keys."""
        candidates, singles, blocks = found
        fits = {self._best.key: self._best}
        gross = candidates[0].log_odds > _GROSS
        leading = candidates[:_REFINED]
        if gross and not (self._settled or (self._start and self._fair)):
            # A large effect is far from linear: the right cause may be well down the linear list. A start that fits
            # has been through this.
            leading = [*candidates[:3], *(one for one in singles[:_REFINED] if one not in candidates[:3])]
        others = swapped(blocks, self._best.causes) if gross else []
        leading = [*leading, *others]
        keys: list[frozenset[tuple[str, str]]] = []
        sets: list[Sequence[Cause]] = []
        about: list[Fit] = []
        starts: list[Start | None] = []
        for candidate in leading:
            causes = [
                self._signatures.hypotheses[number].cause(coordinates)
                for number, coordinates in zip(candidate.members, blocks.coordinates(candidate.members), strict=True)
            ]
            key = frozenset(cause.key for cause in causes)
            close = candidate.log_odds > max(candidates[0].log_odds - _CLOSE, _WORTH_REFINING)
            new = key not in self._tried
            distant = gross and new and (len(causes) == 1 or candidate in others)
            if key in fits or key in keys or not (close or distant):
                continue
            if new:
                moves = self._signatures.drive_moves(causes, candidate.members)
                drives = [drive + move for drive, move in zip(self._best.drives, moves, strict=True)]
            else:
                causes = list(self._tried[key].causes)
            # Ripples locked to the angle lose their phase where the drive's angle has drifted for want of them.
            ripples = {cause.name for cause in causes if "order" in cause.shape}
            again = [self._fitted] if new and ripples and not (self._fair and ripples <= self._best.names) else []
            for base in (self._best, *again):
                keys.append(key)
                sets.append(causes)
                about.append(base)
                starts.append(Start(causes, drives) if new and base is self._best else None)
        refined = refine_each(
            self._segments, sets, self._fixed, [base.drives for base in about], iterations=_ITERATIONS, others=starts
        )
        for key, fit in zip(keys, refined, strict=True):
            fits[key] = max(fits.get(key, fit), fit, key=_posterior)
        return fits

    def judged(self) -> tuple[Fit, dict[str, Fit], list[Fit]]:
        """Prune the best set and compare it with what came close: the best, the best without each cause, the rivals."""
        segments, fixed, best = self._segments, self._fixed, self._best
        if self.given_up:  # nothing of it will be believed
            return best, {}, []
        done: dict[frozenset[tuple[str, str]], Fit] = {}
        best, without = prune(segments, best, fixed, done)
        if self._may_hear_mode_ring and "resonance" not in best.names:
            # A mode that is hardly anything as it bends the ramps may be plain as it rings.
            self._let_mode_ring()
            return self.judged()
        near = [
            self._tried[key]
            for key in sorted(self._behind, key=self._behind.__getitem__)
            if best.causes and key != best.key and self._tried[key].causes and self._behind[key] < _CLOSE + 10.0
        ]
        rivals = near_rivals(segments, best, near[:RIVALS], fixed, done)
        unique = {rival.key: rival for rival in rivals if rival.causes and rival.key != best.key}
        better = max(unique.values(), key=_posterior, default=best)
        if better.log_posterior > best.log_posterior:
            unique[best.key] = best
            best, without = prune(segments, better, fixed, done)
            unique.pop(best.key, None)
        if "resonance" in without:
            worth = best.log_posterior - without["resonance"].log_posterior
            # What is left beside a residue of the calibration is judged once that is held.
            if worth < _FAINT and (self._loose or self._left(best) < worth):
                best = every_mode(segments, best, fixed)
            best = with_honest_mode(segments, best, fixed)
        # What sets are compared by is of the same derivative for all.
        best = replace(self._rippled(best), log_posterior=best.log_posterior)
        return best, without, list(unique.values())

    def _left(self, fit: Fit, *, smooth: bool = True) -> float:
        """Return the log odds of the strongest thing that a fit leaves; without ``smooth``, of no smooth dependence."""
        segments = segments_at(self._segments, fit)
        rounded = any(segment.rounding.channels > 0 for segment in segments)
        return left_over(segments, fit, self._fixed, 0, rounded=rounded, smooth=smooth).log_odds

    def screened(self, about: Fit) -> SignatureSet:
        """Return the signatures about a set: the last ones where they are, or where no set is believed."""
        if self._ahead is not None:
            self._signatures, self._screened = self._ahead, self._best.key
        if about.key == self._screened or self.given_up:
            return self._signatures
        return self._screen(about)
