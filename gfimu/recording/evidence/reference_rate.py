"""Whether a reference rate has the size that the accelerometers give: rev/min and deg/s under a name in rad/s.

In the null space of J the channels read M s(ω) and a constant, with s the products of ω and M the sensitivity of the
null space to them. Their scale is that of the array's lengths. So the slope of these combinations over the square of
the reference is M s(w), where 1/|w| is what the reference is too large by. The means of blocks of time are compared:
they hold little of the noise, and of what turns with the body.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.kinematics import omega_products
from gfimu.array.parts.limits import PartLimits
from gfimu.recording.evidence.rigid import Matrices, product_slopes, rates_of
from gfimu.recording.quantities import GYRO_COLUMNS, REFERENCE_UNITS, reference_quantity
from gfimu.recording.recording import Recording

__all__ = ["OddRate", "RatePolicy", "odd_rates"]

_UNITS = {"rev/min": 30.0 / np.pi, "deg/s": 180.0 / np.pi, "rev/s": 0.5 / np.pi}
"""Units that a rate may be in by mistake, by how many there are in 1 rad/s."""
_SUFFIXES = {"rev/min": "rpm", "deg/s": "deg_s", "deg": "deg"}
"""Endings of a column's name by which the readers know these units."""
_ITERATIONS = 20  # numerical: of the fit of a direction, which settles in a few


@dataclass(frozen=True)
class RatePolicy:
    """Limits of the comparison of a reference with the accelerometers.

    Parameters
    ----------
    blocks : int
        Most blocks of time whose means are compared [1]; by choice, so that errors that last for a while count.
    shortest_block : float
        Shortest block [s]; by choice: about a turn of a slow table.
    fewest_blocks : int
        Fewest blocks for any comparison [1]; by choice.
    explained : float
        Share of the combinations that the reference has to explain before it is judged [1]; by choice.
    sigmas : float
        Standard deviations within which the ratio may be [1]; by choice.
    tolerance : float
        Factor by which gains, places of the chips and the reference itself may move the ratio [1]: a gain of 10 % and
        sites of 5 cm off by 3 mm give 1.16.
    odd : float
        Ratio to the accelerometers' rate from which a reference is wrong [1]; by choice: beyond a slipping belt.
    least_signal : float
        Centripetal terms over the largest constants that biases within their data sheets' limits give [1], below which
        nothing is compared; by choice: biases change by less during a run.
    largest_array : float
        Distance between two chips from which the lengths of the array file may be what is wrong [m]; by choice.
    fastest : float
        Rate that no table or wheel has [rad/s]; by choice: 1900 rev/min.
    """

    blocks: int = 40
    shortest_block: float = 0.5
    fewest_blocks: int = 4
    explained: float = 0.6
    sigmas: float = 4.0
    tolerance: float = 1.2
    odd: float = 1.5
    least_signal: float = 0.05
    largest_array: float = 1.0
    fastest: float = 200.0


@dataclass(frozen=True)
class OddRate:
    """A reference whose rate is not that of the accelerometers.

    Parameters
    ----------
    column : str
        Column of the reference, the first of a gyro.
    text : str
        Cause and remedy, one line.
    certain : bool
        Whether one other unit explains it.
    """

    column: str
    text: str
    certain: bool


