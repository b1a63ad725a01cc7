"""Rigid-body kinematics of an accelerometer array: readings from motion, and motion from readings.

Forward (GF-IMU paper, step 3): a_i = θ_iᵀ p + θ_iᵀ (α × r_i) + θ_iᵀ (ωωᵀ − |ω|² I) r_i, with p the specific force of
the body origin, α the angular acceleration and ω the angular rate, all in body axes. Stacked: a = J [α; p] + Q s(ω).

Backward, four ways:

- `closed_form`: the paper's eqs 28–29, for four tri-axial chips at alternate corners of a cube;
- `motion_from_readings`: the left inverse S of J for any array, with a given ω where S Q ≠ 0 (step 5);
- `joint_form`: the inverse of [J Q], which needs no ω and returns its products too;
- `null_space`: the combinations of readings that no α and no p can move; they see ω alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.observability import MOTION_NAMES, RANK_TOLERANCE, null_rows, require_all_motions, unseen_motions
from gfimu.base.errors import GeometryError, InputError
from gfimu.base.short_repr import short_repr

__all__ = [
    "ALTERNATE_CORNERS",
    "MOTION_NAMES",
    "closed_form",
    "joint_covariance",
    "joint_form",
    "motion_from_readings",
    "null_space",
    "omega_leakage",
    "omega_products",
    "pseudo_inverse",
    "require_all_motions",
    "specific_force",
    "unseen_motions",
]

ALTERNATE_CORNERS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
"""Signs of the positions of chips 1 to 4 of the tetrahedral cube, shape (4, 3)."""

_EXACT = 1e-12
_BLOCK = 2048  # rows per matrix product: the block stays in the first-level cache


@dataclass(frozen=True)
class MotionEstimate:
    """Motion of the body origin, from the readings of one array.

    Parameters
    ----------
    alpha : ndarray, shape (n, 3)
        Angular acceleration in body axes, rad/s².
    p : ndarray, shape (n, 3)
        Specific force of the body origin in body axes, m/s².
    covariance : ndarray, shape (6, 6)
        Covariance of [alpha; p] for channels of unit variance; multiply by the channel variance, (m/s²)².
    """

    alpha: NDArray[np.float64]
    p: NDArray[np.float64]
    covariance: NDArray[np.float64]

    __repr__ = short_repr


@dataclass(frozen=True)
class JointEstimate:
    """Motion and the products of the angular rate, from the readings alone.

    Parameters
    ----------
    alpha : ndarray, shape (n, 3)
        Angular acceleration in body axes, rad/s².
    p : ndarray, shape (n, 3)
        Specific force of the body origin in body axes, m/s².
    omega_products : ndarray, shape (n, 6)
        Products of the angular rate in the order `gfimu.array.array.OMEGA_PRODUCTS`, rad²/s²; NaN where the array
        doesn't see a product.
    covariance : ndarray, shape (12, 12)
        Covariance of [alpha; p; omega_products] for channels of unit variance; NaN rows and columns for products
        that the array doesn't see.
    """

    alpha: NDArray[np.float64]
    p: NDArray[np.float64]
    omega_products: NDArray[np.float64]
    covariance: NDArray[np.float64]

    __repr__ = short_repr


@dataclass(frozen=True)
class NullSpace:
    """Combinations of the readings that neither α nor p can move, white for white channels.

    ``basis @ reading`` = ``sensitivity @ omega_products(ω)`` + noise; with independent channels of equal standard
    deviation σ the noise is independent with standard deviation σ in every row.

    Parameters
    ----------
    basis : ndarray, shape (c − 6, c)
        Orthonormal rows, each orthogonal to J; those that see ω best come first.
    sensitivity : ndarray, shape (c − 6, 6)
        basis Q, m; rows from ``rank`` on are zero: pure parity checks that no motion can move.
    rank : int
        How many of the six products of ω the null space sees.
    """

    basis: NDArray[np.float64]
    sensitivity: NDArray[np.float64]
    rank: int

    __repr__ = short_repr


def omega_products(omega: ArrayLike) -> NDArray[np.float64]:
    """Six products of the angular rate in the order `gfimu.array.array.OMEGA_PRODUCTS`.

    Parameters
    ----------
    omega : array_like, shape (..., 3)
        Angular rate in body axes, rad/s.

    Returns
    -------
    ndarray, shape (..., 6)
        ω_x², ω_y², ω_z², ω_x ω_y, ω_x ω_z, ω_y ω_z, rad²/s².
    """
    x, y, z = np.moveaxis(np.asarray(omega, dtype=float), -1, 0)
    return np.stack([x * x, y * y, z * z, x * y, x * z, y * z], axis=-1)


def specific_force(array: AccelerometerArray, p: ArrayLike, alpha: ArrayLike, omega: ArrayLike) -> NDArray[np.float64]:
    """Compute the specific force along each sensing axis of a moving array.

    Parameters
    ----------
    array : AccelerometerArray
        The array, with c channels.
    p : array_like, shape (n, 3)
        Specific force of the body origin in body axes, m/s².
    alpha : array_like, shape (n, 3)
        Angular acceleration in body axes, rad/s².
    omega : array_like, shape (n, 3)
        Angular rate in body axes, rad/s.

    Returns
    -------
    ndarray, shape (n, c)
        Readings of ideal sensors, m/s².

    Examples
    --------
    >>> import gfimu
    >>> cube = gfimu.AccelerometerArray.load("cube12")
    >>> gfimu.specific_force(cube, [0.0, 0.0, 9.81], [0.0, 0.0, 0.0], [0.0, 0.0, 2.0]).shape
    (1, 12)
    """
    motion = np.concatenate(np.broadcast_arrays(*np.atleast_2d(alpha, p)), axis=-1)  # (n, 6)
    return motion @ array.regression_matrix.T + omega_products(np.atleast_2d(omega)) @ array.centripetal_matrix.T


def pseudo_inverse(array: AccelerometerArray) -> NDArray[np.float64]:
    """Compute the left inverse S = (JᵀJ)⁻¹Jᵀ of the regression matrix (GF-IMU paper, step 5), shape (6, c).

    Unweighted on purpose: weights for unequal noise would let ω² back into α where J is orthogonal to Q.

    Raises
    ------
    GeometryError
        If the array can't see all six motions.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.pseudo_inverse(gfimu.AccelerometerArray.load("cube12")).shape
    (6, 12)
    """
    require_all_motions(array)
    return _left_inverse(array.regression_matrix, array.length_unit)


def omega_leakage(array: AccelerometerArray) -> NDArray[np.float64]:
    """Matrix S Q, shape (6, 6): what the products of ω leave in the rows `MOTION_NAMES` of S a.

    Rows of α are pure numbers, rows of p are in m. Rounding errors are set to zero, so a geometry whose linear
    solution is free of ω² gives exact zeros.
    """
    leakage = pseudo_inverse(array) @ array.centripetal_matrix
    return _without_rounding(leakage, array.length_unit)


def closed_form(
    array: AccelerometerArray, readings: ArrayLike, *, out: NDArray[np.float64] | None = None
) -> MotionEstimate:
    """Solve for the motion from four tri-axial chips at alternate corners of a cube (eqs 28–29).

    Each component of p is a quarter of the sum of four readings, each component of α is 1/(4L) times the signed sum
    of eight. The centripetal terms cancel, so no ω is needed.

    Parameters
    ----------
    array : AccelerometerArray
        ``cube12``, ``cube12_as_built``, or any cube with the chips at `ALTERNATE_CORNERS` in that order and with the
        same sensing axes, each along a body axis, in every chip.
    readings : array_like, shape (n, 12)
        Specific force along the channels, m/s²; C or Fortran order, read once.
    out : ndarray, shape (n, 6), optional
        Where to put [alpha, p]; the result's fields are views of it.

    Returns
    -------
    MotionEstimate
        NaN in every component to which a missing reading contributes.

    Raises
    ------
    GeometryError
        If the array is another geometry.

    Examples
    --------
    >>> import numpy as np
    >>> import gfimu
    >>> cube = gfimu.AccelerometerArray.load("cube12")
    >>> level = np.tile(cube.axes @ [0.0, 0.0, 9.81], (3, 1))
    >>> round(float(gfimu.closed_form(cube, level).p[0, 2]), 6)
    9.81
    """
    from gfimu.array.kernels.alternate_corners import sum_alternate_corners

    half_edge, columns, signs = _cube_of_alternate_corners(array)
    rows = _reading_matrix(array, readings)
    motion = np.empty((len(rows), 6)) if out is None else out
    sum_alternate_corners(rows, columns, signs / (8.0 * half_edge), signs / 4.0, motion)
    covariance = np.diag([1.0 / (8.0 * half_edge**2)] * 3 + [1.0 / 4.0] * 3)
    return MotionEstimate(motion[:, :3], motion[:, 3:], covariance)


def motion_from_readings(
    array: AccelerometerArray, readings: ArrayLike, omega: ArrayLike | None = None
) -> MotionEstimate:
    """Solve for the motion from the readings of any array: [α; p] = S a − S Q s(ω) (GF-IMU paper, step 5).

    Parameters
    ----------
    array : AccelerometerArray
        The array, with c channels.
    readings : array_like, shape (n, c)
        Specific force along the channels, m/s². A row with missing readings (NaN) is solved from the others as far
        as they see all six motions; without ``omega`` such rows usually stay NaN, because ω² no longer cancels.
    omega : array_like, shape (n, 3), optional
        Angular rate in body axes, rad/s; needed where `omega_leakage` isn't zero.

    Raises
    ------
    GeometryError
        If the array can't see all six motions, or leaves ω² terms and ``omega`` is not given.

    Examples
    --------
    >>> import numpy as np
    >>> import gfimu
    >>> cube = gfimu.AccelerometerArray.load("cube12")
    >>> level = np.tile(cube.axes @ [0.0, 0.0, 9.81], (3, 1))
    >>> round(float(gfimu.motion_from_readings(cube, level).p[0, 2]), 6)
    9.81
    """
    rows = _reading_matrix(array, readings)
    rates = None if omega is None else _rate_matrix(omega, len(rows))
    inverse = pseudo_inverse(array)  # (6, c)
    leakage = omega_leakage(array)  # (6, 6)
    if rates is None and leakage.any():
        dirty = [name for name, row in zip(MOTION_NAMES, leakage, strict=True) if row.any()]
        raise GeometryError(
            f"array {array.name!r} leaves products of the angular rate in {', '.join(dirty)}; "
            "give omega, or use joint_form where the array allows it"
        )
    motion = _product_by_blocks(rows, inverse)
    if rates is not None and leakage.any():
        motion -= omega_products(rates) @ leakage.T
    if np.isnan(motion.min(initial=np.inf)):  # one fast pass; missing readings are rare
        holed = np.flatnonzero(np.isnan(motion).any(axis=1))
        motion[holed] = _motion_of_holed_rows(array, rows[holed], None if rates is None else rates[holed])
    return MotionEstimate(motion[:, :3], motion[:, 3:], inverse @ inverse.T)


def joint_form(array: AccelerometerArray, readings: ArrayLike) -> JointEstimate:
    """Solve for motion and products of ω together by the least-squares inverse of [J Q]: needs no ω, no recursion.

    Parameters
    ----------
    array : AccelerometerArray
        An array whose readings determine α and p with the products of ω free: any with four tri-axial chips not in
        one plane, or the nine-accelerometer package 3-2-2-2.
    readings : array_like, shape (n, c)
        Specific force along the channels, m/s².

    Raises
    ------
    GeometryError
        If α or p can't be separated from the products of ω.

    Examples
    --------
    >>> import numpy as np
    >>> import gfimu
    >>> cube = gfimu.AccelerometerArray.load("cube12")
    >>> level = np.tile(cube.axes @ [0.0, 0.0, 9.81], (3, 1))
    >>> round(float(gfimu.joint_form(cube, level).p[0, 2]), 6)
    9.81
    """
    rows = _reading_matrix(array, readings)
    inverse, seen = _joint_inverse(array)
    if not seen[:6].all():
        mixed = [name for name, known in zip(MOTION_NAMES, seen[:6], strict=True) if not known]
        raise GeometryError(
            f"array {array.name!r} can't separate {', '.join(mixed)} from the products of the angular rate; "
            "use motion_from_readings with a given omega, or add sensing axes"
        )
    solution = _product_by_blocks(rows, inverse)  # (n, 12)
    covariance = inverse @ inverse.T
    hidden = ~seen
    solution[:, hidden] = np.nan
    covariance[hidden, :] = np.nan
    covariance[:, hidden] = np.nan
    return JointEstimate(solution[:, :3], solution[:, 3:6], solution[:, 6:], covariance)


def joint_covariance(array: AccelerometerArray) -> NDArray[np.float64]:
    """Covariance of `joint_form` for channels of unit variance, shape (12, 12); NaN for what it can't determine."""
    inverse, seen = _joint_inverse(array)
    covariance = inverse @ inverse.T
    covariance[~seen, :] = np.nan
    covariance[:, ~seen] = np.nan
    return covariance


