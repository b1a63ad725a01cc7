"""Models of the nuisance parameters, compared by evidence: biases that walk, a calibration that is a little off.

The search runs with white noise and bias instability alone. A random walk of the biases, a residue of the calibration
and both together are alternatives; a closed form of what each would bring beside the best set, and beside nothing,
says whether it is worth a search of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain

import numpy as np

from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.learn import learn_noise
from gfimu.diagnosis.fit.linear import Point, linearise, with_residue
from gfimu.diagnosis.fit.random_walk import Walk, as_it_walks, walk_strength
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.explain import Explanation, exactly, explain
from gfimu.diagnosis.search.sets import Sets, has_stalled, prune
from gfimu.diagnosis.terms.jacobian import Jacobian
from gfimu.diagnosis.terms.residue import Residue
from gfimu.diagnosis.time_limit import what_ended

__all__ = ["Understanding", "understand", "understood"]

Report = Callable[[float, str], None]


@dataclass(frozen=True)
class Understanding:
    """The best explanation of all models of the nuisance parameters.

    Parameters
    ----------
    explanation : Explanation
        Under the most probable model.
    walk : Walk, optional
        The random walk of the biases, where that model has one.
    residue : float
        Size of the residue of the calibration in units of its tolerances; 0 where it has none.
    log_odds : float
        That this model needs over white noise and bias instability alone.
    model : str
        Name of this model; empty for white noise and bias instability alone.
    """

    explanation: Explanation
    walk: Walk | None
    residue: float
    log_odds: float
    model: str = ""

    @property
    def log_posterior(self) -> float:
        """Log posterior of the best set, less what its model of the nuisance parameters needs."""
        return self.explanation.best.log_posterior - self.log_odds


def understand(
    stretches: Sequence[Stretch],
    policy: Policy,
    report: Report | None = None,
    *,
    models: Collection[str] | None = None,
) -> Understanding:
    """Explain stretches under every model of the nuisance parameters that is worth a search.

    Parameters
    ----------
    stretches : sequence of Stretch
        What to explain.
    policy : Policy
        Thresholds.
    report : callable, optional
        Called with the share done and a line of text.
    models : collection of str, optional
        Names of the only alternatives to white noise and bias instability alone that are searched; all by default.
    """
    progress = report or (lambda share, text: None)
    found = [understood(explain(stretches, policy, report=lambda s, text: progress(0.6 * s, text)), policy)]
    if found[0].explanation.interrupted:
        return found[0]
    alternatives = [one for one in _models(stretches, policy) if models is None or one.name in models]
    try:
        _add_alternatives(found, stretches, alternatives, policy, progress)
        best = _among(found)
        return replace(best, explanation=exactly(best.explanation, policy))
    except KeyboardInterrupt as stop:
        best = _among(found)
        return replace(best, explanation=replace(best.explanation, interrupted=what_ended(stop)))


def _add_alternatives(
    found: list[Understanding], stretches: Sequence[Stretch], models: Sequence[_Model], policy: Policy, progress: Report
) -> None:
    """Add to the explanation without them those under models of the nuisance parameters that are worth a search."""
    plain, derivatives = found[0].explanation, _Derivatives(stretches)
    rough = _left_by_inexactness(plain)
    offered = [(_offers(stretches, plain, model, derivatives), model) for model in models]
    # The most promising first: what it finds leaves the others little to search for.
    for offers, model in sorted(offered, key=lambda pair: _most(pair[0]) - pair[1].odds, reverse=True):
        progress(0.6, model.name)
        odds = model.odds + rough
        others = {one.explanation.best.key: one.explanation for one in found[1:]}
        beside = [_offers(stretches, one, model, derivatives) for key, one in others.items() if key != plain.best.key]
        start = _start(stretches, [*offers, *chain(*beside)], _leader(found), odds, policy)
        if start is not None:
            explanation = explain(stretches, policy, start=start)
            if explanation.interrupted:
                raise KeyboardInterrupt(explanation.interrupted)
            other = understood(explanation, policy, odds, model.name)
            # What looked like a random walk beside some causes may be no such thing beside the best of that model.
            if other.walk is None or other.walk.is_likely(policy):
                found.append(other)


def _among(found: Sequence[Understanding]) -> Understanding:
    """Return the most probable, with the best sets under the other models beside it."""
    best, elsewhere = _leader(found), []
    for other in found:
        if other is best:
            continue
        fitted = other.explanation.best
        more = other.log_odds - best.log_odds
        elsewhere.append(replace(fitted, log_posterior=fitted.log_posterior - more))
    return replace(best, explanation=replace(best.explanation, elsewhere=tuple(elsewhere)))


def _leader(found: Sequence[Understanding]) -> Understanding:
    """Return the most probable, the prior of its model included."""
    return max(found, key=lambda one: one.log_posterior)


def _left_by_inexactness(plain: Explanation) -> float:
    """Return the log odds of what causes leave whose models are rough: other nuisance parameters would take it."""
    best = plain.best
    lost = {name: best.log_posterior - fewer.log_posterior for name, fewer in plain.without.items()}
    return sum(cause.family.inexactness * max(lost.get(cause.name, 0.0), 0.0) for cause in best.causes)


_Taken = Sequence[Jacobian] | None


@dataclass(frozen=True)
class _Model:
    """A model of the nuisance parameters: what admits it at a point, if it is there, and the log odds that it needs."""

    name: str
    admit: Callable[[Point, _Taken], Point | None]
    odds: float


@dataclass(frozen=True)
class _Offer:
    """A point under another model of the nuisance parameters, and the log posterior that it has in a linear world."""

    worth: float
    point: Point


def _models(stretches: Sequence[Stretch], policy: Policy) -> list[_Model]:
    """Return the alternatives to white noise and bias instability alone."""
    first = stretches[0]
    if isinstance(first, BodyStretch):  # its slow noise takes what walks; a residue would need the force of many poses
        return []
    found: list[_Model] = []
    residues: list[tuple[float, float]] = []
    if Residue.is_possible(first) and not any(s.steps.channels for s in stretches):
        residues = list(policy.residue_odds)
    for scale, odds in residues:
        admit = partial(_with_residue, stretches, scale=scale)
        found.append(_Model(f"calibration residue × {scale:g}", admit, odds))
    if first.first_levels.walk == 0.0:
        # One effect of the library; what it has to bring beside the same causes, `Walk.is_likely` asks.
        walks = float(np.log(len(first.model.families())))
        found.append(_Model("random walk", partial(_walking, stretches, policy=policy), walks))
        for scale, odds in residues[:1]:

            def both(point: Point, taken: _Taken, scale: float = scale) -> Point | None:
                walking = _walking(stretches, point, taken, policy)
                return None if walking is None else with_residue(stretches, walking, scale)

            found.append(_Model("random walk and calibration residue", both, walks + odds))
    return found


def _with_residue(stretches: Sequence[Stretch], point: Point, _: _Taken, scale: float) -> Point:
    return with_residue(stretches, point, scale)


def _walking(stretches: Sequence[Stretch], point: Point, taken: _Taken, policy: Policy) -> Point | None:
    """Return the point with biases that walk as its residuals do, if they do, and the bias instability beside that."""
    walking = as_it_walks(stretches, point, policy)
    return learn_noise(stretches, walking, taken) if walking.levels[0].walk > 0.0 else None


class _Derivatives:
    """Derivatives by the drives at points of fits, each taken once for all models."""

    def __init__(self, stretches: Sequence[Stretch]) -> None:
        self._stretches = stretches
        self._taken: dict[int, tuple[Point, list[Jacobian]]] = {}

    def at(self, point: Point) -> list[Jacobian] | None:
        """Return the derivatives at a point; None where they depend on the noise, over coarse steps."""
        if any(stretch.steps.channels for stretch in self._stretches):
            return None
        if id(point) not in self._taken:  # the point is kept beside them, so that its identity lasts
            linear = linearise(self._stretches, point, responses=False)
            self._taken[id(point)] = point, [posterior.jacobian for posterior in linear.posteriors]
        return self._taken[id(point)][1]


def _offers(stretches: Sequence[Stretch], known: Explanation, model: _Model, derivatives: _Derivatives) -> list[_Offer]:
    """Return what a model offers beside the causes of an explanation and beside fewer.

    A slow cause may stand for a random walk: it shows where that is left out.
    """
    found: list[_Offer] = []
    for base in (known.best, known.nothing, *known.without.values()) if known.best.causes else (known.best,):
        try:
            taken = derivatives.at(base.point)
            point = model.admit(base.point, taken)
            if point is not None:
                found.append(_Offer(base.log_posterior + _promise(stretches, base.point, point, taken), point))
        except np.linalg.LinAlgError:  # a model whose equations have no solution offers nothing
            continue
    return found


def _most(offers: Sequence[_Offer]) -> float:
    return max((offer.worth for offer in offers), default=-np.inf)


def _start(
    stretches: Sequence[Stretch], offers: Sequence[_Offer], leader: Understanding, odds: float, policy: Policy
) -> Point | None:
    """Return where a search under another model starts, if that may beat the leader of those that are known."""
    known, leading = leader.explanation.best, None
    best = known.log_posterior - leader.log_odds + odds
    for offer in sorted(offers, key=lambda one: one.worth, reverse=True):
        reached = best if leading is None else max(best, leading.log_posterior)
        if offer.worth < reached - 2.0 * policy.close:
            break
        sets = Sets(stretches, offer.point, policy)
        if sets.fit([offer.point])[0] is not None:
            tried = prune(sets)
            leading = tried if leading is None or tried.log_posterior > leading.log_posterior else leading
    if leading is None or leading.log_posterior < best - policy.worth_a_search:
        return None
    return None if has_stalled(stretches, known, leading, policy) else leading.point


def _promise(stretches: Sequence[Stretch], before: Point, after: Point, taken: _Taken) -> float:
    """Return what another model of the nuisance parameters brings in a linear world, nats."""
    values = []
    for point in (before, after):
        linear = linearise(stretches, point, jacobians=taken)
        values.append(linear.log_volume + linear.log_noise - 0.5 * linear.objective)
    return values[1] - values[0]


def understood(explanation: Explanation, policy: Policy, odds: float = 0.0, model: str = "") -> Understanding:
    """Return an explanation with what its point says of the nuisance parameters.

    Parameters
    ----------
    explanation : Explanation
        Under one model of them.
    policy : Policy
        Thresholds of `walk_strength`.
    odds : float
        That this model needs.
    model : str
        Its name.
    """
    stretches, point = explanation.stretches, explanation.best.point
    walk = None
    if point.levels[0].walk > 0.0 and stretches[0].first_levels.walk == 0.0:
        walk = walk_strength(stretches, point, policy)
    residue = 0.0 if point.residue is None else point.residue.scale
    return Understanding(explanation, walk, residue, odds, model)
