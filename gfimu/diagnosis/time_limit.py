"""The time that a diagnosis may take. It is looked at wherever the simulation is asked, so that any search can end.

Reaching it is a `KeyboardInterrupt` with these words: what a search does at Ctrl-C it does then too.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

__all__ = ["TIME_LIMIT", "check_time", "expire", "limited_to", "unlimited", "what_ended"]

TIME_LIMIT = "time limit"
"""What ended a search that ran out of time, in words."""


@dataclass
class _Clock:
    """When the work has to end, s of the system's monotonic clock; processes that are split off share it."""

    end: float = math.inf


_CLOCK: ContextVar[_Clock] = ContextVar("clock")


@contextmanager
def limited_to(seconds: float) -> Iterator[None]:
    """Let the work of this block take so long, s, or as long as a block around it may, if that is shorter."""
    with _timed(min(time.monotonic() + seconds, _CLOCK.get(_Clock()).end)):
        yield


def unlimited() -> AbstractContextManager[None]:
    """Let the work of this block take as long as it needs, whatever block is around it."""
    return _timed(math.inf)


@contextmanager
def _timed(end: float) -> Iterator[None]:
    token = _CLOCK.set(_Clock(end))
    try:
        yield
    finally:
        _CLOCK.reset(token)


def check_time() -> None:
    """End the work where its time is over.

    Raises
    ------
    KeyboardInterrupt
        With the words of `TIME_LIMIT`.
    """
    if time.monotonic() > _CLOCK.get(_Clock()).end:
        raise KeyboardInterrupt(TIME_LIMIT)


def expire() -> None:
    """Let the time of the present block be over, for threads that still work for it."""
    _CLOCK.get(_Clock()).end = -math.inf


def what_ended(stop: KeyboardInterrupt) -> str:
    """Return in words what ended a search: the time limit, a signal by its name, or Ctrl-C."""
    return str(stop) or "Ctrl-C"
