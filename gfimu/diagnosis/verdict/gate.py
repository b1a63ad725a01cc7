"""The gate: whether the causes of a verdict may stand, by what they are worth and by the sizes that physics allows.

One gate for every kind of twin: on a table and for a free body.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.diagnosis.criticism.gain import Gain
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.verdict.parts import NamedCause, Residual, Unexplained
from gfimu.model.world_model import EffectFamily

__all__ = ["NOT_THIS_UNIT", "Judgement", "impossible_sizes", "judge", "measurable"]

NOT_THIS_UNIT = "the array file, axes or units do not fit these data"
"""Signature of sizes beyond physics."""


@dataclass(frozen=True)
class Judgement:
    """What the gate says of a set of causes.

    Parameters
    ----------
    withdrawn : bool
        Whether the causes must not stand.
    why : str
        The figure that withdraws them, in words; empty where they stand.
    """

    withdrawn: bool = False
    why: str = ""


def judge(
    gain: Gain,
    residual: Residual,
    causes: Sequence[NamedCause],
    policy: Policy = Policy(),
    unexplained: Unexplained = Unexplained(),
) -> Judgement:
    """Judge causes by what they are worth on held-out data and on the fitted data.

    They are withdrawn where they predict held-out data worse than the given simulation, remove less than half of the
    excess there, or make the error on the fitted data worse, each beyond its standard error; and where something that
    no cause explains is as large as what they explain.

    Parameters
    ----------
    gain : Gain
        What they are worth on held-out data; a figure that could not be measured is NaN and counts for nothing.
    residual : Residual
        The error on the fitted data.
    causes : sequence of NamedCause
        The causes, for the words.
    policy : Policy
        Thresholds.
    unexplained : Unexplained
        What they leave.
    """
    if not causes:
        return Judgement()
    figure = _held_out_figure(gain, policy)
    if figure:
        return Judgement(True, f"{_found(causes)} do not predict validation data: {figure}")
    before, after = residual.rms_before, residual.rms_after
    if after > max((1.0 + policy.noise_accuracy) * before, (1.0 + policy.small) * residual.noise_floor):
        worse = f"the prediction error rises from {before:.3g} to {after:.3g} m/s²"
        return Judgement(True, f"{_found(causes)} make the simulation worse: {worse}")
    if unexplained.significant and not residual.is_noise and residual.share_left > policy.least_share:
        return Judgement(True, f"{_found(causes)} leave {residual.left_in_words}: {unexplained.signature}")
    return Judgement()


def measurable(gain: Gain) -> Gain:
    """Return a gain, or one without figures where causes stand but what they are worth is within the noise.

    There the error may rise as well as fall by chance, and says nothing.
    """
    rises = gain.log_likelihood_per_sample < 0.0 or gain.rms_after > gain.rms_before
    return (
        Gain(gain.held_out, of_other_recording=gain.of_other_recording)
        if rises and np.isnan(gain.share_of_excess_removed)
        else gain
    )


def _held_out_figure(gain: Gain, policy: Policy) -> str:
    """Return the held-out figure that withdraws causes, in words, or nothing."""
    share = gain.share_of_excess_removed
    upper = share + policy.stds * float(np.nan_to_num(gain.share_std))
    rises = f"the error there rises from {gain.rms_before:.3g} to {gain.rms_after:.3g} m/s²"
    if upper < policy.least_share and share < 0.0 and gain.rms_after > (1.0 + policy.noise_accuracy) * gain.rms_before:
        return rises
    if upper < policy.least_share:
        return f"{100 * max(share, 0.0):.0f} % of the excess removed"
    likelihood, std = gain.log_likelihood_per_sample, float(np.nan_to_num(gain.log_likelihood_std))
    # What is measured in other units must not overrule a share that is well above one half.
    if likelihood + policy.stds * std < 0.0 and not share >= policy.least_share:
        return f"log-likelihood per sample {likelihood:+.3g} ± {std:.2g}"
    return rises if np.isnan(share) and gain.rms_after > (1.0 + policy.small) * gain.rms_before else ""


def impossible_sizes(
    causes: Sequence[NamedCause], families: Mapping[str, EffectFamily], array: AccelerometerArray
) -> str:
    """Return a signature where a cause is larger than its part or rig can be off; empty where none is.

    Such a size says that the twin describes another unit: its array file, its axes or its units are wrong. The bound
    is that of the effect's class (`gfimu.model.own_rig.places.Size.bound`); faults of the wiring have none.

    Parameters
    ----------
    causes : sequence of NamedCause
        The causes.
    families : mapping of str to EffectFamily
        The kinds of effects, by name.
    array : AccelerometerArray
        The array.
    """
    beyond: list[tuple[float, str]] = []
    for cause in causes:
        family = families.get(cause.effect)
        if family is None:
            continue
        sizes = family.sizes(array)
        values = family(cause.parameters).size_values(array) if sizes else np.zeros(0)
        for size, value in zip(sizes, values, strict=True):
            bound = size.bound
            if abs(value) > bound:
                beyond.append((abs(value) / bound, f"{cause.effect} {size.key} = {value:.3g}, beyond ±{bound:.3g}"))
    if not beyond:
        return ""
    worst = max(beyond)[1]
    others = f" (and {len(beyond) - 1} more)" if len(beyond) > 1 else ""
    return f"{NOT_THIS_UNIT}: {worst}{others}"


def _found(causes: Sequence[NamedCause]) -> str:
    """Return the subject of a sentence on causes that are withdrawn."""
    return f"the causes found ({', '.join(dict.fromkeys(cause.effect for cause in causes))})"
