"""Workers of a campaign on a Dask cluster, whichever way it was started."""

from __future__ import annotations

import asyncio
import logging
import pickle
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

from gfimu.base.errors import InputError, warn
from gfimu.base.optional_packages import require
from sim.trials.sweep.engine import Workers

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["open_cluster"]

_CONNECT = 5.0  # numerical: s, longest wait for a scheduler; it answers within milliseconds
_ASK = 1.0  # numerical: s between questions for the number of workers


@contextmanager
def open_cluster(address: str, remedy: str = "start some with: dask worker ADDRESS") -> Iterator[Workers]:
    """Open the workers of a cluster by the address of its scheduler; what is queued is cancelled in the end.

    Parameters
    ----------
    address : str
        Such as ``tcp://host:8786``.
    remedy : str
        What a warning advises where the cluster has no workers yet; ADDRESS stands for the address.

    Raises
    ------
    InputError
        If Dask is not installed, or no scheduler answers.
    """
    client = _client(address, remedy.replace("ADDRESS", address))
    executor = _ClusterExecutor(client)
    log = logging.getLogger("distributed.client")
    level = log.level
    log.setLevel(logging.CRITICAL)  # a lost connection is one line of the campaign, not a traceback of Dask
    try:
        yield Workers(executor, executor.count, _deaths)
    finally:
        executor.shutdown(wait=False)
        client.close()
        log.setLevel(level)


class _ClusterExecutor(Executor):
    """Dask's own executor, which says so when the connection is lost, and how many threads there are."""

    def __init__(self, client: Client) -> None:
        self._client, self._executor = client, client.get_executor(pure=False)
        self._threads, self._asked = 0, float("-inf")

    def submit(self, function: Any, /, *values: Any, **named: Any) -> Future[Any]:
        self._check()
        call = pickle.dumps(_Call(partial(function, **named), values))
        found: Future[Any] = self._executor.submit(pickle.loads, call)
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


class _Call:
    """A call that is made when it is unpickled.

    A worker of Dask that can't import what a task names closes its connection, and the task waits for ever. Unpickled
    inside a task, the same failure is that task's error.
    """

    def __init__(self, function: Any, values: tuple[Any, ...]) -> None:
        self._reduced = function, values

    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]:
        return self._reduced


def _client(address: str, remedy: str) -> Client:
    require("a cluster", "distributed")
    from distributed import Client, rpc

    async def ask() -> str:
        async with rpc(address) as scheduler:
            return str((await scheduler.identity())["type"])

    # Asked first, since a client that finds no scheduler takes long to close; in a thread, as a notebook has a loop.
    try:
        with ThreadPoolExecutor(1) as thread:
            kind = thread.submit(lambda: asyncio.run(asyncio.wait_for(ask(), _CONNECT))).result()
    except Exception as error:  # noqa: BLE001 - whatever answers at that port may send anything
        reason = str(error).partition("\n")[0] or f"nothing within {_CONNECT:g} s"
        raise InputError(
            f"--cluster {address}: no Dask scheduler answers ({reason}); start one with: dask scheduler"
        ) from None
    if kind != "Scheduler":
        raise InputError(f"--cluster {address}: is a Dask {kind.lower()}; give the address of the scheduler")
    client = Client(address, timeout=_CONNECT, set_as_default=False)
    if not client.nthreads():
        text = f"--cluster {address}: has no workers yet, the campaign waits for them; {remedy}"
        warn(text)
    return client


def _deaths(error: BaseException) -> int | None:
    """Return how many workers died under a batch: Dask itself moves it on before it gives it up."""
    from distributed import KilledWorker
    from distributed.comm import CommClosedError

    if isinstance(error, KilledWorker):
        return int(error.allowed_failures) + 1
    return 0 if isinstance(error, CancelledError | BrokenExecutor | CommClosedError) else None
