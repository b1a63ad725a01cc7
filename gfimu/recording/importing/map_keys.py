"""Keys of a column map set one by one (``--map-set time.unit=ms``), and the short forms of its tables.

A channel may be given by its column alone, where the map has a ``unit`` (and ``scale``) for all channels:
``unit=g channels.a11=ax channels.a12=ay``. Kinds of rows to drop may be one text: ``drop=corrupt,duplicates``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gfimu.base.errors import InputError
from gfimu.base.files.model_files import set_key

__all__ = ["FOR_ALL", "complete", "set_map_key"]

FOR_ALL = ("unit", "scale")
"""Keys of a map that hold for each of its channels that has none of its own."""


def set_map_key(data: dict[str, Any], change: str) -> None:
    """Set one key of a map, ``table.key=value`` values as in TOML; raises as `gfimu.base.files.model_files.set_key`."""
    set_key(data, change, option="--map-set", example="time.unit=ms", as_table=_as_column)


def _as_column(value: Any, names: list[str]) -> Any:
    """Return the short form of a column, its name or number alone, as the table that gets a further key."""
    short = isinstance(value, str | int) and len(names) == 2 and names[0] in {"channels", "reference"}
    return {"column": value} if short else value


def complete(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of a map with its short forms written out: columns alone, a unit for all channels, one text."""
    whole = {key: value for key, value in data.items() if key not in FOR_ALL}
    usual = {key: data[key] for key in FOR_ALL if key in data}
    channels = whole.get("channels")
    if isinstance(channels, Mapping):
        whole["channels"] = {name: _column(spec, usual) for name, spec in channels.items()}
    elif usual and channels is None:
        raise InputError(f'{" and ".join(usual)} of the column map: no channels; add channels.a11 = "ax"')
    reference = whole.get("reference")
    if isinstance(reference, Mapping):
        whole["reference"] = {name: _column(spec, {}) for name, spec in reference.items()}
    if isinstance(whole.get("drop"), str):
        whole["drop"] = [kind.strip() for kind in whole["drop"].split(",") if kind.strip()]
    return whole


def _column(spec: Any, usual: Mapping[str, Any]) -> Any:
    if isinstance(spec, Mapping):
        return {**usual, **spec}
    return {"column": spec, **usual} if isinstance(spec, str | int | list) else spec
