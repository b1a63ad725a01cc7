"""What users add to gfimu: entry points of packages, found by the name of their group, and functions in files.

A package declares them in its ``pyproject.toml``, such as ::

    [project.entry-points."gfimu.effects"]
    belt_slip = "my_rig.effects:BeltSlip"

Groups: ``gfimu.effects`` (classes of `sim.effects.base.Effect`), ``gfimu.twins`` (functions without arguments that
return a `gfimu.world_model.WorldModel`), ``gfimu.estimators`` (`gfimu.rate.registry.RateMethod`), ``gfimu.readers``
(`gfimu.importing.readers.registry.Reader`) and ``gfimu.formats`` (`gfimu.recording.formats.RecordingFormat`).
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Iterable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from gfimu.errors import InputError, unknown_name
from gfimu.files.input_file import is_ordinary

__all__ = ["GROUPS", "function_of_file", "plugins"]

GROUPS = ("gfimu.effects", "gfimu.twins", "gfimu.estimators", "gfimu.readers", "gfimu.formats")
"""Groups of entry points that gfimu looks for."""

_Kind = TypeVar("_Kind")


def plugins(group: str, kind: type[_Kind], own: Iterable[str] = ()) -> dict[str, _Kind]:
    """Return what installed packages add to a group, by name.

    Parameters
    ----------
    group : str
        One of `GROUPS`.
    kind : type
        What each must be: an instance of this class.
    own : iterable of str
        Names that gfimu has itself, which no package may take.

    Raises
    ------
    InputError
        If one can't be imported, is of another kind, or has a name that is taken.
    """
    found: dict[str, _Kind] = {}
    for name, (package, thing) in _loaded(group).items():
        where = f"entry point {name!r} of {group} in package {package}"
        if isinstance(thing, Exception):
            raise InputError(f"{where}: {type(thing).__name__}: {thing}; repair or uninstall that package") from thing
        if not isinstance(thing, kind):
            raise InputError(f"{where}: is {thing!r}, not a {kind.__name__}; repair or uninstall that package")
        if name in own:
            raise InputError(f"{where}: gfimu has {name!r} itself; let the package name it otherwise")
        found[name] = thing
    return found


@cache
def _loaded(group: str) -> dict[str, tuple[str, object]]:
    """Return package and object of each entry point, the error in its place where it can't be imported."""
    return {point.name: (_package(point), _load(point)) for point in entry_points(group=group)}


def _package(point: EntryPoint) -> str:
    return point.dist.name if point.dist is not None else "?"


def _load(point: EntryPoint) -> object:
    try:
        return point.load()
    except Exception as error:  # noqa: BLE001 - whatever a foreign module may raise
        return error


def function_of_file(source: str, what: str) -> Callable[..., Any]:
    """Return a function of a Python file.

    The file is run as Python runs it: it can import the files beside it. Each call runs it again.

    Parameters
    ----------
    source : str
        ``FILE.py:FUNCTION``.
    what : str
        What the function is, for messages.

    Raises
    ------
    InputError
        If there is no such file or function, or the file raises an exception.
    """
    file, _, name = source.rpartition(":")
    if not file.endswith(".py") or not is_ordinary(file):
        raise InputError(f"{file or source}: no such file; give {what} as FILE.py:FUNCTION")
    module = _run(Path(file))
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
