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

from gfimu.array.array import AccelerometerArray
from gfimu.array.kinematics import omega_products
from gfimu.array.parts.limits import PartLimits
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.recording.evidence.rotation_normal import rotation_normal

__all__ = ["FEWEST", "Costs", "Evidence", "Matrices", "Otherwise", "Window", "product_slopes", "rates_of"]

ALIGNMENT = 0.05  # rad, by which a sensing axis may be off on a real board: "turned by degrees"
FEWEST = 30  # samples of a stretch that is compared
_LEAST_PARITY = 3  # combinations free of all motion that make the integration of α needless
_DIAGONAL = np.diag_indices(6)
_ITERATIONS = 15
_NO_LEAK = 1e-6  # rad/s² per rad²/s²
_WEAK = 0.1  # products seen more weakly than this share of the best are not used to clean α


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
    brief : str
        What it is about in a few words, for a list; the channels by default.
    """

    kind: str
    text: str
    columns: NDArray[np.float64]
    time: float = 1.0
    array: AccelerometerArray | None = None
    channels: tuple[str, ...] = ()
    parts: tuple[Otherwise, ...] = ()
    brief: str = ""

    @property
    def about(self) -> str:
        """What it is about, in a few words."""
        return self.brief or " and ".join(self.channels)

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
    """Samples of a stretch of motion: readings (m, c), their integrals from its start (m, c), times since (m,), s.

    ``tacho`` (m,), rad/s: NaN where there is none.
    """

    readings: NDArray[np.float64]
    integrals: NDArray[np.float64]
    t: NDArray[np.float64]
    tacho: NDArray[np.float64]
    noise_share: float  # variance of the noise over that of one sample


@dataclass(frozen=True)
class Matrices:
    """What an array makes of its readings: α = A y, N y = M s(ω), and P y = 0 for any motion.

    ``clean``: whether no products of ω are left in A y; without that the motion is not judged.
    """

    alpha: NDArray[np.float64]  # (3, c)
    clean: bool
    null: NDArray[np.float64]  # (d, c), orthonormal rows
    sensitivity: NDArray[np.float64]  # (d, 6)
    parity: NDArray[np.float64]  # (k, c), orthonormal rows

    @classmethod
    def of(cls, array: AccelerometerArray, alive: NDArray[np.bool_]) -> Matrices:
        """Return the matrices of the channels (c,) of an array that are alive."""
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
    _cache: dict[str, Matrices] = field(default_factory=dict)

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

    def _matrices(self, array: AccelerometerArray) -> Matrices:
        if array.name not in self._cache:
            self._cache[array.name] = Matrices.of(array, self.alive)
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

    def follows_tacho(self, way: Otherwise) -> float:
        """Return the correlation of the turning about the upward direction with the tachometer, each without its trend.

        It is negative for a mirrored way to read the file, and 0 where there is no tachometer or no upward direction.
        """
        if self.up is None or not self.windows:
            return 0.0
        columns = way.columns[np.ix_(self.alive, self.alive)]
        alpha = self._matrices(way.array or self.array).alpha
        product = power = other = 0.0
        for window in self.windows:
            known = np.isfinite(window.tacho)
            turned = window.integrals[known] @ columns.T @ alpha.T @ self.up
            both = np.column_stack([turned, window.tacho[known]])
            if len(both) < FEWEST:
                continue
            line = np.column_stack([np.ones(len(both)), window.t[known]])
            both -= line @ np.linalg.lstsq(line, both, rcond=None)[0]
            squares = both.T @ both
            product, power, other = product + squares[0, 1], power + squares[0, 0], other + squares[1, 1]
        return float(product / np.sqrt(power * other)) if power * other > 0.0 else 0.0

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
        for start in rates_of(products):
            omega = start
            for _ in range(_ITERATIONS):
                slope = np.hstack([axes, centripetal @ product_slopes(omega[None])[0]]) / limit[:, None]
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
        matrices: Matrices,
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
        rates = rates_of(seen @ z[:5].mean(axis=0)) + [rate - turned[fastest] for rate in rates_of(seen @ z[fastest])]
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
    matrices: Matrices,
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


def product_slopes(omega: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the derivatives of the products of ω (m, 3), shape (m, 6, 3)."""
    x, y, z = omega.T
    o = np.zeros_like(x)
    rows = [(2 * x, o, o), (o, 2 * y, o), (o, o, 2 * z), (y, x, o), (z, o, x), (o, z, y)]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def rates_of(products: NDArray[np.floating[Any]]) -> list[NDArray[np.float64]]:
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
