"""What users add to gfimu: entry points of packages, found by the name of their group, and functions in files.

Code that a file names is run by `user_function` alone, and only with the permission of whoever reads the file.

A package declares them in its ``pyproject.toml``, such as ::

    [project.entry-points."gfimu.effects"]
    belt_slip = "my_rig.effects:BeltSlip"

Groups: ``gfimu.effects`` (classes of `sim.effects.base.Effect`), ``gfimu.twins`` (functions without arguments that
return a `gfimu.model.world_model.WorldModel`), ``gfimu.estimators`` (`gfimu.rate.registry.RateMethod`),
``gfimu.readers`` (`gfimu.recording.importing.readers.registry.Reader`) and ``gfimu.formats``
(`gfimu.recording.formats.RecordingFormat`).
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Iterable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, TypeVar

from gfimu.base.errors import InputError, unknown_name
from gfimu.base.files.input_file import is_ordinary

__all__ = ["GROUPS", "plugins", "user_function"]

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
