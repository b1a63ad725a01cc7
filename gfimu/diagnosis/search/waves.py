"""Waves of the angle or of time in what a fit leaves, looked for at each place by the signal that it would make."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.diagnosis.terms.located.alternatives import ChannelTerms, channel_patterns
from gfimu.diagnosis.terms.located.policy import LOCATED
from gfimu.diagnosis.terms.located.term import LocatedTerm
from gfimu.model.located.dependences.waves import Wave
from gfimu.model.located.operators import Operator, rig_places
from gfimu.model.located.rig_state import RigState

__all__ = ["signal_of", "wave_terms"]

_Floats = NDArray[np.float64]


def signal_of(operator: Operator, whitened: _Floats, weights: _Floats) -> _Floats:
    """Return the error (n,) that an operator's strongest part would make of what a fit leaves, sample by sample.

    Parameters
    ----------
    operator : Operator
        How the error shows.
    whitened : ndarray, shape (n, c + 1)
        W times the residual.
    weights : ndarray, shape (c + 1,)
        One over the white variance of each observation.
    """
    part = next(part for part in reversed(operator.parts) if part is not None)
    return np.asarray(np.sum(part * whitened, axis=1) / np.maximum(part**2 @ weights, 1e-12))  # numerical


def wave_terms(
    states: Sequence[RigState], posteriors: Sequence[Any], array: AccelerometerArray, *, is_angle: bool
) -> tuple[list[LocatedTerm], list[ChannelTerms]]:
    """Return terms of the strongest waves of the angle and of time, in the rig and on channels.

    They are looked for in the longest stretch.
    """
    longest = max(range(len(states)), key=lambda index: len(states[index].t))
    state, posterior = states[longest], posteriors[longest]
    whitened, weights = posterior.whitened, posterior.observed.weights
    fastest = max(float(np.abs(one.spin.rate).max()) for one in states)
    places, terms = rig_places(is_angle=is_angle, has_geometry=state.placed is not None), list[LocatedTerm]()
    for what in sorted({"reads", "turns", "vibrates", "shakes", "heaves", "gain"} & places.keys()):
        signal = np.column_stack([signal_of(one, whitened, weights) for one in places[what].operators(state)])
        of_time = what != "turns"  # the drive follows a tone, as far as its knots do
        terms += [LocatedTerm(places[what], wave) for wave in _waves(signal, state, fastest, of_time=of_time)]
    patterns = channel_patterns(array)
    waves = _waves(whitened[:, :-1] / weights[:-1], state, fastest, of_time=True)
    return terms, [ChannelTerms("offset", wave, patterns) for wave in waves]


def _waves(signal: _Floats, state: RigState, fastest: float, *, of_time: bool) -> Iterator[Wave]:
    """Yield the strongest waves in signals (n, k) of a place."""
    scaled = signal / np.maximum(signal.std(axis=0), 1e-12)  # numerical
    for hz in _tones(scaled, state.period) if of_time else ():
        yield Wave(hz, 1.0 / (len(state.t) * state.period), of_time=True)
    for cycles in _orders(scaled, state):
        apart = 2.0 * np.pi / float(np.ptp(state.spin.angle))
        yield Wave(cycles, apart)
        yield Wave(cycles, apart, fastest=fastest)


def _tones(scaled: _Floats, period: float) -> list[float]:
    """Return the frequencies of the strongest tones in signals (n, k), Hz."""
    padded = LOCATED.padded * len(scaled)
    power = np.abs(np.fft.rfft(scaled * np.hanning(len(scaled))[:, None], padded, axis=0)) ** 2
    frequency = np.fft.rfftfreq(padded, period)
    return _peaks(frequency, np.where(frequency > LOCATED.lowest_hz, power.sum(axis=1), 0.0))


def _orders(scaled: _Floats, state: RigState) -> list[float]:
    """Return the strongest orders in signals (n, k), by their transform over the angle."""
    angle, rate = state.spin.angle, np.abs(state.spin.rate)
    turned = float(np.ptp(angle)) * (1.0 + 1e-4)  # numerical
    if turned < LOCATED.least_turned:
        return []
    bins = int(
        2 ** np.ceil(np.log2(max(turned / (2.0 * np.pi) * LOCATED.highest_order * LOCATED.padded, 1024.0)))
    )  # numerical
    folded = np.zeros((LOCATED.padded * bins, scaled.shape[1]))
    np.add.at(folded, ((angle - angle.min()) / turned * bins).astype(int), scaled * rate[:, None])
    power = np.sum(np.abs(np.fft.rfft(folded, axis=0)) ** 2, axis=1)
    order = np.arange(len(power)) * 2.0 * np.pi / (LOCATED.padded * turned)
    return _peaks(order, np.where((order > LOCATED.lowest_order) & (order < LOCATED.highest_order), power, 0.0))


def _peaks(axis: NDArray[Any], power: NDArray[Any]) -> list[float]:
    """Return where the highest peaks of a spectrum (k,) are, between its points by a parabola through the logs."""
    rest, found = power.copy(), list[float]()
    for _ in range(LOCATED.waves):
        if not rest.max() > 0.0:
            break
        at = int(np.clip(np.argmax(rest), 1, len(rest) - 2))
        low, top, high = np.log(np.maximum(rest[at - 1 : at + 2], 1e-300))  # numerical
        shift = float(np.clip(0.5 * (low - high) / min(low - 2.0 * top + high, -1e-12), -0.5, 0.5))  # numerical
        found.append(float(axis[at]) + shift * float(axis[1] - axis[0]))
        rest[max(at - LOCATED.apart, 0) : at + LOCATED.apart + 1] = 0.0
    return found
