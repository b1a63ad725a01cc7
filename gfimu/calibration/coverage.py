"""Pose coverage: are there enough poses, different enough, and which are to be added.

Directions are those of the specific force in the triad's own axes: "+x" is the pose with sensing axis x up.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError

__all__ = [
    "FACES",
    "check_faces",
    "check_magnitude_coverage",
    "distinct_poses",
    "fit_sphere",
    "pose_directions",
    "pose_label",
]

Floats = NDArray[np.float64]

FACES = np.concatenate([np.eye(3), -np.eye(3)])
"""Directions of the six faces: +x, +y, +z, −x, −y, −z up."""

_CANDIDATES = np.array(
    sorted((v for v in itertools.product((-1, 0, 1), repeat=3) if any(v)), key=lambda v: np.abs(v).sum()), dtype=float
)
_SAME_POSE_DEG = 8.0
_FACE_DEG = 20.0
_MINIMUM_POSES = 9
_WEAK = 12.0


def pose_label(direction: NDArray[np.float64]) -> str:
    """Name the nearest of the 26 faces, edges and corners: ``+x up``, ``+x−y up (edge)``, ``… (corner)``."""
    unit = _CANDIDATES / np.linalg.norm(_CANDIDATES, axis=1, keepdims=True)
    signs = _CANDIDATES[int(np.argmax(unit @ np.asarray(direction, dtype=float)))]
    name = "".join(f"{'+' if sign > 0 else '−'}{axis}" for sign, axis in zip(signs, "xyz", strict=True) if sign)
    return f"{name} up" + {1: "", 2: " (edge)", 3: " (corner)"}[int(np.abs(signs).sum())]


def fit_sphere(means: Floats) -> tuple[Floats, float]:
    """Fit a sphere to readings: its centre is a coarse bias, its radius a coarse scale times g.

    Parameters
    ----------
    means : ndarray, shape (p, 3)
        Readings of p poses.

    Returns
    -------
    centre : ndarray, shape (3,)
    radius : float

    Raises
    ------
    InputError
        If the poses lie in one plane or are nearly alike.
    """
    origin = means.mean(axis=0)
    points = means - origin
    size = float(np.linalg.norm(points, axis=1).max()) if len(points) else 0.0
    advice = "turn the sensor so that each axis points up once and down once"
    if len(means) < 4 or size == 0.0:
        raise InputError(f"{len(means)} poses are too few to separate bias from scale; {advice}")
    points = points / size
    spread = np.linalg.svd(points, compute_uv=False)
    if spread[2] < 0.05 * np.sqrt(len(points)):
        raise InputError(f"the {len(means)} poses are too similar: their readings lie nearly in one plane; {advice}")
    design = np.column_stack([2.0 * points, np.ones(len(points))])
    solution = np.linalg.lstsq(design, np.sum(points**2, axis=1), rcond=None)[0]
    radius = np.sqrt(solution[3] + solution[:3] @ solution[:3])
    return origin + size * solution[:3], float(size * radius)


def pose_directions(means: Floats) -> Floats:
    """Return the unit vectors of the specific force in sensor axes, from the sphere through the readings, (p, 3)."""
    centre, _ = fit_sphere(means)
    arrows = means - centre
    return arrows / np.linalg.norm(arrows, axis=1, keepdims=True)


def distinct_poses(directions: Floats) -> list[list[int]]:
    """Group poses that are within 8° of the first of their group; one list of pose numbers per distinct pose."""
    same = (directions @ directions.T > np.cos(np.deg2rad(_SAME_POSE_DEG))).tolist()
    groups: list[list[int]] = []
    for index, like in enumerate(same):
        for group in groups:
            if like[group[0]]:
                group.append(index)
                break
        else:
            groups.append([index])
    return groups


def check_magnitude_coverage(directions: Floats) -> None:
    """Refuse poses that can't determine nine parameters from magnitudes alone.

    Raises
    ------
    InputError
        With the number of distinct poses and the poses to add.
    """
    groups = distinct_poses(directions)
    distinct = directions[[group[0] for group in groups]]
    added = _poses_to_add(distinct)
    if not added:
        return
    names = ", ".join(pose_label(direction) for direction in added)
    repeated = len(directions) - len(distinct)
    note = f" ({repeated} of them repeat another pose)" if repeated else ""
    if len(distinct) < _MINIMUM_POSES:
        raise InputError(
            f"{len(directions)} poses{note}: {len(distinct)} distinct ones are too few for 9 parameters; "
            f"at least {_MINIMUM_POSES} are needed, 18 are recommended; add: {names}"
        )
    raise InputError(f"the {len(distinct)} distinct poses are too similar for 9 parameters; add: {names}")


def check_faces(directions: Floats) -> NDArray[np.intp]:
    """Assign each pose to one of the six faces; refuse a pose that is none and a face that is missing.

    Returns
    -------
    ndarray of int, shape (p,)
        Row of `FACES` for each pose; −1 for a pose more than 20° from every face.

    Raises
    ------
    InputError
        If a face is missing; the message names it.
    """
    cosine = directions @ FACES.T
    face = np.argmax(cosine, axis=1)
    face[np.max(cosine, axis=1) < np.cos(np.deg2rad(_FACE_DEG))] = -1
    missing = [pose_label(FACES[k]) for k in range(6) if k not in face]
    if missing:
        raise InputError(f"{len(directions)} poses, but not all six faces; add: {', '.join(missing)}")
    return face


def _information(directions: Floats) -> Floats:
    """Return the normal matrix of the nine-parameter magnitude problem for a perfect triad, per unit variance."""
    x, y, z = directions.T
    quadratic = np.column_stack([x * x, y * y, z * z, x * y, x * z, y * z])
    design = np.column_stack([quadratic, directions])
    return np.asarray(design.T @ design, dtype=np.float64)


def _worst(normal: Floats) -> float:
    """Return the largest standard deviation of a parameter per unit standard deviation of a pose."""
    values, vectors = np.linalg.eigh(normal)
    if values[0] < 1e-9 * values[-1]:
        return float("inf")
    return float(np.sqrt((vectors**2 / values).sum(axis=1).max()))


def _poses_to_add(distinct: Floats) -> Sequence[Floats]:
    """Choose the poses to add, best first, until nine parameters are well determined; empty if they are already."""
    normal = _information(distinct)
    candidates = _CANDIDATES / np.linalg.norm(_CANDIDATES, axis=1, keepdims=True)
    candidates = candidates[(candidates @ distinct.T).max(axis=1) < np.cos(np.deg2rad(_SAME_POSE_DEG))]
    added: list[Floats] = []
    while len(candidates) and (len(distinct) + len(added) < _MINIMUM_POSES or _worst(normal) > _WEAK):
        gains = [
            np.linalg.slogdet(normal + _information(candidate[None]) + 1e-6 * np.eye(9))[1] for candidate in candidates
        ]
        best = int(np.argmax(gains))
        added.append(candidates[best])
        normal = normal + _information(candidates[best][None])
        candidates = np.delete(candidates, best, axis=0)
    return added
