"""The gate: whether the causes of a verdict may stand, by what they are worth and by the sizes that physics allows.

One gate for every kind of twin: on a table and for a free body.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gfimu.diagnosis.verdict.verdict import Gain, NamedCause, Residual
from gfimu.geometry.array import AccelerometerArray
from gfimu.world_model import EffectFamily, bound_of

__all__ = ["LEAST_SHARE", "Judgement", "impossible_sizes", "judge", "measurable"]

LEAST_SHARE = 0.5
"""Share of the held-out excess below which causes are withdrawn: they miss more than they explain."""
_STDS = 2.0  # standard errors beyond which a figure counts
_WORSE = 1.01  # of the rms before: an in-sample error that is larger by less is the noise of the drive
_NEAR_NOISE = 1.1  # of the noise floor: an error within it is no evidence against a cause


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


def judge(gain: Gain, residual: Residual, causes: Sequence[NamedCause]) -> Judgement:
    """Judge causes by what they are worth on held-out data and on the fitted data.

    They are withdrawn where they predict held-out data worse than the given simulation, remove less than half of the
    excess there, or make the error on the fitted data worse, each beyond its standard error.

    Parameters
    ----------
    gain : Gain
        What they are worth on held-out data; a figure that could not be measured is NaN and counts for nothing.
    residual : Residual
        The error on the fitted data.
    causes : sequence of NamedCause
        The causes, for the words.
    """
    if not causes:
        return Judgement()
    figure = _held_out_figure(gain)
    if figure:
        return Judgement(True, f"{_found(causes)} do not predict data the fit never saw: {figure}")
    before, after = residual.rms_before, residual.rms_after
    if after > max(_WORSE * before, _NEAR_NOISE * residual.noise_floor):
        worse = f"the prediction error rises from {before:.3g} to {after:.3g} m/s²"
        return Judgement(True, f"{_found(causes)} make the simulation worse: {worse}")
    return Judgement()


def measurable(gain: Gain) -> Gain:
    """Return a gain, or one without figures where causes stand but what they are worth is within the noise.

    There the error may rise as well as fall by chance, and says nothing.
    """
    rises = gain.log_likelihood_per_sample < 0.0 or gain.rms_after > gain.rms_before
    return Gain(gain.held_out) if rises and np.isnan(gain.share_of_excess_removed) else gain


def _held_out_figure(gain: Gain) -> str:
    """Return the held-out figure that withdraws causes, in words, or nothing."""
    share = gain.share_of_excess_removed
    upper = share + _STDS * float(np.nan_to_num(gain.share_std))
    rises = f"the error there rises from {gain.rms_before:.3g} to {gain.rms_after:.3g} m/s²"
    if upper < LEAST_SHARE and share < 0.0 and gain.rms_after > _WORSE * gain.rms_before:
        return rises
    if upper < LEAST_SHARE:
        return f"{100 * max(share, 0.0):.0f} % of the excess removed"
    likelihood, std = gain.log_likelihood_per_sample, float(np.nan_to_num(gain.log_likelihood_std))
    # What is measured in other units must not overrule a share that is well above one half.
    if likelihood + _STDS * std < 0.0 and not share >= LEAST_SHARE:
        return f"log-likelihood per sample {likelihood:+.3g} ± {std:.2g}"
    return rises if np.isnan(share) and gain.rms_after > _NEAR_NOISE * gain.rms_before else ""


def impossible_sizes(
    causes: Sequence[NamedCause], families: Mapping[str, EffectFamily], array: AccelerometerArray
) -> str:
    """Return a signature where a cause is larger than its part or rig can be off; empty where none is.

    Such a size says that the twin describes another unit: its array file, its axes or its units are wrong. The bound
    is that of the effect's class (`gfimu.world_model.bound_of`); faults of the wiring have none.

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
            bound = bound_of(size)
            if abs(value) > bound:
                beyond.append((abs(value) / bound, f"{cause.effect} {size.key} = {value:.3g}, beyond ±{bound:.3g}"))
    if not beyond:
        return ""
    worst = max(beyond)[1]
    others = f" (and {len(beyond) - 1} more)" if len(beyond) > 1 else ""
    return f"the array file, axes or units do not fit these data: {worst}{others}"


def _found(causes: Sequence[NamedCause]) -> str:
    """Return the subject of a sentence on causes that are withdrawn."""
    return f"the causes found ({', '.join(dict.fromkeys(cause.effect for cause in causes))})"
