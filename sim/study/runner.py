"""Run the cases of a study through an executor and append their outcomes to a file that can be resumed."""

from __future__ import annotations

import json
import lzma
import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from functools import partial
from multiprocessing.queues import SimpleQueue
from pathlib import Path
from typing import Any

import numpy as np

from gfimu.atomic_file import atomic_path
from gfimu.errors import InputError
from sim.study.baselines import run_baseline
from sim.study.cases import Case
from sim.study.outcome import run_case

__all__ = ["keep_outcomes", "open_executor", "read_outcomes", "run_study"]

_WATCH_PERIOD = 2.0
_PACKED = ".xz"
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


def read_outcomes(path: str | Path) -> list[dict[str, Any]]:
    """Read the outcomes of a study, packed (``.xz``) or not; a last line cut off by an interruption is left out."""
    file = Path(path)
    if not file.exists():
        return []
    try:
        packed = file.suffix == _PACKED
        text = lzma.decompress(file.read_bytes()).decode() if packed else file.read_text(encoding="utf-8")
    except (lzma.LZMAError, UnicodeDecodeError):
        raise InputError(f"{file}: not a file of outcomes; give one that `python -m sim.study run` wrote") from None
    outcomes = []
    for line in text.splitlines():
        try:
            outcomes.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return outcomes


def keep_outcomes(outcomes: Sequence[Mapping[str, Any]], path: str | Path) -> Path:
    """Write outcomes packed (``.xz``), numbers to six digits, to make the tables again from; return the path."""
    lines = [json.dumps(_rounded(outcome)) + "\n" for outcome in outcomes]
    file = Path(path)
    file.parent.mkdir(parents=True, exist_ok=True)
    with atomic_path(file) as temporary:
        temporary.write_bytes(lzma.compress("".join(lines).encode(), preset=9))
    return file


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def run_study(
    cases: Sequence[Case],
    out: str | Path,
    executor: Executor,
    *,
    source: str = "",
    method: str = "",
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
    tell : callable, optional
        Called with each outcome as it comes.
    """
    file = Path(out)
    file.parent.mkdir(parents=True, exist_ok=True)
    work = partial(run_baseline, method) if method else run_case
    done = {(outcome["key"], outcome["source"], outcome.get("method", "")) for outcome in read_outcomes(file)}
    open_cases = [case for case in cases if (case.key, source or "sim.campaign", method) not in done]
    torn = file.exists() and file.stat().st_size > 0 and not file.read_bytes().endswith(b"\n")
    with file.open("a", encoding="utf-8") as lines:
        if torn:
            lines.write("\n")
        for future in as_completed([executor.submit(work, case, source) for case in open_cases]):
            outcome = future.result()
            lines.write(json.dumps(_finite(outcome), allow_nan=False) + "\n")
            lines.flush()
            if tell is not None:
                tell(outcome)
    return len(open_cases)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not np.isfinite(value) else value
