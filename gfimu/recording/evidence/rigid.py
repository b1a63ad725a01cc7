"""How well readings fit one rigid body: at rest, in motion, and by combinations that no rigid motion can change.

An array has more channels than a rigid body has motions. What is in excess measures how wrong a file is about itself:
its units, the order and sign of its columns, its array. Each cost here is zero for perfect channels and at most of the
order of 1 for channels whose bias, gain and alignment are anywhere within their data sheet's limits.

A reading of the file otherwise (`Otherwise`) is a linear map of the columns, another array, or another unit of time.
So the readings are reduced once, to means of rests, to a covariance, and to a few hundred samples with their running
integrals, and each other reading costs little.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.errors import InputError
from gfimu.geometry.array import AccelerometerArray
from gfimu.geometry.kinematics import omega_products
from gfimu.parts.limits import PartLimits
from gfimu.rate.integration import integrate_samples
from gfimu.recording.evidence.rotation_normal import rotation_normal
from gfimu.recording.recording import Recording
from gfimu.recording.rest import detect_rest
from gfimu.units import STANDARD_GRAVITY

__all__ = ["Costs", "Evidence", "Otherwise", "Window", "gather"]

ALIGNMENT = 0.05  # rad, by which a sensing axis may be off on a real board: "turned by degrees"
_RESTS = 8  # stretches of rest that are used, the longest
_MOST_RESTS = 200  # stretches of rest that are looked at, the longest
_FEWEST_STILL = 10  # samples of a rest in a window of motion, after decimation
_STILL = 0.02  # of the size of the mean readings, by which readings at rest may scatter, in whatever unit they are
_WINDOW = 2000  # samples of a window of motion, after decimation
_ROWS = 200  # of them that are compared
_RATE = 100.0  # Hz, to which faster recordings are averaged
_NOMINAL_RATES = (4.0, 20_000.0)  # Hz; outside of them rest is looked for as if at 100 Hz
_LEAST_PARITY = 3  # combinations free of all motion that make the integration of α needless
_DIAGONAL = np.diag_indices(6)
_ITERATIONS = 15
_NO_LEAK = 1e-6  # rad/s² per rad²/s²
_WEAK = 0.1  # products seen more weakly than this share of the best are not used to clean α
_FEWEST = 30  # samples
_TABLE = {"tacho_rad_s", "command_rad_s", "angle_rad"}  # references of a body that turns about one axis only


@dataclass(frozen=True)
class Otherwise:
    """A file read in another way.

    Parameters
    ----------
    kind : str
        What is taken to be wrong: ``time``, ``unit``, ``chip_unit``, ``sign``, ``exchange`` or ``array``.
    text : str
        Cause and remedy, one sentence.
    columns : ndarray, shape (c, c)
        Channels as they should be, from the channels as they are.
    time : float
        Factor of the times.
    array : AccelerometerArray or None
        Another array.
    channels : tuple of str
        Channels that it is about.
    parts : tuple of Otherwise
        The two ways that it is made of, if it is.
    """

    kind: str
    text: str
    columns: NDArray[np.float64]
    time: float = 1.0
    array: AccelerometerArray | None = None
    channels: tuple[str, ...] = ()
    parts: tuple[Otherwise, ...] = ()

    def is_one_of(self, kinds: Collection[str]) -> bool:
        """Whether the way, or one of its parts, is of one of these kinds."""
        return any(one.kind in kinds for one in self.parts or (self,))


@dataclass(frozen=True)
class Costs:
    """What contradicts a way to read the file, each in units of what the data sheets allow at most.

    Parameters
    ----------
    rest : float
        Mean over the rests of Σ (residual/limit)², the channels against one specific force.
    level : float
        Square of how far gravity at rest is from 9.8 m/s² over what biases and gains allow.
    parity, motion : float
        Energy of what no rigid motion explains over the largest that the limits allow: by fixed combinations of the
        channels, and with the centripetal terms of the integrated rate. Motion is NaN where nothing moves.
    parity_noise, motion_noise : float
        The same of white noise alone.
    worst_rest : float
        Least possible largest residual of a channel at rest over its limit: above 1 the limits can't explain it.
    points : tuple of ndarray, shape (6,)
        Rate at the start and bias of α that fit each window best.
    """

    rest: float
    level: float
    parity: float
    motion: float
    parity_noise: float
    motion_noise: float
    worst_rest: float
    points: tuple[NDArray[np.float64], ...] = ()

    def total(self, *, motion: bool) -> float:
        """Sum of the costs, with or without that of the motion."""
        return self.rest + self.level + self.parity + (self.motion if motion and np.isfinite(self.motion) else 0.0)


@dataclass(frozen=True)
class Window:
    """Samples of a stretch of motion: readings (m, c), their integrals from its start (m, c), times since (m,), s."""

    readings: NDArray[np.float64]
    integrals: NDArray[np.float64]
    t: NDArray[np.float64]
    noise_share: float  # variance of the noise over that of one sample


@dataclass(frozen=True)
class _Matrices:
    """What an array makes of its readings: α = A y, N y = M s(ω), and P y = 0 for any motion.

    ``clean``: whether no products of ω are left in A y; without that the motion is not judged.
    """

    alpha: NDArray[np.float64]  # (3, c)
    clean: bool
    null: NDArray[np.float64]  # (d, c), orthonormal rows
    sensitivity: NDArray[np.float64]  # (d, 6)
    parity: NDArray[np.float64]  # (k, c), orthonormal rows

    @classmethod
    def of(cls, array: AccelerometerArray, alive: NDArray[np.bool_]) -> _Matrices:
        scale = np.array([array.length_unit] * 3 + [1.0] * 3)
        j, q = array.regression_matrix[alive] / scale, array.centripetal_matrix[alive] / array.length_unit
        alpha = np.linalg.pinv(j)[:3] / array.length_unit
        null = scipy.linalg.null_space(j.T, rcond=1e-9).T
        parity = scipy.linalg.null_space(np.hstack([j, q]).T, rcond=1e-9).T
        centripetal = array.centripetal_matrix[alive]
        leak = alpha @ centripetal
        if np.abs(leak).max() > _NO_LEAK and len(null):  # the null space takes off what it sees well
            alpha = alpha - leak @ np.linalg.pinv(null @ centripetal, rcond=_WEAK) @ null
            leak = alpha @ centripetal
        return cls(alpha, bool(np.abs(leak).max() < _NO_LEAK), null, null @ centripetal, parity)


@dataclass(frozen=True)
class Evidence:
    """A recording reduced to what shows whether its channels fit one rigid body.

    Parameters
    ----------
    array : AccelerometerArray
        The array as given.
    alive : ndarray of bool, shape (c,)
        Channels with readings that are not stuck.
    limits : PartLimits
        Of all channels.
    rests : ndarray, shape (k, c)
        Mean readings of the rests, m/s².
    covariance : ndarray, shape (c, c)
        Covariance of the readings over time.
    windows : tuple of Window
        Stretches of motion.
    up : ndarray, shape (3,), or None
        Upward direction at rest in body axes, if the recording is of a table and says how the body was mounted on it.
    quiet : ndarray, shape (c,)
        Noise seen between neighbouring samples where they are quietest, m/s².
    sample_rate : float
        By the times as given, Hz.
    unit_from : str
        Which argument stated the unit of the readings (`gfimu.Recording`).
    """

    array: AccelerometerArray
    alive: NDArray[np.bool_]
    limits: PartLimits
    rests: NDArray[np.float64]
    covariance: NDArray[np.float64]
    windows: tuple[Window, ...]
    up: NDArray[np.float64] | None
    quiet: NDArray[np.float64]
    sample_rate: float
    unit_from: str = ""
    _cache: dict[str, _Matrices] = field(default_factory=dict)

    @property
    def has_parity(self) -> bool:
        """Whether enough combinations of the channels are free of all motion."""
        return self.has_parity_of(self.array)

    def has_parity_of(self, array: AccelerometerArray) -> bool:
        """Whether enough combinations of an array's channels are free of all motion."""
        return len(self._matrices(array).parity) >= _LEAST_PARITY

    def as_given(self) -> Otherwise:
        """Return the file as it says of itself."""
        return Otherwise("", "", np.eye(self.array.n_channels))

    def costs(
        self,
        way: Otherwise,
        *,
        with_motion: bool = True,
        hopeless: float = np.inf,
        points: Sequence[NDArray[np.float64]] = (),
    ) -> Costs:
        """Return what contradicts a way to read the file.

        Motion is left out where not asked for, and where rest and parity alone cost more than ``hopeless``. ``points``
        are further points to start its fit from, one per window.
        """
        array = way.array or self.array
        matrices = self._matrices(array)
        rest, level, worst = self._rest(way, array, exact=way.kind in {"", "array"})
        columns = way.columns[np.ix_(self.alive, self.alive)]
        sigma = self.limits.noise[self.alive]
        parity = parity_noise = 0.0
        if len(matrices.parity) >= _LEAST_PARITY and self.covariance.size:
            moved = columns @ self.covariance[np.ix_(self.alive, self.alive)] @ columns.T
            allowed = self._allowed(np.sqrt(np.diag(moved)))
            parity = float(np.trace(matrices.parity @ moved @ matrices.parity.T)) / allowed
            parity_noise = float(np.sum((matrices.parity * sigma) ** 2)) / allowed
        motion = motion_noise = np.nan
        fitted: tuple[NDArray[np.float64], ...] = ()
        with_motion = with_motion and rest + level + parity <= hopeless
        if with_motion and matrices.clean and len(matrices.null) and self.windows:
            starts: Sequence[NDArray[np.float64] | None] = points or [None] * len(self.windows)
            found = [
                self._motion(window, columns, way.time, matrices, start)
                for window, start in zip(self.windows, starts, strict=True)
            ]
            energy, noise, allowed = np.sum([figures for figures, _ in found], axis=0)
            fitted = tuple(point for _, point in found)
            motion, motion_noise = energy / allowed, noise / allowed
        return Costs(rest, level, parity, motion, parity_noise, motion_noise, worst, fitted)

    def _matrices(self, array: AccelerometerArray) -> _Matrices:
        if array.name not in self._cache:
            self._cache[array.name] = _Matrices.of(array, self.alive)
        return self._cache[array.name]

    def _allowed(self, spread: NDArray[np.float64]) -> float:
        """Return the energy that gains and axes at their limits, and noise, add to channels of this spread at most."""
        gain, sigma = self.limits.gain[self.alive], self.limits.noise[self.alive]
        return float(np.sum((gain * spread + ALIGNMENT * spread.max(initial=0.0)) ** 2 + (3.0 * sigma) ** 2))

    def _rest(self, way: Otherwise, array: AccelerometerArray, *, exact: bool) -> tuple[float, float, float]:
        """Return the costs of the rests: channels against one specific force, gravity, and the worst channel."""
        if not len(self.rests):
            return 0.0, 0.0, 0.0
        axes = array.axes[self.alive]
        gain, bias = self.limits.gain[self.alive], self.limits.bias[self.alive]
        rests = (self.rests @ way.columns.T)[:, self.alive]
        costs, levels, worst = [], [], []
        for mean in rests:
            limit = bias + gain * (np.abs(mean) + bias) / (1.0 - gain) + ALIGNMENT * STANDARD_GRAVITY
            force = np.linalg.lstsq(axes / limit[:, None], mean / limit, rcond=None)[0]
            ratio = (mean - axes @ force) / limit
            largest = float(np.abs(ratio).max())
            if exact and largest > 0.5:
                largest = _least_largest(axes, mean, limit)
                spinning = self._spinning(array, mean, limit) if largest > 1.0 else ratio
                if largest > 1.0 and float(np.abs(spinning).max()) < largest:
                    ratio, largest = spinning, float(np.abs(spinning).max())
            costs.append(float(ratio @ ratio))
            worst.append(largest)
            size = float(np.linalg.norm(force))
            # Biases all the same way at their limits, gains too, would move gravity that far.
            free = float(np.linalg.norm(np.abs(np.linalg.pinv(axes)) @ bias)) + float(gain.max()) * STANDARD_GRAVITY
            if self.up is not None:
                levels.append(float(np.sum((force - STANDARD_GRAVITY * self.up) ** 2)) / free**2)
            else:
                levels.append(((size - STANDARD_GRAVITY) / free) ** 2)
        return float(np.mean(costs)), float(np.mean(levels)), float(np.max(worst))

    def gravity_at_rest(self, way: Otherwise) -> NDArray[np.float64]:
        """Return the size of the specific force of each rest, shape (k,), m/s²."""
        axes = (way.array or self.array).axes[self.alive]
        return np.linalg.norm((self.rests @ way.columns.T)[:, self.alive] @ np.linalg.pinv(axes).T, axis=1)

    def _spinning(
        self, array: AccelerometerArray, mean: NDArray[np.float64], limit: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the residuals (c,) over their limits if the body spins steadily while its readings rest."""
        axes, centripetal = array.axes[self.alive], array.centripetal_matrix[self.alive]
        both = np.hstack([axes, centripetal]) / limit[:, None]
        products = np.linalg.lstsq(both, mean / limit, rcond=1e-9)[0][3:]
        best = np.full(len(mean), np.inf)
        for start in _rates_of(products):
            omega = start
            for _ in range(_ITERATIONS):
                slope = np.hstack([axes, centripetal @ _slopes(omega[None])[0]]) / limit[:, None]
                inside = (mean - centripetal @ omega_products(omega)) / limit
                step = np.linalg.lstsq(slope, inside, rcond=1e-9)[0]
                omega = omega + step[3:]
            residual = (mean - centripetal @ omega_products(omega)) / limit
            force = np.linalg.lstsq(axes / limit[:, None], residual, rcond=None)[0]
            left = residual - axes @ force / limit
            best = min(best, left, key=lambda ratio: float(np.abs(ratio).max()))
        return best

    def _motion(
        self,
        window: Window,
        columns: NDArray[np.float64],
        time: float,
        matrices: _Matrices,
        further: NDArray[np.float64] | None,
    ) -> tuple[tuple[float, float, float], NDArray[np.float64]]:
        """Return the energy that no rigid motion explains in a window, that of noise, the largest allowed; and the fit.

        The rate is the integral of α from an unknown start with an unknown constant bias; the null space may have a
        constant bias too.
        """
        readings = window.readings @ columns.T
        z = readings @ matrices.null.T
        turned = time * (window.integrals @ columns.T @ matrices.alpha.T)  # (m, 3)
        t = time * window.t
        sigma = self.limits.noise[self.alive]
        noise = float(np.sum((matrices.null * sigma) ** 2)) * window.noise_share
        allowed = self._allowed(np.std(readings, axis=0))
        bias_std = np.abs(matrices.alpha) @ self.limits.bias[self.alive]  # (3,) of α
        prior = noise / len(matrices.null) / np.maximum(bias_std, 1e-9) ** 2
        seen = np.linalg.pinv(matrices.sensitivity, rcond=0.05)
        fastest = int(np.argmax(np.sum(z**2, axis=1)))  # where biases matter least
        rates = _rates_of(seen @ z[:5].mean(axis=0)) + [rate - turned[fastest] for rate in _rates_of(seen @ z[fastest])]
        energy, fitted = np.inf, np.zeros(6)
        starts = [np.concatenate([rate, np.zeros(3)]) for rate in [np.zeros(3), *rates]]
        for start in starts if further is None else [*starts, further]:
            left, point = _unexplained(z, turned, t, matrices, start, prior)
            if left < energy:
                energy, fitted = left, point
            if energy < 2.0 * noise:
                break
        return (energy, noise, allowed), fitted


def _unexplained(
    z: NDArray[np.float64],
    turned: NDArray[np.float64],
    t: NDArray[np.float64],
    matrices: _Matrices,
    start: NDArray[np.float64],
    prior: NDArray[np.float64],
) -> tuple[float, NDArray[np.float64]]:
    """Return the mean square of the null space (m, d), m/s², that the best rate at the start and bias of α leave.

    The second value are those two (6,), found from ``start``. ``prior`` (3,) weighs the square of the bias against
    the sum of squares. Levenberg's damped Gauss–Newton steps.
    """
    count = len(t)
    weight = np.concatenate([np.zeros(3), prior])
    centred, turned = np.ascontiguousarray(z - z.mean(axis=0)), np.ascontiguousarray(turned)
    point = start
    best, damping = np.inf, 1e-6
    kept = point
    normal, pull = np.zeros((6, 6)), np.zeros(6)
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(_ITERATIONS):
            square, slopes, inner = rotation_normal(centred, turned, t, matrices.sensitivity, point)
            energy = float(square + weight @ point**2) / count
            if np.isfinite(energy) and energy < best:
                done = best - energy < 1e-4 * energy
                best, kept, damping = energy, point, 0.2 * damping
                normal = slopes
                normal[_DIAGONAL] += weight
                pull = inner - weight * point
                if done:
                    break
            else:
                damping = max(10.0 * damping, 1e-4)
            lifted = normal.copy()
            lifted[_DIAGONAL] += damping * normal[_DIAGONAL] + 1e-12 * normal[_DIAGONAL].sum()
            if not (np.isfinite(lifted).all() and lifted.any()):
                break
            point = kept + np.linalg.solve(lifted, pull)  # lifted is positive definite
    return best, kept


def _slopes(omega: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the derivatives of the products of ω (m, 3), shape (m, 6, 3)."""
    x, y, z = omega.T
    o = np.zeros_like(x)
    rows = [(2 * x, o, o), (o, 2 * y, o), (o, o, 2 * z), (y, x, o), (z, o, x), (o, z, y)]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _rates_of(products: NDArray[np.floating[Any]]) -> list[NDArray[np.float64]]:
    """Return the two rates whose products (6,) are nearest to these."""
    xx, yy, zz, xy, xz, yz = products
    values, vectors = np.linalg.eigh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    rate = np.sqrt(max(values[-1], 0.0)) * vectors[:, -1]
    return [rate, -rate] if rate.any() else []


def _least_largest(axes: NDArray[np.float64], mean: NDArray[np.float64], limit: NDArray[np.float64]) -> float:
    """Return the least possible largest residual of a specific force, over each channel's limit (Chebyshev's fit)."""
    from scipy.optimize import linprog  # takes a while, and few recordings need it

    upper = np.hstack([axes, -limit[:, None]])
    lower = np.hstack([-axes, -limit[:, None]])
    found = linprog(
        [0.0, 0.0, 0.0, 1.0],
        A_ub=np.vstack([upper, lower]),
        b_ub=np.concatenate([mean, -mean]),
        bounds=[(None, None)] * 3 + [(0.0, None)],
    )
    return float(found.fun) if found.success else 0.0


def gather(recording: Recording, array: AccelerometerArray, limits: PartLimits, alive: NDArray[np.bool_]) -> Evidence:
    """Reduce a recording to what shows whether its channels fit one rigid body.

    Raises
    ------
    InputError
        As `gfimu.Recording.for_array`.
    """
    readings = np.where(alive, recording.for_array(array), 0.0)  # (n, c)
    whole: NDArray[np.bool_] = np.asarray(np.isfinite(readings).all(axis=1))
    rests = _rests(recording, array, readings, whole, alive, limits.noise)
    step = max(1, int(np.count_nonzero(whole)) // 20_000)
    covariance = np.cov(readings[whole][::step].T) if np.count_nonzero(whole) > 2 else np.zeros((0, 0))
    up = None
    if "mounting_rotvec_rad" in recording.metadata and _TABLE & set(recording.reference):
        up = Rotation.from_rotvec(recording.mounting_rotvec).inv().apply([0.0, 0.0, 1.0])
    longest = sorted(sorted(rests, key=lambda rest: rest.start - rest.stop)[:_RESTS], key=lambda rest: rest.start)
    means = np.array([readings[rest][whole[rest]].mean(axis=0) for rest in longest]).reshape(-1, array.n_channels)
    windows = _windows(recording, readings[:, alive], whole, rests)
    quiet, rate = _quiet(readings), recording.sample_rate
    return Evidence(array, alive, limits, means, covariance, windows, up, quiet, rate, recording.unit_from)


def _rests(
    recording: Recording,
    array: AccelerometerArray,
    readings: NDArray[np.float64],
    whole: NDArray[np.bool_],
    alive: NDArray[np.bool_],
    noise: NDArray[np.float64],
) -> list[slice]:
    """Return the stretches of rest, the longest ones of many."""
    t = recording.t_s
    rate = recording.sample_rate
    if not _NOMINAL_RATES[0] < rate < _NOMINAL_RATES[1]:
        t = np.arange(len(t)) / _RATE
    names = tuple(name for name, lives in zip(array.channels, alive, strict=True) if lives)
    try:
        tacho = {name: recording.reference[name] for name in ("tacho_rad_s",) if name in recording.reference}
        rest = detect_rest(Recording(t, readings[:, alive], names, tacho))
    except InputError:
        return []
    longest = np.sort(np.argsort(-rest.lengths, kind="stable")[:_MOST_RESTS])
    found = [slice(int(rest.start[place]), int(rest.stop[place])) for place in longest]
    kept = []
    for rows in found:
        inside = readings[rows][whole[rows]]
        if len(inside) >= _FEWEST and np.all(
            inside.std(axis=0) < 3.0 * noise + _STILL * np.linalg.norm(inside.mean(axis=0))
        ):
            kept.append(rows)  # a perfect sensor's slowest motion is a rest for `detect_rest` too
    return kept


def _windows(
    recording: Recording, readings: NDArray[np.float64], whole: NDArray[np.bool_], rests: Sequence[slice]
) -> tuple[Window, ...]:
    """Return the first stretch of motion, and the one in which the readings vary most."""
    t, values = recording.t_s[whole], readings[whole]
    group = max(1, int(recording.sample_rate // _RATE)) if recording.sample_rate < _NOMINAL_RATES[1] else 1
    count = len(t) // group
    if count < 2 * _FEWEST:
        return ()
    t = t[: count * group].reshape(count, group).mean(axis=1)
    values = values[: count * group].reshape(count, group, -1).mean(axis=1)
    length = min(_WINDOW, count)
    starts = np.arange(0, count - length + 1, max(1, length // 4))
    spread = [float(values[start : start + length].var(axis=0).sum()) for start in starts]
    after_rest = 0
    if rests:
        last = int(np.count_nonzero(whole[: rests[0].stop])) // group
        after_rest = max(0, min(last - _FEWEST, count - length))
    passed = np.concatenate([[0], np.cumsum(whole)])
    edges = np.array([[passed[rest.start], passed[rest.stop]] for rest in rests]).reshape(-1, 2) // group
    chosen = dict.fromkeys([after_rest, int(starts[int(np.argmax(spread))])])
    windows = []
    for start in chosen:
        part = slice(start, start + length)
        still = _still(t[part], values[part], edges - start)
        integrals = integrate_samples(t[part], values[part] - still, method="trapezoid")
        rows = np.unique(np.linspace(0, length - 1, min(_ROWS, length)).astype(int))
        windows.append(Window(values[part][rows], integrals[rows], t[part][rows] - t[start], 1.0 / group))
    return tuple(windows)


def _still(t: NDArray[np.float64], values: NDArray[np.float64], rests: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return what channels (m, c) read while α is zero, interpolated between the rests (k, 2) of a window.

    A gain that is off by a tenth makes an α of gravity, another one in each pose, that would integrate to a rate. At
    rest, and in a steady spin, α is zero; so what is read there is taken off, and what is wrong with it is fitted.
    """
    inside = np.clip(rests, 0, len(t))
    inside = inside[inside[:, 1] - inside[:, 0] >= _FEWEST_STILL]
    if not len(inside):
        return np.zeros_like(values)
    middles = [float(t[start:stop].mean()) for start, stop in inside]
    means = np.array([values[start:stop].mean(axis=0) for start, stop in inside])
    return np.column_stack([np.interp(t, middles, column) for column in means.T])


def _quiet(readings: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the noise of each channel (c,) from second differences of its quietest tenth of samples, m/s²."""
    size = 20
    second = np.diff(readings, n=2, axis=0) / np.sqrt(6.0)
    count = len(second) // size
    if count < 1:
        return np.zeros(readings.shape[1])
    blocks = second[: count * size].reshape(count, size, -1)
    rms = np.sqrt(np.mean(blocks**2, axis=1))  # NaN where a sample is missing
    return np.nan_to_num(np.nanquantile(rms, 0.1, axis=0)) if np.isfinite(rms).any() else np.zeros(readings.shape[1])
