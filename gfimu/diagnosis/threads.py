"""Work on several segments at once."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any, TypeVar

from threadpoolctl import ThreadpoolController

__all__ = ["over_segments"]

Result = TypeVar("Result")


def over_segments(work: Callable[..., Result], *columns: Iterable[Any]) -> list[Result]:
    """Call ``work`` with one item of each column per segment, on threads where there are several segments.

    Segments share nothing that changes, and their algebra leaves the interpreter free.
    """
    rows = list(zip(*columns, strict=True))
    workers = min(len(rows), os.cpu_count() or 1)
    if workers < 2:
        return [work(*row) for row in rows]
    # Each segment's algebra on threads of its own as well would take half as long again.
    with _thread_pools().limit(limits=1, user_api="blas"), ThreadPoolExecutor(workers) as pool:
        return list(pool.map(lambda row: work(*row), rows))


@cache
def _thread_pools() -> ThreadpoolController:
    return ThreadpoolController()
