"""What a faulty channel does: step, drift, gain, noise, stuck or spikes.

The difference r of a channel from what the other channels predict is fitted from the onset of the fault to shortly
after it was found. Each kind is a model of r with at most one size,

    step r = f,   drift r = f (t − t₀),   gain r = f s (s the predicted reading),   noise r ~ N(0, σ²),

and the one with the least Bayesian information criterion is named. A channel that repeats one value is frozen; noise of
which a few samples hold most is spikes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.rate.health.fault import ChannelFault
from gfimu.rate.health.policy import MonitorPolicy
from gfimu.rate.health.recursion.prediction import omega_products, prediction_row
from gfimu.rate.sensing import SensorErrors

__all__ = ["kind_of_fault", "name_kinds"]

_SLOW = ("drift", "gain")
_FEWEST = 8  # numerical: samples
_PARTS = 5  # numerical: of a time, whose means show errors that last


def kind_of_fault(
    t: NDArray[np.float64],
    readings: NDArray[np.float64],
    difference: NDArray[np.float64],
    noise_std: float,
    policy: MonitorPolicy | None = None,
) -> str:
    """Name what a channel does.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times from the onset on, s.
    readings : ndarray, shape (n,)
        Readings of the channel, m/s².
    difference : ndarray, shape (n,)
        Readings less the prediction by the other channels, with the bias from before the onset taken off, m/s².
    noise_std : float
        Standard deviation of one sample of ``difference`` from a sound channel, m/s².
    policy : MonitorPolicy, optional
        What counts as noise and as spikes.

    Returns
    -------
    str
        "step", "drift", "gain", "noise", "stuck", "spikes" or "unknown".
    """
    policy = policy or MonitorPolicy()
    valid = np.isfinite(readings) & np.isfinite(difference)
    t, readings, difference = t[valid], readings[valid], difference[valid]
    if len(t) < _FEWEST:
        return "unknown"
    if np.ptp(readings[len(readings) // 4 :]) == 0.0:
        return "stuck"
    predicted = readings - difference
    columns = {
        "step": np.ones(len(t)),
        "drift": t - t[0],
        "gain": predicted,
    }
    removed = {}
    for name, column in columns.items():
        length = float(column @ column)
        removed[name] = float(column @ difference) ** 2 / length / noise_std**2 if length > 0.0 else 0.0
    best = max(removed, key=lambda name: removed[name])
    if removed["step"] >= removed[best] - policy.kind_decided:  # a gain at rest looks like a step, and is called one
        best = "step"
    column = columns[best]
    rest = difference - column * float(column @ difference) / float(column @ column)
    variance = float(rest @ rest) / (len(t) - 1) / noise_std**2
    energy = len(t) * (variance - 1.0 - np.log(max(variance, 1e-12))) if variance > policy.noisy_kind else 0.0
    if energy > removed[best]:
        share = np.sort(rest**2)[::-1].cumsum()
        few = max(1, int(policy.spike_share * len(t)))
        return "spikes" if share[few - 1] > 0.9 * share[-1] else "noise"
    if removed[best] < 0.5 * float(difference @ difference) / noise_std**2 - len(t):
        return "unknown"
    return best


def name_kinds(
    array: AccelerometerArray,
    errors: SensorErrors,
    t: NDArray[np.float64],
    readings: NDArray[np.float64],
    omega: NDArray[np.float64],
    faults: Sequence[ChannelFault],
    *,
    policy: MonitorPolicy,
    early: bool = False,
) -> tuple[ChannelFault, ...]:
    """Name the kind of each isolated fault of a recording; several channels of one fault share it or are "unknown".

    ``t`` (n,), ``readings`` (n, c) and ``omega`` (n, 3) are the recording and the rate found in it, rad/s. ``early``: a
    drift or a gain can't be separated from a step yet, and is called one.
    """
    named = []
    for fault in faults:
        if not fault.isolated:
            named.append(fault)
            continue
        used = np.ones(array.n_channels, dtype=np.bool_)
        for other in faults:
            if other.onset_s < fault.found_s + policy.kind_span_s and other.end_s > fault.onset_s - policy.kind_span_s:
                used[[array.channels.index(name) for name in other.channels]] = False
        found = [
            _seen(array, errors, t, readings, omega, fault, array.channels.index(name), used, policy)
            for name in fault.channels
        ]
        named.append(_described(fault, [one for one in found if one is not None], policy, early=early))
    return tuple(named)


@dataclass(frozen=True)
class _Seen:
    """What a channel did around a fault."""

    t: NDArray[np.float64]  # (n,) from the onset on, s
    readings: NDArray[np.float64]  # (n,) m/s²
    difference: NDArray[np.float64]  # (n,) from the prediction, less its mean before the onset, m/s²
    noise_std: float  # of one sample of it
    constant_std: float  # of its mean: bias and errors of the calibration


def _described(fault: ChannelFault, seen: list[_Seen], policy: MonitorPolicy, *, early: bool) -> ChannelFault:
    """Return the fault with its kind, and the sizes of a step as the differences have them."""
    kinds = {kind_of_fault(one.t, one.readings, one.difference, one.noise_std, policy) for one in seen}
    if len(seen) < len(fault.channels) or len(kinds) != 1:
        return replace(fault, kind="unknown")
    kind = kinds.pop()
    if early and kind in _SLOW:
        kind = "step"
    if kind != "step":
        return replace(fault, kind=kind)
    sizes, spreads = [], []
    for one in seen:  # the onset is known to a block
        settled = one.difference[(one.t > fault.onset_s + policy.block_s) & np.isfinite(one.difference)]
        if not len(settled):
            return replace(fault, kind=kind)
        sizes.append(float(settled.mean()))
        spreads.append(float(np.hypot(_std_of_mean(settled, one.noise_std), one.constant_std)))
    return replace(fault, kind=kind, sizes=tuple(sizes), sizes_std=tuple(spreads))


def _std_of_mean(values: NDArray[np.float64], noise_std: float) -> float:
    """Return the standard deviation of a mean, of values (n,) whose errors may last for a part of their time."""
    white = noise_std / np.sqrt(len(values))
    if len(values) < _PARTS * _FEWEST:
        return float(white)
    means = [part.mean() for part in np.array_split(values, _PARTS)]
    return float(max(white, np.std(means, ddof=1) / np.sqrt(_PARTS)))


def _seen(
    array: AccelerometerArray,
    errors: SensorErrors,
    t: NDArray[np.float64],
    readings: NDArray[np.float64],
    omega: NDArray[np.float64],
    fault: ChannelFault,
    channel: int,
    used: NDArray[np.bool_],
    policy: MonitorPolicy,
) -> _Seen | None:
    """Return what one channel of a fault did; None where the others don't predict it."""
    lengths = np.array([array.length_unit] * 3 + [1.0] * 3)
    if np.linalg.matrix_rank(array.regression_matrix[used] / lengths, tol=1e-6) < 6:
        return None
    row = prediction_row(array, channel, used)
    near = (t >= fault.onset_s - policy.kind_span_s) & (t <= min(fault.found_s + policy.kind_span_s, fault.end_s))
    part = np.where(np.isfinite(readings[near]) | (row != 0.0), readings[near], 0.0)
    difference = part @ row - omega_products(omega[near]) @ (row @ array.centripetal_matrix)
    times = t[near]
    noise = float(np.sqrt(np.sum((row * errors.noise_std) ** 2)))
    before = (times < fault.onset_s - policy.block_s) & np.isfinite(difference)
    variance = float(row @ row) * policy.bias_std**2
    if before.any():
        variance = float(row @ row) * policy.bias_walk * policy.kind_span_s
        variance += _std_of_mean(difference[before], noise) ** 2
        difference = difference - float(np.mean(difference[before]))
    ranges = np.nan_to_num(np.nanmax(part, axis=0) - np.nanmin(part, axis=0)) if len(part) else np.zeros(len(row))
    variance += float(np.sum((0.5 * errors.gain_std * ranges * row) ** 2))
    after = times >= fault.onset_s
    return _Seen(times[after], part[after, channel], difference[after], noise, float(np.sqrt(variance)))
