"""Run the cases of a study through an executor and append their outcomes to a file that can be resumed."""

from __future__ import annotations

import json
import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from functools import partial
from multiprocessing.queues import SimpleQueue
from pathlib import Path
from typing import Any

import numpy as np

from gfimu.errors import InputError
from sim.study.baselines import run_baseline
from sim.study.blame import blame_of, is_miss
from sim.study.cases import Case
from sim.study.outcome import run_case
from sim.study.outcome_file import read_outcomes

__all__ = ["open_executor", "run_study"]

_WATCH_PERIOD = 2.0
_SUSPECTS = 8  # cases a broken pool may have been at: more than it has workers, and few to run one by one
_Work = Callable[[Case, str], dict[str, Any]]
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@contextmanager
def open_executor(workers: int, cluster: str = "") -> Iterator[Executor]:
    """Open a process pool, or the executor of a Dask cluster at an address such as ``tcp://host:8786``."""
    if cluster:
        try:
            from distributed import Client
        except ImportError:
            raise InputError('a cluster needs Dask: pip install "gfimu[cluster]"') from None
        with Client(cluster) as client, client.get_executor() as executor:
            yield executor
        return
    # Linear algebra on many threads collapses when every worker does it; NumPy reads this when it is first imported.
    for variable in _ONE_THREAD:
        os.environ.setdefault(variable, "1")
    context = multiprocessing.get_context("spawn")
    shares = context.SimpleQueue()
    for share in _shares(workers):
        shares.put(share)
    with ProcessPoolExecutor(workers, context, initializer=_begin, initargs=(os.getpid(), shares)) as pool:
        yield pool


def _shares(workers: int) -> list[set[int]]:
    """Deal the processors out to the workers, so that what one does on several of them takes none from another."""
    if not hasattr(os, "sched_getaffinity"):
        return [set() for _ in range(workers)]
    processors = sorted(os.sched_getaffinity(0))
    if workers >= len(processors):
        return [{processors[worker % len(processors)]} for worker in range(workers)]
    return [set(processors[worker::workers]) for worker in range(workers)]


def _begin(parent: int, shares: SimpleQueue[set[int]]) -> None:
    share = shares.get()
    if share:
        os.sched_setaffinity(0, share)
    _end_with_parent(parent)


def _end_with_parent(parent: int) -> None:
    """Let a worker end soon after the study was killed; it would go on with its case, and hold a core, otherwise."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_WATCH_PERIOD)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


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
