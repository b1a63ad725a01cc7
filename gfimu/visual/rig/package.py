"""What holds the chips of an array: its kind and size, guessed from the places of the chips alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.base.short_repr import short_repr

__all__ = ["Package", "chip_half_size", "drawing_size", "is_cube", "package_of", "stand_height"]

CUBE_HALF_EDGE = 0.05
"""Half the edge of the aluminium cube of ``models/mjcf``, m."""

_CUBE_HEIGHT = 0.06  # m
_FLAT = 0.2  # an extent below this share of the largest counts as thickness
_ROUND = 0.05  # spread of the distances from the centre, as a share, of chips on a round plate
_LEAST_ON_ROUND = 5
_CHIP = 0.002  # half size of the package of a chip alone, m
_LEAST_SIZE = 0.02  # half size that a drawing has at least, m: arrows and names need room
_SAME_PLACE = 1e-6


@dataclass(frozen=True)
class Package:
    """The body that holds the chips.

    Parameters
    ----------
    kind : {"cube", "box", "disc", "plate", "rod", "chip"}
        The aluminium cube; a box around chips in three dimensions; a round or square plate; a rod; a chip alone.
    centre : ndarray, shape (3,)
        Centre in the body frame, m.
    half : ndarray, shape (3,)
        Half sizes along its own axes, m; of a disc its radius, its radius, half its thickness.
    rotation : Rotation
        Its own axes to the body's.
    """

    kind: str
    centre: NDArray[np.float64]
    half: NDArray[np.float64]
    rotation: Rotation

    __repr__ = short_repr


def is_cube(array: AccelerometerArray) -> bool:
    """Whether the chips are spread over the faces of the aluminium cube, edge 100 mm."""
    places = array.chip_positions
    on_faces = np.abs(np.abs(places).max(axis=1) - CUBE_HALF_EDGE) < _SAME_PLACE
    spread = places.max(axis=0) - places.min(axis=0)
    return bool(len(places) >= 4 and on_faces.all() and (spread > 1.9 * CUBE_HALF_EDGE).all())


def chip_half_size(array: AccelerometerArray) -> float:
    """Half size of a chip's symbol, m: small beside the array and beside the distance to the next chip."""
    places = _distinct(array.chip_positions)
    reach = float(np.linalg.norm(places - places.mean(axis=0), axis=1).max())
    if array.turning_axis is not None and len(places) == 1:
        reach = float(np.linalg.norm(places[0] - _foot(array)))
    if len(places) < 2:
        return _CHIP if reach == 0.0 else min(0.06 * reach, 2.0 * _CHIP)
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    nearest = float(apart[np.triu_indices(len(places), 1)].min())
    return float(min(0.06 * reach, 0.3 * nearest))


def drawing_size(array: AccelerometerArray) -> float:
    """Size that arrows and distances of a drawing refer to, m: the largest half size, at least 20 mm."""
    return max(float(package_of(array).half.max()), _LEAST_SIZE)


def stand_height(array: AccelerometerArray | None) -> float:
    """Height of the body's origin above the table where nothing else is known, m; 60 mm for the cube."""
    if array is None or is_cube(array):
        return _CUBE_HEIGHT
    package = package_of(array)
    below = float(np.abs(package.rotation.as_matrix()[2]) @ package.half) - float(package.centre[2])
    return below + 0.5 * drawing_size(array)


def package_of(array: AccelerometerArray) -> Package:
    """Return the body that most simply holds the chips; a rod reaches from a known axis to one or two chips."""
    if is_cube(array):
        return Package("cube", np.zeros(3), np.full(3, CUBE_HALF_EDGE), Rotation.identity())
    places = _distinct(array.chip_positions)
    chip = chip_half_size(array)
    if array.turning_axis is not None and len(places) <= 2:
        places = _distinct(np.vstack([places, _foot(array)]))
    if len(places) == 1:
        return Package("chip", places[0], chip * np.array([2.5, 2.5, 0.4]), Rotation.identity())
    frame = _frame(places)  # columns: largest extent first
    along = places @ frame
    low, high = along.min(axis=0), along.max(axis=0)
    extent, centre = high - low, frame @ ((low + high) / 2)
    rotation = Rotation.from_matrix(frame)
    if extent[1] < _FLAT * extent[0]:
        thin = np.maximum(extent[1:] / 2, 0.8 * chip)
        return Package("rod", centre, np.array([extent[0] / 2 + 1.5 * chip, *thin]), rotation)
    thickness = max(float(extent[2]) / 2, 0.3 * chip)
    if extent[2] < _FLAT * extent[0]:
        radius = np.linalg.norm(along[:, :2] - along[:, :2].mean(axis=0), axis=1)
        if len(_distinct(along[:, :2])) >= _LEAST_ON_ROUND and np.ptp(radius) < _ROUND * radius.max():
            middle = frame @ np.array([*along[:, :2].mean(axis=0), (low[2] + high[2]) / 2])
            wide = float(radius.max()) + 2.0 * chip
            return Package("disc", middle, np.array([wide, wide, thickness]), rotation)
        return Package("plate", centre, np.array([*(extent[:2] / 2 + 2.0 * chip), thickness]), rotation)
    return Package("box", centre, extent / 2, rotation)


def _distinct(places: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.unique(np.round(places / _SAME_PLACE), axis=0) * _SAME_PLACE)


def _foot(array: AccelerometerArray) -> NDArray[np.float64]:
    """Return the point of the known axis that is nearest to the chips, shape (3,), m."""
    assert array.turning_axis is not None
    axis = array.turning_axis
    lever = array.chip_positions.mean(axis=0) - axis.point
    return np.asarray(axis.point + (lever @ axis.direction) * axis.direction)


def _frame(places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the axes of the body that holds some places, as columns, right-handed, the thinnest last.

    They are the axes of the body frame unless the chips lie in a plane or on a line that is skew to it.
    """
    centred = places - places.mean(axis=0)
    extents = np.ptp(places, axis=0)
    order = np.argsort(-extents, kind="stable")
    _, strength, rows = np.linalg.svd(centred, full_matrices=True)
    strength = np.pad(strength, (0, 3 - len(strength)))
    flat_by_axes = extents[order[2]] < _FLAT * extents[order[0]]
    line_by_axes = extents[order[1]] < _FLAT * extents[order[0]]
    flat, line = strength[2] < 0.5 * _FLAT * strength[0], strength[1] < 0.5 * _FLAT * strength[0]
    skew = (line and not line_by_axes) or (flat and not flat_by_axes)
    frame = rows.T if skew else np.eye(3)[:, order]
    return np.asarray(frame if np.linalg.det(frame) > 0 else frame * np.array([1.0, 1.0, -1.0]))
