"""Finding a world model of one's own: in a Python file, in an installed package, or in a twin file that names it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import FunctionType

from gfimu.errors import InputError, unknown_name
from gfimu.files.input_file import is_ordinary
from gfimu.files.model_files import read_toml
from gfimu.own_rig.cause import UnnamedCause
from gfimu.own_rig.simulator import SimulatorModel
from gfimu.plugins import function_of_file, plugins
from gfimu.world_model import Effect, WorldModel

__all__ = ["load_model"]

GROUP = "gfimu.twins"
"""Entry points of functions that return a world model."""


def load_model(name: str | Path) -> WorldModel | None:
    """Return a world model of one's own, or None where the name means none.

    Parameters
    ----------
    name : str or Path
        ``rig.py:function``, a Python file and a function in it without arguments that returns the model; the name of
        an entry point of ``gfimu.twins``; or a twin file with the key ``simulator``, which holds one of these.

    Raises
    ------
    InputError
        If the file, the function or the model in it can't be used; the file is run as Python runs it.
    """
    text = str(name)
    if text.rpartition(":")[0].endswith(".py"):
        return _with_source(_made(function_of_file(text, "a twin of one's own"), text), text)
    installed = plugins(GROUP, FunctionType)
    if text in installed:
        return _with_source(_made(installed[text], text), text)
    if text.endswith(".toml") and is_ordinary(text):
        return _of_file(Path(text))
    return None


def _of_file(path: Path) -> WorldModel | None:
    """Return the model that a twin file names, with the effects in it; None of one without ``simulator``."""
    content = read_toml(path)
    if "simulator" not in content:
        return None
    source = str(content["simulator"])
    beside = source if Path(source).is_absolute() else str(path.parent / source)
    model = load_model(beside if ".py:" in source else source)
    if model is None:
        raise InputError(f"{path}: simulator = {source!r} is no file.py:function and no installed twin")
    families = model.families()
    effects: list[Effect] = []
    for entry in content.get("effect", []):
        found = str(entry.get("name", ""))
        if found == UnnamedCause.name:
            effects.append(UnnamedCause.of_file(entry.get("parameters", {})))
            continue
        if found not in families:
            raise unknown_name(f"effect in {path}:", found, families)
        effects.append(families[found](entry.get("parameters", {})))
    return model.extended(effects)


def _made(function: Callable[[], object], source: str) -> WorldModel:
    try:
        model = function()
    except TypeError as error:
        raise InputError(f"{source}: {error}; the function takes no arguments and returns a world model") from error
    missing = [
        name for name in ("array", "drive_source", "families", "predict", "extended") if not hasattr(model, name)
    ]
    if missing:
        raise InputError(f"{source}: returned {model!r:.60}, which is no world model: it has no {missing[0]}")
    return model  # type: ignore[return-value]


def _with_source(model: WorldModel, source: str) -> WorldModel:
    """Return a model that knows where it is, so that the twin file of a verdict finds it again."""
    if isinstance(model, SimulatorModel):
        path, colon, function = source.rpartition(":")
        return replace(model, source=f"{Path(path).resolve()}:{function}" if colon else source)
    return model
