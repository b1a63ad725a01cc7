"""Which other way to read a file, or which two at once, explain what contradicts it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gfimu.recording.evidence.rigid import Costs, Evidence, Otherwise
from gfimu.recording.evidence.ways import both_ways, ways_to_read

__all__ = ["Explanation", "explanations"]

_LEAST_NOISE = 0.1  # of the other channels', so that a channel is not explained away by a tiny unit
_MOST_NOISE = 4.0  # of the data sheet's, in another unit
_REMOVED = 0.8  # of the contradiction, by the other way to read the file
_FITS = 1.0  # of what the limits allow
_SIGNIFICANT = 3.0  # times what white noise gives, for a warning
_REMOVED_FOR_WARNING = 0.9
_WORSE = 0.1  # by which a cost may grow that was possible before
_FASTEST = 2.0  # times the part's fastest output data rate
_CLEAR = 0.02  # of the contradiction is left: no need to look further
_OF_ALL = frozenset({"time", "unit", "array"})
_SCALED = frozenset({"unit", "chip_unit"})
_FIRST = 6  # ways that remove the most, each of which is tried with a second one


@dataclass(frozen=True)
class Explanation:
    """A way to read a file that removes what contradicts it.

    Parameters
    ----------
    left : float
        What is left of the contradiction, a ratio.
    way : Otherwise
        The way.
    costs : Costs
        What contradicts the file read that way.
    refused : bool
        Whether errors within the data sheets' limits can't be the reason, so that the file should be refused.
    """

    left: float
    way: Otherwise
    costs: Costs
    refused: bool


def explanations(evidence: Evidence) -> list[Explanation]:
    """Compare the file as given with the other ways to read it; none where nothing contradicts it, or none explains it.

    Where no single way explains all of a contradiction that errors within the limits can't be the reason for, two at
    once are tried: those that remove most of it alone, each with every other one.

    Returns
    -------
    list of Explanation
        The one that leaves least of the contradiction first.
    """
    before = evidence.costs(evidence.as_given())
    if not _contradicting(before, evidence):
        return []
    ways = ways_to_read(evidence)
    found: list[Explanation] = []
    tried: list[tuple[Otherwise, Costs]] = []
    for of_all in (True, False):
        group = _with_costs([way for way in ways if (way.kind in _OF_ALL) == of_all], before, evidence)
        found += _explaining(group, before, evidence)
        tried += group
        if min((one.left for one in found), default=1.0) < _CLEAR:
            break
    found.sort(key=lambda one: one.left)
    together = _explaining_together(tried, found[0] if found else None, before, evidence)
    return sorted(together, key=lambda one: one.left) or found


def _explaining_together(
    tried: Sequence[tuple[Otherwise, Costs]], best: Explanation | None, before: Costs, evidence: Evidence
) -> list[Explanation]:
    """Return pairs of ways of which each removes four fifths of what the other, and the best single way, leaves."""
    shown = () if best is None else _contradicting(best.costs, evidence)
    if best is not None and not (best.refused and shown):
        return []
    impossible = _impossible(before, motion=bool(np.isfinite(before.motion)))
    if not impossible:
        return []
    possible = [(way, costs) for way, costs in tried if _possible(way, before, evidence)]
    possible.sort(key=lambda one: np.nan_to_num(_sum(one[1], impossible), nan=np.inf))
    pairs: dict[str, Otherwise] = {}
    for one, _ in possible[:_FIRST]:
        for two, _ in possible:
            if one is two or (one.kind == two.kind and set(one.channels) & set(two.channels)):
                continue
            both = both_ways(one, two)
            quick = evidence.costs(both, with_motion=False)
            if max(quick.worst_rest, quick.level, quick.parity) < _FITS:
                pairs.setdefault(both.text, both)
    found = _explaining(_with_costs(list(pairs.values()), before, evidence), before, evidence)
    if best is None:
        return [one for one in found if one.refused and one.left < (1.0 - _REMOVED) ** 2]
    return [
        one
        for one in found
        if one.refused and _left(best.costs, one.costs, shown, scaled=one.way.is_one_of(_SCALED)) < 1.0 - _REMOVED
    ]


def _with_costs(ways: Sequence[Otherwise], before: Costs, evidence: Evidence) -> list[tuple[Otherwise, Costs]]:
    # Wiring shows in the combinations that no motion changes, where there are any; else in the whole motion.
    hopeless = before.total(motion=True)
    return [
        (way, evidence.costs(way, with_motion=not evidence.has_parity or way.is_one_of(_OF_ALL), hopeless=hopeless))
        for way in ways
    ]


def _explaining(tried: Sequence[tuple[Otherwise, Costs]], before: Costs, evidence: Evidence) -> list[Explanation]:
    """Return the ways that explain a contradiction."""
    # A motion that no way fits, of those that the rests allow, can't be compared: it was too long or too fast.
    usable = before.motion < _FITS or any(
        costs.motion < _FITS and max(costs.worst_rest, costs.level, costs.parity) < _FITS for _, costs in tried
    )
    found = []
    for way, costs in tried:
        compared = usable and bool(np.isfinite(costs.motion))
        if not _possible(way, before, evidence) or costs.worst_rest > _FITS:
            continue
        after = costs
        if way.array is not None and evidence.has_parity and not evidence.has_parity_of(way.array):
            # An array without combinations free of motion has no cost of them: its motion has to fit instead.
            after = replace(costs, parity=costs.motion if compared else np.inf)
        fits = max(after.parity, after.motion if compared else 0.0, after.level) < _FITS
        if not fits:
            continue
        if compared and after.points and after.motion < before.motion:  # the fit of the file as given may have failed
            again = evidence.costs(evidence.as_given(), points=after.points)
            before = again if again.motion < before.motion else before
        impossible = _impossible(before, motion=compared)
        left = _left(before, after, impossible, scaled=way.is_one_of(_SCALED))
        if impossible and left < 1.0 - _REMOVED and _removes_enough(before, after, impossible):
            found.append(Explanation(left, way, after, refused=True))
        elif not impossible and _explains_noise(before, after, motion=compared):
            left = after.total(motion=compared) / before.total(motion=compared)
            found.append(Explanation(left, way, after, refused=False))
    return found


def _impossible(costs: Costs, *, motion: bool) -> tuple[str, ...]:
    """Return the costs that errors within the limits can't be the reason for."""
    beyond = {
        "rest": costs.worst_rest > _FITS,
        "level": costs.level > _FITS,
        "parity": costs.parity > _FITS,
        "motion": motion and costs.motion > _FITS,
    }
    return tuple(name for name, is_beyond in beyond.items() if is_beyond)


