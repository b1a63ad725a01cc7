"""Units of triads of an unknown table: by their names, by gravity at rest, and a gyro's by how gravity turns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.base.units import STANDARD_GRAVITY
from gfimu.recording.doubts.samples import least_step
from gfimu.recording.importing.raw_table import RawTable
from gfimu.recording.policy import GuessPolicy
from gfimu.recording.units import factor_of, kind_of, last_word_unit, unit_of_name

__all__ = [
    "NEAR",
    "TriadUnit",
    "are_poses",
    "rest_windows",
    "sphere_of",
    "triad_values",
    "unit_of_acceleration",
    "unit_of_rate",
]

_POLICY = GuessPolicy()
_GRAVITY = {"m/s^2": 1.0, "g": STANDARD_GRAVITY, "mg": STANDARD_GRAVITY / 1e3, "mm/s^2": 1e-3, "cm/s^2": 1e-2}
_RARE = {"mm/s^2", "cm/s^2"}  # units that hardly any logger writes
NEAR = 0.08  # relative, of gravity at rest: gains of parts lie within
_WINDOWS = 400  # pieces into which a triad is divided to look for rest
_BEST, _AS_QUIET = 5, 3.0  # pieces that show how quiet rest is, and how many times that still counts as rest
_STEP_SCATTER = 1.0  # steps by which rounded readings scatter at rest
_LOW_COUNTS = 20.0  # below that counts per g would be too coarse for any part
_FASTEST_RAD_S = 40.0  # rad/s: beyond the range of nearly all gyros (2000 °/s is 35 rad/s)
_ROUND = 0.03  # relative scatter of the poses about a sphere: gains of the axes differ by less
_TURNED = 0.5  # of the radius, by which poses differ along each axis where they show a sphere
_POSES = 9  # rest poses from which offset and scale of raw counts follow
_SCALES = {
    ("rad/s", 1.0): "rad/s",
    ("deg/s", 1.0): "°/s",
    ("deg/s", 1e-3): "m°/s",
    ("mrad/s", 1.0): "mrad/s",
    **{("deg/s", 1.0 / counts): f"{counts:g} counts per °/s" for counts in (131.0, 65.5, 32.8, 16.4, 14.375)},
    **{("deg/s", 1e-3 * step): f"{step:g} m°/s per count" for step in (4.375, 8.75, 17.5, 35.0, 70.0)},
}
_TURN_WINDOW_S = 0.2  # over which readings are averaged before gravity's turn is taken
_LEAST_TURN = 0.6  # correlation of gravity's turn with the gyro's from which the scale follows
_NEAR_SCALE = 0.1  # relative, by which a usual scale may differ from that by gravity's turn


@dataclass(frozen=True)
class TriadUnit:
    """Unit of a triad: (number − offset) · scale in a unit.

    Parameters
    ----------
    unit : str
        As in a column map.
    scale : float
        One step of the numbers in that unit.
    offset : tuple of float
        Numbers at zero, per axis.
    why : str
        What the guess rests on.
    sure : bool
        Whether the data leave no other reading.
    is_gravity : bool
        Whether gravity at rest is that of a usual unit, a usual number of counts, or of a sphere of poses.
    agreement : float
        Of rates: correlation of what gravity turns by with what they would turn it by; 0 where that is not known.
    off : float
        Of accelerations in a usual unit: relative distance of the length at rest from gravity.
    """

    unit: str
    scale: float
    offset: tuple[float, float, float]
    why: str
    sure: bool
    is_gravity: bool = True
    agreement: float = 0.0
    off: float = 0.0


def triad_values(table: RawTable, columns: Sequence[str]) -> NDArray[np.float64]:
    """Return three columns of a table, (n, 3)."""
    return np.column_stack([table.numbers(name) for name in columns])


def rest_windows(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the means of the quietest of equal pieces of a triad, (k, 3), a fifth; all rows if each is a pose."""
    rows = values[np.isfinite(values).all(axis=1) & values.any(axis=1)]  # zeros throughout: nothing measured yet
    if are_poses(rows):
        return np.asarray(rows)
    size = max(len(rows) // _WINDOWS, 8)
    count = len(rows) // size
    if count < 5:
        return rows.mean(axis=0, keepdims=True) if len(rows) else np.empty((0, 3))
    pieces = rows[: count * size].reshape(count, size, 3)
    means, scatter = pieces.mean(axis=1), pieces.std(axis=1).max(axis=1)
    best = float(np.sort(scatter)[min(_BEST, count) - 1])
    still = max(_AS_QUIET * best, _STEP_SCATTER * least_step(rows))
    return np.asarray(means[scatter <= min(float(np.quantile(scatter, 0.2)), still)])


def are_poses(rows: NDArray[np.float64]) -> bool:
    """Whether each row is a pose at rest: about as long as the others, and turned from the one before."""
    if len(rows) < _POSES:
        return False
    lengths = np.linalg.norm(rows, axis=1)
    usual = float(np.median(lengths))
    jumps = np.linalg.norm(np.diff(rows, axis=0), axis=1)
    return bool(float(np.std(lengths)) < _POLICY.pose_lengths * usual and float(np.median(jumps)) > _TURNED * usual)


def unit_of_acceleration(table: RawTable, columns: Sequence[str]) -> TriadUnit:
    """Return the unit of a triad of accelerations: from its names, or from gravity at rest."""
    zero = (0.0, 0.0, 0.0)
    values = triad_values(table, columns)
    windows = rest_windows(values)
    length = float(np.median(np.linalg.norm(windows, axis=1))) if len(windows) else float("nan")
    unit = unit_of_name(columns[0])[1]
    if unit:
        said = length * factor_of(unit, "acceleration")
        agrees = abs(said / STANDARD_GRAVITY - 1.0) < NEAR
        why = f"the name has {unit}; at rest {said:.3g} m/s²" + ("" if agrees else ", which is not gravity")
        return TriadUnit(unit, 1.0, zero, why, agrees, agrees)
    usual = _usual_unit(values, length)
    if usual is not None:
        return usual
    last = last_word_unit(columns[0])
    if kind_of(last) == "acceleration":
        size = length * factor_of(last, "acceleration")
        is_near = abs(size / STANDARD_GRAVITY - 1.0) < _POLICY.near_in_motion
        why = f"the name ends in {last}; at rest {size:.3g} m/s²" + ("" if is_near else ", which is not gravity")
        return TriadUnit(last, 1.0, zero, why, is_near, False)
    sphere = sphere_of(windows)
    if sphere is not None:
        centre, radius = sphere
        # Raw counts with an offset: their length alone means nothing.
        if np.linalg.norm(centre) > 0.2 * radius:
            offset = (float(centre[0]), float(centre[1]), float(centre[2]))
            where = ", ".join(f"{one:.6g}" for one in centre)
            why = f"rest poses lie on a sphere about {where} of radius {radius:.6g} counts"
            return TriadUnit("g", 1.0 / radius, offset, why, _are_whole(values))
    if _LOW_COUNTS < length < math.inf:
        power = 2.0 ** round(math.log2(length))
        if abs(length / power - 1.0) < NEAR and _are_whole(values):
            why = f"at rest its length is {length:.5g}: {power:g} counts per g"
            return TriadUnit("g", 1.0 / power, zero, why, abs(length / power - 1.0) < _POLICY.exact_counts)
        why = f"at rest its length is {length:.5g}, taken as 1 g; the data sheet has the exact scale"
        return TriadUnit("g", 1.0 / length, zero, why, False, False)
    return TriadUnit(
        "m/s^2", 1.0, zero, f"at rest its length is {length:.4g}: no unit of gravity; is it without g?", False, False
    )


def _usual_unit(values: NDArray[np.float64], length: float) -> TriadUnit | None:
    """Return the usual unit in which gravity comes nearest to a length at rest, with the others that are as likely."""
    readings = {name: STANDARD_GRAVITY / factor for name, factor in _GRAVITY.items()}
    if _are_whole(values):
        readings["1024 counts per g"] = 1024.0
    off = {name: abs(length / one - 1.0) for name, one in readings.items()}
    near = [name for name, distance in off.items() if distance < NEAR]
    near.sort(key=lambda name: off[name] + _POLICY.rare * (name in _RARE))
    if not near:
        return None
    best, *others = near
    unit, scale = ("g", 1.0 / 1024.0) if best not in _GRAVITY else (best, 1.0)
    why = (
        f"at rest its length is {length:.4g}: gravity in {best}"
        if best in _GRAVITY
        else f"at rest {length:.4g}: {best}"
    )
    why += f"; {' or '.join(others)} is possible" if others else ""
    return TriadUnit(unit, scale, (0.0, 0.0, 0.0), why, not others, off=off[best])


def _are_whole(values: NDArray[np.float64]) -> bool:
    """Whether all readings are whole numbers, as counts are."""
    known = values[np.isfinite(values)]
    return bool(np.all(known == np.round(known)))


def sphere_of(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], float] | None:
    """Fit a sphere to rest poses by linear least squares; None where they do not determine one."""
    if len(points) < _POSES:
        return None
    middle, size = points.mean(axis=0), float(np.abs(points - points.mean(axis=0)).max()) or 1.0
    scaled = (points - middle) / size
    matrix = np.column_stack([2.0 * scaled, np.ones(len(points))])
    if np.linalg.cond(matrix) > 30.0:
        return None
    solution = np.linalg.lstsq(matrix, (scaled**2).sum(axis=1), rcond=None)[0]
    radius = math.sqrt(max(float(solution[3] + solution[:3] @ solution[:3]), 0.0))
    scatter = float(np.std(np.linalg.norm(scaled - solution[:3], axis=1)))
    turned = float(np.ptp(scaled, axis=0).min()) > _TURNED * radius
    return (middle + size * solution[:3], size * radius) if turned and scatter < _ROUND * radius else None


