"""A study as a campaign: the plan that lists its worlds, and what each of them does.

The plan is a grid of one factor, ``world``, whose values are the worlds themselves: ``STUDY/SEED``, or
``STUDY/SEED FILE.py:FUNCTION`` where another generator draws it. So a study is resumed, and survives a worker that
dies, as any campaign does (`sim.trials.sweep`).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import msgspec
import numpy as np

from gfimu.base.errors import InputError
from gfimu.model.user_code import user_function
from sim.trials.study.baselines import run_baseline
from sim.trials.study.blame import blame_of, is_miss
from sim.trials.study.cases import find_case, study_cases
from sim.trials.study.gate import GATE, gate_cases
from sim.trials.study.outcome import run_case
from sim.trials.study.tally import brief
from sim.trials.sweep.design import Case
from sim.trials.sweep.plan import PlanFile

__all__ = ["study_plan", "study_work"]


def study_plan(
    studies: Iterable[str], *, first: int | None = None, source: str = "", method: str = "", blame: bool = False
) -> PlanFile:
    """Return the plan of some studies.

    Parameters
    ----------
    studies : iterable of str
        Names of studies, or ``gate``.
    first : int, optional
        Only so many cases of each.
    source : str
        Generator of the worlds, as in `draw_world`; the gate has its own.
    method : str
        A simpler method instead of the diagnosis (`sim.trials.study.baselines.METHODS`).
    blame : bool
        Whether each miss is fitted again from the truth (`sim.trials.study.blame`), which takes as long as the case
        did.

    Raises
    ------
    InputError
        If there is no such study or generator.
    """
    worlds: dict[str, None] = {}
    for study in studies:
        if study == GATE and source:
            raise InputError(f"{GATE} has generators of its own; leave out --world")
        cases = gate_cases(first) if study == GATE else [(case, source) for case in study_cases(study, first)]
        worlds |= {f"{case.key} {own}".strip(): None for case, own in cases}
    for generator in {world.partition(" ")[2] for world in worlds} - {""}:
        user_function(generator, "a generator")
    return PlanFile({"world": list(worlds), "method": [method], "blame": [blame]}, kind="study", batch=1)


def study_work(case: Case) -> dict[str, Any]:
    """Run a case of a study's plan; the whole outcome is one column of JSON, as its parameters differ by effect."""
    key, _, source = str(case.values["world"]).partition(" ")
    chosen, method = find_case(key), str(case.values["method"])
    outcome = run_baseline(method, chosen, source) if method else run_case(chosen, source)
    if case.values["blame"] and not method and is_miss(outcome):
        outcome |= blame_of(chosen, source, outcome)
    # Numbers of NumPy become plain ones, and what is not finite becomes null.
    text = msgspec.json.encode(outcome, enc_hook=np.generic.item).decode()
    return {"seed": chosen.seed, **brief(outcome), "processor_s": outcome["processor_s"], "outcome": text}
