"""Run the batches of a campaign that its folder lacks: whatever is killed, nothing is lost and nothing runs twice."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import AbstractContextManager
from typing import Any

from gfimu.errors import GfimuError
from sim.sweep.dataset import Dataset
from sim.sweep.design import Case, Design
from sim.sweep.plan import PlanFile
from sim.sweep.together import prepared

__all__ = ["Work", "run_campaign"]

Work = Callable[[Case], Mapping[str, Any]]
"""What a case does: it returns its results by name, with units in the names; a `GfimuError` is a failed case."""

OpenExecutor = Callable[[int], AbstractContextManager[Executor]]
"""Opens an executor of so many workers."""

_TRIES = 3  # of a batch whose worker dies
_AHEAD = 2  # batches per worker that wait in the pool


def run_campaign(
    dataset: Dataset,
    work: Work,
    open_executor: OpenExecutor,
    workers: int,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> int:
    """Run the batches that are not yet in the dataset; return how many cases were run.

    Parameters
    ----------
    dataset : Dataset
        The campaign's folder.
    work : callable
        What each case does; a function of a module, so that other processes can find it.
    open_executor : callable
        Opens an executor of a number of workers, which is closed when the campaign ends or a worker died.
    workers : int
        Worker processes.
    progress : callable, optional
        Called with the number of cases that are there and of all cases.
    """
    design = Design(dataset.plan)
    tell = progress or (lambda done, total: None)
    missing = [batch for batch in design.batches() if not dataset.shard(batch).exists()]
    done = len(design) - sum(map(len, missing))
    tell(done, len(design))
    ran = 0
    for batch, rows in _results(dataset.plan, work, missing, open_executor, workers):
        dataset.write(batch, rows)
        ran += len(batch)
        tell(done + ran, len(design))
    return ran


def run_batch(plan: PlanFile, work: Work, first: int, stop: int) -> list[dict[str, Any]]:
    """Run the cases of a batch in this process and return a row each."""
    design = Design(plan)
    work = prepared(work, [design[number] for number in range(first, stop)])
    return [_row(design[number], work) for number in range(first, stop)]


def _row(case: Case, work: Work) -> dict[str, Any]:
    """Return the row of a case: number, seed, factors, failure (empty for none), results."""
    row: dict[str, Any] = {"case": case.number, "seed": case.seed, **case.values, "failure": ""}
    try:
        return row | dict(work(case))
    except GfimuError as error:
        return row | {"failure": str(error).splitlines()[0]}
    except Exception as error:  # noqa: BLE001 - a failed case is a row, not the end of the campaign
        return row | {"failure": f"{type(error).__name__}: {error}".splitlines()[0]}


def _results(
    plan: PlanFile, work: Work, missing: list[range], open_executor: OpenExecutor, workers: int
) -> Iterator[tuple[range, list[dict[str, Any]]]]:
    """Yield batches with their rows as they come; one whose worker dies is tried again, alone.

    When a worker dies its pool ends, and any batch that it held may be the cause.
    """
    waiting, suspects, tries = list(missing), list[range](), dict[range, int]()
    while waiting or suspects:
        # Suspects run one at a time: the one that kills its worker again is the cause.
        alone = bool(suspects)
        queue = suspects[:1] if alone else waiting
        held: dict[Future[list[dict[str, Any]]], range] = {}
        try:
            with open_executor(1 if alone else workers) as executor:
                for _ in range(1 if alone else _AHEAD * workers):
                    _submit(executor, plan, work, queue, held)
                while held:
                    finished, _ = wait(held, return_when=FIRST_COMPLETED)
                    for future in finished:
                        rows = future.result()  # raises where the pool is broken
                        batch = held.pop(future)
                        if alone:
                            suspects.remove(batch)
                        yield batch, rows
                        if not alone:
                            _submit(executor, plan, work, queue, held)
        except Exception as error:
            if not _died(error):
                raise
            for batch in held.values():
                tries[batch] = tries.get(batch, 0) + 1
            suspects += [batch for batch in held.values() if batch not in suspects]
            for batch in [batch for batch in suspects if tries[batch] >= _TRIES]:
                suspects.remove(batch)
                yield batch, run_lost(plan, batch)


def _died(error: Exception) -> bool:
    """Whether an error says that a worker died: that of a process pool, or Dask's after its own tries."""
    return isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker"


def _submit(
    executor: Executor,
    plan: PlanFile,
    work: Work,
    queue: list[range],
    held: dict[Future[list[dict[str, Any]]], range],
) -> None:
    if queue:
        batch = queue[0]
        # A pool that broke meanwhile refuses it: then the batch stays in the queue.
        held[executor.submit(run_batch, plan, work, batch.start, batch.stop)] = batch
        queue.pop(0)


def run_lost(plan: PlanFile, batch: range) -> list[dict[str, Any]]:
    """Return the rows of a batch whose worker died each time."""
    failure = f"the worker process died {_TRIES} times in this batch (out of memory?)"
    design = Design(plan)
    cases = [design[number] for number in batch]
    return [{"case": case.number, "seed": case.seed, **case.values, "failure": failure} for case in cases]