def unit_of_rate(
    rates: NDArray[np.float64], name: str, forces: NDArray[np.float64] | None = None, rate_hz: float | None = None
) -> TriadUnit:
    """Return the unit of a triad of rates: from its names, from how gravity turns, or from the largest value.

    Parameters
    ----------
    rates : ndarray, shape (n, 3)
        The numbers.
    name : str
        Name of the first column.
    forces : ndarray, shape (n, 3), optional
        Specific force of a chip in the gyro's axes, m/s², in the same rows.
    rate_hz : float, optional
        Sample rate of both, where it is known.
    """
    zero = (0.0, 0.0, 0.0)
    turned = None if forces is None or rate_hz is None else _turn_of_gravity(rates, forces, rate_hz)
    turn, agreement = turned or (None, 0.0)
    unit = unit_of_name(name)[1]
    if unit:
        if turn is None or abs(turn / factor_of(unit, "rate") - 1.0) < 0.5:
            return TriadUnit(unit, 1.0, zero, f"the name has {unit}", True, agreement=agreement)
        words = min(_SCALES.items(), key=lambda one: abs(_log_ratio(one[0], turn)))[1]
        ratio = turn / factor_of(unit, "rate")
        why = f"the name has {unit}, but by the turn of gravity they are {ratio:.2g} times that, nearest to {words}"
        return TriadUnit(unit, 1.0, zero, why, False, agreement=agreement)
    if turn is not None:
        (unit, scale), words = min(_SCALES.items(), key=lambda one: abs(_log_ratio(one[0], turn)))
        ratio = math.exp(_log_ratio((unit, scale), turn))
        others = [
            word
            for key, word in _SCALES.items()
            if word != words and abs(_log_ratio(key, turn) - _log_ratio((unit, scale), turn)) < _POLICY.ratio_error
        ]
        why = f"gravity turns as these rates do in {words} (ratio {ratio:.3f})"
        why += f"; {' or '.join(others)} is as likely" if others else ""
        sure = not others and abs(ratio - 1.0) < _NEAR_SCALE
        return TriadUnit(unit, scale, zero, why, sure, agreement=agreement)
    largest = float(np.nanmax(np.abs(rates)))
    if largest > 2500.0:
        why = f"up to {largest:.4g}: counts; 16.4 per °/s (±2000 °/s) is a guess, the data sheet has the scale"
        return TriadUnit("deg/s", 1.0 / 16.4, zero, why, False)
    if largest > _FASTEST_RAD_S:
        whole = _are_whole(rates)
        why = f"up to {largest:.4g}: too fast for rad/s" + ("; deg/s, or counts" if whole else "")
        return TriadUnit("deg/s", 1.0, zero, why, not whole)
    return TriadUnit("rad/s", 1.0, zero, f"up to {largest:.4g}: rad/s, or slow motion in deg/s", False)


