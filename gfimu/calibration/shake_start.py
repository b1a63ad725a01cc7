"""Where the fit of a shake starts: which samples belong to it, and a first rate with its sign."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.calibration.array_motion import turning_readings
from gfimu.rate.channel_sets import ChannelSets
from gfimu.rate.maximum_likelihood import rates_of_null_space
from gfimu.recording import Recording
from gfimu.recording.rest import Rest

__all__ = ["Shake", "shakes", "signed_rate"]

Floats = NDArray[np.float64]

_REST_KEPT_S = 0.3
_SLOWEST = 2.0  # rad/s: below it the centripetal field of a hand-sized array is under the noise
_SHORTEST_S = 0.5
_MOST_SAMPLES = 4000


@dataclass(frozen=True)
class Shake:
    """One stretch of motion from rest to rest.

    Parameters
    ----------
    t_s : ndarray, shape (n,)
        Times, s.
    readings : ndarray, shape (n, c)
        Corrected readings, m/s², in the array's order.
    still : ndarray of bool, shape (n,)
        Samples at rest, at its ends.
    omega : ndarray, shape (n, 3)
        First rate, rad/s.
    """

    t_s: Floats
    readings: Floats
    still: NDArray[np.bool_]
    omega: Floats


def shakes(recording: Recording, array: AccelerometerArray, rest: Rest, noise: Floats) -> list[Shake]:
    """Cut the shakes out of a recording: motion between rests that turns fast enough.

    Parameters
    ----------
    recording : Recording
        Corrected readings, m/s².
    array : AccelerometerArray
        The drawing.
    rest : Rest
        Stretches of rest.
    noise : ndarray, shape (c,)
        White noise of a sample, m/s².

    Raises
    ------
    InputError
        If no stretch between rests turns faster than 2 rad/s for half a second.
    """
    n, kept = len(recording), max(round(_REST_KEPT_S * recording.sample_rate), 3)
    edges = np.concatenate([[0], np.column_stack([rest.start, rest.stop]).ravel(), [n]])
    found = []
    for before, after in zip(edges[::2], edges[1::2], strict=True):
        first, last = max(before - kept, 0), min(after + kept, n)
        if after - before < _SHORTEST_S * recording.sample_rate:
            continue
        readings, t = recording.for_array(array)[first:last], recording.t_s[first:last]
        good = np.isfinite(readings).all(axis=1)
        readings, t = readings[good], t[good]
        place = np.arange(first, last)[good]
        still = (place < before) | (place >= after)
        rate = signed_rate(array, t, readings, noise, still)
        moving = np.linalg.norm(rate, axis=1) > _SLOWEST
        if _turning(readings, array, noise)[~still].mean() < 0.5 or moving.sum() < _SHORTEST_S * recording.sample_rate:
            continue
        found.append(Shake(t, readings, still, rate))
    if not found:
        raise InputError(
            f"nothing between the rests turns faster than {_SLOWEST:g} rad/s for {_SHORTEST_S:g} s; shake and turn the "
            "array about all its axes, from rest to rest"
        )
    return _thinned(found)


def signed_rate(
    array: AccelerometerArray, t: Floats, readings: Floats, noise: Floats, still: NDArray[np.bool_]
) -> Floats:
    """Rate of every sample by maximum likelihood, (n, 3), rad/s, with the signs that α ties together."""
    full = ChannelSets(array, np.broadcast_to(noise, array.n_channels).astype(float)).full
    rate = np.nan_to_num(rates_of_null_space(readings @ full.product_rows.T, full.sensitivity)[0])
    rate[still] = 0.0
    return _with_signs(rate, readings, t, array)


def _turning(readings: Floats, array: AccelerometerArray, noise: Floats) -> NDArray[np.bool_]:
    """Whether the chips of each sample differ by more than their noise: only rotation makes them, shape (n,)."""
    apart = readings - readings @ np.linalg.pinv(array.axes).T @ array.axes.T
    expected = float(np.sum(noise**2)) * (array.n_channels - 3) / array.n_channels
    return np.asarray(np.sum(apart**2, axis=1) > 4.0 * expected)


def _thinned(found: list[Shake]) -> list[Shake]:
    """Keep the fastest shakes, so many that their samples can be adjusted together; a long one is cut."""
    order = sorted(found, key=lambda shake: -float(np.mean(np.sum(shake.omega**2, axis=1))))
    chosen, room = [], _MOST_SAMPLES
    for shake in order:
        part = slice(0, room)
        if room >= min(len(shake.t_s), _MOST_SAMPLES // 4):
            chosen.append(Shake(shake.t_s[part], shake.readings[part], shake.still[part], shake.omega[part]))
            room -= len(chosen[-1].t_s)
    return sorted(chosen, key=lambda shake: float(shake.t_s[0]))


def _with_signs(rate: Floats, readings: Floats, t: Floats, array: AccelerometerArray) -> Floats:
    """Give the rates of all samples the signs under which their steps agree best with the angular acceleration.

    The centripetal field shows ±ω. Of all sequences of signs the one with the least sum of
    |ω_k − ω_(k−1) − α dt|² is taken (Viterbi's algorithm); α holds for both signs.
    """
    alpha = turning_readings(readings, array, rate)
    step = 0.5 * (alpha[1:] + alpha[:-1]) * np.diff(t)[:, None]  # (n − 1, 3)
    same = np.sum((rate[1:] - rate[:-1] - step) ** 2, axis=1), np.sum((rate[:-1] - rate[1:] - step) ** 2, axis=1)
    turned = np.sum((rate[1:] + rate[:-1] - step) ** 2, axis=1), np.sum((rate[1:] + rate[:-1] + step) ** 2, axis=1)
    scale = 1.0 / (1.0 + 0.01 * np.sum(rate[1:] ** 2 + rate[:-1] ** 2, axis=1))
    plus, minus = 0.0, 0.0
    origin = np.zeros((len(rate), 2), dtype=bool)  # whether the best way to + or − came from the other sign
    for k in range(len(step)):
        to_plus = plus + same[0][k] * scale[k], minus + turned[0][k] * scale[k]
        to_minus = minus + same[1][k] * scale[k], plus + turned[1][k] * scale[k]
        origin[k + 1] = to_plus[1] < to_plus[0], to_minus[1] < to_minus[0]
        plus, minus = min(to_plus), min(to_minus)
    signs = np.ones(len(rate))
    sign = 1 if plus <= minus else -1
    for k in range(len(rate) - 1, -1, -1):
        signs[k] = sign
        if origin[k, 0 if sign > 0 else 1]:
            sign = -sign
    return np.asarray(rate * signs[:, None])
