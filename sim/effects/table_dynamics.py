"""Dynamics between the commanded motion and the array: torque ripple under a servo, a torsional mode."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray
from scipy.signal import cont2discrete, lfilter

from sim.motions.motion import SpinMotion, SpinState

__all__ = ["Mode", "RippledSpin", "TwistingSpin"]

_FINE_STEP = 2e-3
_SERVO = 2 * np.pi  # rad/s: a bandwidth of 1 Hz
_SERVO_DAMPING = 0.7
_SERVO_STIFFNESS = _SERVO**2  # 1/s²: angular acceleration with which it takes back an error of the angle
_DRAG = 2 * _SERVO_DAMPING * _SERVO
_REST_RATE = 0.3
_SLOW_MODE = 90.0


class RippledSpin:
    """Spin of a servo-controlled table under a torque ripple locked to the table's own angle.

    The error δ against the command obeys δ'' = A s(ω) sin(n(θ + δ) + φ) − 2ζω₀δ' − ω₀²δ with θ and ω the command's
    angle and rate, ω₀ and ζ of the table's servo, which takes back what is slower than itself. At rest the bearing's
    friction holds the table, so that the ripple turns nothing: s = ω²/(ω² + ω₁²).

    Parameters
    ----------
    motion : SpinMotion
        Commanded motion.
    t : ndarray, shape (n,)
        Time span that will be asked for, s.
    amplitude : float
        A, rad/s².
    order : float
        n, cycles per revolution.
    phase : float
        φ, rad.
    """

    def __init__(
        self, motion: SpinMotion, t: NDArray[np.float64], amplitude: float, order: float, phase: float
    ) -> None:
        self._motion = motion
        step = 0.5 * _FINE_STEP
        self._grid = np.arange(t[0], t[-1] + 2 * step, step)
        spin = motion.at(self._grid)
        torque = amplitude * spin.rate**2 / (spin.rate**2 + _REST_RATE**2)
        a, b = _servo_of(step)
        self._angle, self._rate, self._acceleration = _servo_error(
            torque, order * spin.angle + phase, float(order), a, b
        )

    def at(self, t: ArrayLike) -> SpinState:
        """State of the rippled spin at times (n,), s."""
        return _added(
            self._motion, np.asarray(t, dtype=float), self._grid, (self._angle, self._rate, self._acceleration)
        )


@njit(cache=True, nogil=True)
def _servo_error(torque, turns, order, a, b):  # type: ignore[no-untyped-def]  # pragma: no cover
    """Integrate the error of the servo: the torque of a step is the mean of its ends, the far one predicted."""
    n = len(torque)
    angle, rate, acceleration = np.zeros(n), np.zeros(n), np.zeros(n)
    here = torque[0] * np.sin(turns[0])
    acceleration[0] = here
    for k in range(n - 1):
        free = a[0, 0] * angle[k] + a[0, 1] * rate[k]
        there = torque[k + 1] * np.sin(turns[k + 1] + order * (free + b[0] * here))
        mean = 0.5 * (here + there)
        angle[k + 1] = free + b[0] * mean
        rate[k + 1] = a[1, 0] * angle[k] + a[1, 1] * rate[k] + b[1] * mean
        # What the mean moves the angle by beside the prediction is of the third order in the step.
        here = there
        acceleration[k + 1] = here - _SERVO_STIFFNESS * angle[k + 1] - _DRAG * rate[k + 1]
    return angle, rate, acceleration


@dataclass(frozen=True)
class Mode:
    """A mode between table and array that the table's angular acceleration α excites: φ'' + 2ζω₀φ' + ω₀²φ = −α.

    Parameters
    ----------
    gain : float
        Share of the twist φ that the array takes part in.
    natural : float
        ω₀, rad/s.
    damping : float
        ζ.
    """

    gain: float
    natural: float
    damping: float


class TwistingSpin:
    """Spin of an array on a torsion spring upon a spinning table: φ'' + 2ζω₀φ' + ω₀²φ = −α, of which a share is seen.

    Parameters
    ----------
    motion : SpinMotion
        Motion of the table.
    t : ndarray, shape (n,)
        Time span that will be asked for, s; the twist is steady before.
    mode : Mode
        The spring.
    """

    def __init__(self, motion: SpinMotion, t: NDArray[np.float64], mode: Mode) -> None:
        gain, natural, damping = mode.gain, mode.natural, mode.damping
        self._motion = motion
        step = _FINE_STEP if natural < _SLOW_MODE else 0.5 * _FINE_STEP
        self._grid = np.arange(t[0], t[-1] + 2 * step, step)
        push = -motion.at(self._grid).acceleration
        push = push - push[0]  # steady before the first sample
        numerators, poles = _filter_of(natural, damping, step)
        twist, twist_rate = (lfilter(numerator, poles, push) for numerator in numerators)
        self._angle, self._rate = gain * twist, gain * twist_rate
        self._acceleration = gain * (push - natural**2 * twist - 2 * damping * natural * twist_rate)

    def at(self, t: ArrayLike) -> SpinState:
        """State of the array's spin at times (n,), s."""
        return _added(
            self._motion, np.asarray(t, dtype=float), self._grid, (self._angle, self._rate, self._acceleration)
        )