def odd_rates(
    recording: Recording,
    array: AccelerometerArray,
    limits: PartLimits,
    alive: NDArray[np.bool_],
    policy: RatePolicy = RatePolicy(),
) -> list[OddRate]:
    """Compare each reference of the rate with the rate that the accelerometers give.

    Parameters
    ----------
    recording : Recording
        Readings in m/s².
    array : AccelerometerArray
        Its array.
    limits : PartLimits
        What its parts may be off by.
    alive : ndarray of bool, shape (c,)
        Channels with readings.
    policy : RatePolicy
        Limits.

    Returns
    -------
    list of OddRate
        Empty where the references fit, or the motion can't tell.
    """
    matrices = Matrices.of(array, alive)
    places = array.chip_positions
    span = float(np.linalg.norm(places[:, None] - places, axis=2).max())
    found = []
    for column, unit, rates in _references(recording):
        ratio = _ratio(recording, array, limits, alive, matrices, rates, policy)
        one = None if ratio is None else _named(column, unit, ratio, span, policy)
        fast = float(np.quantile(np.linalg.norm(np.nan_to_num(rates), axis=1), 0.9))
        if ratio is None and fast > policy.fastest:
            units = " or ".join(_in_words(name, unit) for name in ("rev/min", "deg/s"))
            text = f"column {column} gives {fast:.3g} rad/s, more than a table or wheel has: it may be in {units}"
            one = OddRate(column, f"{text}; check its unit", certain=False)
        if one is not None:
            found.append(one)
    return found


def _references(recording: Recording) -> list[tuple[str, str, NDArray[np.float64]]]:
    """Return name, unit and rate of each reference: (n, 3) of a gyro, (n, 1) about an axis that is not given."""
    have = recording.reference
    found = [(name, "rad/s", have[name][:, None]) for name in ("tacho_rad_s", "command_rad_s") if name in have]
    if "angle_rad" in have and len(recording) > 1:
        found.append(("angle_rad", "rad", np.gradient(have["angle_rad"], recording.t_s)[:, None]))
    if all(name in have for name in GYRO_COLUMNS):
        found.append((GYRO_COLUMNS[0], "rad/s", np.column_stack([have[name] for name in GYRO_COLUMNS])))
    return found


def _ratio(
    recording: Recording,
    array: AccelerometerArray,
    limits: PartLimits,
    alive: NDArray[np.bool_],
    matrices: Matrices,
    rates: NDArray[np.float64],
    policy: RatePolicy,
) -> tuple[float, float] | None:
    """Return the least and the largest ratio of a reference to the accelerometers' rate; None where they can't tell."""
    readings = recording.for_array(array)[:, alive]
    whole = np.isfinite(readings).all(axis=1) & np.isfinite(rates).all(axis=1)
    if not len(matrices.null) or whole.sum() < 2:
        return None
    t = recording.t_s
    length = max(policy.shortest_block, recording.duration / policy.blocks)
    numbers = np.floor((t - t[0]) / length).astype(np.int64)[whole]
    _, member, counts = np.unique(numbers, return_inverse=True, return_counts=True)
    if len(counts) < policy.fewest_blocks:
        return None

    def means(values: NDArray[np.float64]) -> NDArray[np.float64]:
        sums = np.zeros((len(counts), values.shape[1]))
        np.add.at(sums, member, values)
        return np.asarray(sums / counts[:, None])

    seen = means(readings[whole] @ matrices.null.T)  # (b, d)
    about_an_axis = rates.shape[1] == 1
    if about_an_axis:
        predicted = np.repeat(means(rates[whole] ** 2), seen.shape[1], axis=1)
    else:
        predicted = means(omega_products(rates[whole])) @ matrices.sensitivity.T
    constant = np.sqrt((matrices.null**2) @ limits.bias[alive] ** 2)  # (d,)
    slopes, error = _slopes(predicted, seen, constant, policy.explained, together=not about_an_axis)
    if slopes is None:
        return None
    signal = np.linalg.norm(slopes * np.sqrt(np.mean(predicted**2, axis=0)))
    if signal < policy.least_signal * np.linalg.norm(constant):
        return None
    size = float(np.linalg.norm(slopes)) if about_an_axis else float(slopes.mean())
    scale = 1.0
    if about_an_axis:
        w, left = _rate_of(slopes, matrices.sensitivity)
        if left > 1.0 - policy.explained or not w.any():
            return None
        scale = float(np.linalg.norm(matrices.sensitivity @ omega_products(w / np.linalg.norm(w))))
    most, least = (size + policy.sigmas * error) / scale, (size - policy.sigmas * error) / scale
    if most <= 0.0:
        return None
    return 1.0 / np.sqrt(most), 1.0 / np.sqrt(least) if least > 0.0 else np.inf


