"""What an ambiguous verdict leaves open: the effects that the data couldn't distinguish."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gfimu.errors import InputError
from gfimu.world_model import Effect, WorldModel

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
    try:
        verdict = json.loads(file.read_text(encoding="utf-8"))
        causes = {str(cause["effect"]): cause for cause in verdict["causes"]}
        rivals = [str(rival) for cause in causes.values() for rival in cause.get("not_distinguishable_from", [])]
    except OSError as error:
        raise InputError(f"{file}: {error.strerror}; name a verdict.json or the folder that diagnose wrote") from None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise InputError(f"{file}: not a verdict; name the verdict.json that diagnose wrote") from None
    named = [name for name, cause in causes.items() if cause.get("not_distinguishable_from")]
    names = list(dict.fromkeys([*named, *rivals]))
    if len(names) < 2:
        raise InputError(
            f"{file}: the verdict is {verdict.get('verdict')!r} and leaves no effects to distinguish; "
            "name them instead, such as tacho_scale sensor_position"
        )
    families = model.families()
    sizes = {name: len(families[name].sizes(model.array)) for name in names if name in families}
    fewest = min(sizes.values(), default=0)
    effects: list[str | Effect] = []
    for name in names:
        fitted = _fitted(causes.get(name, {}), name, model) if sizes.get(name) == fewest else None
        effects.append(name if fitted is None else fitted)
    return effects


def _fitted(cause: Mapping[str, Any], name: str, model: WorldModel) -> Effect | None:
    """Return the effect as fitted, or None where the verdict does not hold its size."""
    values = {key: entry.get("value") for key, entry in cause.get("parameters", {}).items()}
    numbers = {key: float(value) for key, value in values.items() if isinstance(value, int | float)}
    effect = model.families()[name](numbers)
    return effect if effect.size_values(model.array).any() else None
