"""Motions to simulate: table profiles put together from segments, and a free tumble in three dimensions.

A profile's rate is twice continuously differentiable: holds joined by quintic ramps, chirps under a smooth window.
The tumble is the torque-free motion of a rigid body with three different moments of inertia, started from rest by a
smooth change of its time scale, so that rotation, rate and angular acceleration are known without integration steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PPoly, make_interp_spline
from scipy.spatial.transform import Rotation
from scipy.special import ellipj, ellipk

from gfimu.array.smooth_ramp import smooth_ramp
from gfimu.base.errors import InputError
from sim.motions.motion import BodyState, SplineSpin

__all__ = ["Chirp", "Hold", "Ramp", "Segment", "Sine", "Tumble", "paper_run", "speed_sweep", "spin_profile"]

_MOST_NODES = 10_000_000  # numerical: of a sweep
_LONGEST = 1e9  # numerical: s, of a piece of a profile
_SHORTEST = 1e-9  # numerical: s, of a piece: its fifth power is no zero

_WINDOW_SHARE = 0.1  # share of an oscillation's duration in which its window opens, and again closes
_POINTS_PER_PERIOD = 40  # nodes of the quintic spline of an oscillation, per shortest period
_PRECESSION_HARMONICS = 512


class Segment(Protocol):
    """A piece of a table profile."""

    @property
    def duration(self) -> float:
        """Length of the piece, s."""
        ...

    def rate(self, start: float) -> PPoly:
        """Rate from time 0 to ``duration``, rad/s, given the rate ``start`` at which the piece before ends."""
        ...


@dataclass(frozen=True)
class Hold:
    """Keep the rate for a while; a rest is a hold at rate zero.

    Parameters
    ----------
    duration : float
        Length, s.
    """

    duration: float

    def rate(self, start: float) -> PPoly:
        """Rate as a polynomial of the time since the piece began, rad/s."""
        return PPoly(_quintic(start, start, self.duration), [0.0, self.duration])


@dataclass(frozen=True)
class Ramp:
    """Change the rate along a quintic that begins and ends without angular acceleration or jerk of the rate.

    Parameters
    ----------
    to : float
        Rate at the end, rad/s.
    duration : float
        Length, s.
    """

    to: float
    duration: float

    def rate(self, start: float) -> PPoly:
        """Rate as a polynomial of the time since the piece began, rad/s."""
        return PPoly(_quintic(start, self.to, self.duration), [0.0, self.duration])


@dataclass(frozen=True)
class Sine:
    """Swing the rate about the one held, with a whole or broken number of periods under a smooth window.

    Parameters
    ----------
    amplitude : float
        Amplitude of the rate, rad/s.
    frequency : float
        Frequency, Hz.
    duration : float
        Length, s.
    """

    amplitude: float
    frequency: float
    duration: float

    def rate(self, start: float) -> PPoly:
        """Rate as a piecewise quintic of the time since the piece began, rad/s."""
        return Chirp(self.amplitude, self.frequency, self.frequency, self.duration).rate(start)


@dataclass(frozen=True)
class Chirp:
    """Swing the rate about the one held with a frequency that moves exponentially from one value to another.

    Parameters
    ----------
    amplitude : float
        Amplitude of the rate, rad/s.
    start_frequency, stop_frequency : float
        First and last frequency, Hz.
    duration : float
        Length, s.
    """

    amplitude: float
    start_frequency: float
    stop_frequency: float
    duration: float

    def rate(self, start: float) -> PPoly:
        """Rate as a piecewise quintic of the time since the piece began, rad/s."""
        fastest = max(self.start_frequency, self.stop_frequency)
        nodes = max(int(np.ceil(_POINTS_PER_PERIOD * fastest * self.duration)), 80)
        if nodes > _MOST_NODES:
            raise InputError(
                f"a sweep of {self.duration:g} s up to {fastest:g} Hz is too long; make one of them smaller"
            )
        t = np.linspace(0.0, self.duration, nodes + 1)
        growth = np.log(self.stop_frequency / self.start_frequency) / self.duration
        cycles = self.start_frequency * (np.expm1(growth * t) / growth if growth else t)
        edge = np.minimum(t, self.duration - t) / (_WINDOW_SHARE * self.duration)
        value = start + self.amplitude * _smooth_step(np.clip(edge, 0.0, 1.0)) * np.sin(2 * np.pi * cycles)
        flat = [(1, 0.0), (2, 0.0)]
        spline = make_interp_spline(t, value, k=5, bc_type=(flat, flat))  # type: ignore[arg-type]
        return PPoly.from_spline((spline.t, spline.c, spline.k))


def spin_profile(segments: Sequence[Segment], *, start_rate: float = 0.0, start_angle: float = 0.0) -> SplineSpin:
    """Spin of the table from segments in a row; the last rate is kept beyond the end, the first before the start.

    Parameters
    ----------
    segments : sequence of Segment
        The pieces; each begins at the rate at which the one before ends.
    start_rate : float
        Rate before the first piece, rad/s.
    start_angle : float
        Table angle at time zero, rad.

    Raises
    ------
    InputError
        If there is no segment or one has no positive duration.
    """
    if not segments:
        raise InputError("a motion profile needs at least one segment; add a hold, ramp, sine or chirp")
    breaks, coefficients = [0.0], []
    rate, end = start_rate, 0.0
    for number, segment in enumerate(segments, start=1):
        if not segment.duration > 0:
            raise InputError(f"motion segment {number}: duration {segment.duration} s; give a positive time")
        piece = segment.rate(rate)
        breaks.extend(end + piece.x[1:])
        coefficients.append(_raised_to_quintic(piece.c))
        rate = float(piece(segment.duration))
        end += segment.duration
    # Constant pieces on both sides: filters and late chips look a little beyond the ends.
    before, after = _quintic(start_rate, start_rate, 1.0), _quintic(rate, rate, 1.0)
    spline = PPoly(np.hstack([before, *coefficients, after]), np.array([-1.0, *breaks, end + 1.0]))
    return SplineSpin(spline, start=0.0, angle_at_start=start_angle)


def paper_run(*, rate: float = np.pi, ramp: float = 1.0) -> tuple[Segment, ...]:
    """Segments of the GF-IMU paper's experiment: 30 s with rests, turning left, then right, at two speeds.

    Parameters
    ----------
    rate : float
        Faster of the two speeds, rad/s; the slower is half of it.
    ramp : float
        Duration of a change of speed, s.
    """
    hold = (26.0 - 6 * ramp) / 4
    return (
        Hold(3.0),
        Ramp(rate / 2, ramp),
        Hold(hold),
        Ramp(rate, ramp),
        Hold(hold),
        Ramp(0.0, ramp),
        Hold(1.0),
        Ramp(-rate / 2, ramp),
        Hold(hold),
        Ramp(-rate, ramp),
        Hold(hold - 2.0),
        Ramp(0.0, ramp),
        Hold(2.0),
    )


def speed_sweep(rates: Sequence[float], *, hold: float = 4.0, ramp: float = 1.0, rest: float = 2.0) -> list[Segment]:
    """Segments that rest, hold each of ``rates`` (rad/s) in turn, and come to rest again; times in s."""
    segments: list[Segment] = [Hold(rest)]
    for rate in rates:
        segments += [Ramp(rate, ramp), Hold(hold)]
    return [*segments, Ramp(0.0, ramp), Hold(rest)]


@dataclass(frozen=True)
class Tumble:
    """Torque-free tumble of a body with moments of inertia in the ratio ``inertia``, started smoothly from rest.

    The rate follows Jacobi's elliptic functions (Landau & Lifshitz, Mechanics, § 37, eq. 37.10), slowed down at the
    start by a time scale that rises from 0 to 1. The body sits upright at time zero.

    Parameters
    ----------
    rate : float
        Magnitude of the angular rate once the tumble is at full speed, at its start, rad/s.
    inclination : float
        Angle between the rate and the axis of the largest inertia at the start, rad; the nearer to the separatrix
        (π/3 for the default ratio) the wilder the tumble.
    rest : float
        Time at rest before the start, s.
    spin_up : float
        Time from rest to full speed, s.
    inertia : tuple of float
        Ratio of the moments of inertia about body x, y, z, ascending.
    sway : tuple of float
        Amplitude of the body origin's oscillation along world x, y, z, m.
    sway_frequency : tuple of float
        Its frequencies, Hz.
    """

    rate: float = 2 * np.pi
    inclination: float = 0.95
    rest: float = 2.0
    spin_up: float = 3.0
    inertia: tuple[float, float, float] = (1.0, 2.0, 3.0)
    sway: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sway_frequency: tuple[float, float, float] = (0.5, 0.7, 0.3)

    def __post_init__(self) -> None:
        i1, i2, i3 = self.inertia
        if not 0 < i1 < i2 < i3:
            raise InputError(f"tumble inertia {self.inertia}: give three ascending positive numbers")
        limit = np.arctan(np.sqrt(i3 * (i3 - i2) / (i1 * (i2 - i1))))
        if not 0 < self.inclination < limit:
            raise InputError(f"tumble inclination_rad {self.inclination}: must lie between 0 and {limit:.4f}")
        if self.rate <= 0 or self.rest < 0 or self.spin_up <= 0:
            raise InputError("tumble: rate_rad_s and spin_up_s must be positive, rest_s not negative")

    def at(self, t: ArrayLike) -> BodyState:
        """State of the body at times ``t``, s, shape (n,)."""
        time = np.asarray(t, dtype=float)
        tau, scale, slope = self._time_scale(time)
        free_rate, free_alpha = self._free_rate(tau)
        frequency = 2 * np.pi * np.asarray(self.sway_frequency)
        sway = np.asarray(self.sway)
        phase = tau[:, None] * frequency
        d_tau, dd_tau = sway * frequency * np.sin(phase), sway * frequency**2 * np.cos(phase)
        return BodyState(
            position=sway * (1 - np.cos(phase)),
            rotation=self._rotation(tau),
            velocity=d_tau * scale[:, None],
            acceleration=d_tau * slope[:, None] + dd_tau * scale[:, None] ** 2,
            omega=free_rate * scale[:, None],
            alpha=free_rate * slope[:, None] + free_alpha * scale[:, None] ** 2,
        )

    def _time_scale(
        self, t: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Time of the free tumble, its rate of change and the slope of that, each (n,)."""
        share = np.clip((t - self.rest) / self.spin_up, 0.0, 1.0)
        integral = share**4 * (2.5 + share * (-3.0 + share)) * self.spin_up  # ∫ of the quintic step
        tau = integral + np.maximum(t - self.rest - self.spin_up, 0.0)
        slope = 30 * share**2 * (1 - share) ** 2 / self.spin_up
        return tau, _smooth_step(share), slope

    @cached_property
    def _elliptic(self) -> tuple[NDArray[np.float64], float, float]:
        """Amplitudes of the three rates, rad/s, argument per time, rad/s, and parameter m = k²."""
        i1, i2, i3 = self.inertia
        w1, w3 = self.rate * np.sin(self.inclination), self.rate * np.cos(self.inclination)
        twice_energy, momentum2 = i1 * w1**2 + i3 * w3**2, (i1 * w1) ** 2 + (i3 * w3) ** 2
        low, high = momentum2 - twice_energy * i1, twice_energy * i3 - momentum2
        amplitude = np.array([w1, np.sqrt(high / (i2 * (i3 - i2))), w3])
        return (
            amplitude,
            float(np.sqrt((i3 - i2) * low / (i1 * i2 * i3))),
            float((i2 - i1) * high / ((i3 - i2) * low)),
        )

    def _free_rate(self, tau: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Rate and its derivative in body axes at times of the free tumble, each (n, 3)."""
        amplitude, pace, m = self._elliptic
        sn, cn, dn, _ = ellipj(pace * tau, m)
        omega = amplitude * np.stack([cn, sn, dn], axis=-1)
        i1, i2, i3 = self.inertia
        x, y, z = omega.T
        # Euler's equations without torque.
        alpha = np.stack([(i2 - i3) / i1 * y * z, (i3 - i1) / i2 * z * x, (i1 - i2) / i3 * x * y], axis=-1)
        return omega, alpha

    @cached_property
    def _precession(self) -> tuple[float, NDArray[np.complex128]]:
        """Mean precession rate, rad/s, and the Fourier coefficients of its integral over half a period of sn."""
        _, pace, m = self._elliptic
        period = 2 * ellipk(m) / pace
        omega, _ = self._free_rate(np.arange(2 * _PRECESSION_HARMONICS) * period / (2 * _PRECESSION_HARMONICS))
        inertia = np.asarray(self.inertia)
        momentum = float(np.linalg.norm(inertia * omega[0]))
        x, y = inertia[0] * omega[:, 0], inertia[1] * omega[:, 1]
        precession = momentum * (x * omega[:, 0] + y * omega[:, 1]) / (x**2 + y**2)
        spectrum = np.fft.rfft(precession)[:_PRECESSION_HARMONICS] / len(precession)
        order = np.arange(1, _PRECESSION_HARMONICS)
        return float(spectrum[0].real), 2 * spectrum[1:] * period / (2j * np.pi * order)

    def _rotation(self, tau: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rotation matrices from body to world axes at times of the free tumble, (n, 3, 3)."""
        frames = self._to_momentum_frame(np.concatenate([[0.0], tau]))
        return frames[0].T @ frames[1:]

    def _to_momentum_frame(self, tau: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rotation from body axes to a frame with z along the angular momentum (Landau & Lifshitz, eq. 37.14)."""
        omega, _ = self._free_rate(tau)
        x, y, z = (np.asarray(self.inertia) * omega).T
        nutation, spin = np.arctan2(np.hypot(x, y), z), np.arctan2(x, y)
        _, pace, m = self._elliptic
        mean, ripple = self._precession
        significant = ripple[: max(int(np.flatnonzero(np.abs(ripple) > 1e-17)[-1]) + 1, 1)]
        turn = np.exp(1j * np.pi * pace / ellipk(m) * tau)
        wave = np.polynomial.polynomial.polyval(turn, np.concatenate([[0.0], significant]))
        angles = np.stack([mean * tau + (wave - wave[0]).real, nutation, spin], axis=-1)
        return Rotation.from_euler("ZXZ", angles).as_matrix()


def _smooth_step(share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quintic from 0 to 1 with vanishing first and second derivatives at both ends."""
    return share**3 * (10 + share * (-15 + 6 * share))


def _quintic(start: float, stop: float, duration: float) -> NDArray[np.float64]:
    """Coefficients of one quintic piece from ``start`` to ``stop``, highest power first, shape (6, 1)."""
    if not _SHORTEST < duration < _LONGEST:
        raise InputError(f"a piece of {duration:g} s; give more than {_SHORTEST:g} s and less than {_LONGEST:g} s")
    return smooth_ramp(start, stop, duration)[:, None]


def _raised_to_quintic(coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pad polynomial coefficients (k, m) with zero high powers to (6, m)."""
    missing = 6 - len(coefficients)
    return np.vstack([np.zeros((missing, coefficients.shape[1])), coefficients])
