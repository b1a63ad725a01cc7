"""Units as other programs write them, and their factors to SI."""

from __future__ import annotations

import math
import re
from functools import lru_cache

from gfimu.base.errors import UnitError
from gfimu.base.units import STANDARD_GRAVITY

__all__ = ["bracketed_unit", "factor_of", "kind_of", "last_word_unit", "unit_of_name"]

_DEGREE = math.pi / 180.0
_KINDS = {
    "acceleration": {
        "m/s2": 1.0,
        "mm/s2": 1e-3,
        "cm/s2": 1e-2,
        "g": STANDARD_GRAVITY,
        "mg": STANDARD_GRAVITY / 1e3,
        "ug": STANDARD_GRAVITY / 1e6,
        "ft/s2": 0.3048,
    },
    "rate": {
        "rad/s": 1.0,
        "mrad/s": 1e-3,
        "deg/s": _DEGREE,
        "mdeg/s": 1e-3 * _DEGREE,
        "rpm": math.pi / 30.0,
        "hz": math.tau,
    },
    "angle": {"rad": 1.0, "mrad": 1e-3, "deg": _DEGREE, "rev": math.tau},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "d": 86400.0},
    "temperature": {"degc": 1.0},
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6},
    "speed": {"m/s": 1.0, "mm/s": 1e-3, "mm/min": 1e-3 / 60.0},
    "field": {"ut": 1e-6, "mt": 1e-3, "nt": 1e-9, "gauss": 1e-4, "mgauss": 1e-7},
    "pressure": {"pa": 1.0, "hpa": 1e2, "kpa": 1e3, "mbar": 1e2},
}
_SIGNS = str.maketrans({"²": "2", "¹": "1", "⁻": "-", "µ": "u", "μ": "u", "°": "deg", **dict.fromkeys("^*·()")})
_WORDS = (
    (re.compile(r"_?(?:squared|sq)$"), "2"),
    (re.compile(r"_?per_?|_/_?|/_|_(?=s)"), "/"),  # deg_per_s, m_s2
    (re.compile(r"^milli-?(?=[a-z])"), "m"),
    (re.compile(r"^micro(?=[a-z])"), "u"),
    (re.compile(r"^nano(?=[a-z])"), "n"),
    (re.compile(r"seconds?|sec"), "s"),
    (re.compile(r"^met(?:er|re)s?(?=/)"), "m"),
    (re.compile(r"degrees?"), "deg"),
    (re.compile(r"radians?"), "rad"),
    (re.compile(r"turns?"), "rev"),
    (re.compile(r"dps$"), "deg/s"),
    (re.compile(r"(?<=[a-z])/?s-(?=[12]$)"), "/s"),  # rad s^-1
    (re.compile(r"/s/?s$"), "/s2"),
    (re.compile(r"/s1$"), "/s"),
)
_SAME = {
    **dict.fromkeys(("ms2", "mps2"), "m/s2"),
    **dict.fromkeys(("rads", "rads/s"), "rad/s"),
    **dict.fromkeys(("min-1", "u/min", "r/min", "1/min"), "rpm"),
    **dict.fromkeys(("rps", "rev/s"), "hz"),
    **dict.fromkeys(("gn", "gs"), "g"),
    **dict.fromkeys(("c", "celsius"), "degc"),
    **dict.fromkeys(("day", "days"), "d"),
    "gal": "cm/s2",
}
_AMBIGUOUS = {"g", "s", "h", "d", "c", "min", "gs", "day", "hz", "rev", "turn", "turns", "second", "gal"}
_WORD = re.compile(r"[^_ ,.]+")
_REMEMBERED = 10_000  # numerical: units and names; lines of a log repeat theirs
_JOINTS = "_ ,."
_MOST_WORDS = 4  # numerical: deg_per_second, m_per_s_squared
_BRACKETS = re.compile(r"[\[({]((?:[^\[\](){}]|\([^\[\](){}]*\))+)[\])}]$")


@lru_cache(_REMEMBERED)
def _plain(text: str) -> str:
    """Return a unit as its sign: ``deg_per_s`` and ``°/s`` as ``deg/s``, ``m_per_second_squared`` as ``m/s2``."""
    short = "".join(text.lower().translate(_SIGNS).split())
    if short in _SAME:
        return _SAME[short]
    for words, sign in _WORDS:
        short = words.sub(sign, short)
    return _SAME.get(short, short)


def factor_of(unit: str, kind: str, *, where: str = "") -> float:
    """Return the factor of a unit to SI.

    Parameters
    ----------
    unit : str
        As people write it: ``m/s^2``, ``m_s2``, ``°/s``, ``dps``, ``rad s^-1``.
    kind : {"acceleration", "rate", "angle", "time", "temperature", "length", "speed"}
        What is measured.
    where : str
        What has that unit, for messages.

    Raises
    ------
    UnitError
        If the unit is none of that kind.
    """
    factors = _KINDS[kind]
    try:
        return factors[_plain(unit)]
    except KeyError:
        place = f"{where}: " if where else ""
        raise UnitError(f"{place}unknown unit {unit!r} for {kind}; valid: {', '.join(factors)}") from None


def kind_of(unit: str) -> str:
    """Return what is measured in a unit; empty if it is not known."""
    plain = _plain(unit)
    return next((kind for kind, factors in _KINDS.items() if plain in factors), "")


@lru_cache(_REMEMBERED)
def bracketed_unit(name: str) -> tuple[str, str]:
    """Split the name of a column into the name and a unit in brackets at its end; empty without one."""
    plain = name.strip()
    found = _BRACKETS.search(plain)
    if found is None or not kind_of(found[1]):
        return plain, ""
    return plain[: found.start()].strip(), found[1].strip()


def last_word_unit(name: str) -> str:
    """Return the last word of a name where it is a unit that may mean anything else, as the g of ``ax_g``; else ""."""
    last = re.split(f"[{_JOINTS}]", name.strip())[-1]
    return last if last != name.strip() and last.lower() in _AMBIGUOUS and kind_of(last) else ""


def unit_of_name(name: str) -> tuple[str, str]:
    """Split the name of a column into the name and its unit, in brackets or as its last word; empty without one.

    ``acc_x_mg``, ``omega_dps`` and ``time_ms`` carry a unit; a last word that may mean anything else, as the s of
    ``acc_s``, counts only in brackets.
    """
    plain, unit = bracketed_unit(name)
    if unit:
        return plain, unit
    words = list(_WORD.finditer(plain))
    for first in words[-_MOST_WORDS:]:
        unit = plain[first.start() :]
        if first.start() and plain[first.start() - 1] in _JOINTS and unit.lower() not in _AMBIGUOUS and kind_of(unit):
            return plain[: first.start()].rstrip(_JOINTS), unit
    return plain, ""