def _log_ratio(scale: tuple[str, float], turn: float) -> float:
    return math.log(turn / (factor_of(scale[0], "rate") * scale[1]))


def _turn_of_gravity(
    rates: NDArray[np.float64], forces: NDArray[np.float64], rate_hz: float
) -> tuple[float, float] | None:
    """Return what one step of a gyro's numbers is, rad/s, and the correlation, from how gravity turns: ḟ = −ω × f.

    Samples where the specific force is not near gravity do not count. None where the two do not agree: a motion that
    does not turn gravity, or axes that differ.
    """
    size = max(int(_TURN_WINDOW_S * rate_hz), 1)
    count = len(rates) // size
    if count < 20:
        return None

    def averaged(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(values[: count * size].reshape(count, size, 3).mean(axis=1))

    scatter = rates[: count * size].reshape(count, size, 3).std(axis=1).max(axis=1)
    offset = np.nanmedian(averaged(rates)[scatter.argsort()[:10]], axis=0)  # from the quietest windows
    # The same average of both sides of f(t₂) − f(t₁) = −∫ ω × f dt, so that fast turns bias nothing.
    f = averaged(forces)
    turned = np.diff(f, axis=0)
    expected = np.diff(averaged(np.cumsum(-np.cross(rates - offset, forces), axis=0) / rate_hz), axis=0)
    quiet = np.abs(np.linalg.norm(f, axis=1) / STANDARD_GRAVITY - 1.0) < 0.3
    good = (quiet[1:] & quiet[:-1])[:, None] & np.isfinite(turned) & np.isfinite(expected)
    if good.sum() < 60:
        return None
    left, right = turned[good], expected[good]
    power = float(right @ right)
    if power == 0.0 or not left.any():
        return None
    correlation = float(left @ right) / math.sqrt(power * float(left @ left))
    return (float(left @ right) / power, correlation) if correlation > _LEAST_TURN else None
