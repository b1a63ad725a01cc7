"""Where an unknown cause is: located terms, what the residual shows without any fit, likely mistakes of the files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gfimu.diagnosis.criticism.views.rigid_motion import rigid_motion
from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.learn import predicted_by_reference
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.localise import localise
from gfimu.diagnosis.verdict.gate import NOT_THIS_UNIT
from gfimu.diagnosis.verdict.likely_mistakes import likely_mistake
from gfimu.diagnosis.verdict.located import located
from gfimu.diagnosis.verdict.parts import Located
from gfimu.diagnosis.verdict.verdict import Diagnosis
from gfimu.model.world_model import is_linear

__all__ = ["with_place"]

_SEARCHED = 2  # numerical: stretches in which terms are searched
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
        more = more[0].upper() + more[1:]
    first, *others = found.sentences
    return replace(found, unexplained=unexplained, sentences=(first, more, *others) if more else found.sentences)


def _described(stretches: Sequence[Stretch], policy: Policy) -> tuple[Located, ...]:
    """Return where something without a name is, searched in the first stretches of the recordings."""
    some = stretches[:_SEARCHED]
    if some[0].model.placed(some[0].run.mounting) is None:
        return ()
    try:
        return located(localise(some, policy), policy)
    except np.linalg.LinAlgError:  # a run whose equations have no solution has no place either
        return ()