def null_space(array: AccelerometerArray) -> NullSpace:
    """Compute the whitened left null space of J, and which products of ω it sees.

    Raises
    ------
    GeometryError
        If the array can't see all six motions.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.null_space(gfimu.AccelerometerArray.load("cube12")).rank
    6
    """
    require_all_motions(array)
    scale = np.array([array.length_unit] * 3 + [1.0] * 3)
    basis = null_rows((array.regression_matrix / scale).T)  # (c - 6, c)
    if len(basis) == 0:
        return NullSpace(basis, np.empty((0, 6)), 0)
    rotation, strengths, products = np.linalg.svd(basis @ array.centripetal_matrix)
    rank = int(np.sum(strengths > RANK_TOLERANCE * array.length_unit))
    sensitivity = np.zeros((len(basis), 6))
    sensitivity[:rank] = strengths[:rank, None] * products[:rank]
    return NullSpace(rotation.T @ basis, sensitivity, rank)


def _left_inverse(regression: NDArray[np.float64], length: float) -> NDArray[np.float64]:
    """Left inverse of J with its columns brought to one order of magnitude first, shape (6, c)."""
    scale = np.array([length] * 3 + [1.0] * 3)
    return np.linalg.pinv(regression / scale) / scale[:, None]


def _without_rounding(leakage: NDArray[np.float64], length: float) -> NDArray[np.float64]:
    size = np.abs(leakage) / np.array([1.0] * 3 + [length] * 3)[:, None]
    return np.where(size > RANK_TOLERANCE, leakage, 0.0)


