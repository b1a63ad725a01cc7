"""Keys of a column map set one by one (``--map-set time.unit=ms``), and the short forms of its tables.

A channel may be given by its column alone, where the map has a ``unit`` (and ``scale``) for all channels:
``unit=g channels.a11=ax channels.a12=ay``. Kinds of rows to drop may be one text: ``drop=corrupt,duplicates``.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import Any

from gfimu.errors import InputError

__all__ = ["FOR_ALL", "complete", "set_key"]

FOR_ALL = ("unit", "scale")
"""Keys of a map that hold for each of its channels that has none of its own."""


def set_key(data: dict[str, Any], change: str) -> None:
    """Set one key of a map, ``table.key=value`` with the value as in TOML (a bare word is a string).

    Raises
    ------
    InputError
        If it is no ``key=value``, or a key within what is no table.
    """
    key, equals, text = change.partition("=")
    names = [name.strip() for name in key.split(".")]
    if not equals or not all(names):
        raise InputError(f"--map-set {change!r}: write it as key=value, such as time.unit=ms")
    *tables, last = names
    place = data
    for number, name in enumerate(tables):
        found = place.setdefault(name, {})
        if isinstance(found, str | int) and tables[0] in {"channels", "reference"} and number == 1:
            found = place[name] = {"column": found}  # the short form of a column gets a further key
        if not isinstance(found, dict):
            raise InputError(f"--map-set {change!r}: {name} is no table; give it as a whole, {name}=value")
        place = found
    place[last] = _value(text, change)


def _value(text: str, change: str) -> Any:
    """Return a value as TOML has it, or the text as it stands where it is none."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError as error:
        if text.lstrip()[:1] in {"{", "[", '"', "'"}:
            raise InputError(f"--map-set {change!r}: the value is not valid TOML ({error})") from None
        return text if text.isspace() else text.strip()


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
