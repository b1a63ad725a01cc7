"""Workers of a campaign as processes of this machine."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.connection import Connection
from multiprocessing.queues import SimpleQueue

from gfimu.errors import GfimuError
from sim.sweep.engine import Workers

__all__ = ["open_pool"]

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@contextmanager
def open_pool(count: int) -> Iterator[Workers]:
    """Open a pool of so many processes; an error, or Ctrl-C, ends them at once.

    Raises
    ------
    GfimuError
        If a process ends as soon as it starts.
    """
    context = multiprocessing.get_context("spawn")
    shares = context.SimpleQueue()
    for share in _shares(count):
        shares.put(share)
    # The workers watch the other end: it closes when the campaign is given up, and when its process is killed.
    watched, kept = context.Pipe(duplex=False)
    with (
        watched,
        kept,
        _one_thread(),
        ProcessPoolExecutor(count, context, initializer=_begin, initargs=(watched, shares)) as pool,
    ):
        try:
            pool.submit(_ready).result()
        except BrokenExecutor:
            raise GfimuError(
                "worker processes end at their start; a script has to call gfimu below if __name__ == '__main__':"
            ) from None
        try:
            yield Workers(pool, lambda: count, lambda error: 1 if isinstance(error, BrokenExecutor) else None)
        except BaseException:
            kept.close()
            pool.shutdown(cancel_futures=True)
            raise


@contextmanager
def _one_thread() -> Iterator[None]:
    """Give processes that start one thread of linear algebra each, as many in every worker would wait for each other.

    NumPy reads these variables when it is first imported.
    """
    added = [variable for variable in _ONE_THREAD if variable not in os.environ]
    os.environ.update(dict.fromkeys(added, "1"))
    try:
        yield
    finally:
        for variable in added:
            os.environ.pop(variable, None)


def _shares(workers: int) -> list[set[int]]:
    """Deal the processors out to the workers, so that what one does on several of them takes none from another."""
    if not hasattr(os, "sched_getaffinity"):
        return [set() for _ in range(workers)]
    mine = sorted(os.sched_getaffinity(0))
    if workers >= len(mine):
        return [{mine[worker % len(mine)]} for worker in range(workers)]
    return [set(mine[worker::workers]) for worker in range(workers)]


def _begin(watched: Connection, shares: SimpleQueue[set[int]]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C in a terminal reaches all processes; the campaign ends them
    share = shares.get()
    if share:
        os.sched_setaffinity(0, share)

    def watch() -> None:
        try:
            watched.recv_bytes()
        except (EOFError, OSError):
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _ready() -> None:
    """Show that a worker has started."""
