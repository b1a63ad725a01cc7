"""What the readings of an array show, for every set of working channels: α, products of ω, and neither.

The c readings y of a rigid body that moves with α, p and ω are y = J [α; p] + Q s(ω) + b + noise, with s the six
products of ω. For any set of channels they fall into three parts:

* α = A y − L s(ω) − A b, with A J = [1 0]: what a filter integrates. A is the unweighted left inverse, cleaned of the
  products as far as the null space sees them well; L is what remains. p = P y − L_p s(ω) − P b is solved alike.
* z = Z y = M s(ω) + Z b + noise, with Z J = 0: the combinations that see products, at most six; whitened.
* parity rows, which see neither: they show the noise, and the biases that only smaller sets of channels see.

The biases that a filter can know are b_α = A b, b_z = Z b and b_p = P b of the full set. A smaller set sees these and
the parity biases b_0, A' b = b_α + K b_z + K' b_0, P' b = b_p + K_p b_z + K_p' b_0 and Z' b = T b_z + T' b_0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.kinematics import require_all_motions
from gfimu.array.observability import null_rows
from gfimu.base.errors import InputError

__all__ = ["ChannelSet", "ChannelSets", "SetTables"]

_RANK = 1e-9  # numerical: share of the largest entry that counts as zero
_SEEN = 1e-6  # numerical: of the best seen product
_WEAK = 0.1  # products seen more weakly than this share of the best are not used to clean α


class ChannelSet(NamedTuple):
    """One set of working channels.

    Parameters
    ----------
    alpha_rows : ndarray, shape (3, c)
        A.
    leak : ndarray, shape (3, 6)
        L.
    alpha_noise : ndarray, shape (3, 3)
        Covariance of the noise of A y, (rad/s²)².
    force_rows, force_leak, force_noise : ndarray, shapes (3, c), (3, 6), (3, 3)
        P, L_p and the covariance of the noise of P y, (m/s²)².
    product_rows : ndarray, shape (m, c)
        Z; zero rows behind those that this set has.
    sensitivity : ndarray, shape (m, 6)
        M.
    rows : int
        Rows of Z that this set has; −1 where it does not see α.
    cross_noise : ndarray, shape (3, m)
        Covariance of the noises of A y and Z y, rad/s².
    alpha_bias, product_bias : ndarray, shapes (3, m), (m, m)
        K and T.
    alpha_parity, product_parity : ndarray, shapes (3, d), (m, d)
        K' and T'.
    force_bias, force_parity : ndarray, shapes (3, m), (3, d)
        K_p and K_p'.
    null_rows : ndarray, shape (c − 6, c)
        Z and behind it the parity rows of this set; zero rows behind those that there are.
    nulls : int
        How many there are; −1 if the set can't see α.
    inverse : ndarray, shape (6, m)
        M⁺, which gives the products from z as far as they are seen.
    square_seen : ndarray of bool, shape (3,)
        Whether ω_x², ω_y² and ω_z² are seen each by itself.
    plain : bool
        Whether A y holds α and b_α alone.
    mixed : bool
        Whether the noises of A y and Z y are correlated.
    size : float
        ‖M‖², s⁴/rad⁴ in units of the noise.
    cross_products, cross_bias, cross_square : ndarray, shapes (3, 6), (3, m), (3, 3)
        S M, S T and S Sᵀ with S the cross noise.
    cross_size : float
        ‖S M‖².
    inverse_bias : ndarray, shape (3, m)
        Biases of the squares of ω: the first rows of M⁺ T.
    """

    alpha_rows: NDArray[np.float64]
    leak: NDArray[np.float64]
    alpha_noise: NDArray[np.float64]
    force_rows: NDArray[np.float64]
    force_leak: NDArray[np.float64]
    force_noise: NDArray[np.float64]
    product_rows: NDArray[np.float64]
    sensitivity: NDArray[np.float64]
    rows: int
    cross_noise: NDArray[np.float64]
    alpha_bias: NDArray[np.float64]
    product_bias: NDArray[np.float64]
    alpha_parity: NDArray[np.float64]
    product_parity: NDArray[np.float64]
    force_bias: NDArray[np.float64]
    force_parity: NDArray[np.float64]
    inverse: NDArray[np.float64]
    square_seen: NDArray[np.bool_]
    plain: bool
    mixed: bool
    size: float
    cross_products: NDArray[np.float64]
    cross_bias: NDArray[np.float64]
    cross_square: NDArray[np.float64]
    cross_size: float
    inverse_bias: NDArray[np.float64]
    null_rows: NDArray[np.float64]
    nulls: int

    @property
    def null_sensitivity(self) -> NDArray[np.float64]:
        """What ``null_rows`` see of the products, shape (c − 6, 6): M, and nothing in the parity rows."""
        return np.pad(self.sensitivity, ((0, len(self.null_rows) - len(self.sensitivity)), (0, 0)))


class SetTables(NamedTuple):
    """The fields of `ChannelSet` that a compiled filter needs, stacked over the sets."""

    leak: NDArray[np.float64]  # (sets, 3, 6)
    alpha_noise: NDArray[np.float64]  # (sets, 3, 3)
    force_leak: NDArray[np.float64]  # (sets, 3, 6)
    force_noise: NDArray[np.float64]  # (sets, 3, 3)
    force_bias: NDArray[np.float64]  # (sets, 3, m)
    sensitivity: NDArray[np.float64]  # (sets, m, 6)
    rows: NDArray[np.int64]  # (sets,)
    cross_noise: NDArray[np.float64]  # (sets, 3, m)
    alpha_bias: NDArray[np.float64]  # (sets, 3, m)
    product_bias: NDArray[np.float64]  # (sets, m, m)
    inverse: NDArray[np.float64]  # (sets, 6, m)
    square_seen: NDArray[np.bool_]  # (sets, 3)
    plain: NDArray[np.bool_]  # (sets,)
    mixed: NDArray[np.bool_]  # (sets,)
    size: NDArray[np.float64]  # (sets,)
    cross_products: NDArray[np.float64]  # (sets, 3, 6)
    cross_bias: NDArray[np.float64]  # (sets, 3, m)
    cross_square: NDArray[np.float64]  # (sets, 3, 3)
    cross_size: NDArray[np.float64]  # (sets,)
    inverse_bias: NDArray[np.float64]  # (sets, 3, m)


class ChannelSets:
    """The sets of working channels of an array that were met so far; set 0 has every channel.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions.
    noise_std : ndarray, shape (c,)
        White noise of its channels per sample, m/s².

    Attributes
    ----------
    parity_rows : ndarray, shape (d, c)
        Whitened combinations of all channels that see no motion.

    Raises
    ------
    GeometryError
        If the array can't see all six motions.
    """

    def __init__(self, array: AccelerometerArray, noise_std: NDArray[np.float64]) -> None:
        require_all_motions(array)
        if np.shape(noise_std) != (array.n_channels,):
            raise InputError(
                f"noise_std holds {np.size(noise_std)} numbers; array {array.name!r} has {array.n_channels} channels"
            )
        self.array, self.noise_std = array, noise_std
        self._variance = noise_std**2
        self._scale = np.array([array.length_unit] * 3 + [1.0] * 3)
        basis = self._whitened(null_rows((array.regression_matrix / self._scale).T))  # (c − 6, c)
        rows, self._products = _by_products(basis, array.centripetal_matrix)
        self._basis = rows
        self.parity_rows = rows[self._products :]
        self._places: dict[bytes, int] = {}
        self._tables: SetTables | None = None
        self.sets: list[ChannelSet] = []
        self.index(np.ones(array.n_channels, dtype=np.bool_))

    @property
    def full(self) -> ChannelSet:
        """The set with every channel."""
        return self.sets[0]

    @property
    def products(self) -> int:
        """Number m of rows that see products of ω."""
        return self._products

    def index(self, present: NDArray[np.bool_]) -> int:
        """Place of the set with the channels ``present`` (c,), built if new."""
        key = present.tobytes()
        if key not in self._places:
            self._places[key] = len(self.sets)
            self._tables = None
            self.sets.append(self._build(present))
        return self._places[key]

    def indices(self, present: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Places of the sets of n samples, ``present`` (n, c)."""
        places = np.zeros(len(present), dtype=np.int64)
        partial = np.flatnonzero(~present.all(axis=1))
        if partial.size:
            kinds, which = np.unique(present[partial], axis=0, return_inverse=True)
            places[partial] = np.array([self.index(kind) for kind in kinds])[which.reshape(-1)]
        return places

    def tables(self) -> SetTables:
        """Return the sets met so far, stacked."""
        if self._tables is None:
            self._tables = SetTables(*(np.stack([getattr(one, key) for one in self.sets]) for key in SetTables._fields))
        return self._tables

    def bias_covariance(self, channels: NDArray[np.float64], *, path: bool = False) -> NDArray[np.float64]:
        """Covariance of [b_α; b_z], or [b_α; b_z; b_p], of channel biases with the covariance (c, c), m²/s⁴."""
        rows = self.rows(path=path)
        return np.asarray(rows @ channels @ rows.T)

    def rows(self, *, path: bool = False) -> NDArray[np.float64]:
        """Rows [A; Z] of the full set, (3 + m, c), or with those of p, [A; Z; P]."""
        rows = [self.full.alpha_rows, self.full.product_rows]
        return np.vstack([*rows, self.full.force_rows] if path else rows)

    def _build(self, present: NDArray[np.bool_]) -> ChannelSet:
        c, m, d = self.array.n_channels, self._products, len(self.parity_rows)
        everything = bool(present.all())
        rows, leak, noise = np.zeros((6, c)), np.zeros((6, 6)), np.zeros((6, 6))  # of [α; p]
        product_rows, sensitivity, mixing = np.zeros((m, c)), np.zeros((m, 6)), np.zeros((m, m + d))
        biases, nulls = np.zeros((6, m + d)), np.zeros((m + d, c))
        count = known = -1
        if np.linalg.matrix_rank(self.array.regression_matrix[present] / self._scale, tol=1e-6) == 6:
            # Combinations of the null space that don't touch the missing channels.
            ordered, count = self._basis, m
            if not everything:
                smaller = null_rows(self._basis[:, ~present].T) @ self._basis
                smaller[:, ~present] = 0.0
                ordered, count = _by_products(smaller, self.array.centripetal_matrix)
            known = len(ordered)
            nulls[:known], product_rows[:count] = ordered, ordered[:count]
            mixing[:count] = ordered[:count] * self._variance @ self._basis.T
            sensitivity[:count] = _clean(product_rows[:count] @ self.array.centripetal_matrix)
            rows = self._motion_rows(present, product_rows[:count])
            full = rows if everything else np.vstack([self.full.alpha_rows, self.full.force_rows])
            biases = (rows - full) * self._variance @ self._basis.T
            leak = _clean(rows @ self.array.centripetal_matrix)
            noise = rows * self._variance @ rows.T
        inverse = np.linalg.pinv(sensitivity, rcond=_SEEN)  # (6, m)
        seen = np.abs((inverse @ sensitivity)[:3] - np.eye(6)[:3]).max(axis=1) < _SEEN
        cross = rows[:3] * self._variance @ product_rows.T
        mixed = bool(np.any(np.square(cross) > _RANK * noise[:3, :3].max(initial=0.0)))
        return ChannelSet(
            rows[:3], leak[:3], noise[:3, :3], rows[3:], leak[3:], noise[3:, 3:], product_rows, sensitivity, count,
            cross, biases[:3, :m], mixing[:, :m], biases[:3, m:], mixing[:, m:], biases[3:, :m], biases[3:, m:],
            np.asarray(inverse, dtype=np.float64), seen, everything and not leak[:3].any(), mixed,
            float(np.sum(sensitivity**2)), cross @ sensitivity, cross @ mixing[:, :m], cross @ cross.T,
            float(np.sum((cross @ sensitivity) ** 2)), np.asarray(inverse[:3] @ mixing[:, :m], dtype=np.float64),
            nulls, known,
        )  # fmt: skip

    def _whitened(self, basis: NDArray[np.float64]) -> NDArray[np.float64]:
        if len(basis) == 0:
            return basis
        factor = np.linalg.cholesky(basis * self._variance @ basis.T)
        return np.linalg.solve(factor, basis)

    def _motion_rows(self, present: NDArray[np.bool_], product_rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rows [A; P] (6, c) of the working channels: unweighted left inverse, cleaned of products seen well."""
        rows = np.zeros((6, self.array.n_channels))
        inverse = np.linalg.pinv(self.array.regression_matrix[present] / self._scale)
        rows[:, present] = inverse / self._scale[:, None]
        leak = _clean(rows @ self.array.centripetal_matrix)
        if leak.any() and len(product_rows):
            seen = product_rows @ self.array.centripetal_matrix
            rows = rows - leak @ np.linalg.pinv(seen, rcond=_WEAK) @ product_rows
        return rows


def _by_products(basis: NDArray[np.float64], centripetal: NDArray[np.float64]) -> tuple[NDArray[np.float64], int]:
    """Rotate whitened rows so that those that see products of ω stand first; returns the rows and their number."""
    if len(basis) == 0:
        return basis, 0
    rotation, strengths, _ = np.linalg.svd(_clean(basis @ centripetal))
    return rotation.T @ basis, int(np.sum(strengths > _SEEN * max(strengths[0], 1e-300))) if strengths.any() else 0


def _clean(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Set rounding errors to zero, so that what cancels exactly is an exact zero."""
    largest = np.abs(matrix).max(initial=0.0)
    return np.where(np.abs(matrix) > _RANK * max(1.0, largest), matrix, 0.0)
