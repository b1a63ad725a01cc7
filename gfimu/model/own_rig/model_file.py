"""Finding a world model of one's own: in a Python file, in an installed package, or in a twin file that names it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import FunctionType
from typing import Annotated, Any

from gfimu.base.errors import InputError, check_name, naming
from gfimu.base.files.input_file import is_ordinary
from gfimu.base.files.model_files import read_toml
from gfimu.base.files.schema import Table, about, read
from gfimu.base.plugins import plugins
from gfimu.model.located.effect import UNLISTED, LocatedEffect
from gfimu.model.own_rig.simulator import SimulatorModel
from gfimu.model.user_code import user_function
from gfimu.model.world_model import Effect, WorldModel

__all__ = ["load_model"]

GROUP = "gfimu.twins"
"""Entry points of functions that return a world model."""

_TWIN = "a twin of one's own"


class RigEffect(Table, frozen=True):
    """A cause that the simulation has."""

    name: Annotated[str, about("Name of the cause.")]
    parameters: Annotated[dict[str, Any], about("Its parameters by key.")] = {}  # noqa: RUF012  of msgspec


class RigFile(Table, frozen=True):
    """A twin file that leads to a simulation of one's own."""

    simulator: Annotated[str, about("FILE.py:FUNCTION, FILE relative to this file, or the name of an entry point.")]
    effect: Annotated[tuple[RigEffect, ...], about("Causes that the simulation has.")] = ()


def load_model(name: str | Path, *, allow_code: bool = False) -> WorldModel | None:
    """Return a world model of one's own, or None where the name means none.

    Parameters
    ----------
    name : str or Path
        ``rig.py:function``, a Python file and a function in it without arguments that returns the model; the name of
        an entry point of ``gfimu.twins``; or a twin file with the key ``simulator``, which holds one of these.
    allow_code : bool
        Whether a twin file may name the function that is run.

    Raises
    ------
    InputError
        If the file, the function or the model in it can't be used, or a twin file names it and may not. The Python file
        is run as Python runs it.
    """
    text = str(name)
    if text.endswith(".toml"):
        return _of_file(Path(text), allow_code=allow_code) if is_ordinary(text) else None
    if text.rpartition(":")[0].endswith(".py") or text in plugins(GROUP, FunctionType):
        return _made(user_function(text, _TWIN, group=GROUP), text)
    return None


def _of_file(path: Path, *, allow_code: bool) -> WorldModel | None:
    """Return the model that a twin file names, with the effects in it; None of one without ``simulator``."""
    content = read_toml(path)
    if "simulator" not in content:
        return None
    file = read(content, RigFile, str(path))
    with naming(str(path)):
        function = user_function(file.simulator, _TWIN, group=GROUP, named_in=path, allow_code=allow_code)
        model = _made(function, str(path.parent / file.simulator) if ":" in file.simulator else file.simulator)
        families = model.families()
        effects: list[Effect] = []
        for one in file.effect:
            if one.name == UNLISTED:
                effects.append(LocatedEffect.of_parameters(one.parameters, model.array))
                continue
            _check_kinds(one)
            check_name("effect", one.name, families)
            effects.append(families[one.name](one.parameters))
        return model.extended(effects)


def _check_kinds(effect: RigEffect) -> None:
    for key, value in effect.parameters.items():
        if not isinstance(value, int | float):
            raise InputError(f"effect {effect.name!r}: {key} = {value!r} must be a number")


def _made(function: Callable[[], object], source: str) -> WorldModel:
    """Return the model that a function returns; it knows where it is, so that the twin file of a verdict finds it."""
    try:
        model = function()
    except TypeError as error:
        raise InputError(f"{source}: {error}; the function takes no arguments and returns a world model") from error
    missing = [
        name for name in ("array", "drive_source", "families", "predict", "extended") if not hasattr(model, name)
    ]
    if missing:
        raise InputError(f"{source}: returned {model!r:.60}, which is no world model: it has no {missing[0]}")
    if isinstance(model, SimulatorModel):
        file, colon, name = source.rpartition(":")
        return replace(model, source=f"{Path(file).resolve()}:{name}" if colon else source)
    return model  # type: ignore[return-value]
