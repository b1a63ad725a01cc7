"""Functions that users name: of a Python file, which is run, or of an installed package.

Code that a file names is run by `user_function` alone, and only with the permission of whoever reads the file.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

from gfimu.base.errors import InputError, unknown_name
from gfimu.base.files.input_file import is_ordinary
from gfimu.base.plugins import plugins

__all__ = ["user_function"]


def user_function(
    source: str, what: str, *, group: str = "", named_in: Path | None = None, allow_code: bool = False
) -> Callable[..., Any]:
    """Return a function of a Python file, or of an installed package.

    The file is run as Python runs it: it can import the files beside it. Each call runs it again.

    Parameters
    ----------
    source : str
        ``FILE.py:FUNCTION``, or the name of an entry point.
    what : str
        What the function is, for messages.
    group : str
        Group of the entry points; empty where none is meant.
    named_in : Path, optional
        File that holds the source, relative to whose folder FILE is; None where a person gave it.
    allow_code : bool
        Whether a file may name what is run.

    Raises
    ------
    InputError
        If there is no such file or function, the file raises an exception, or a file names it and may not.
    """
    file, _, name = source.rpartition(":")
    installed = plugins(group, FunctionType) if group and not file else {}
    if source not in installed and not file.endswith(".py"):
        raise InputError(f"{file or source}: no such file; give {what} as FILE.py:FUNCTION")
    if named_in is not None and not allow_code:
        raise InputError(f"{named_in} would run code: {source}; add --allow-code if you trust it")
    if source in installed:
        return installed[source]
    path = Path(file) if named_in is None else named_in.parent / file
    if not is_ordinary(path):
        raise InputError(f"{path}: no such file; give {what} as FILE.py:FUNCTION")
    module = _run(path)
    function = getattr(module, name, None)
    if not callable(function):
        own = [one for one, thing in vars(module).items() if getattr(thing, "__module__", "") == module.__name__]
        raise unknown_name(f"function of {file}", name, [one for one in own if callable(vars(module)[one])])
    return function  # type: ignore[no-any-return]


def _run(file: Path) -> ModuleType:
    name = f"gfimu_user_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise InputError(f"{file}: not a Python file")
    module = importlib.util.module_from_spec(spec)
    folder = str(file.resolve().parent)
    if folder not in sys.path:
        sys.path.append(folder)  # at the end: a file of the user hides no installed package
    sys.modules[name] = module  # as dataclasses in it need
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # whatever the file may raise
        raise InputError(f"{file}: {type(error).__name__}: {error}; run it with python to see where") from error
    return module
