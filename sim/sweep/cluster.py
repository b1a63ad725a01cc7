"""Workers of a campaign on a Dask cluster, whichever way it was started."""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from gfimu.errors import InputError
from sim.sweep.workers import Workers

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["open_cluster"]

_CONNECT = "10s"  # numerical: longest wait for a scheduler; it answers within milliseconds
_ASK = 1.0  # numerical: s between questions for the number of workers


@contextmanager
def open_cluster(address: str) -> Iterator[Workers]:
    """Open the workers of a cluster by the address of its scheduler, such as ``tcp://host:8786``.

    What is queued is cancelled when the campaign ends.

    Raises
    ------
    InputError
        If Dask is not installed, or no scheduler answers.
    """
    client = _client(address)
    executor = _ClusterExecutor(client)
    try:
        yield Workers(executor, executor.count, _deaths)
    finally:
        executor.shutdown(wait=False)
        client.close()


class _ClusterExecutor(Executor):
    """Dask's own executor, which says so when the connection is lost, and how many threads there are."""

    def __init__(self, client: Client) -> None:
        self._client, self._executor = client, client.get_executor(pure=False)
        self._threads, self._asked = 0, float("-inf")

    def submit(self, function: Any, /, *values: Any, **named: Any) -> Future[Any]:
        self._check()
        found: Future[Any] = self._executor.submit(function, *values, **named)
        return found

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        if self._client.status == "running":
            self._executor.shutdown(wait=wait and not cancel_futures)

    def count(self) -> int:
        """Return the threads of all workers that are there now; at least one, whose batch waits for a worker."""
        if time.monotonic() > self._asked + _ASK:
            self._check()
            try:
                self._threads, self._asked = sum(self._client.nthreads().values()), time.monotonic()
            except OSError as error:
                raise BrokenExecutor(str(error)) from None
        return max(self._threads, 1)

    def _check(self) -> None:
        if self._client.status != "running":
            raise BrokenExecutor("the scheduler is gone")


def _client(address: str) -> Client:
    try:
        from distributed import Client
    except ImportError:
        raise InputError('a cluster needs Dask: pip install "gfimu[cluster]"') from None
    try:
        return Client(address, timeout=_CONNECT, set_as_default=False)
    except (OSError, ValueError) as error:  # a time-out and a broken connection are of the former
        reason = str(error).partition("\n")[0]
        raise InputError(
            f"--cluster {address}: no Dask scheduler answers ({reason}); start one with: dask scheduler"
        ) from None


def _deaths(error: BaseException) -> int | None:
    """Return how many workers died under a batch: Dask itself moves it on before it gives it up."""
    from distributed import KilledWorker

    if isinstance(error, KilledWorker):
        return int(error.allowed_failures) + 1
    return 0 if isinstance(error, CancelledError | BrokenExecutor | OSError) else None
