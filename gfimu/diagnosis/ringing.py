"""How a mode of the mounting answers the drive: twist, its rate and acceleration per coefficient of the drive's spline.

A mode remembers the drive for as long as it rings, so the readings of an instant depend on coefficients of long before.
The acceleration of a quartic spline is a parabola on each knot interval, for which φ'' + 2ζω₀φ' + ω₀²φ = −α is solved
exactly:

    φ(s) = b₀ + b₁s + b₂s² + Re(C e^{λs}),  λ = −ζω₀ + iω₀√(1 − ζ²),

and once a basis function is over, it rings on as Re(C e^{λt}).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from gfimu.diagnosis.drive import DEGREE, AngleSpline
from gfimu.world_model import Mode

__all__ = ["Response", "Ringing"]

_FORGOTTEN = 3e-3  # of an amplitude: what rings on below it is left out
_LONGEST = 5.0  # s, as which a mode with hardly any damping rings on
_MOST_DAMPING = 0.98


@dataclass(frozen=True)
class Response:
    """Derivative of angle, rate and acceleration at n times with respect to m coefficients, sparse by rows.

    Parameters
    ----------
    free : ndarray, shape (2, e)
        Real and imaginary part of what each coefficient rings with at the start of the time's interval.
    turned : ndarray of complex, shape (n,)
        How far that has turned, and decayed, since.
    pole : complex
        What the free ringing is multiplied by when differentiated, 1/s.
    forced : ndarray, shape (3, n, 5)
        What the functions of the interval, the last five of each row, add to angle, rate and acceleration.
    columns, ends : ndarray of int, shape (e,) and (n + 1,)
        Coefficient of each entry, and where each row's entries end.
    size : int
        m.
    """

    free: NDArray[np.float64]
    turned: NDArray[np.complex128]
    pole: complex
    forced: NDArray[np.float64]
    columns: NDArray[np.intp]
    ends: NDArray[np.intp]
    size: int

    def matrix(self, slopes: NDArray[np.float64]) -> csr_array:
        """Return the matrix (n, m) from the coefficients to Σ slopes · (angle, rate, acceleration); slopes (3, n)."""
        mixed = (slopes[0] + self.pole * (slopes[1] + self.pole * slopes[2])) * self.turned  # (n,)
        lengths = np.diff(self.ends)
        values = np.repeat(mixed.real, lengths) * self.free[0] - np.repeat(mixed.imag, lengths) * self.free[1]
        own = self.ends[1:, None] + np.arange(-DEGREE - 1, 0)  # (n, 5)
        values[own] += np.einsum("sn,snj->nj", slopes, self.forced)
        return csr_array((values, self.columns, self.ends), shape=(len(lengths), self.size))


@dataclass(frozen=True)
class Ringing:
    """Derivative of a mode's twist with respect to the coefficients of a spline.

    Parameters
    ----------
    spline : AngleSpline
        The drive's spline.
    mode : Mode
        The mode.
    start : float
        Time before which the acceleration is held for steady, s.
    """

    spline: AngleSpline
    mode: Mode
    start: float

    def response(self, t: NDArray[np.float64]) -> Response:
        """Return what the mode adds to angle, rate and acceleration at times (n,), s, per coefficient."""
        inside, after = self._amplitudes
        first, since = self.spline.interval(t)
        earliest, past = self._past(after)
        # A row holds the functions that are over and ring on, and the five of the interval, without a gap.
        over = first - earliest[first]
        lengths = over + DEGREE + 1
        ends = np.concatenate([[0], np.cumsum(lengths)])
        order = np.arange(ends[-1]) - np.repeat(ends[:-1], lengths)
        interval = np.repeat(first, lengths)
        padded = np.concatenate([past, np.zeros((len(past), DEGREE + 1))], axis=1)
        free = self.mode.gain * padded.ravel()[interval * padded.shape[1] + order]
        own = ends[1:, None] + np.arange(-DEGREE - 1, 0)  # (n, 5)
        free[own] = self.mode.gain * inside[first]
        b0, b1, b2 = self._forced[first].transpose(1, 0, 2)  # each (n, 5)
        s = since[:, None]
        forced = self.mode.gain * np.stack([b0 + s * (b1 + s * b2), b1 + 2.0 * s * b2, 2.0 * b2])
        columns = np.repeat(earliest[first], lengths) + order
        turned = np.exp(self._pole * since)  # (n,)
        parts = np.stack([free.real, free.imag])
        return Response(parts, turned, self._pole, forced, columns, ends, self.spline.size)

    @cached_property
    def _pole(self) -> complex:
        damping = min(self.mode.damping, _MOST_DAMPING)
        return complex(-damping, np.sqrt(1.0 - damping**2)) * self.mode.natural

    @cached_property
    def _forced(self) -> NDArray[np.float64]:
        """Return b of each interval's basis functions, shape (k, 3, 5)."""
        stiffness, drag = self.mode.natural**2, -2.0 * self._pole.real
        pushed = -self.spline.accelerations
        b2 = pushed[:, 2] / stiffness
        b1 = (pushed[:, 1] - 2.0 * drag * b2) / stiffness
        b0 = (pushed[:, 0] - drag * b1 - 2.0 * b2) / stiffness
        return np.stack([b0, b1, b2], axis=1)

    def _amplitude(self, twist: NDArray[np.float64], rate: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Return C of a free mode with this twist and rate."""
        pole = self._pole
        return np.asarray(twist - 1j * (rate - pole.real * twist) / pole.imag)

    @cached_property
    def _amplitudes(self) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Return C of each interval's basis functions from its start, (k, 5), and of each once it is over, (m,)."""
        spline, pole = self.spline, self._pole
        b0, b1, b2 = self._forced.transpose(1, 0, 2)  # each (k, 5)
        h = spline.widths[:, None]
        starting = self._amplitude(b0, b1)
        ending = self._amplitude(b0 + h * (b1 + h * b2), b1 + 2.0 * h * b2)
        decay = np.exp(pole * spline.widths)
        first, offset = spline.interval(np.array([self.start]))
        began, since = int(first[0]), float(offset[0])
        # Steady at the start: φ = −α/ω₀², at rest.
        steady = -(spline.accelerations[began].T @ since ** np.arange(3.0)) / self.mode.natural**2
        here = b0[began] + since * (b1[began] + since * b2[began])
        rate = b1[began] + 2.0 * since * b2[began]
        inside = np.zeros((len(decay), DEGREE + 1), dtype=complex)
        ended = np.zeros(len(decay), dtype=complex)
        # A function is the last of an interval first, and the first of one at last.
        for place in range(DEGREE, -1, -1):
            inside[1:, place] = ended[:-1] - starting[1:, place]
            inside[:began, place] = 0.0
            inside[began, place] = self._amplitude(steady - here, -rate)[place] * np.exp(-pole * since)
            ended = ending[:, place] + inside[:, place] * decay
            ended[:began] = 0.0
        return inside, np.append(ended, np.zeros(spline.size - len(ended)))

    def _past(self, after: NDArray[np.complex128]) -> tuple[NDArray[np.intp], NDArray[np.complex128]]:
        """Return the first function that still rings in each interval, (k,), and amplitudes of it and those after it
        at the interval's start, (k, L).
        """  # noqa: D205
        breaks = self.spline.breaks
        memory = min(np.log(_FORGOTTEN) / self._pole.real, _LONGEST)
        starts = breaks[:-1]
        # Function j is over at break j + 1.
        earliest = np.searchsorted(breaks[1:], starts - memory)
        earliest = np.minimum(earliest, np.arange(len(starts)))
        longest = int((np.arange(len(starts)) - earliest).max(initial=0))
        functions = np.minimum(earliest[:, None] + np.arange(longest), len(starts) - 1)
        over = starts[:, None] - breaks[functions + 1]
        return earliest, after[functions] * np.exp(self._pole * np.maximum(over, 0.0))
