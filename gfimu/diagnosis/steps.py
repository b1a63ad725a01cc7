"""The steps of a diagnosis after its samples are read: search, places, validation, verdict."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gfimu.diagnosis.criticism.gain import Gain
from gfimu.diagnosis.criticism.holdout import Holdout, gate_gains, held_out_gain, other_recordings, split
from gfimu.diagnosis.criticism.lack_of_fit import LackOfFit, lack_of_fit
from gfimu.diagnosis.criticism.series_tests import NOTHING
from gfimu.diagnosis.data.body.stretch import make_body_stretches
from gfimu.diagnosis.data.prepared_runs import PreparedRuns
from gfimu.diagnosis.data.stretch import Stretch, make_stretches
from gfimu.diagnosis.fit.gauss_newton import Fit
from gfimu.diagnosis.fit.learn import starting_point
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.challenge import challenged
from gfimu.diagnosis.search.explain import Explanation, reduced
from gfimu.diagnosis.search.long_run import understand_any_length
from gfimu.diagnosis.search.nuisance_models import Understanding, understood
from gfimu.diagnosis.terms.located.policy import LOCATED
from gfimu.diagnosis.terms.located.term import is_located
from gfimu.diagnosis.verdict.conclude import conclude, is_dominant, is_unknown, named_causes
from gfimu.diagnosis.verdict.gate import impossible_sizes, judge, measurable
from gfimu.diagnosis.verdict.library import LibraryEvidence, with_library
from gfimu.diagnosis.verdict.naming import conflicting
from gfimu.diagnosis.verdict.parts import Interrupted, NamedCause
from gfimu.diagnosis.verdict.verdict import Diagnosis
from gfimu.model.world_model import WorldModel, is_of_one_recording

__all__ = ["STAGES", "Report", "Steps", "interrupted", "stretches_of"]

Report = Callable[[float, str], None]

STAGES = ("samples", "search", "places", "validation")
"""Stages of a diagnosis in order, as an interrupted one lists them."""


def stretches_of(model: WorldModel, prepared: PreparedRuns) -> tuple[Stretch, ...]:
    """Cut prepared runs into the stretches that a model is compared with."""
    make = make_body_stretches if model.drive_source == "gyro" else make_stretches
    return make(model, prepared.runs, prepared.effects)


class Steps:
    """The steps of one diagnosis; ``stage`` is the one that goes on.

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

    def understood(self) -> Understanding:
        """Return the most probable causes of the library."""
        stretches, progress = stretches_of(self._model, self._prepared), self._report
        return understand_any_length(stretches, self._policy, lambda share, text: progress(0.05 + 0.6 * share, text))

    def challenged(self, understanding: Understanding, start: float = 0.65, end: float = 0.88) -> Understanding:
        """Return the same with located terms beside the causes of the library and instead of them.

        ``start`` and ``end`` are the shares of the whole diagnosis that are done before and after.
        """
        self.stage = STAGES[2]
        self._report(start, self.stage)

        def report(share: float, text: str) -> None:
            self._report(start + (end - start) * share, text)

        try:
            explanation = challenged(understanding.explanation, self._policy, report)
        except np.linalg.LinAlgError:  # without a solution there is nothing to compare
            return understanding
        return understood(explanation, self._policy, understanding.log_odds, understanding.model)

    def verdict(self, understanding: Understanding) -> Diagnosis:
        """Return the verdict on what a search found."""
        policy, progress = self._policy, self._report
        self.stage = STAGES[3]
        progress(0.88, "lack of fit")
        understanding, left = self._apart_from_the_rest(understanding)
        withdrawn: list[str] = []
        gain = Gain()
        if not is_dominant(understanding.explanation, left, policy):
            progress(0.92, "hold out")
            try:
                before = understanding.explanation.best.log_posterior
                understanding, withdrawn = self._gated(understanding)
                if before - understanding.explanation.best.log_posterior > LOCATED.free_odds:
                    # What explained so much is real, but it is not what its name says.
                    understanding, again = self._gated(self.challenged(understanding, 0.92, 0.95))
                    withdrawn, self.stage = [*withdrawn, *again], STAGES[3]
                left = self._left(understanding.explanation) if withdrawn else left
                progress(0.97, "measure the gain")
                gain = self._gain(understanding.explanation, understanding.explanation.best)
            except np.linalg.LinAlgError:
                return self._unknown(understanding, left, withdrawn, "the causes found can't be fitted to part of it")
        if is_unknown(understanding.explanation, left, gain, policy):
            return self._unknown(understanding, left, withdrawn, "")
        found = conclude(self._prepared, understanding, left, gain, policy, withdrawn=withdrawn)
        refuted = self._impossible(understanding.explanation)
        if refuted:
            return self._unknown(understanding, left, withdrawn, refuted)
        fitted = understanding.explanation.best.names
        inferred = [cause for cause in found.causes if cause.effect in fitted]
        refuted = judge(gain, found.residual, inferred, policy, found.unexplained).why
        if refuted:
            return self._unknown(understanding, left, withdrawn, refuted)
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
        confirmed = found.gain.of_other_recording and found.gain.share_of_excess_removed >= 1.0 - self._policy.small
        left = max(found.unexplained.log_odds, self._policy.lack_odds if found.unexplained.significant else 0.0)
        fits = [explanation.best, *conflicting(explanation, self._policy)]
        shapes = {cause.name: tuple(cause.shape) for fit in fits for cause in fit.causes}
        return with_library(found, LibraryEvidence(left, confirmed), shapes, self._policy)

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
        """Withdraw causes that do not predict held-out data; a function of absolute time can't, and stays."""
        explanation, withdrawn = understanding.explanation, []
        if not explanation.best.causes:
            return understanding, []
        pairs = self._pairs(explanation, explanation.best, np.inf)
        while True:
            best = explanation.best
            of_time = {c.name for c in best.causes if is_located(c) and is_of_one_recording(c.family)}
            without = {name: fewer for name, fewer in explanation.without.items() if name not in of_time}
            gains = gate_gains(best, without, pairs, self._policy, other_recording=self._kept is not None)
            worst = min(gains, key=gains.__getitem__, default=None)
            if worst is None or gains[worst] >= self._policy.ambiguous:
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

    def _impossible(self, explanation: Explanation) -> str:
        """Return the signature where every set that the data can't distinguish holds a size beyond physics."""
        families, array = self._model.families(), self._model.array
        found = [
            impossible_sizes(named_causes(explanation, one, self._policy), families, array)
            for one in (explanation.best, *conflicting(explanation, self._policy))
        ]
        return found[0] if all(found) else ""

    def _unknown(self, understanding: Understanding, left: LackOfFit, withdrawn: list[str], refuted: str) -> Diagnosis:
        """Return the verdict unknown."""
        return conclude(
            self._prepared,
            understanding,
            left,
            Gain(),
            self._policy,
            withdrawn=withdrawn,
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