def _removes_enough(before: Costs, after: Costs, impossible: Sequence[str]) -> bool:
    """Whether what a way removes is by itself beyond the limits, where motion alone contradicts the file.

    The cost of a motion is no strict bound: errors of α add up in the rate of a long fast spin.
    """
    return tuple(impossible) != ("motion",) or before.motion - after.motion > _FITS


def _left(before: Costs, after: Costs, impossible: Sequence[str], *, scaled: bool) -> float:
    """Return what is left of the impossible costs, or 1 if another one grows (larger readings have larger errors)."""
    others = {"rest", "level", "parity", "motion"} - set(impossible)
    grown = [name for name in others if getattr(after, name) > getattr(before, name) + _WORSE]  # false for NaN
    if any(not scaled or getattr(after, name) > _FITS for name in grown):
        return 1.0
    return _sum(after, impossible) / max(_sum(before, impossible), 1e-12)


def _sum(costs: Costs, names: Sequence[str]) -> float:
    return float(sum(getattr(costs, name) for name in names))


def _contradicting(costs: Costs, evidence: Evidence) -> tuple[str, ...]:
    """Return the costs that show a contradiction at all."""
    moving = costs.motion > _SIGNIFICANT * costs.motion_noise  # false for NaN
    if evidence.has_parity:
        moving = moving and costs.motion > _FITS
    shown = {
        "rest": costs.worst_rest > 0.5,
        "level": costs.level > 0.5,
        "parity": costs.parity > _SIGNIFICANT * costs.parity_noise,
        "motion": bool(moving),
    }
    return tuple(name for name, is_shown in shown.items() if is_shown)


def _explains_noise(before: Costs, after: Costs, *, motion: bool) -> bool:
    """Whether a contradiction is significant and gone, at rest as in motion."""
    pairs = [(before.parity - before.parity_noise, after.parity - before.parity_noise, before.parity_noise)]
    if motion:
        pairs.append((before.motion - before.motion_noise, after.motion - before.motion_noise, before.motion_noise))
    if before.worst_rest > 0.5:
        pairs.append((before.rest, after.rest, 0.1))
    left = [
        rest_after - (1.0 - _REMOVED_FOR_WARNING) * excess
        for excess, rest_after, noise in pairs
        if excess > _SIGNIFICANT * noise
    ]
    worse = after.rest > before.rest + _WORSE or after.level > before.level + _WORSE
    return bool(left) and max(left) < 0.0 and not worse


def _possible(way: Otherwise, before: Costs, evidence: Evidence) -> bool:
    """Whether a way is possible at all.

    Another unit of time has to give a rate that the part has; another unit of all readings has to be asked for by
    gravity at rest; and the noise has to fit another unit, as it shrinks and grows with the readings.
    """
    if way.parts:
        return all(_possible(one, before, evidence) for one in way.parts)
    if way.kind == "time":
        return evidence.sample_rate / way.time < _FASTEST * evidence.limits.output_rate[1]
    if way.kind == "unit" and not (len(evidence.rests) and before.level > _FITS):
        return False
    if way.kind not in _SCALED:
        return True
    scale = np.abs(np.diag(way.columns))
    noise = scale * evidence.quiet / evidence.limits.noise
    changed = evidence.alive & (scale != 1.0)
    others = evidence.alive & ~changed
    least = _LEAST_NOISE * float(np.median(noise[others])) if others.any() else 0.0
    return least <= float(np.median(noise[changed])) < _MOST_NOISE
