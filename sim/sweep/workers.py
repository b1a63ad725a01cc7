"""What a campaign knows of the workers that run its batches, whichever engine they belong to."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass

__all__ = ["Workers"]


@dataclass(frozen=True)
class Workers:
    """An executor, and what a campaign must know of the workers behind it.

    An executor that can't go on raises `BrokenExecutor`, from ``count``, ``submit`` or a future; the campaign then
    opens another one.

    Parameters
    ----------
    executor : Executor
        Runs the batches.
    count : callable
        Returns how many batches run at once; of a cluster that may change.
    deaths : callable
        Returns how many workers died under a batch, by the error of its future: 0 where it was lost for another
        reason, None where the error says nothing of workers.
    """

    executor: Executor
    count: Callable[[], int]
    deaths: Callable[[BaseException], int | None]
