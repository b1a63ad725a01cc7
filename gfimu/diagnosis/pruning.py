"""Pruning: what the data hardly ask for is dropped, and rivals are judged as the best set was."""

from __future__ import annotations

from collections.abc import Sequence

from gfimu.diagnosis.fit import Fit, without
from gfimu.diagnosis.other_orders import is_ripple, power_at_other_orders
from gfimu.diagnosis.refinement import refine_each
from gfimu.diagnosis.segment import Segment
from gfimu.world_model import Effect

__all__ = ["LEAST_EXTRA_ODDS", "LEAST_ODDS", "RIVALS", "near_rivals", "prune"]

LEAST_ODDS = 4.0
"""Log odds that a single cause needs against nothing.

Wide of what chance does: in 240 runs with nothing hidden (`threshold_nulls` of `sim.study`, not those that the false
alarms are counted on) two reached even odds and none e against one.
"""
LEAST_EXTRA_ODDS = 7.0
"""Log odds that a further cause, beside others or a fault of the data, needs against the set without it."""
_LEAST_ROUNDED_ODDS = 15.0  # where readings are coarse: at rest the same rounding error repeats, sample after sample
RIVALS = 6
"""How many other sets are judged beside the best."""
_WORTH_PRUNING = 40.0
_CHANCE_ORDER = 10.0  # misfit that one of four wrong orders of a ripple takes off by chance in one run of forty


def prune(
    segments: Sequence[Segment],
    fit: Fit,
    fixed: Sequence[Sequence[Effect]],
    done: dict[frozenset[tuple[str, str]], Fit] | None = None,
) -> tuple[Fit, dict[str, Fit]]:
    """Drop causes that the data hardly ask for.

    Parameters
    ----------
    segments : sequence of Segment
        The data.
    fit : Fit
        What to prune.
    fixed : sequence of sequence of Effect
        Effects known beforehand, per segment.
    done : dict, optional
        Sets refined before under the same noise; those refined here are added.

    Returns
    -------
    fit : Fit
        What the data ask for.
    without : dict of str to Fit
        By cause, the best fit without it.
    """
    known = {} if done is None else done
    faults = any(effect.place == "data" for effects in fixed for effect in effects)
    rounded = any(segment.rounding.channels > 0 for segment in segments)
    while True:
        if not fit.causes:
            return fit, {}
        rest = [[other for other in fit.causes if other.name != cause.name] for cause in fit.causes]
        keys = [frozenset(other.key for other in some) for some in rest]
        new = [number for number, key in enumerate(keys) if key not in known]
        refined = refine_each(
            segments,
            [rest[number] for number in new],
            fixed,
            [fit.drives] * len(new),
            iterations=8,
            others=[without(fit, number, segments[0].model.array) for number in new],
        )
        known |= {one.key: one for one in refined}
        fewer = {cause.name: known[key] for cause, key in zip(fit.causes, keys, strict=True)}
        lost = {name: fit.log_posterior - other.log_posterior for name, other in fewer.items()}
        for cause in filter(is_ripple, fit.causes):
            elsewhere = power_at_other_orders(segments, fewer[cause.name], fixed, cause)
            lost[cause.name] -= max(elsewhere - _CHANCE_ORDER, 0.0)
        weakest = min(lost, key=lost.__getitem__)
        needed = LEAST_ODDS if len(fit.causes) == 1 and not faults else LEAST_EXTRA_ODDS
        needed = _LEAST_ROUNDED_ODDS if rounded else needed
        noise = segments[0].levels.of_reading
        needed += sum(cause.inexactness(noise) * lost[cause.name] for cause in fit.causes if cause.name != weakest)
        if lost[weakest] >= needed:
            return fit, fewer
        fit = fewer[weakest]


def near_rivals(
    segments: Sequence[Segment],
    best: Fit,
    near: Sequence[Fit],
    fixed: Sequence[Sequence[Effect]],
    done: dict[frozenset[tuple[str, str]], Fit],
) -> list[Fit]:
    """Refine other sets under the noise and drive prior of the best one; those that come close are pruned too."""
    rivals = []
    sets = [fit.causes for fit in near if len(fit.causes) <= len(best.causes) + 1]
    refined = refine_each(segments, sets, fixed, [best.drives] * len(sets), iterations=6)
    for fit in refined:
        rival = fit
        if any(rival.key > other.key and rival.log_posterior < other.log_posterior for other in (best, *refined)):
            continue  # another set with something superfluous
        if rival.log_posterior > best.log_posterior - _WORTH_PRUNING:
            rival = prune(segments, rival, fixed, done)[0]
        rivals.append(rival)
    return rivals
