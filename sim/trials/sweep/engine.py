"""Run the batches of a campaign that its folder lacks: whatever is killed, nothing is lost and nothing runs twice.

A batch is always in exactly one place: waiting, held by the executor, put aside as a suspect, or yielded to be written.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Generator, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import AbstractContextManager, closing
from dataclasses import dataclass
from typing import Any

from threadpoolctl import threadpool_limits

from gfimu.base.errors import GfimuError
from sim.trials.sweep.batch_work import prepared
from sim.trials.sweep.dataset import Dataset
from sim.trials.sweep.design import Case, Design
from sim.trials.sweep.pace import running
from sim.trials.sweep.plan import PlanFile

__all__ = ["Work", "Workers", "run_campaign"]

Work = Callable[[Case], Mapping[str, Any]]
"""What a case does: it returns its results by name, with units in the names; a `GfimuError` is a failed case."""


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


OpenWorkers = Callable[[], AbstractContextManager[Workers]]
"""Opens the workers, which are closed when the campaign ends or the executor breaks."""

Rows = list[dict[str, Any]]

_TRIES = 3  # workers that may die under a batch before it is reported
_AHEAD = 2  # batches per worker that the executor holds, so that none waits for the next
_LOOK = 2.0  # numerical: s, after which workers that came or went are noticed though no batch ended


def run_campaign(
    dataset: Dataset,
    work: Work,
    open_workers: OpenWorkers,
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
    open_workers : callable
        Opens the workers, such as `sim.trials.sweep.executors.open_pool` with its count.
    progress : callable, optional
        Called with the number of cases that are there and of all cases, first before anything is run.

    Raises
    ------
    GfimuError
        If a worker can't run batches at all.
    """
    design = Design(dataset.plan)
    report = progress or (lambda done, total: None)
    present = set(dataset.present())
    missing = [batch for batch in design.batches() if batch not in present]
    done = len(design) - sum(map(len, missing))
    report(done, len(design))
    ran = 0
    # Closed here whatever happens, so that an error or Ctrl-C ends the workers before it is reported.
    with closing(_Batches(dataset.plan, work, missing).results(open_workers)) as results, running(dataset) as note:
        for batch, rows in results:
            dataset.write(batch, rows)
            ran += len(batch)
            note(ran)
            report(done + ran, len(design))
    return ran


def run_batch(plan: PlanFile, work: Work, first: int, stop: int) -> Rows:
    """Run the cases of a batch in this process, with one thread of linear algebra, and return a row each."""
    design = Design(plan)
    with threadpool_limits(1):
        work = prepared(work, [design[number] for number in range(first, stop)])
        return [_row(design[number], work) for number in range(first, stop)]


def _row(case: Case, work: Work) -> dict[str, Any]:
    """Return the row of a case: number, seed, factors, failure (empty for none), results."""
    row: dict[str, Any] = {"case": case.number, "seed": case.seed, **case.values, "failure": ""}
    try:
        return row | dict(work(case))
    except GfimuError as error:
        return row | {"failure": _first_line(str(error))}
    except Exception as error:  # noqa: BLE001 - a failed case is a row, not the end of the campaign
        return row | {"failure": _first_line(f"{type(error).__name__}: {error}")}


def _first_line(text: str) -> str:
    return next(iter(text.splitlines()), "")


class _Batches:
    """The batches of one call, each in exactly one place."""

    def __init__(self, plan: PlanFile, work: Work, missing: list[range]) -> None:
        self._plan, self._work = plan, work
        self._waiting = deque(missing)
        self._held: dict[Future[Rows], range] = {}
        # A worker died under these, or under a batch beside them. They run alone when nothing else does: the one
        # whose worker dies again is the cause.
        self._suspects: deque[range] = deque()
        self._deaths: Counter[range] = Counter()

    def results(self, open_workers: OpenWorkers) -> Generator[tuple[range, Rows], None, None]:
        """Yield batches with their rows as they come."""
        while self._waiting or self._suspects:
            with open_workers() as workers:
                broken = False
                while self._held or (not broken and (self._waiting or self._suspects)):
                    broken = broken or not self._submitted(workers)
                    finished, _ = wait(self._held, _LOOK, FIRST_COMPLETED)
                    for future in finished:
                        if future.cancelled() or future.exception() is not None:
                            yield from self._lost(future, workers)
                        else:
                            yield self._held.pop(future), future.result()

    def _submitted(self, workers: Workers) -> bool:
        """Hand batches to the executor as far as it can use them; return whether it takes them."""
        try:
            while len(self._held) < _AHEAD * workers.count() and self._waiting:
                self._submit(workers, self._waiting)
            if self._suspects and not self._held:
                self._submit(workers, self._suspects)
        except BrokenExecutor:
            return False
        return True

    def _submit(self, workers: Workers, queue: deque[range]) -> None:
        batch = queue[0]
        # An executor that broke meanwhile refuses it: then the batch stays in its queue.
        future = workers.executor.submit(run_batch, self._plan, self._work, batch.start, batch.stop)
        self._held[future] = batch
        queue.popleft()

    def _lost(self, future: Future[Rows], workers: Workers) -> Iterator[tuple[range, Rows]]:
        """Put a batch back whose rows did not come, or report it."""
        error = CancelledError() if future.cancelled() else future.exception()
        deaths = None if error is None else workers.deaths(error)
        if deaths is None:
            raise GfimuError(
                f"a worker can't run a batch ({type(error).__name__}: {_first_line(str(error))}); "
                "it needs the same gfimu as this process"
            ) from error
        batch = self._held.pop(future)
        alone = self._deaths[batch] > 0
        self._deaths[batch] += deaths
        if alone and self._deaths[batch] >= _TRIES:
            yield batch, self._rows_of_lost(batch)
        elif self._deaths[batch]:
            self._suspects.append(batch)
        else:
            self._waiting.appendleft(batch)

    def _rows_of_lost(self, batch: range) -> Rows:
        """Return the rows of a batch whose worker died each time."""
        failure = f"the worker process died {self._deaths[batch]} times in this batch (out of memory?)"
        design = Design(self._plan)
        cases = [design[number] for number in batch]
        return [{"case": case.number, "seed": case.seed, **case.values, "failure": failure} for case in cases]
