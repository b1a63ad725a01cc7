"""Whether a filter has to be compiled before it can run."""

from __future__ import annotations

from types import FunctionType
from typing import Any

from gfimu.rate.body_rate import follow

__all__ = ["must_compile"]


def must_compile(kernel: Any = follow) -> bool:
    """Whether the first call of a filter will compile it: nothing is compiled here or kept from an earlier run.

    numba keeps compiled code beside the source, or in ``NUMBA_CACHE_DIR``, once per installation and kind of processor.
    """
    if isinstance(kernel, FunctionType) or kernel.signatures:  # a plain function where numba is switched off
        return False
    try:  # numba has no public way to ask what it keeps
        return not kernel._cache._cache_file._load_index()
    except (AttributeError, OSError):  # nothing can be kept
        return True
