"""What an ambiguous verdict leaves open: the effects that the data couldn't distinguish."""

from __future__ import annotations

from pathlib import Path

import msgspec

from gfimu.base.errors import InputError, system_errors
from gfimu.base.units import is_usable
from gfimu.model.world_model import Effect, WorldModel

__all__ = ["open_effects"]


def open_effects(path: str | Path, model: WorldModel) -> list[str | Effect]:
    """Read the effects that a verdict could not distinguish.

    The effect with the fewest sizes comes at its fitted size. A wide family, fitted to the same data, has taken the
    very form of its rival, which no experiment could part from it; it is taken in its usual size instead.

    Parameters
    ----------
    path : str or Path
        ``verdict.json``, or the folder that holds it.
    model : WorldModel
        The simulation, which knows the effects.

    Raises
    ------
    InputError
        If the file is no verdict, or leaves nothing open.
    """
    file = Path(path)
    if file.is_dir():
        file = file / "verdict.json"
    with system_errors(file, "name a verdict.json or the folder that diagnose wrote"):
        content = file.read_bytes()
    try:
        verdict = msgspec.json.decode(content, type=_Verdict)
    except (ValueError, RecursionError):
        raise InputError(f"{file}: not a verdict; name the verdict.json that diagnose wrote") from None
    causes = {cause.effect: cause for cause in verdict.causes}
    named = [name for name, cause in causes.items() if cause.not_distinguishable_from]
    rivals = [rival for cause in causes.values() for rival in cause.not_distinguishable_from]
    names = list(dict.fromkeys([*named, *rivals]))
    if len(names) < 2:
        raise InputError(
            f"{file}: the verdict is {verdict.verdict!r} and leaves no effects to distinguish; "
            "name them instead, such as tacho_scale sensor_position"
        )
    families = model.families()
    sizes = {name: len(families[name].sizes(model.array)) for name in names if name in families}
    fewest = min(sizes.values(), default=0)
    effects: list[str | Effect] = []
    for name in names:
        fitted = _fitted(causes[name], model) if name in causes and sizes.get(name) == fewest else None
        effects.append(name if fitted is None else fitted)
    return effects


class _Value(msgspec.Struct):
    value: float | str | list[str] | None


class _Cause(msgspec.Struct):
    effect: str
    parameters: dict[str, _Value] = {}
    not_distinguishable_from: list[str] = []


class _Verdict(msgspec.Struct):
    """What is read of a verdict's file."""

    causes: list[_Cause]
    verdict: str = ""


def _fitted(cause: _Cause, model: WorldModel) -> Effect | None:
    """Return the effect as fitted, or None where the verdict does not hold its size."""
    values = {key: one.value for key, one in cause.parameters.items()}
    numbers = {key: value for key, value in values.items() if isinstance(value, float) and is_usable(value)}
    effect = model.families()[cause.effect](numbers)
    return effect if effect.size_values(model.array).any() else None
