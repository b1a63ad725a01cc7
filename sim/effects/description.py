"""What an effect's class says of itself: the text of its page in the catalogue, read from the docstring.

The docstring of an effect has a title, a paragraph that says what it is in a rig, and a section ``Notes`` of fields::

Notes
-----
    :formula: y = f + b
    :symbols: b = {channel}_m_s2
    :size: where the usual size comes from
    :example: a11_m_s2 = 0.2
    :experiment: how a lab separates it from its rivals
    :recordings: where it was seen in measured data (left out where it was not)
    :rivals: how a diagnosis finds it, where it has no column in the standard motions (left out where it has)

The formula is text and Python at once (`docs/scripts/effect_formulas.py` has its grammar): it is printed as it stands,
typeset on the page, and evaluated by a test that compares it with the simulation.
"""

from __future__ import annotations

import inspect
import re
import tomllib
from dataclasses import dataclass
from typing import Any

from gfimu.base.errors import InputError

__all__ = ["FIELDS", "OPTIONAL_FIELDS", "Description", "describe"]

FIELDS = ("formula", "symbols", "size", "example", "experiment")
"""Fields that the notes of every effect have."""

OPTIONAL_FIELDS = ("recordings", "rivals")
"""Fields that may be left out."""

_FIELD = re.compile(r"^:(\w+):[ \n]", re.MULTILINE)


@dataclass(frozen=True)
class Description:
    """The text of an effect's page that no computation gives.

    Parameters
    ----------
    title : str
        First line of the docstring, without its full stop.
    what : str
        What it is in a rig that a lab would recognise.
    formula : tuple of str
        Equations, one each.
    symbols : dict of str to str
        Parameter keys by symbol of the formula.
    size : str
        Where the usual size comes from.
    example : dict
        Parameters that show well in the reference run.
    experiment : str
        How a lab separates it from its rivals.
    recordings : str
        Where it was seen in measured data; empty where it was not.
    rivals : str
        How a diagnosis finds it, where no rivals can be computed; empty where they can.
    """

    title: str
    what: str
    formula: tuple[str, ...]
    symbols: dict[str, str]
    size: str
    example: dict[str, Any]
    experiment: str
    recordings: str
    rivals: str


def describe(effect: type) -> Description:
    """Return the description in the docstring of an effect's class.

    Parameters
    ----------
    effect : type
        Class of the effect.

    Raises
    ------
    InputError
        If the docstring lacks a field, has one that is unknown, or its example is no TOML; the message names the class.
    """
    where = f"docstring of {effect.__name__}"
    text = inspect.cleandoc(effect.__dict__.get("__doc__") or "")
    head, _, notes = text.partition("\nNotes\n-----\n")
    paragraphs = [" ".join(one.split()) for one in head.split("\n\n") if one.strip()]
    parts = _FIELD.split("\n" + notes)
    fields = dict(zip(parts[1::2], parts[2::2], strict=True))
    missing = [name for name in FIELDS if name not in fields]
    if len(paragraphs) < 2 or missing:
        what = f"the field :{missing[0]}:" if missing else "a paragraph that says what it is"
        raise InputError(f"{where}: lacks {what}; see sim/effects/description.py")
    valid = (*FIELDS, *OPTIONAL_FIELDS)
    if unknown := [name for name in fields if name not in valid]:
        raise InputError(f"{where}: unknown field :{unknown[0]}:; valid: {', '.join(valid)}")
    flat = {name: " ".join(value.split()) for name, value in fields.items()}
    try:
        example = tomllib.loads(f"example = {{{flat['example']}}}")["example"]
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{where}: :example: is no TOML ({error}); write key = value, key = value") from None
    return Description(
        paragraphs[0].removesuffix("."),
        paragraphs[1],
        tuple(one.strip() for one in flat["formula"].split(";")),
        _symbols(flat["symbols"], where),
        flat["size"],
        example,
        flat["experiment"],
        flat.get("recordings", ""),
        flat.get("rivals", ""),
    )


def _symbols(text: str, where: str) -> dict[str, str]:
    pairs = [part.split(" = ") for part in text.split("; ")]
    if any(len(pair) != 2 for pair in pairs):
        raise InputError(f"{where}: :symbols: must be symbol = key, several parted by semicolons")
    return {symbol.strip(): key.strip() for symbol, key in pairs}
