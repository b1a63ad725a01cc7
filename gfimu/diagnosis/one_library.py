"""The diagnosis by one library of effects: explain, look at the lack of fit, hold out, conclude."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from gfimu.diagnosis.criticism.coincidence.bound_numbers import Coincidence, coincidences
from gfimu.diagnosis.criticism.gain import Gain
from gfimu.diagnosis.criticism.holdout import Holdout, gate_gains, held_out_gain, other_recordings, split
from gfimu.diagnosis.criticism.lack_of_fit import LackOfFit, lack_of_fit
from gfimu.diagnosis.criticism.series_tests import NOTHING
from gfimu.diagnosis.criticism.surrogate import surrogates
from gfimu.diagnosis.data.body.stretch import BodyStretch, make_body_stretches
from gfimu.diagnosis.data.prepared_runs import PreparedRuns
from gfimu.diagnosis.data.stretch import Stretch, make_stretches
from gfimu.diagnosis.fit.gauss_newton import Fit
from gfimu.diagnosis.fit.learn import starting_point
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.beam import Blocks, promise
from gfimu.diagnosis.search.explain import Explanation, reduced
from gfimu.diagnosis.search.long_run import understand_any_length
from gfimu.diagnosis.search.nuisance_models import Understanding
from gfimu.diagnosis.search.screening import screen
from gfimu.diagnosis.verdict.conclude import Described, conclude, is_dominant, is_unknown, named_causes
from gfimu.diagnosis.verdict.gate import impossible_sizes, judge, measurable
from gfimu.diagnosis.verdict.library import LibraryEvidence, with_library
from gfimu.diagnosis.verdict.naming import conflicting
from gfimu.diagnosis.verdict.parts import Interrupted, NamedCause
from gfimu.diagnosis.verdict.verdict import Diagnosis
from gfimu.model.world_model import WorldModel, is_of_one_recording

__all__ = ["STAGES", "WIDER", "LibraryDiagnosis", "Report", "interrupted", "stretches_of"]

Report = Callable[[float, str], None]

WIDER = "wider library"
STAGES = ("samples", "search", "lack of fit", "validation", WIDER, "place")
"""Stages of a diagnosis in order, as an interrupted one lists them."""


def stretches_of(model: WorldModel, prepared: PreparedRuns) -> tuple[Stretch, ...]:
    """Cut prepared runs into the stretches that a model is compared with."""
    make = make_body_stretches if model.drive_source == "gyro" else make_stretches
    return make(model, prepared.runs, prepared.effects)


class LibraryDiagnosis:
    """The steps of a diagnosis by the library of one model.

    Parameters
    ----------
    prepared, kept : PreparedRuns
        Runs to explain, and those kept for the gain, if any.
    model : WorldModel
        Assumptions of the simulation about the rig.
    policy : Policy
        Thresholds.
    report : callable
        Called with the share done and a line of text.
    """

    def __init__(
        self, prepared: PreparedRuns, kept: PreparedRuns | None, model: WorldModel, policy: Policy, report: Report
    ) -> None:
        self._prepared, self._kept, self._model, self._policy, self._report = prepared, kept, model, policy, report
        self.stage = STAGES[1]

    def understood(self, models: Collection[str] | None = None) -> Understanding:
        """Return what a search finds, under some models of the nuisance parameters only or under all."""
        stretches, progress = stretches_of(self._model, self._prepared), self._report
        return understand_any_length(
            stretches, self._policy, lambda share, text: progress(0.05 + 0.8 * share, text), models=models
        )

    def promise(self, understanding: Understanding, others: Collection[str]) -> float:
        """Return by how much sets with other effects are more probable than what was found, in a linear world, nats."""
        stretches, best = stretches_of(self._model, self._prepared), understanding.explanation.best
        blocks = Blocks(screen(stretches, best.point, only=others), self._policy)
        return promise(blocks, best.causes, others, self._policy)

    def verdict(self, understanding: Understanding) -> Diagnosis:
        """Return the verdict on what a search found."""
        policy, progress = self._policy, self._report
        self.stage = STAGES[2]
        progress(0.88, self.stage)
        understanding, left = self._apart_from_the_rest(understanding)
        withdrawn: list[str] = []
        bound = self._coincidence(understanding.explanation)
        if bound is not None and bound.log_odds > policy.steady:
            return self._described(understanding, left, withdrawn, bound.sentence)
        gain = Gain()
        if not is_dominant(understanding.explanation, left, policy):
            self.stage = STAGES[3]
            progress(0.92, "hold out")
            try:
                understanding, withdrawn = self._gated(understanding)
                left = self._left(understanding.explanation) if withdrawn else left
                progress(0.97, "measure the gain")
                gain = self._gain(understanding.explanation, understanding.explanation.best)
            except np.linalg.LinAlgError:
                return self._described(understanding, left, withdrawn, "the causes found can't be fitted to part of it")
        if is_unknown(understanding.explanation, left, gain, policy):
            return self._described(understanding, left, withdrawn, "")
        found = conclude(self._prepared, understanding, left, gain, policy, withdrawn=withdrawn)
        refuted = self._impossible(understanding.explanation)
        if refuted:  # a twin with such sizes leaves nothing that is worth a description
            return conclude(
                self._prepared, understanding, left, Gain(), policy, withdrawn=withdrawn, refuted=refuted, unknown=True
            )
        fitted = understanding.explanation.best.names
        inferred = [cause for cause in found.causes if cause.effect in fitted]
        refuted = judge(gain, found.residual, inferred, policy, found.unexplained).why
        if refuted:
            return self._described(understanding, left, withdrawn, refuted)
        gained = measurable(gain)
        if gained is not gain:
            found = conclude(self._prepared, understanding, left, gained, policy, withdrawn=withdrawn)
        return self._doubted(found, understanding.explanation)

    def so_far(self, understanding: Understanding | None, by: str) -> Diagnosis:
        """Return what was known when the diagnosis was interrupted: no verdict, as what leads was not criticised.

        Parameters
        ----------
        understanding : Understanding, optional
            What the search had found; None where it had not begun.
        by : str
            What interrupted it.
        """
        self._report(1.0, "interrupted")
        if understanding is None:
            stretches = stretches_of(self._model, self._prepared)
            none = Fit(starting_point(stretches, self._policy.knots), 0.0, 0.0, 0.0, np.zeros((0, 0)), np.zeros(0))
            understanding = Understanding(Explanation(none, none, {}, (), None, stretches), None, 0.0, 0.0)
        explanation = understanding.explanation
        leading = named_causes(explanation, explanation.best, self._policy)
        names = "; ".join(one.effect + _sizes(one) for one in leading)
        known = f"leading by then, and not yet confirmed: {names}" if leading else "nothing was leading by then"
        why = f"the {self.stage} was interrupted ({by}); {known}"
        found = conclude(self._prepared, understanding, NOTHING, Gain(), self._policy, refuted=why, unknown=True)
        words = (f"No verdict: {why}.", *found.sentences[1:])
        return interrupted(replace(found, rivals=(), sentences=words), self.stage, by)

    def _doubted(self, found: Diagnosis, explanation: Explanation) -> Diagnosis:
        """Return a verdict whose probabilities include that the truth is outside the library."""
        bound = self._coincidence(explanation)
        confirmed = found.gain.of_other_recording and found.gain.share_of_excess_removed >= 1.0 - self._policy.small
        nats = float("nan") if bound is None else bound.log_odds
        left = max(found.unexplained.log_odds, self._policy.lack_odds if found.unexplained.significant else 0.0)
        evidence = LibraryEvidence(float(np.nan_to_num(nats)), left, confirmed)
        fits = [explanation.best, *conflicting(explanation, self._policy)]
        shapes = {cause.name: tuple(cause.shape) for fit in fits for cause in fit.causes}
        return with_library(replace(found, coincidence=nats), evidence, shapes, self._policy)

    def _apart_from_the_rest(self, understanding: Understanding) -> tuple[Understanding, LackOfFit]:
        """Drop causes that explain less than what no cause explains: they would be made of it.

        Real hands leave more than some right causes of a free body explain.
        """
        explanation = understanding.explanation
        left = self._left(explanation)
        if self._policy.free_body:
            return understanding, left
        while len(explanation.best.causes) > 1 and left.log_odds > self._policy.lack_odds:
            best = explanation.best
            lost = {name: best.log_posterior - fewer.log_posterior for name, fewer in explanation.without.items()}
            weakest = min(lost, key=lost.__getitem__)
            if lost[weakest] >= left.log_odds:
                break
            explanation = reduced(explanation, weakest, self._policy)
            left = self._left(explanation)
        return replace(understanding, explanation=explanation), left

    def _left(self, explanation: Explanation) -> LackOfFit:
        return lack_of_fit(
            explanation.stretches,
            explanation.best,
            spikes=self._prepared.spikes,
            rounded=self._prepared.rounded,
            policy=self._policy,
        )

    def _pairs(self, explanation: Explanation, fit: Fit, duration: float | None = None) -> list[Holdout]:
        """Pair fitted and held-out data: other recordings where given, blocks of the runs otherwise."""
        if self._kept is None:
            return split(explanation.stretches, fit, self._policy, duration=duration)
        stretches = stretches_of(self._model, self._kept)
        return other_recordings(explanation.stretches, fit, stretches, self._policy)

    def _gated(self, understanding: Understanding) -> tuple[Understanding, list[str]]:
        """Withdraw causes that do not predict held-out data."""
        explanation, withdrawn = understanding.explanation, []
        if not explanation.best.causes:
            return understanding, []
        pairs = self._pairs(explanation, explanation.best, np.inf)
        while explanation.best.causes:
            best = explanation.best
            gains = gate_gains(best, explanation.without, pairs, self._policy, other_recording=self._kept is not None)
            worst = min(gains, key=gains.__getitem__)
            if gains[worst] >= self._policy.ambiguous:
                break
            withdrawn.append(worst)
            explanation = reduced(explanation, worst, self._policy)
        return replace(understanding, explanation=explanation), withdrawn

    def _gain(self, explanation: Explanation, fit: Fit) -> Gain:
        """Measure what all that was found is worth on validation data."""
        found = fit.causes or fit.point.residue or any(stretch.known for stretch in explanation.stretches)
        if not found:
            return Gain()
        label = "blocks of the recording, odd and even from each other" if self._kept is None else "another recording"
        gain = held_out_gain(fit.causes, self._pairs(explanation, fit), self._policy, label=label)
        return replace(gain, of_other_recording=self._kept is not None)

    def _coincidence(self, explanation: Explanation) -> Coincidence | None:
        """Return what most likely binds the numbers of the causes that nothing should bind; None where nothing can."""
        first = explanation.stretches[0]
        if isinstance(first, BodyStretch):  # its motion has no arms that all recordings share
            return None
        mounting = Rotation.from_rotvec(first.run.mounting).as_matrix()
        found = coincidences(explanation.best, self._model.array, mounting)
        return found[0] if found else None

    def _impossible(self, explanation: Explanation) -> str:
        """Return the signature where every set that the data can't distinguish holds a size beyond physics."""
        families, array = self._model.families(), self._model.array
        found = [
            impossible_sizes(named_causes(explanation, one, self._policy), families, array)
            for one in (explanation.best, *conflicting(explanation, self._policy))
        ]
        return found[0] if all(found) else ""

    def _describing(self, explanation: Explanation, whole: Fit) -> tuple[Described, Gain]:
        """Return a description with what it is worth on held-out data, and which of its terms the twin gets.

        Terms of absolute time have the phase of one recording: only another one can confirm them.
        """
        gain = self._gain(explanation, whole)
        kept = tuple(cause for cause in whole.causes if not is_of_one_recording(cause.family))
        carried = replace(whole, point=replace(whole.point, causes=kept)) if kept else None
        if len(kept) < len(whole.causes) and self._kept is not None:
            alone = self._gain(explanation, carried) if carried is not None else Gain()
            samples = sum(len(run.t) for run in self._kept.runs)
            better = gain.log_likelihood_per_sample - float(np.nan_to_num(alone.log_likelihood_per_sample))
            carried, gain = (whole, gain) if better * samples > self._policy.ambiguous else (carried, alone)
        elif carried is not None and (
            gain.share_in_any_recording <= 0.0 or not self._carries_over(explanation, carried)
        ):
            carried = None
        return Described(whole, carried), gain

    def _carries_over(self, explanation: Explanation, described: Fit) -> bool:
        """Whether one half of a run predicts the other: blocks in between follow what changes with time."""
        if self._kept is not None:
            return True
        halves = held_out_gain(described.causes, self._pairs(explanation, described, np.inf), self._policy, label="")
        return not halves.share_of_excess_removed < self._policy.least_share

    def _described(
        self, understanding: Understanding, left: LackOfFit, withdrawn: Sequence[str], refuted: str
    ) -> Diagnosis:
        """Return the verdict unknown, with the description that predicts the validation data best, if one does."""
        explanation, described, gain = understanding.explanation, None, Gain()
        body = isinstance(explanation.stretches[0], BodyStretch)  # its motion has no functions to describe it by
        found = [] if body else surrogates(explanation.stretches, explanation.nothing, self._policy, left.hints)
        for one in found:
            tried, worth = self._describing(explanation, one.fit)
            better = worth.log_likelihood_per_sample > float(np.nan_to_num(gain.log_likelihood_per_sample))
            # Less than a tenth of the excess describes nothing.
            if better and not worth.share_of_excess_removed < self._policy.small:
                described, gain = tried, worth
        return conclude(
            self._prepared,
            understanding,
            left,
            gain,
            self._policy,
            withdrawn=withdrawn,
            described=described,
            refuted=refuted,
            unknown=True,
        )


def interrupted(found: Diagnosis, stage: str, by: str) -> Diagnosis:
    """Return a diagnosis that was interrupted in a stage, with the stages that were done and those that were not."""
    place = STAGES.index(stage)
    done, missing = STAGES[:place], STAGES[place:]
    words = (*found.sentences, f"Done: {', '.join(done)}. Not done: {', '.join(missing)}.")
    return replace(found, sentences=words, interrupted=Interrupted(by, stage, done, missing))


def _sizes(cause: NamedCause) -> str:
    """Return the sizes of a cause that differ from zero, in a line."""
    shown = [
        f"{key} = {float(cause.parameters[key]):.4g} ± {std:.2g}"
        for key, std in cause.std.items()
        if std > 0.0 and abs(float(cause.parameters[key])) > Policy.stds * std
    ]
    return f" ({', '.join(shown)})" if shown else ""
