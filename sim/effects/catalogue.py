"""The catalogue of effects: every effect that a scenario may have, and what was computed of it.

The numbers are made by ``docs/scripts/make_effect_catalogue.py`` and stored with the models.
"""

from __future__ import annotations

import re
import textwrap
from unicodedata import normalize

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.model.effect_catalogue import effect_catalogue
from sim.effects.base import Effect
from sim.effects.description import describe
from sim.effects.registry import (
    BODY_EFFECTS,
    CARRIAGE_EFFECTS,
    INCLINED_EFFECTS,
    SIMULATED_EFFECTS,
    TABLE_EFFECTS,
)
from sim.effects.unknown import Unknown

__all__ = ["essence", "every_effect"]

_LEGEND = {
    "f": "reading before the effect",
    "y": "reading after it",
    "ω": "rate",
    "α": "angular acceleration",
    "θ": "table angle",
    "Ω": "reading of the reference",
    "a": "sensing axis",
    "r": "place of the chip from the axis",
    "ρ": "place of the chip from the cube's centre",
    "F": "specific force at the chip",
    "z": "table's axis",
    "u": "up",
    "t": "time since the start",
    "T": "temperature, °C",
    "turn": "rotation about z",
}
"""Symbols that formulas share."""

_MOST_KEYS = 6
_WORD = re.compile(r"[^\W\d_]+[\u0307\u0308′]*")
_SEEN, _SEPARATED = 4.8, 12.0
"""Size in standard deviations from which an effect shows, and nats from which two are separable, as the diagnosis has
them: `gfimu.diagnosis` stands above this room, and a test compares the two."""


def every_effect() -> dict[str, type[Effect]]:
    """Return every effect of gfimu by name; of a name that a linear axis has too, that of the table."""
    known = CARRIAGE_EFFECTS | BODY_EFFECTS | TABLE_EFFECTS | INCLINED_EFFECTS | SIMULATED_EFFECTS
    known = {**known, Unknown.name: Unknown}
    first = [*TABLE_EFFECTS, *known]
    return {name: known[name] for name in dict.fromkeys(first)}


def essence(effect: type[Effect]) -> str:
    """Return the essence of an effect's page as plain text: what it is, formula, parameters, rivals, experiment.

    Of an effect whose docstring has no such fields (one that another package adds) it is its summary.
    """
    try:
        text = describe(effect)
    except InputError:
        return f"{effect.name}: {effect.summary}\n"
    used = {word.rstrip("′²³⁴₀₁\u0307\u0308") for one in text.formula for word in _WORD.findall(normalize("NFD", one))}
    legend = [f"{symbol} {words}" for symbol, words in _LEGEND.items() if symbol in used and symbol not in text.symbols]
    array = AccelerometerArray.load("cube12")
    sizes = {size.key: size for size in effect.sizes(array)}
    keys = effect.parameter_units(array)
    lines = [f"{effect.name}: {effect.summary}", "", _wrapped(text.what.replace("``", "`"))]
    lines += ["", *(f"    {one}" for one in text.formula), ""]
    lines += [f"    {symbol} = {key}" for symbol, key in text.symbols.items()]
    lines += [_wrapped("; ".join(legend), "    ")] if legend else []
    shown = list(keys)[:_MOST_KEYS]
    usual = {key: f", usual size {sizes[key].prior_std:.3g}" if key in sizes else "" for key in shown}
    lines += ["", "Parameters of cube12:", *(f"    {key}, {keys[key]}{usual[key]}" for key in shown)]
    lines += [f"    and {len(keys) - len(shown)} more"] if len(keys) > len(shown) else []
    lines += ["", *_rivals(effect.name), "How to separate it:", _wrapped(text.experiment, "    ")]
    if text.recordings:
        lines += ["", "In real data:", _wrapped(text.recordings, "    ")]
    return "\n".join(lines) + f"\n\nMore: docs/effects/{effect.name}.md\n"


def _rivals(name: str) -> list[str]:
    """Return, of each standard motion, the effects that it does not separate from one; nothing where none is stored."""
    motions = effect_catalogue().get(name, {}).get("motions", {})
    lines = []
    for motion, one in motions.items():
        alike = [rival for rival, _, nats in one["rivals"] if nats < _SEPARATED]
        shows = one["detectability"] >= _SEEN
        what = ("not separable from " + ", ".join(alike) if alike else "no rival") if shows else "does not show"
        lines.append(_wrapped(f"{motion}: {what}", "    "))
    return ["Rivals by motion:", *lines, ""] if lines else []


def _wrapped(text: str, indent: str = "") -> str:
    return textwrap.fill(text, 100, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False)
