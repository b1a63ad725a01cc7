"""Dynamics between the commanded motion and the cube: torque ripple under a speed loop, a torsional mode."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.signal import cont2discrete, lfilter

from sim.motion import SpinMotion, SpinState

__all__ = ["RippledSpin", "TwistingSpin"]

_FINE_STEP = 2e-3
_SPEED_LOOP_TIME = 0.5
_REST_RATE = 0.3
_SLOW_MODE = 90.0


class RippledSpin:
    """Spin of a speed-controlled table under a torque ripple locked to the commanded angle.

    The error δ against the command obeys δ'' = A s(ω) sin(nθ + φ) − δ'/τ with θ and ω the command's angle and rate and
    τ the speed loop's time constant. At rest the bearing's friction holds the table, so that the ripple turns nothing:
    s = ω²/(ω² + ω₀²). The real table's angle is meant, so this holds while n δ stays well below a radian; beyond it a
    table stalls and slips, and no two runs are alike.

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
        self._ripple = (float(amplitude), float(order), float(phase))
        step = 0.5 * _FINE_STEP
        self._grid = np.arange(t[0], t[-1] + 2 * step, step)
        push = self._push(motion.at(self._grid))
        decay = np.exp(-step / _SPEED_LOOP_TIME)
        mean = 0.5 * (push[1:] + push[:-1]) * (_SPEED_LOOP_TIME * (1 - decay))
        rate = np.concatenate([[0.0], lfilter([1.0], [1.0, -decay], mean)])
        self._rate = rate
        self._angle = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]))]) * step

    def _push(self, spin: SpinState) -> NDArray[np.float64]:
        amplitude, order, phase = self._ripple
        turning = spin.rate**2 / (spin.rate**2 + _REST_RATE**2)
        return np.asarray(amplitude * turning * np.sin(order * spin.angle + phase))

    def at(self, t: ArrayLike) -> SpinState:
        """State of the rippled spin at times (n,), s."""
        t = np.asarray(t, dtype=float)
        spin = self._motion.at(t)
        rate = np.interp(t, self._grid, self._rate)
        return SpinState(
            spin.angle + np.interp(t, self._grid, self._angle),
            spin.rate + rate,
            spin.acceleration + self._push(spin) - rate / _SPEED_LOOP_TIME,
        )


class TwistingSpin:
    """Spin of a cube on a torsion spring upon a spinning table: φ'' + 2ζω₀φ' + ω₀²φ = −α, of which a share is seen.

    Parameters
    ----------
    motion : SpinMotion
        Motion of the table.
    t : ndarray, shape (n,)
        Time span that will be asked for, s; the twist is steady before.
    gain : float
        Share of φ that the cube takes part in.
    natural : float
        ω₀, rad/s.
    damping : float
        ζ.
    """

    def __init__(self, motion: SpinMotion, t: NDArray[np.float64], gain: float, natural: float, damping: float) -> None:
        self._motion = motion
        step = _FINE_STEP if natural < _SLOW_MODE else 0.5 * _FINE_STEP
        self._grid = np.arange(t[0], t[-1] + 2 * step, step)
        push = -motion.at(self._grid).acceleration
        push = push - push[0]  # steady before the first sample
        system = (np.array([[0.0, 1.0], [-(natural**2), -2 * damping * natural]]), np.array([[0.0], [1.0]]))
        outputs = (np.eye(2), np.zeros((2, 1)))
        a, b, c, d, _ = cont2discrete((*system, *outputs), step, method="foh")
        poles = np.array([1.0, -np.trace(a), np.linalg.det(a)])
        twist, twist_rate = (lfilter(_numerator(a, b, c[[row]], d[[row]], poles), poles, push) for row in range(2))
        self._angle, self._rate = gain * twist, gain * twist_rate
        self._acceleration = gain * (push - natural**2 * twist - 2 * damping * natural * twist_rate)

    def at(self, t: ArrayLike) -> SpinState:
        """State of the cube's spin at times (n,), s."""
        t = np.asarray(t, dtype=float)
        spin = self._motion.at(t)
        return SpinState(
            spin.angle + np.interp(t, self._grid, self._angle),
            spin.rate + np.interp(t, self._grid, self._rate),
            spin.acceleration + np.interp(t, self._grid, self._acceleration),
        )


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
