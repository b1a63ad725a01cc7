"""Executors of a campaign: a process pool of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import multiprocessing
import os
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.queues import SimpleQueue

from gfimu.errors import InputError

__all__ = ["open_executor", "processors"]

_WATCH_PERIOD = 2.0  # s
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def processors() -> int:
    """Return how many processors this process has."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


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
    mine = sorted(os.sched_getaffinity(0))
    if workers >= len(mine):
        return [{mine[worker % len(mine)]} for worker in range(workers)]
    return [set(mine[worker::workers]) for worker in range(workers)]


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
