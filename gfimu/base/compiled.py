"""How recursions over samples are compiled by numba."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.dispatcher import Dispatcher

__all__ = ["INNER", "compiled"]

_COMPILE: dict[str, Any] = {"cache": True, "error_model": "numpy", "fastmath": {"contract", "reassoc", "nsz"}}
"""Options of numba for the recursions."""

INNER: dict[str, Any] = {**_COMPILE, "cache": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""The same for functions that only compiled ones call: no entry from Python is compiled, and none kept."""


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a recursion; what is kept of it is compiled anew when the source of a function that it calls changes.

    numba looks at the file of the function itself alone, and would go on with the old ones of other files.
    """
    dispatcher = njit(**_COMPILE)(function)
    stamps = []
    for file in sorted(_sources(function, set())):
        state = Path(file).stat()
        stamps += [state.st_mtime, state.st_size]
    cache = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    if cache is not None:  # numba has no public way to say this; None where nothing is kept
        cache._source_stamp = tuple(stamps)
        _forget_unreadable(cache)
    return dispatcher


def _forget_unreadable(cache: Any) -> None:
    """Remove what is kept of a function by an earlier version whose classes are no longer where they were."""
    try:
        cache._load_index()
    except (AttributeError, ImportError):
        Path(cache._index_path).unlink(missing_ok=True)


def _sources(function: Any, met: set[Any]) -> set[str]:
    """Return the files of a function and of all compiled ones that it calls."""
    met.add(function)
    called = (function.__globals__.get(name) for name in function.__code__.co_names)
    inner = {one.py_func for one in called if isinstance(one, Dispatcher)} - met
    return {function.__code__.co_filename}.union(*(_sources(one, met) for one in inner))
