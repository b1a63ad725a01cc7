"""Setting one key of the content of a TOML file, as options of commands do: ``table.key=value``."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from typing import Any

from gfimu.errors import InputError

__all__ = ["set_key"]


def set_key(
    data: dict[str, Any],
    change: str,
    *,
    option: str,
    example: str,
    as_table: Callable[[Any, list[str]], Any] = lambda value, names: value,
) -> None:
    """Set one key of a table and of the tables within it.

    Parameters
    ----------
    data : dict
        Content of a file; changed in place.
    change : str
        ``table.key=value`` with the value as in TOML; a bare word is a string.
    option : str
        Option that holds it, for messages.
    example : str
        A change that is right, for messages.
    as_table : callable
        Called with what stands where a table is needed, and the names that lead there; returns the table of a short
        form, or the value as it is.

    Raises
    ------
    InputError
        If it is no ``key=value``, the value is no TOML, or a key lies within what is no table.
    """
    key, equals, text = change.partition("=")
    names = [name.strip() for name in key.split(".")]
    if not equals or not all(names):
        raise InputError(f"{option} {change!r}: write it as key=value, such as {example}")
    place = data
    for number, name in enumerate(names[:-1], start=1):
        found = place[name] = as_table(place.setdefault(name, {}), names[:number])
        if not isinstance(found, dict):
            raise InputError(f"{option} {change!r}: {name} is not a table; give it as a whole, {name}=value")
        place = found
    place[names[-1]] = _value(text, f"{option} {change!r}")


def _value(text: str, where: str) -> Any:
    """Return a value as TOML has it, or the text as it stands where it is none."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError as error:
        if text.lstrip()[:1] in {"{", "[", '"', "'"}:
            raise InputError(f"{where}: the value is not valid TOML ({error})") from None
        return text if text.isspace() else text.strip()
