"""Warnings of gfimu as one line each on standard error, beside the results on standard output."""

from __future__ import annotations

import sys
import warnings
from typing import Any

from gfimu.errors import GfimuWarning

__all__ = ["install"]


def install() -> None:
    """Print each warning of gfimu once, as one line; others as they were."""
    usual = warnings.showwarning
    printed: set[str] = set()

    def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
        if not issubclass(category, GfimuWarning):
            usual(message, category, *place, **more)
        elif str(message) not in printed:
            printed.add(str(message))
            sys.stderr.write(f"gfimu: warning: {' '.join(str(message).split())}\n")

    warnings.simplefilter("ignore", RuntimeWarning)  # of numbers without end: what follows from them is refused
    warnings.simplefilter("always", GfimuWarning)
    warnings.showwarning = show
