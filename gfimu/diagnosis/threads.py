"""Work on several segments, or on several sets of causes, at once."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from functools import cache
from typing import Any, TypeVar

from threadpoolctl import ThreadpoolController

__all__ = ["at_once", "one_blas_thread", "over_segments"]

Item = TypeVar("Item")
Result = TypeVar("Result")


def over_segments(work: Callable[..., Result], *columns: Iterable[Any]) -> list[Result]:
    """Call ``work`` with one item of each column per segment, on threads where there are several segments.

    Segments share nothing that changes, and their algebra leaves the interpreter free.
    """
    rows = list(zip(*columns, strict=True))
    if len(rows) < 2:
        return [work(*row) for row in rows]
    return at_once(lambda row: work(*row), rows)


def at_once(work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """Call ``work`` with each item, on as many threads as there are processors; results in the order of the items."""
    workers = min(len(items), os.cpu_count() or 1)
    if workers < 2:
        return [work(item) for item in items]
    with one_blas_thread(), ThreadPoolExecutor(workers) as pool:
        return list(pool.map(work, items))


def one_blas_thread() -> AbstractContextManager[Any]:
    """Keep linear algebra to one thread while the context lasts.

    Matrices of a thousand rows gain little from several, which wait for each other at full speed: a diagnosis on two
    processors takes a quarter longer with them.
    """
    return _thread_pools().limit(limits=1, user_api="blas")  # type: ignore[no-any-return]


@cache
def _thread_pools() -> ThreadpoolController:
    return ThreadpoolController()
