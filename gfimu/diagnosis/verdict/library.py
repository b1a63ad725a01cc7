"""Whether the library holds the truth: the probability of a named cause when reality may be outside of it.

The probability of a cause by evidence is one among the effects of the library. Free numbers fit much that is not
in it. What gives a confounded cause away can be seen in the fit: numbers bound by a pattern that nothing should bind,
sizes that hardly stand out from their uncertainty, and something that stays unexplained beside the causes.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit

from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.verdict.parts import NamedCause
from gfimu.diagnosis.verdict.verdict import Diagnosis

__all__ = [
    "LibraryEvidence",
    "LibraryRule",
    "library_probability",
    "standing_out",
    "with_library",
]


@dataclass(frozen=True)
class LibraryEvidence:
    """What a fit shows of whether its causes are the truth.

    Parameters
    ----------
    unexplained : float
        Log odds of the strongest lack of fit beside the causes, nats, at least ``Policy.lack_odds`` where the slow
        noise of a channel stands out; 0 where chance is likelier.
    confirmed : bool
        Whether another recording, as validation data, was predicted.
    """

    unexplained: float = 0.0
    confirmed: bool = False


@dataclass(frozen=True)
class LibraryRule:
    """Logistic rule for the probability that a cause is true, its coefficients fitted to worlds inside and outside.

    The log odds are ``constant + size · ln z + unexplained · ln(1 + beside · l/e)`` with the evidence l of
    `LibraryEvidence` and the evidence e of the cause, nats, and z the largest size of the cause over its standard
    deviation: what stays unexplained makes a cause doubtful as far as it is not small beside what the cause explains.

    Parameters
    ----------
    constant, size, unexplained : float
        Coefficients. Set on 142 causes that were named in worlds inside the library (the gate of `sim.trials.study`,
        with one effect taken out of it in some) and in foreign ones (``tests/foreign_study.py``); 11 of these names
        were wrong. In 108 later cases of the gate 90 of 99 names were right, at a mean probability of 0.88.
    beside : float
        Evidence of a cause, nats, at which l counts as such: by choice, as few worlds of a known truth leave much.
    most : float
        Largest probability without another recording.
    stds : tuple of (float, float)
        Where z is clipped: what is beyond says no more.
    """

    constant: float = 1.19
    size: float = 0.67
    unexplained: float = -0.83
    beside: float = 100.0
    most: float = 0.97
    stds: tuple[float, float] = (0.3, 100.0)


def standing_out(cause: NamedCause, shape: Collection[str]) -> float:
    """Return the largest size of a cause over its standard deviation; infinite where it has none.

    Parameters of its ``shape`` and angles are compared with nothing.
    """
    ratios = [
        abs(float(cause.parameters[key])) / std
        for key, std in cause.std.items()
        if std > 0.0 and key not in shape and not key.startswith(("phase", "direction"))
    ]
    return max(ratios, default=float("inf"))


def library_probability(
    evidence: LibraryEvidence, stds: float, explained: float, rule: LibraryRule, policy: Policy
) -> float:
    """Return the probability that a cause is the truth and not confounded with something outside the library.

    Parameters
    ----------
    evidence : LibraryEvidence
        What the fit shows.
    stds : float
        The largest size of the cause over its standard deviation.
    explained : float
        Log odds that the cause explains, nats.
    rule : LibraryRule
        The rule.
    policy : Policy
        The largest probability where another recording was predicted, ``most_certain``.
    """
    odds = (
        rule.constant
        + rule.size * float(np.log(np.clip(stds, *rule.stds)))
        + rule.unexplained * float(np.log1p(rule.beside * max(evidence.unexplained, 0.0) / max(explained, 1.0)))
    )
    return min(float(expit(odds)), policy.most_certain if evidence.confirmed else rule.most)


def with_library(
    found: Diagnosis,
    evidence: LibraryEvidence,
    shapes: Mapping[str, Collection[str]],
    policy: Policy,
    rule: LibraryRule = LibraryRule(),
) -> Diagnosis:
    """Return a verdict whose probabilities include "none of these".

    Parameters
    ----------
    found : Diagnosis
        The verdict; one without causes from a fit stays as it is.
    evidence : LibraryEvidence
        What its fit shows.
    shapes : mapping
        Keys of the shape parameters by effect, of all causes of a fit; what is not in it, as a fault of the samples, is
        seen and not inferred.
    policy : Policy
        Thresholds.
    rule : LibraryRule
        How the evidence is weighed.
    """
    most = max((cause.log_odds for cause in found.causes), default=0.0)  # of one that others could be, none is stated
    likely = {
        cause.effect: library_probability(
            evidence, standing_out(cause, shapes[cause.effect]), cause.log_odds or most, rule, policy
        )
        for cause in found.causes
        if cause.effect in shapes
    }
    if found.verdict not in {"explained", "ambiguous"} or not likely:
        return found
    causes = tuple(replace(one, probability=one.probability * likely.get(one.effect, 1.0)) for one in found.causes)
    least = min(likely.values())
    words = (*found.sentences, f"{_sentence(least, evidence)}.")
    return replace(found, causes=causes, library_probability=least, sentences=words)


def _sentence(least: float, evidence: LibraryEvidence) -> str:
    """Say how likely it is that the truth is among the effects that were tried, and what would test it."""
    stated = (
        "What is named is the truth, confounded with nothing outside the library, with a probability of "
        f"{100 * least:.0f} %"
    )
    if evidence.confirmed:
        return stated
    return f"{stated}; another recording, with another motion, would test it (--held-out)"
