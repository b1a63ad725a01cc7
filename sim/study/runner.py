"""Run the cases of a study through an executor and append their outcomes to a file that can be resumed."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, as_completed
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from sim.study.baselines import run_baseline
from sim.study.blame import blame_of, is_miss
from sim.study.cases import Case
from sim.study.outcome import run_case
from sim.study.outcome_file import read_outcomes
from sim.sweep.executors import open_executor

__all__ = ["run_study"]

_SUSPECTS = 8  # cases a broken pool may have been at: more than it has workers, and few to run one by one
_Work = Callable[[Case, str], dict[str, Any]]


def run_study(
    cases: Sequence[Case],
    out: str | Path,
    executor: Executor,
    *,
    source: str = "",
    method: str = "",
    blame: bool = False,
    tell: Callable[[dict[str, Any]], None] | None = None,
) -> int:
    """Run the cases whose outcome is not yet in the file; return how many were run.

    Parameters
    ----------
    cases : sequence of Case
        The cases.
    out : str or Path
        File of outcomes, one line of JSON each; appended to.
    executor : Executor
        Where the cases run.
    source : str
        Generator of the worlds, as in `draw_world`.
    method : str
        A simpler method instead of the diagnosis (`sim.study.baselines.METHODS`).
    blame : bool
        Whether each miss is fitted again from the truth (`sim.study.blame`), which takes as long as the case did.
    tell : callable, optional
        Called with each outcome as it comes.
    """
    file = Path(out)
    file.parent.mkdir(parents=True, exist_ok=True)
    work: _Work = partial(run_baseline, method) if method else partial(_run_and_blame, blame=blame)
    done = {(outcome["key"], outcome["source"], outcome.get("method", "")) for outcome in read_outcomes(file)}
    open_cases = [case for case in cases if (case.key, source or "sim.campaign", method) not in done]
    torn = file.exists() and file.stat().st_size > 0 and not file.read_bytes().endswith(b"\n")
    with file.open("a", encoding="utf-8") as lines:
        if torn:
            lines.write("\n")
        for outcome in _outcomes(executor, work, open_cases, source):
            lines.write(json.dumps(_finite(outcome), allow_nan=False) + "\n")
            lines.flush()
            if tell is not None:
                tell(outcome)
    return len(open_cases)


def _run_and_blame(case: Case, source: str, *, blame: bool) -> dict[str, Any]:
    outcome = run_case(case, source)
    if blame and is_miss(outcome):
        outcome |= blame_of(case, source, outcome)
    return outcome


def _outcomes(executor: Executor, work: _Work, cases: Sequence[Case], source: str) -> Iterator[dict[str, Any]]:
    """Yield outcomes as they come; where a worker was killed, which breaks its pool, go on in pools of our own.

    The cases that it may have been at are run again one by one: the one that kills its worker again says so.
    """
    futures = {executor.submit(work, case, source): case for case in cases}
    broken = []
    for future in as_completed(futures):
        try:
            yield future.result()
        except BrokenExecutor:
            broken.append(futures[future])
    lost = [case for case in cases if case in broken]
    for case in lost[:_SUSPECTS]:
        with open_executor(1) as alone:
            try:
                outcome = alone.submit(work, case, source).result()
            except BrokenExecutor:
                outcome = _died(case, source)
        yield outcome
    if lost[_SUSPECTS:]:
        with open_executor(getattr(executor, "_max_workers", 1)) as again:
            yield from _outcomes(again, work, lost[_SUSPECTS:], source)


def _died(case: Case, source: str) -> dict[str, Any]:
    """Return the row of a case whose worker was killed twice."""
    what = {"verdict": "error", "error": "the worker process was killed (out of memory?)", "causes": []}
    nothing: dict[str, Any] = {"share_of_excess_removed": None, "unexplained": False, "signature": "", "noise": {}}
    times = {"wall_s": 0.0, "processor_s": 0.0}
    return {"key": case.key, "source": source or "sim.campaign", **case.to_dict(), **what, **nothing, **times}


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not np.isfinite(value) else value
