"""Where an unknown cause is: located terms, what the residual shows without any fit, likely mistakes of the files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax

from gfimu.diagnosis.criticism.views.rigid_motion import rigid_motion
from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.data.table.rig_state import RigState
from gfimu.diagnosis.fit.learn import predicted_by_reference
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.free_time import FreeTime
from gfimu.diagnosis.search.localise import ComparedTerm, Localised, localise
from gfimu.diagnosis.terms.cause import Cause
from gfimu.diagnosis.terms.located.policy import LOCATED
from gfimu.diagnosis.terms.located.term import LocatedTerm
from gfimu.diagnosis.verdict.gate import NOT_THIS_UNIT
from gfimu.diagnosis.verdict.likely_mistakes import likely_mistake
from gfimu.diagnosis.verdict.parts import FunctionTable, Located
from gfimu.diagnosis.verdict.verdict import Diagnosis
from gfimu.model.world_model import is_linear

__all__ = ["located", "with_place"]

_Floats = NDArray[np.float64]
_NO_MISTAKE = (
    "Other orders and signs of the channels, millimetres, centimetres or inches for metres, and other arrays of the "
    "library were tried: none of them fits."
)


def with_place(found: Diagnosis, stretches: Sequence[Stretch], runs: Sequence[Run], policy: Policy) -> Diagnosis:
    """Return a verdict with the place of what the given simulation misses; an unknown one says it in words.

    Parameters
    ----------
    found : Diagnosis
        The verdict.
    stretches : sequence of Stretch
        The data with the simulation as it was given.
    runs : sequence of Run
        The recordings.
    policy : Policy
        Thresholds.
    """
    rigid = None if is_linear(stretches[0].model) else rigid_motion(stretches, policy)
    found = replace(found, rigid=rigid)
    if rigid is None or found.verdict != "unknown":
        return found
    mistake = likely_mistake(stretches[0].model, runs, predicted_by_reference)
    if mistake is not None:
        unexplained, more = replace(found.unexplained, mistake=mistake.text), mistake.sentence
    elif found.unexplained.signature.startswith(NOT_THIS_UNIT):
        unexplained, more = found.unexplained, _NO_MISTAKE
    else:
        described = _described(stretches, policy)
        unexplained = replace(found.unexplained, located=described)
        more = f"{'; '.join(one.text for one in described)}." if described else rigid.sentence
        more = more[:1].upper() + more[1:]
    first, *others = found.sentences
    return replace(found, unexplained=unexplained, sentences=(first, more, *others) if more else found.sentences)


def _described(stretches: Sequence[Stretch], policy: Policy) -> tuple[Located, ...]:
    """Return where something without a name is, searched in the first samples of the first stretches."""
    some = [
        replace(one, run=one.run.rows(0, min(len(one.run.t), LOCATED.samples)))
        for one in stretches[: LOCATED.stretches]
    ]
    if some[0].model.placed(some[0].run.mounting) is None:
        return ()
    try:
        return located(localise(some, policy), policy)
    except np.linalg.LinAlgError:  # a run whose equations have no solution has no place either
        return ()


def located(found: Localised, policy: Policy) -> tuple[Located, ...]:
    """Return the descriptions of located terms, or the place of an error that is free in time where that says more.

    Parameters
    ----------
    found : Localised
        The terms at their optimum.
    policy : Policy
        Thresholds ``cause_odds``, ``least_share`` and ``temperature``.
    """
    explained = sum(rivals[0].log_odds for rivals in found.rounds)
    if found.free and found.free[0].log_odds > max(LOCATED.free_odds, policy.least_share * explained):
        return (_of_time(found.free, policy),)
    stretch = found.stretches[0]
    state = stretch.state((), found.fit.point.drives[0].spin)
    pairs = zip(found.fit.causes, found.rounds, strict=True)
    return tuple(_of_term(cause, rivals, state, policy) for cause, rivals in pairs)


def _of_term(cause: Cause, rivals: Sequence[ComparedTerm], state: RigState, policy: Policy) -> Located:
    """Return the description of a term, given what it was compared with."""
    best, *others = rivals
    term = best.leader.term
    likely = softmax(np.array([rival.log_odds for rival in rivals]) / policy.temperature)
    same = sum(w for w, rival in zip(likely, rivals, strict=True) if rival.leader.term.where.name == term.where.name)
    close = [rival.leader.term for rival in others if rival.log_odds > best.log_odds - policy.cause_odds]
    table, size = _function(cause, term, state)
    return Located(
        place=term.where.name,
        what=term.where.what,
        pattern=term.pattern,
        series=term.where.components if any(term.where.components) else (),
        dependence=term.dependence.name,
        text=f"{_words(term)}{size}",
        place_probability=min(float(same), 1.0) * LOCATED.most_certain_place,
        log_odds=best.log_odds,
        instead=tuple(map(_words, close)),
        function=table,
    )


def _of_time(places: Sequence[FreeTime], policy: Policy) -> Located:
    """Return the description of an error that goes with nothing that is known."""
    best = places[0]
    likely = softmax(np.array([one.log_odds for one in places]) / policy.temperature)
    same = sum(w for w, one in zip(likely, places, strict=True) if one.where.name == best.where.name)
    close = [one for one in places[1:] if one.log_odds > best.log_odds - policy.cause_odds]
    return Located(
        place=best.where.name,
        what=best.where.what,
        pattern=best.pattern,
        series=best.where.components if any(best.where.components) else (),
        dependence="time",
        text=f"{best.where.words}, in time, with nothing else that is known",
        place_probability=min(float(same), 1.0) * LOCATED.most_certain_place,
        log_odds=best.log_odds,
        instead=tuple(one.where.words for one in close),
    )


def _words(term: LocatedTerm) -> str:
    return f"{term.where.words}, {term.dependence.words}"


def _function(cause: Cause, term: LocatedTerm, state: RigState) -> tuple[FunctionTable | None, str]:
    """Return the largest component of a term's function as a table, and its largest value in words."""
    basis = term.dependence.values(state)
    count, components = term.dependence.count, len(term.where.components)
    coefficients = (cause.mixing @ cause.coordinates).reshape(components, count) * term.where.usual
    if basis.ndim == 3:
        return None, ""
    values = coefficients @ basis.T  # (components, n)
    largest = int(np.argmax(np.mean(values**2, axis=1)))
    of = term.dependence.abscissa
    at = int(np.argmax(np.abs(values[largest])))
    size = _amount(float(values[largest, at]), term.where.unit)
    size += f" in {term.where.components[largest]}" if components > 1 else ""
    if of is None:
        return None, f" (up to {size})"
    x = of.of(state)
    order = np.argsort(x)
    even = np.linspace(x[order[0]], x[order[-1]], LOCATED.rows)
    rows = np.unique(np.minimum(np.searchsorted(x[order], even), len(x) - 1))
    rows = order[rows]
    mixing = cause.mixing[largest * count : (largest + 1) * count] * term.where.usual
    spread = basis[rows] @ mixing  # (rows, k)
    std = np.sqrt(np.maximum(np.einsum("nk,kl,nl->n", spread, cause.covariance, spread), 0.0))
    table = FunctionTable(_rounded(x[rows]), _rounded(values[largest, rows]), _rounded(std), of.unit, term.where.unit)
    return table, f" ({size} at {x[at]:.3g} {of.unit})"


def _rounded(values: _Floats) -> tuple[float, ...]:
    return tuple(float(f"{value:.5g}") for value in values)


def _amount(value: float, unit: str) -> str:
    """Return a value with its unit as people read it."""
    if unit == "1":
        return f"{100.0 * value:+.2g} %"
    for factor, name in ((1e3, "m"), (1e6, "µ")):  # numerical
        if abs(value) * factor >= 1.0 and abs(value) < 0.1 and unit in ("rad", "m", "s"):  # numerical
            return f"{factor * value:+.3g} {name}{unit}"
    return f"{value:+.3g} {unit}"
