"""What the name of a column shows: a quantity, a unit, whether another quantity or a processed one."""

from __future__ import annotations

import re

from gfimu.recording.policy import GuessPolicy
from gfimu.recording.units import kind_of, unit_of_name

__all__ = ["OTHER", "evidence_of_names", "is_acceleration", "is_rate", "words_of"]

_POLICY = GuessPolicy()

_BETWEEN = (
    re.compile(r"(?<=[a-z])(?=[A-Z])"),  # accX, angularVelocity
    re.compile(r"(?<=[A-Za-z])(?=\d)|(?<=\d)(?=[A-Za-z])"),  # adxl345, imu1ax
)

_ACCELERATION = re.compile(
    r"\b\w?acc|acceler|\bforce|\badxl|\bmma \d|\blis \d|\bbma \d|\bkx|\bg ?f ?[xyz]\b|\bspecific|\bg force"
)
"""Words of an acceleration or a specific force."""
_WEAK_ACCELERATION = re.compile(r"\ba ?\d* ?[xyz]\b|^a \d|\ba [xyz\d]")
"""A lone letter that is an acceleration more often than not: ``ax``, ``a_1``."""
_RATE = re.compile(
    r"gyr|omega|ang\w* ?(rate|vel|speed)|angular(?! acc)|\brate\b|\brot(ation)?( rate| vel\w*| [xyz]|ation [xyz])?\b"
    r"|rotation ?rate|\bitg"
)
"""Words of an angular rate."""
_WEAK_RATE = re.compile(r"\b[wg] ?\d* ?[xyz]\b|^w \d|\bw [xyz\d]")
"""A lone letter that is an angular rate more often than not: ``wx``, ``gx``."""
OTHER = re.compile(
    r"\bmag(?!nitude)|magn(?!itude)|\b[mb] ?[xyz]\b|euler|quat|orient|\bfield ?[xyz]\b|\w field\b|angle|roll|pitch|yaw"
    r"|heading|azimuth|\bpos|\bvel|\bstd|\bcov|temp|\bgps|\bq ?[0-3wxyz]\b|\bmat\b|rotm|\brot(ation)? (mat|vec)|\bdcm"
    r"|setpoint|\bmotor|\baxis [pidf]\b|command|uncal|\bbaro|pressure|altitude|latitude|longitude|humid|\bbatt"
    r"|\bvolt|\bref\b"
)
"""Words of another quantity than acceleration or rate."""
_PROCESSED = re.compile(
    r"\bfree\b|(?<!including )\bgrav|\blin(ear)? ?acc|(without|no|minus) ?g|user ?acc|rotated|\bworld"
    r"|\bearth|\bglobal|\bnav\b|\bned\b|\benu\b|\bfilt|compensated|\bfused|\bsmooth|\blow ?pass|\bestimat"
)
"""Words of an acceleration that a program has computed: gravity or all but it, in other axes, or smoothed."""
_ABSOLUTE = re.compile(
    r"\babs|magnitude|\bnorm\b|\btotal\b|resultant|\bsv[mt]\b|\brms\b|\bsum\b|\bmod(ulus)?\b|\bmean\b"
)
"""Words of the length of a vector, which is no axis."""


def words_of(name: str) -> str:
    """Return the name of a column without its unit as words in small letters: ``raw_accX [g]`` is ``raw acc x``."""
    plain = unit_of_name(name)[0]
    for between in _BETWEEN:
        plain = between.sub(" ", plain)
    return " ".join(re.findall(r"[a-z]+|\d+|#", plain.lower()))


def is_acceleration(name: str) -> bool:
    """Whether a column is an acceleration along one axis by its unit or its name."""
    words, unit = words_of(name), unit_of_name(name)[1]
    if OTHER.search(words) or _RATE.search(words) or _PROCESSED.search(words) or _ABSOLUTE.search(words):
        return False
    if unit:
        return kind_of(unit) == "acceleration"
    return bool(_ACCELERATION.search(words) or _WEAK_ACCELERATION.match(words))


def is_rate(name: str) -> bool:
    """Whether a column is an angular rate by its unit or its name."""
    words, unit = words_of(name), unit_of_name(name)[1]
    if OTHER.search(words) and not _RATE.search(words):
        return False
    return kind_of(unit) == "rate" if unit else bool(_RATE.search(words) or _WEAK_RATE.match(words))


def evidence_of_names(words: str, table: str, unit: str) -> tuple[dict[str, float], bool]:
    """Return log odds of what a column measures by its name and that of its table, and whether it was computed."""
    found: dict[str, float] = {}

    def add(kind: str, odds: float) -> None:
        found[kind] = found.get(kind, 0.0) + odds

    if unit:
        kind = "field" if unit in {"G", "mG"} and OTHER.search(words) else kind_of(unit)  # gauss
        add(kind if kind in {"acceleration", "rate"} else "", _POLICY.unit)
    for text, odds in ((words, _POLICY.word), (table, _POLICY.table)):
        if text and _RATE.search(text) and not re.search(r"uncal|temp|\bstd|\bcov", text):
            add("rate", odds)
        elif text and OTHER.search(text):
            add("", _POLICY.unit)
        elif text and _ACCELERATION.search(text):
            add("acceleration", odds)
        else:
            continue
        break
    if not found and _WEAK_ACCELERATION.search(words):
        add("acceleration", _POLICY.letter)
    if not found and _WEAK_RATE.search(words):
        add("rate", _POLICY.letter)
    is_named = any(mark.search(words) for mark in (_RATE, OTHER, _ACCELERATION))
    return found, bool(_PROCESSED.search(words if is_named else f"{words} {table}"))