@lru_cache(maxsize=32)
def _servo_of(step: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return transition (2, 2) and input (2,) of the error of the servo over one step, for reading only."""
    system = (np.array([[0.0, 1.0], [-_SERVO_STIFFNESS, -_DRAG]]), np.array([[0.0], [1.0]]))
    a, b, *_ = cont2discrete((*system, np.eye(2), np.zeros((2, 1))), step)
    return a, b[:, 0]


@lru_cache(maxsize=256)
def _filter_of(
    natural: float, damping: float, step: float
) -> tuple[tuple[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]:
    """Return the numerators of twist and twist rate, and the poles, of a mode over one step, for reading only."""
    system = (np.array([[0.0, 1.0], [-(natural**2), -2 * damping * natural]]), np.array([[0.0], [1.0]]))
    a, b, c, d, _ = cont2discrete((*system, np.eye(2), np.zeros((2, 1))), step, method="foh")
    poles = np.array([1.0, -np.trace(a), np.linalg.det(a)])
    twist, rate = (_numerator(a, b, c[[row]], d[[row]], poles) for row in range(2))
    return (twist, rate), poles


def _numerator(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    c: NDArray[np.float64],
    d: NDArray[np.float64],
    poles: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Numerator of a second-order discrete transfer function from its first Markov parameters."""
    markov = [d.item(), (c @ b).item(), (c @ a @ b).item()]
    return np.array(
        [markov[0], markov[1] + poles[1] * markov[0], markov[2] + poles[1] * markov[1] + poles[2] * markov[0]]
    )


def _added(
    motion: SpinMotion, t: NDArray[np.float64], grid: NDArray[np.float64], more: tuple[NDArray[np.float64], ...]
) -> SpinState:
    """Return the state of a motion at times (n,) with angle, rate and acceleration given on an even grid added."""
    spin = motion.at(t)
    flat = np.ravel(t)
    angle, rate, acceleration = _between((flat - grid[0]) / (grid[1] - grid[0]), *more).reshape(3, *t.shape)
    return SpinState(spin.angle + angle, spin.rate + rate, spin.acceleration + acceleration)


@njit(cache=True, nogil=True)
def _between(places, first, second, third):  # type: ignore[no-untyped-def]  # pragma: no cover
    """Interpolate three series linearly at fractional places, the ends held."""
    last = len(first) - 1
    out = np.empty((3, len(places)))
    for k in range(len(places)):
        place = min(max(places[k], 0.0), float(last))
        left = min(int(place), last - 1)
        share = place - left
        out[0, k] = first[left] + share * (first[left + 1] - first[left])
        out[1, k] = second[left] + share * (second[left + 1] - second[left])
        out[2, k] = third[left] + share * (third[left + 1] - third[left])
    return out
