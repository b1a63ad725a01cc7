"""What the name of a column shows: a quantity, a unit, whether another quantity or a processed one."""

from __future__ import annotations

import re

from gfimu.recording.units import unit_of_name

__all__ = ["ABSOLUTE", "ACCELERATION", "OTHER", "PROCESSED", "RATE", "WEAK_ACCELERATION", "WEAK_RATE", "words_of"]

_BETWEEN = (
    re.compile(r"(?<=[a-z])(?=[A-Z])"),  # accX, angularVelocity
    re.compile(r"(?<=[A-Za-z])(?=\d)|(?<=\d)(?=[A-Za-z])"),  # adxl345, imu1ax
)

ACCELERATION = re.compile(
    r"\b\w?acc|acceler|\bforce|\badxl|\bmma \d|\blis \d|\bbma \d|\bkx|\bg ?f ?[xyz]\b|\bspecific|\bg force"
)
"""Words of an acceleration or a specific force."""
WEAK_ACCELERATION = re.compile(r"\ba ?\d* ?[xyz]\b|^a \d|\ba [xyz\d]")
"""A lone letter that is an acceleration more often than not: ``ax``, ``a_1``."""
RATE = re.compile(
    r"gyr|omega|ang\w* ?(rate|vel|speed)|angular(?! acc)|\brate\b|\brot(ation)?( rate| vel\w*| [xyz]|ation [xyz])?\b"
    r"|rotation ?rate|\bitg"
)
"""Words of an angular rate."""
WEAK_RATE = re.compile(r"\b[wg] ?\d* ?[xyz]\b|^w \d|\bw [xyz\d]")
"""A lone letter that is an angular rate more often than not: ``wx``, ``gx``."""
OTHER = re.compile(
    r"\bmag(?!nitude)|magn(?!itude)|\b[mb] ?[xyz]\b|euler|quat|orient|\bfield ?[xyz]\b|\w field\b|angle|roll|pitch|yaw"
    r"|heading|azimuth|\bpos|\bvel|\bstd|\bcov|temp|\bgps|\bq ?[0-3wxyz]\b|\bmat\b|rotm|\brot(ation)? (mat|vec)|\bdcm"
    r"|setpoint|\bmotor|\baxis [pidf]\b|command|uncal|\bbaro|pressure|altitude|latitude|longitude|humid|\bbatt"
    r"|\bvolt|\bref\b"
)
"""Words of another quantity than acceleration or rate."""
PROCESSED = re.compile(
    r"\bfree\b|(?<!including )\bgrav|\blin(ear)? ?acc|(without|no|minus) ?g|user ?acc|rotated|\bworld"
    r"|\bearth|\bglobal|\bnav\b|\bned\b|\benu\b|\bfilt|compensated|\bfused|\bsmooth|\blow ?pass|\bestimat"
)
"""Words of an acceleration that a program has computed: gravity or all but it, in other axes, or smoothed."""
ABSOLUTE = re.compile(
    r"\babs|magnitude|\bnorm\b|\btotal\b|resultant|\bsv[mt]\b|\brms\b|\bsum\b|\bmod(ulus)?\b|\bmean\b"
)
"""Words of the length of a vector, which is no axis."""


def words_of(name: str) -> str:
    """Return the name of a column without its unit as words in small letters: ``raw_accX [g]`` is ``raw acc x``."""
    plain = unit_of_name(name)[0]
    for between in _BETWEEN:
        plain = between.sub(" ", plain)
    return " ".join(re.findall(r"[a-z]+|\d+|#", plain.lower()))
