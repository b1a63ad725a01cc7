"""What users add to gfimu: entry points of packages, found by the name of their group.

A package declares them in its ``pyproject.toml``, such as ::

    [project.entry-points."gfimu.effects"]
    belt_slip = "my_rig.effects:BeltSlip"

Groups: ``gfimu.effects`` (classes of `sim.effects.base.Effect`), ``gfimu.twins`` (functions without arguments that
return a `gfimu.model.world_model.WorldModel`), ``gfimu.estimators`` (`gfimu.rate.registry.RateMethod`),
``gfimu.readers`` (`gfimu.recording.importing.readers.registry.Reader`) and ``gfimu.formats``
(`gfimu.recording.formats.RecordingFormat`).
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import TypeVar

from gfimu.base.errors import InputError

__all__ = ["GROUPS", "plugins"]

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
