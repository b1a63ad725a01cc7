"""Which motions an array can't see, in words."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import GeometryError
from gfimu.base.files.model_files import list_models

__all__ = ["MOTION_NAMES", "RANK_TOLERANCE", "null_rows", "require_all_motions", "seeing_arrays", "unseen_motions"]

MOTION_NAMES = ("alpha_x", "alpha_y", "alpha_z", "p_x", "p_y", "p_z")
"""Order of the columns of J and of the rows of its left inverse."""

RANK_TOLERANCE = 1e-9
"""Relative size of a singular value that counts as zero, with lengths in the array's length unit."""


def null_rows(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Orthonormal rows that a matrix maps to zero, shape (d, columns), by its singular values (`RANK_TOLERANCE`)."""
    _, strengths, rows = np.linalg.svd(matrix)
    return rows[int(np.sum(strengths > RANK_TOLERANCE * strengths.max(initial=0.0))) :]


def unseen_motions(array: AccelerometerArray) -> tuple[str, ...]:
    """Motions that leave every reading unchanged, in words; empty if J has rank 6.

    Each is a field α × r + p: a rotation about an axis through a point, a translation, or a screw.
    """
    scale = np.array([array.length_unit] * 3 + [1.0] * 3)
    columns = array.regression_matrix / scale  # (c, 6), all columns of order one
    free = null_rows(columns)  # (d, 6)
    if len(free) == 0:
        return ()
    import scipy.linalg  # for the arrays alone that need a known axis

    # The basis with ones at d chosen components has the most zeros and reads best.
    *_, pivots = scipy.linalg.qr(free, pivoting=True, mode="economic")
    basis = np.linalg.solve(free[:, pivots[: len(free)]], free)  # (d, 6)
    return tuple(_motion_in_words(motion / scale) for motion in basis)


def sees_all_motions(array: AccelerometerArray) -> bool:
    """Whether J has rank 6."""
    scale = np.array([array.length_unit] * 3 + [1.0] * 3)
    return len(null_rows(array.regression_matrix / scale)) == 0


def seeing_arrays() -> list[str]:
    """Return the names of the shipped arrays that see all six motions; the others need a known axis."""
    return [name for name in list_models("arrays") if sees_all_motions(AccelerometerArray.load(name))]


def require_all_motions(array: AccelerometerArray, *, or_axis: bool = True) -> None:
    """Check that the array sees all six components of α and p.

    Parameters
    ----------
    array : AccelerometerArray
        The array.
    or_axis : bool
        Whether a known axis (``--axis``) is a remedy where the check is made.

    Raises
    ------
    GeometryError
        If J has rank < 6; the message names the motions that the array can't see.
    """
    unseen = unseen_motions(array)
    if unseen:
        axis = ", or give the axis about which alone it turns (--axis)" if or_axis else ""
        raise GeometryError(
            f"array {array.name!r} (rank {6 - len(unseen)} of 6, {array.n_channels} channels) can't see "
            f"{'; '.join(unseen)}; add sensing axes that do{axis}"
        )


def _motion_in_words(motion: NDArray[np.float64]) -> str:
    """Describe the field α × r + p of one unseen motion, shape (6,), SI."""
    alpha, p = motion[:3], motion[3:]
    turn = float(np.linalg.norm(alpha))
    if turn < RANK_TOLERANCE * np.linalg.norm(motion):
        return f"acceleration along {_direction(p)}"
    axis = alpha / turn
    point = np.cross(alpha, p) / turn**2
    words = f"angular acceleration about {_direction(axis)}"
    if np.linalg.norm(point) > 1e-9:
        words += f" through the point ({', '.join(f'{value:.4g}' for value in np.round(point, 12) + 0.0)}) m"
    pitch = float(axis @ p) / turn
    if abs(pitch) > 1e-9:
        words += f" together with an acceleration of {pitch:.4g} m per rad along it"
    return words


def _direction(vector: NDArray[np.float64]) -> str:
    """Name a direction: a body axis where it is one, else its components."""
    unit = vector / np.linalg.norm(vector)
    unit *= np.sign(unit[np.argmax(np.abs(unit))])
    if np.max(np.abs(unit)) > 1 - RANK_TOLERANCE:
        return "xyz"[int(np.argmax(np.abs(unit)))]
    unit[np.abs(unit) < RANK_TOLERANCE] = 0.0
    return f"({', '.join(f'{value:.4g}' for value in unit)})"
