"""Where to look for an effect whose frequency or order is unknown: scans of what a fit leaves.

The product of a whitened residual with a column is that column's score, so that thousands of frequencies cost no more
than a Fourier transform.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from gfimu.model.world_model import Whitened

__all__ = ["mode_shapes", "order_shapes", "peaks", "tone_shapes"]

_ORDERS = np.arange(1.0, 37.0)
_DAMPINGS = (0.01, 0.03, 0.1)
_SLOWEST_MODE = 1.5  # Hz
_SLOWEST_TONE = 4.0  # cycles in a run
_PADDED = 8


def peaks(power: NDArray[np.float64], count: int, apart: int = 1) -> list[int]:
    """Return the places of the highest values that are apart from each other."""
    left, found = power.copy(), []
    for _ in range(count):
        place = int(np.argmax(left))
        found.append(place)
        left[max(place - apart, 0) : place + apart + 1] = -1.0
    return found


def tone_shapes(left: Sequence[Whitened], count: int) -> tuple[list[dict[str, float]], float]:
    """Return the strongest lines of the longest residual summed over the channels."""
    longest = max(left, key=lambda one: len(one.t))
    total = longest.residual[:, :-1].sum(axis=1)
    period = float(longest.t[1] - longest.t[0])
    power = np.abs(np.fft.rfft(total, _PADDED * len(total))) ** 2
    frequency = np.fft.rfftfreq(_PADDED * len(total), period)
    power[frequency < _SLOWEST_TONE / (len(total) * period)] = 0.0
    best = peaks(power, count, apart=2 * _PADDED)
    return [{"frequency_hz": float(frequency[place])} for place in best], len(total) / 2


def order_shapes(
    left: Sequence[Whitened],
    count: int,
    column: Callable[[Whitened], tuple[NDArray[np.float64], NDArray[np.float64]]],
) -> tuple[list[dict[str, float]], float]:
    """Return the strongest orders of the table's angle.

    ``column`` gives the score of each sample (n,) and its information (n,).
    """
    power = np.zeros(len(_ORDERS))
    for one in left:
        score, information = column(one)
        turns = np.exp(1j * np.outer(_ORDERS, one.state.angle))  # (orders, n)
        power += np.abs(turns @ score) ** 2 / (0.5 * information.sum() + 1e-12)
    return [{"order": float(_ORDERS[place])} for place in peaks(power, count)], float(len(_ORDERS))


def per_acceleration(one: Whitened) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return score and information of an angular acceleration at each sample."""
    pattern = one.array.regression_matrix[:, 2]  # m
    weight = float(np.sum(pattern**2 * one.weights[:-1]))
    return one.residual[:, :-1] @ pattern, np.full(len(one.t), weight)


def per_rate(one: Whitened) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return score and information of a ratio of the reference at each sample."""
    return one.residual[:, -1] * one.state.rate, one.state.rate**2 * one.weights[-1]


def mode_shapes(left: Sequence[Whitened], count: int) -> tuple[list[dict[str, float]], float]:
    """Return the modes of every frequency and damping that, excited by the drive, follow the residual best."""
    period = float(left[0].t[1] - left[0].t[0])
    top = 0.45 / period
    modes = []
    for damping in _DAMPINGS:
        number = int(np.log(top / _SLOWEST_MODE) / (1.5 * damping + 0.01)) + 1
        modes += [(float(f), damping) for f in np.geomspace(_SLOWEST_MODE, top, number)]
    power, energy = np.zeros(len(modes)), np.full(len(modes), 1e-30)
    for one in left:
        score, information = per_acceleration(one)
        for place, (frequency, damping) in enumerate(modes):
            ring = _modal_acceleration(one.state.acceleration, frequency, damping, period)
            power[place] += float(ring @ score)
            energy[place] += float(information @ ring**2)
    gain = np.array(power**2 / energy)
    shapes = []
    for _ in range(count):
        place = int(np.argmax(gain))
        frequency, damping = modes[place]
        shapes.append({"frequency_hz": frequency, "damping_ratio": damping})
        for other, (f, zeta) in enumerate(modes):
            if abs(np.log(f / frequency)) < 0.05 and abs(np.log(zeta / damping)) < 0.1:
                gain[other] = -1.0
    return shapes, 60.0


def _modal_acceleration(
    push: NDArray[np.float64], frequency: float, damping: float, period: float
) -> NDArray[np.float64]:
    """Return the acceleration of a mode against its base, by the bilinear transform with the frequency pre-warped."""
    # s²/(s² + 2ζω₀s + ω₀²) at s = (2/T)(1 − z⁻¹)/(1 + z⁻¹), in units of 2/T.
    natural = np.tan(np.pi * frequency * period)
    denominator = [
        1.0 + 2 * damping * natural + natural**2,
        2.0 * (natural**2 - 1.0),
        1.0 - 2 * damping * natural + natural**2,
    ]
    return np.asarray(lfilter([1.0, -2.0, 1.0], denominator, push - push[0]))