def _joint_inverse(array: AccelerometerArray) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Least-squares inverse of [J Q], shape (12, c), and which of its twelve unknowns the readings determine."""
    length = array.length_unit
    scale = np.array([length] * 3 + [1.0] * 3 + [length] * 6)
    combined = np.hstack([array.regression_matrix, array.centripetal_matrix]) / scale  # (c, 12)
    inverse = np.linalg.pinv(combined, rcond=RANK_TOLERANCE)
    # An unknown is determined if its unit vector lies in the row space of [J Q].
    seen = np.abs(inverse @ combined - np.eye(12)).max(axis=1) < np.sqrt(RANK_TOLERANCE)
    return inverse / scale[:, None], seen


def _motion_of_holed_rows(
    array: AccelerometerArray, rows: NDArray[np.float64], rates: NDArray[np.float64] | None
) -> NDArray[np.float64]:
    """Solve rows with missing readings, one pattern of missing channels at a time; NaN where they don't suffice."""
    motion = np.full((len(rows), 6), np.nan)
    scale = np.array([array.length_unit] * 3 + [1.0] * 3)
    patterns, membership = np.unique(~np.isnan(rows), axis=0, return_inverse=True)
    for index, present in enumerate(patterns):
        regression = array.regression_matrix[present]
        if np.linalg.matrix_rank(regression / scale, tol=RANK_TOLERANCE) < 6:
            continue
        inverse = _left_inverse(regression, array.length_unit)
        leakage = _without_rounding(inverse @ array.centripetal_matrix[present], array.length_unit)
        members = membership.reshape(-1) == index
        if rates is not None:
            motion[members] = rows[members][:, present] @ inverse.T - omega_products(rates[members]) @ leakage.T
        else:
            clean = ~leakage.any(axis=1)
            motion[np.ix_(members, clean)] = rows[members][:, present] @ inverse[clean].T
    return motion


