"""Warnings about recordings as one line each on standard error, beside the results on standard output."""

from __future__ import annotations

import sys
import warnings
from typing import Any

from gfimu.errors import RecordingWarning

__all__ = ["install"]


def install() -> None:
    """Print each warning about a recording once, as one line; others as they were."""
    usual = warnings.showwarning
    printed: set[str] = set()

    def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
        if not issubclass(category, RecordingWarning):
            usual(message, category, *place, **more)
        elif str(message) not in printed:
            printed.add(str(message))
            sys.stderr.write(f"gfimu: warning: {' '.join(str(message).split())}\n")

    warnings.simplefilter("ignore", RuntimeWarning)  # of numbers without end: what follows from them is refused
    warnings.simplefilter("always", RecordingWarning)
    warnings.showwarning = show
