"""Warnings of gfimu as one line each on standard error, beside the results on standard output."""

from __future__ import annotations

import sys
import warnings
from typing import Any

from gfimu.base.errors import GfimuWarning, one_line, printable

__all__ = ["install"]


def install() -> None:
    """Print each warning of gfimu once, as one line; others as Python does."""
    printed: set[str] = set()

    def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
        if not issubclass(category, GfimuWarning):
            sys.stderr.write(printable(warnings.formatwarning(message, category, *place[:2])))
        elif str(message) not in printed:
            printed.add(str(message))
            sys.stderr.write(f"gfimu: warning: {one_line(str(message))}\n")

    warnings.simplefilter("ignore", RuntimeWarning)  # of numbers without end: what follows from them is refused
    warnings.simplefilter("always", GfimuWarning)
    warnings.showwarning = show
