"""Whether a miss is the fault of the search or of the evidence: the truth is fitted too, under the same noise.

Where the hidden set, fitted from its true parameters, is more probable than what the search ended with, the search did
not come by it; where it is less probable, the evidence prefers something else and no search would help.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gfimu.diagnosis.data.stretch import make_stretches
from gfimu.diagnosis.diagnose import prepare
from gfimu.diagnosis.fit.gauss_newton import Fit, fit
from gfimu.diagnosis.fit.parallel import one_blas_thread
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.explain import Explanation
from gfimu.diagnosis.search.long_run import understand_any_length
from gfimu.diagnosis.terms.cause import Cause
from sim.effects import Effect, make_effect
from sim.trials.study.cases import Case
from sim.trials.study.outcome import HiddenWorld, draw_world
from sim.trials.study.tally import Outcome, score, visible

__all__ = ["blame_of", "is_miss", "truth_over_found"]

_TIE = 0.5  # nats between two sets that are as probable as each other
_SPANNED = 1e-6  # share of the sizes that a place may leave


def is_miss(outcome: Outcome) -> bool:
    """Whether an outcome is a miss that a fit of the truth can explain: on a table, inside the library."""
    outside = outcome["without"] or outcome["study"] == "exotics" or outcome.get("body")
    return visible(outcome) and not outside and not score(outcome)["fair"]


def blame_of(case: Case, source: str, outcome: Outcome) -> dict[str, Any]:
    """Return the blame for a miss: ``search``, ``evidence``, or why it can't be said, and the nats between the two.

    ``truth_over_found`` is the log posterior of the hidden set, refitted from the truth, over that of what was found.
    """
    if outcome["verdict"] == "error":
        return {"blame": "crash"}
    world = draw_world(case, source)
    if any(not make_effect(name, values).sizes(world.twin.array) for name, values in world.truth):
        return {"blame": "no fit: an effect without a size is hidden"}
    over = truth_over_found(world)
    return {"blame": "search" if over > _TIE else "evidence", "truth_over_found": over}


def truth_over_found(world: HiddenWorld) -> float:
    """Return the log posterior of the truth less that of what the search finds, under the noise it ends with."""
    policy = Policy()
    with one_blas_thread():
        prepared = prepare([world.recording], world.twin, ["run"])
        stretches = make_stretches(world.twin, prepared.runs, prepared.effects)
        found = understand_any_length(stretches, policy, lambda share, text: None).explanation
        hidden = [_as_cause(make_effect(name, values), world, found) for name, values in world.truth]
        return max(one.log_posterior for one in _fits(found, hidden, policy)) - found.best.log_posterior


def _fits(found: Explanation, causes: Sequence[Cause], policy: Policy) -> list[Fit]:
    """Fit the truth from the drives of what was found and of nothing, which may be another basin."""
    points = [replace(one.point, causes=tuple(causes)) for one in (found.best, found.nothing)]
    return [fit(found.stretches, point, policy) for point in points]


def _as_cause(effect: Effect, world: HiddenWorld, found: Explanation) -> Cause:
    """Return a hidden effect as the search would have it: at the narrowest place that spans its sizes."""
    array, family = world.twin.array, type(effect)
    values = effect.size_values(array) / np.array([size.prior_std for size in family.sizes(array)])
    spanning = []
    for pattern in family.patterns(array):
        coordinates = np.linalg.lstsq(pattern.mixing, values, rcond=None)[0]
        if np.linalg.norm(pattern.mixing @ coordinates - values) <= _SPANNED * np.linalg.norm(values):
            spanning.append((pattern, coordinates))
    pattern, coordinates = min(spanning, key=lambda pair: pair[0].mixing.shape[1])
    prior = _log_prior(found, family.name, pattern.name)
    return Cause(family, pattern.name, pattern.mixing, effect.shape_values(), coordinates, prior)


def _log_prior(found: Explanation, name: str, place: str) -> float:
    """Return the prior that the search gives an effect at a place."""
    assert found.screening is not None  # nothing interrupted it
    priors = {hypothesis.cause.key: hypothesis.cause.log_prior for hypothesis in found.screening.hypotheses}
    known: Mapping[tuple[str, str], float] = {**priors, **{cause.key: cause.log_prior for cause in found.best.causes}}
    return known.get((name, place), min(priors.values()))
