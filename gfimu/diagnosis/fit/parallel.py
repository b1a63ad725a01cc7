"""Work on several segments, or on several sets of causes, at once."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import pickle
import signal
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from contextvars import copy_context
from functools import cache
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar

from threadpoolctl import ThreadpoolController

from gfimu.diagnosis.time_limit import expire

__all__ = ["each_apart", "one_blas_thread", "over_segments"]

Item = TypeVar("Item")
Result = TypeVar("Result")


def over_segments(work: Callable[..., Result], *columns: Iterable[Any]) -> list[Result]:
    """Call ``work`` with one item of each column per segment, on threads where there are several segments.

    Segments share nothing that changes, and their algebra leaves the interpreter free.
    """
    rows = list(zip(*columns, strict=True))
    workers = min(len(rows), _processors())
    if workers < 2:
        return [work(*row) for row in rows]
    return _on_threads(lambda row: work(*row), rows, workers)


def each_apart(
    work: Callable[[Item], Result], items: Sequence[Item], *, keep: Callable[[Result], None] | None = None
) -> list[Result]:
    """Call ``work``, which changes nothing, with each item; results in the order of the items.

    ``keep`` gets each result as soon as it is there: an interrupt takes away only what is not yet done.

    Where the system can split a process, on as many as there are processors: threads would wait for the interpreter
    half of their time. What ``work`` needs is there already in a process that is split off; only results are sent, and
    one that can't be sent is computed here again.

    Raises
    ------
    RuntimeError
        If a process ends without an answer, as where memory is short.
    """
    kept = keep or (lambda result: None)

    def here(item: Item) -> Result:
        result = work(item)
        kept(result)
        return result

    workers = min(len(items), _processors())
    if workers < 2:
        return [here(item) for item in items]
    if sys.platform != "linux":  # a process can't be split, or must not be
        return _on_threads(here, items, workers)
    # Items are dealt out while they are done, as some take much longer than others.
    todo = iter(range(len(items)))
    results: dict[int, Result] = {}
    processes: list[_Apart] = []
    busy: list[Connection] = []
    try:
        for process in _split_off(work, items, workers):
            processes.append(process)
            process.pipe.send(next(todo))
            busy.append(process.pipe)
        while busy:
            for pipe in wait(busy):
                assert isinstance(pipe, Connection)
                number, result = _answer(pipe, work, items)
                results[number] = result
                kept(result)
                following = next(todo, None)
                pipe.send(following)
                if following is None:
                    busy.remove(pipe)
    finally:
        for process in processes:
            process.end()
    return [results[index] if index in results else here(item) for index, item in enumerate(items)]


def _split_off(work: Callable[[Item], Result], items: Sequence[Item], most: int) -> Iterator[_Apart]:
    """Start processes, as many as the system allows."""
    for _ in range(most):
        try:
            process = _Apart(work, items)
        except OSError:  # no more processes, or no memory for one
            return
        yield process


def _answer(pipe: Connection, work: Callable[[Item], Result], items: Sequence[Item]) -> tuple[int, Result]:
    """Return the number and the result of what a process has done; computed here where it can't be sent."""
    try:
        number, result, error = pipe.recv()
    except EOFError:
        raise RuntimeError("a process of the diagnosis ended without an answer; is there memory enough?") from None
    if isinstance(error, _UnsendableError):
        return number, work(items[number])
    if error is not None:
        raise error
    return number, result


def _on_threads(work: Callable[[Item], Result], items: Sequence[Item], workers: int) -> list[Result]:
    contexts = [copy_context() for _ in items]
    with one_blas_thread(), ThreadPoolExecutor(workers) as pool:
        try:
            return list(pool.map(lambda context, item: context.run(work, item), contexts, items))
        except KeyboardInterrupt:
            expire()
            raise


class _UnsendableError(Exception):
    """A result that no pipe takes, as where an effect of another simulator is made of local functions."""


class _Apart:
    """A process split off this one that calls ``work`` with the items whose numbers it is sent.

    Parameters
    ----------
    work, items
        As `each_apart` takes them.
    """

    def __init__(self, work: Callable[[Item], Result], items: Sequence[Item]) -> None:
        context = multiprocessing.get_context("fork")
        self.pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(work, items, theirs, os.getpid()), daemon=True)
        with warnings.catch_warnings():
            # Other threads (a progress bar) hold no lock that the algebra asks for.
            warnings.simplefilter("ignore", DeprecationWarning)
            self._process.start()
        theirs.close()

    def end(self) -> None:
        """End the process; one that is still at work is stopped."""
        self.pipe.close()
        self._process.join(timeout=0.1)
        if self._process.is_alive():
            self._process.terminate()
            self._process.join()
        self._process.close()


def _ends_with(parent: int) -> bool:
    """Let the system end this process as soon as its parent has ended, however that was; False where it has already."""
    set_parent_death_signal = 1  # of prctl (Linux)
    ctypes.CDLL(None).prctl(set_parent_death_signal, signal.SIGKILL)
    return os.getppid() == parent


def _serve(work: Callable[[Item], Result], items: Sequence[Item], pipe: Connection, parent: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that this was split off from ends it
    if not _ends_with(parent):
        return
    with one_blas_thread():
        while True:
            try:
                number = pipe.recv()
            except EOFError:
                return
            if number is None:
                return
            try:
                answer: tuple[int, Result | None, BaseException | None] = (number, work(items[number]), None)
            except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001 - raised again where it is received
                answer = (number, None, error)
            try:
                pipe.send(answer)
            except (pickle.PicklingError, AttributeError, TypeError):
                pipe.send((number, None, _UnsendableError()))


def _processors() -> int:
    """Return how many processors there are for this process; one where it is itself one of several."""
    if multiprocessing.current_process().daemon:
        return 1
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def one_blas_thread() -> AbstractContextManager[Any]:
    """Keep linear algebra to one thread while the context lasts.

    Matrices of a thousand rows gain little from several, which wait for each other at full speed: a diagnosis on two
    processors takes a quarter longer with them.
    """
    return _thread_pools().limit(limits=1, user_api="blas")  # type: ignore[no-any-return]


@cache
def _thread_pools() -> ThreadpoolController:
    return ThreadpoolController()
