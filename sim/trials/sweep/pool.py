"""Workers of a campaign as processes of this machine."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.connection import Connection
from multiprocessing.queues import SimpleQueue
from typing import Any, TypeVar

from gfimu.base.child_process import environment
from gfimu.base.errors import GfimuError
from sim.trials.sweep.engine import Workers

__all__ = ["open_pool"]

T = TypeVar("T")

_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""One thread of linear algebra each: as many in every worker would wait for each other. NumPy reads it once."""


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
        environment(**_ONE_THREAD),
        _Pool(count, context, initializer=_begin, initargs=(watched, shares)) as pool,
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


class _Pool(ProcessPoolExecutor):
    """A pool whose workers leave Ctrl-C, which a terminal sends to every process, to the campaign from the start.

    Workers start under `submit`, and a process begins with the blocked signals of the thread that starts it. SIGTERM
    waits meanwhile, because a worker that its campaign leaves half-started prints a traceback.
    """

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        if not hasattr(signal, "pthread_sigmask"):
            return super().submit(fn, *args, **kwargs)
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
        try:
            return super().submit(fn, *args, **kwargs)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _shares(workers: int) -> list[set[int]]:
    """Deal the processors out to the workers, so that what one does on several of them takes none from another."""
    if not hasattr(os, "sched_getaffinity"):
        return [set() for _ in range(workers)]
    mine = sorted(os.sched_getaffinity(0))
    if workers >= len(mine):
        return [{mine[worker % len(mine)]} for worker in range(workers)]
    return [set(mine[worker::workers]) for worker in range(workers)]


def _begin(watched: Connection, shares: SimpleQueue[set[int]]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # where `_Pool` can't block it: the campaign ends its workers
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})
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