def _product_by_blocks(rows: NDArray[np.float64], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``rows @ matrix.T`` block by block, which runs at memory speed where one large product doesn't."""
    result = np.empty((len(rows), len(matrix)))
    transposed = np.ascontiguousarray(matrix.T)
    for start in range(0, len(rows), _BLOCK):
        np.matmul(rows[start : start + _BLOCK], transposed, out=result[start : start + _BLOCK])
    return result


def _reading_matrix(array: AccelerometerArray, readings: ArrayLike) -> NDArray[np.float64]:
    rows = np.atleast_2d(np.asarray(readings, dtype=float))
    if rows.ndim != 2 or rows.shape[1] != array.n_channels:
        raise InputError(
            f"readings of shape {np.shape(readings)} don't fit array {array.name!r}; "
            f"give one column for each of its {array.n_channels} channels"
        )
    return rows


def _rate_matrix(omega: ArrayLike, n: int) -> NDArray[np.float64]:
    rates = np.asarray(omega, dtype=float)
    if rates.shape not in {(3,), (1, 3), (n, 3)}:
        raise InputError(f"omega of shape {rates.shape} doesn't fit {n} samples; give shape ({n}, 3), rad/s")
    return np.broadcast_to(rates, (n, 3))


def _cube_of_alternate_corners(array: AccelerometerArray) -> tuple[float, NDArray[np.intp], NDArray[np.float64]]:
    """Half the edge, m; which axis of a chip lies along body x, y, z; and its sign."""
    remedy = f"array {array.name!r} isn't four tri-axial chips at alternate corners; use motion_from_readings"
    if [len(chip.axes) for chip in array.chips] != [3] * 4:
        raise GeometryError(remedy)
    half_edge = float(array.chip_positions[0, 0])
    axes = array.chips[0].axes  # rows: chip axis; columns: body axis
    columns = np.argmax(np.abs(axes), axis=0)  # chip axis along body x, y, z
    signs = np.sign(axes[columns, np.arange(3)])
    along_body = np.zeros((3, 3))
    along_body[columns, np.arange(3)] = signs
    if (
        half_edge <= 0
        or not np.allclose(array.chip_positions, half_edge * ALTERNATE_CORNERS, rtol=0, atol=_EXACT)
        or not all(np.allclose(chip.axes, along_body, rtol=0, atol=_EXACT) for chip in array.chips)
    ):
        raise GeometryError(remedy)
    return half_edge, columns, signs
