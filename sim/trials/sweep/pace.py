"""How fast a campaign runs now, for its own progress and for another process that asks."""

from __future__ import annotations

import json
import os
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import msgspec

from gfimu.base.declared import Declared, figure
from gfimu.base.files.atomic_file import atomic_path
from sim.trials.sweep.dataset import Dataset

__all__ = ["Pace", "Run", "running", "runs"]

_PREFIX, _SUFFIX = ".running-", ".json"
_REWRITE = 1.0  # numerical: s between two notes of a run


class Pace:
    """Cases per second of this run: neither what was there before nor the start of the workers counts."""

    def __init__(self) -> None:
        self._first: tuple[int, float] | None = None
        self._began = time.monotonic()
        self.rate = 0.0

    def note(self, ran: int) -> float:
        """Return the rate, 1/s, when so many cases were run; 0 before the first."""
        now = time.monotonic()
        if self._first is None and ran:
            self._first = ran, now
        if self._first is not None:
            count, since = self._first
            # The first batch alone has no other measure than the time since the start.
            self.rate = (ran - count) / (now - since) if ran > count else ran / max(now - self._began, 1e-9)
        return self.rate


@dataclass(frozen=True)
class Run(Declared):
    """A process that works at a campaign."""

    host: Annotated[str, figure("Its machine.")]
    pid: Annotated[int, figure("Its number there.")]
    ran: Annotated[int, figure("Cases that it has done.")]
    rate_per_s: float  # cases per second
    updated_unix_s: float  # time of its last batch

    @property
    def ended(self) -> bool:
        """Whether it was killed; False where its machine is another one, which can't be asked."""
        if self.host != socket.gethostname():
            return False
        try:
            os.kill(self.pid, 0)
        except ProcessLookupError:
            return True
        except (OSError, OverflowError):
            return False
        return False


@contextmanager
def running(dataset: Dataset) -> Iterator[Callable[[int], None]]:
    """Leave a note in the folder of a campaign while it runs; yields a function called with the cases that were run."""
    host, pid, pace = socket.gethostname(), os.getpid(), Pace()
    path = dataset.folder / f"{_PREFIX}{host}-{pid}{_SUFFIX}"
    written = float("-inf")

    def note(ran: int) -> None:
        nonlocal written
        rate = pace.note(ran)
        if time.monotonic() > written + _REWRITE:
            written = time.monotonic()
            with suppress(OSError), atomic_path(path) as part:  # the rows matter, this does not
                Path(part).write_text(json.dumps(asdict(Run(host, pid, ran, rate, time.time()))), encoding="utf-8")

    for kept, run in _notes(dataset):
        if run.ended:
            kept.unlink(missing_ok=True)
    note(0)
    try:
        yield note
    finally:
        with suppress(OSError):
            path.unlink(missing_ok=True)


def runs(dataset: Dataset) -> list[Run]:
    """Return the processes that run a campaign now, as far as their notes say."""
    return [run for _, run in _notes(dataset) if not run.ended]


def _notes(dataset: Dataset) -> list[tuple[Path, Run]]:
    found = []
    for path in sorted(dataset.folder.glob(f"{_PREFIX}*{_SUFFIX}")):
        with suppress(OSError, ValueError, TypeError):  # one that ends at this moment
            found.append((path, msgspec.json.decode(path.read_bytes(), type=Run)))
    return found
