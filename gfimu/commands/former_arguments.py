"""Former names of the arguments of functions: they work as before, with a `DeprecationWarning`."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

__all__ = ["former_arguments"]

_Parameters = ParamSpec("_Parameters")
_Result = TypeVar("_Result")


def former_arguments(
    **present: str,
) -> Callable[[Callable[_Parameters, _Result]], Callable[_Parameters, _Result]]:
    """Return a decorator that accepts arguments by their former names.

    Parameters
    ----------
    **present : str
        Present name of each argument, by its former one.
    """

    def decorate(function: Callable[_Parameters, _Result]) -> Callable[_Parameters, _Result]:
        @functools.wraps(function)
        def called(*args: Any, **kwargs: Any) -> Any:
            for former in present.keys() & kwargs.keys():
                name = present[former]
                if name in kwargs:
                    raise TypeError(f"{function.__name__}: {former} is the former name of {name}; give one of them")
                warnings.warn(f"{function.__name__}: {former} is now called {name}", DeprecationWarning, stacklevel=2)
                kwargs[name] = kwargs.pop(former)
            return function(*args, **kwargs)

        return called

    return decorate