def _slopes(
    predicted: NDArray[np.float64],
    seen: NDArray[np.float64],
    constant: NDArray[np.float64],
    explained: float,
    *,
    together: bool,
) -> tuple[NDArray[np.float64] | None, float]:
    """Return the slopes (d,) of combinations (b, d) over their prediction, and the standard deviation of their norm.

    Each combination has a constant of its own of the standard deviation ``constant`` (d,). ``together``: one slope for
    all. None where the prediction does not explain the share ``explained`` of what is seen.
    """
    count, free = len(seen), 2
    noise = np.full(seen.shape[1], 1e-12)
    if not predicted.any():
        return None, 0.0
    for _ in range(3):
        weight = count + noise / np.maximum(constant, 1e-9) ** 2
        along = predicted - predicted.sum(axis=0) / weight
        power = np.sum(along * predicted, axis=0)
        product = np.sum(along * seen, axis=0)
        if together:
            power, product = np.full_like(power, power.sum()), np.full_like(product, product.sum())
        slopes = product / power
        offset = np.sum(seen - slopes * predicted, axis=0) / weight
        residual = seen - slopes * predicted - offset
        noise = np.maximum(np.sum(residual**2, axis=0) / max(count - free, 1), 1e-12)
    left = float(np.sum(residual**2) / np.sum((seen - offset) ** 2))
    if left > 1.0 - explained:
        return None, 0.0
    variance = noise / power
    return slopes, float(np.sqrt(variance.max() if together else variance.sum()))


def _rate_of(slopes: NDArray[np.float64], sensitivity: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Return the vector w (3,) whose products fit the slopes (d,) best, and the share that it does not explain."""
    w = rates_of(np.linalg.pinv(sensitivity, rcond=1e-6) @ slopes)[0]  # −w has the same products
    for _ in range(_ITERATIONS):
        slope = sensitivity @ product_slopes(w[None])[0]
        w = w + np.linalg.lstsq(slope, slopes - sensitivity @ omega_products(w), rcond=1e-9)[0]
    return w, float(np.sum((slopes - sensitivity @ omega_products(w)) ** 2) / np.sum(slopes**2))


def _named(column: str, unit: str, ratio: tuple[float, float], span: float, policy: RatePolicy) -> OddRate | None:
    """Say what is wrong with a reference that is that many times the accelerometers' rate, at least and at most."""
    least, most = ratio
    if least <= policy.odd and most >= 1.0 / policy.odd:
        return None
    between = f"{least:.3g} to {most:.3g}" if most < np.inf else f"{least:.3g} or more"
    seen = f"it is {between} times what the accelerometers give"
    units = [
        _in_words(name, unit)
        for name, factor in _UNITS.items()
        if least / policy.tolerance <= factor <= most * policy.tolerance and not (unit == "rad" and name == "rev/min")
    ]
    if not units:
        text = f"column {column}: {seen}; check its unit, the gear, and the lengths of the array file"
        return OddRate(column, text, certain=False)
    quantity = reference_quantity(column) or column
    suffix = _SUFFIXES.get(units[0])
    named = len(units) == 1 and suffix in REFERENCE_UNITS.get(quantity, {})
    remedy = f"name it {quantity}_{suffix}, or convert it to {unit}" if named else f"convert it to {unit}"
    text = f"column {column} is in {' or '.join(units)}, not in {unit}: {seen}; {remedy}"
    if span > policy.largest_array:
        text += f"; or the lengths of the array file are in cm: two of its chips are {span:.3g} m apart"
    return OddRate(column, text, certain=len(units) == 1 and span <= policy.largest_array)


def _in_words(name: str, unit: str) -> str:
    """Return the unit of a rate, or of the angle that has this rate."""
    return {"rev/s": "turns", "deg/s": "deg", "rev/min": "turns/60"}[name] if unit == "rad" else name
