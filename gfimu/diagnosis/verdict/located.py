"""Causes without a name in a verdict: where they are, what they go with, and the function, in words and as a table."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax

from gfimu.diagnosis.fit.gauss_newton import Fit
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.explain import Explanation
from gfimu.diagnosis.search.free_time import FreeTime
from gfimu.diagnosis.terms.cause import Cause, effects_of
from gfimu.diagnosis.terms.located.policy import LOCATED
from gfimu.diagnosis.terms.located.term import LocatedTerm, is_located
from gfimu.diagnosis.verdict.parts import FunctionTable, Located, NamedCause
from gfimu.model.located.effect import UNLISTED
from gfimu.model.located.rig_state import RigState

__all__ = ["experiment_between", "located_cause", "of_free_time"]

_Floats = NDArray[np.float64]

_TURNS = "slow turns through several revolutions"
_AGAIN = "the same motion once more, at another time"
_QUICK = "quick starts and stops"
_SHOWN_BY = {
    "omega": "held speeds, slow and fast, both ways",
    "alpha": _QUICK,
    "memory": _QUICK,
    "mode": _QUICK,
    "theta": _TURNS,
    "revolution": _TURNS,
    "order": _TURNS,
    "t": _AGAIN,
    "tone": _AGAIN,
    "step": _AGAIN,
    "T": "the same motion with a cold board and with a warm one",
    "own": "the array turned over on the table",
}
"""The recording that shows by itself what an error goes with, by the first word of the kind of its dependence."""
_ELSEWHERE = "the array at another place on the table, and turned there"


def located_cause(explanation: Explanation, fit: Fit, cause: Cause, policy: Policy) -> NamedCause:
    """Return a located term of a fit as a cause of the verdict.

    Parameters
    ----------
    explanation : Explanation
        What the search ended with.
    fit : Fit
        The set that the term belongs to.
    cause : Cause
        The term.
    policy : Policy
        Thresholds ``cause_odds`` and ``temperature``.
    """
    term = cause.family
    assert isinstance(term, LocatedTerm)
    sets = [fit, *(one for one in (*explanation.rivals, explanation.nothing) if one.key != fit.key)]
    likely = softmax(np.array([one.log_posterior for one in sets]) / policy.temperature)
    weights = list(zip(likely, map(_terms, sets), strict=True))
    place = sum(weight for weight, terms in weights if any(one.where.name == term.where.name for one in terms))
    kind = term.dependence.kind
    dependence = sum(weight for weight, terms in weights if any(one.dependence.kind == kind for one in terms))
    near = [one for one in sets[1:] if one.log_posterior > fit.log_posterior - policy.cause_odds]
    others = [own for one in near for own in _terms(one) if own.name != term.name]
    stretch = explanation.stretches[0]
    named = [one for one in fit.causes if not is_located(one)]
    state = stretch.state(effects_of(named, stretch.model.array, stretch.index), fit.point.drives[0].spin)
    table, size = _function(cause, term, state)
    text = f"{_words(term)}{size}"
    without = explanation.without.get(cause.name)
    found = Located(
        place=term.where.name,
        what=term.where.what,
        pattern=term.pattern,
        series=term.where.components if any(term.where.components) else (),
        dependence=term.dependence.name,
        text=text,
        place_probability=min(float(place), LOCATED.most_certain_place),
        dependence_probability=min(float(dependence), LOCATED.most_certain_place),
        instead=tuple(dict.fromkeys(map(_words, others))),
        function=table,
    )
    return NamedCause(
        UNLISTED,
        {},
        {},
        found.place_probability,
        would_be_separated_by=experiment_between(term, others),
        why=text,
        log_odds=0.0 if without is None else float(fit.log_posterior - without.log_posterior),
        unlisted=found,
    )


def _terms(fit: Fit) -> list[LocatedTerm]:
    return [cause.family for cause in fit.causes if isinstance(cause.family, LocatedTerm)]


def experiment_between(term: LocatedTerm, others: Sequence[LocatedTerm]) -> str:
    """Return what to record to tell a term from others that fit as well; empty where there are none."""
    found: list[str] = []
    for other in others:
        kinds = [one.dependence.kind.split(",")[0].split(" ")[0] for one in (term, other)]
        if kinds[0] != kinds[1]:
            found += [_SHOWN_BY[kind] for kind in kinds if kind in _SHOWN_BY]
        elif other.where.name != term.where.name:
            found.append(_ELSEWHERE)
    return " and ".join(dict.fromkeys(found))


def of_free_time(places: Sequence[FreeTime], policy: Policy) -> NamedCause:
    """Return an error that goes with nothing that is known as a cause of the verdict, by its places, best first."""
    best = places[0]
    likely = softmax(np.array([one.log_odds for one in places]) / policy.temperature)
    same = sum(w for w, one in zip(likely, places, strict=True) if one.where.name == best.where.name)
    close = [one for one in places[1:] if one.log_odds > best.log_odds - policy.cause_odds]
    found = Located(
        place=best.where.name,
        what=best.where.what,
        pattern=best.pattern,
        series=best.where.components if any(best.where.components) else (),
        dependence="time",
        text=f"{best.where.words}, in time, with nothing else that is known",
        place_probability=min(float(same), LOCATED.most_certain_place),
        dependence_probability=None,
        instead=tuple(one.where.words for one in close),
    )
    why = found.text
    return NamedCause(
        UNLISTED,
        {},
        {},
        found.place_probability,
        would_be_separated_by=_ELSEWHERE if close else "",
        why=why,
        log_odds=best.log_odds,
        unlisted=found,
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
    return table, f" ({size} at {_minus(f'{x[at]:.3g}')} {of.unit})"


def _rounded(values: _Floats) -> tuple[float, ...]:
    return tuple(float(f"{value:.5g}") for value in values)


def _amount(value: float, unit: str) -> str:
    """Return a value with its unit as people read it."""
    if unit == "1":
        return _minus(f"{100.0 * value:+.2g} %")
    for factor, name in ((1e3, "m"), (1e6, "µ")):  # numerical
        if abs(value) * factor >= 1.0 and abs(value) < 0.1 and unit in ("rad", "m", "s"):  # numerical
            return _minus(f"{factor * value:+.3g} {name}{unit}")
    return _minus(f"{value:+.3g} {unit}")


def _minus(text: str) -> str:
    return text.replace("-", "−")
