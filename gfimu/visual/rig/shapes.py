"""Shapes of an array, of the axis about which it turns, of gravity and of a table, all sized from the array."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.array.turning_axis import TurningAxis
from gfimu.base.results.colours import AXES, ESTIMATE, GRAVITY, METAL, SPIN_AXIS, TABLE, chip_colour
from gfimu.visual.rig.package import chip_half_size, drawing_size, is_cube, package_of
from gfimu.visual.scene import Box, Cylinder, Names, Pointers, Shape

__all__ = [
    "array_shapes",
    "axes_shapes",
    "axis_shapes",
    "channel_shapes",
    "chip_names",
    "ghost_shapes",
    "gravity_shapes",
    "post_shapes",
    "table_axis_shapes",
    "table_shapes",
]

_TABLE_RADIUS = 0.15
_TABLE_THICKNESS = 0.012
_AXIS_LENGTH = 0.36  # of the arrow along a sensing axis, in sizes of the drawing
_MOST_CHANNEL_NAMES = 6  # channels named in the scene; of more, the chips are, and a channel's name shows on a click


def array_shapes(array: AccelerometerArray) -> Sequence[Shape]:
    """Return package and chips of an array in its body frame, each chip in its hue.

    A chip of three axes lies flat across its third, others as the package does.
    """
    package, chip = package_of(array), chip_half_size(array)
    turn = package.rotation.as_quat(scalar_first=True).tolist()
    half, centre = package.half, package.centre.tolist()
    body: Shape
    match package.kind:
        case "disc":
            body = Cylinder(float(half[0]), 2.0 * float(half[2]), centre, turn, METAL)
        case "box":
            body = Box(half.tolist(), centre, turn, METAL, wireframe=True)
        case "cube":
            body = Box((0.94 * half).tolist(), centre, turn, METAL)
        case _:
            body = Box(half.tolist(), centre, turn, METAL)
    symbols = [
        Box(
            (1.6 * chip, 1.6 * chip, chip),
            one.position.tolist(),
            _z_along(one.axes[2]) if len(one.axes) == 3 else turn,
            chip_colour(index),
            label=one.name,
        )
        for index, one in enumerate(array.chips)
    ]
    return [body, *symbols]


def chip_names(array: AccelerometerArray) -> Names:
    """Return the chips' names, a little outside of the chips."""
    centre, chip = package_of(array).centre, chip_half_size(array)
    away = array.chip_positions - centre
    distance = np.linalg.norm(away, axis=1, keepdims=True)
    outwards = np.where(distance > 1e-9, away / np.maximum(distance, 1e-9), [0.0, 0.0, 1.0])
    return Names(
        array.chip_positions + 3.0 * chip * outwards,
        [one.name for one in array.chips],
        [chip_colour(index) for index in range(len(array.chips))],
    )


def channel_shapes(array: AccelerometerArray) -> Pointers:
    """Return an arrow along every sensing axis, in its chip's hue, darker for the first axis and lighter for the third.

    The arrows name their channels; few enough do so at once, others when they are pointed at.
    """
    size, places = drawing_size(array), array.chip_positions
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    beside = apart[apart > 0.25 * size]  # chips back to back on one board count as one
    length = min(_AXIS_LENGTH * size, 0.6 * float(beside.min()) if beside.size else np.inf)
    axis_on_chip = [axis for chip in array.chips for axis in range(len(chip.axes))]
    colours = [chip_colour(int(chip), axis) for chip, axis in zip(array.chip_of_channel, axis_on_chip, strict=True)]
    return Pointers(
        array.positions,
        length * array.axes,
        colours,
        array.channels,
        0.012 * size,
        show_labels=len(array.chips) < array.n_channels <= _MOST_CHANNEL_NAMES,
    )


def axes_shapes(array: AccelerometerArray) -> Pointers:
    """Return the body's axes x, y, z as a triad beside its lowest corner: there it hides no chip."""
    package, size = package_of(array), drawing_size(array)
    corners = package.rotation.apply(package.half * np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T)
    corner = package.centre + corners.min(axis=0) - 0.25 * size * np.array([1.0, 1.0, 0.0])
    return Pointers(np.tile(corner, (3, 1)), 0.4 * size * np.eye(3), AXES, ("x", "y", "z"), 0.014 * size)


def axis_shapes(axis: TurningAxis, array: AccelerometerArray) -> Sequence[Shape]:
    """Return an axis through the body, in the body frame: a long arrow with its name, and a hub around it."""
    size, centre = drawing_size(array), package_of(array).centre
    foot = axis.point + ((centre - axis.point) @ axis.direction) * axis.direction
    name = "axis of rotation" if axis.hub == "fixed" else "axis of rotation, hub moves"
    hub: list[Shape] = [Cylinder(0.08 * size, 0.3 * size, foot.tolist(), _z_along(axis.direction), TABLE)]
    arm = centre - foot
    length = float(np.linalg.norm(arm))
    if length > 2.0 * float(package_of(array).half.max()):  # the body hangs on an arm, of which it is no part
        hub.append(Cylinder(0.05 * size, length, (foot + 0.5 * arm).tolist(), _z_along(arm / length), METAL))
    return [*hub, *_long_arrow(foot, axis.direction, size, name)]


def table_axis_shapes(array: AccelerometerArray, centre: NDArray[np.float64]) -> Sequence[Shape]:
    """Return the axis of a table in the world, for an array whose body origin stands at ``centre``, shape (3,), m."""
    up, height = np.array([0.0, 0.0, 1.0]), float(centre[2] + package_of(array).centre[2])
    return _long_arrow(height * up, up, drawing_size(array), "axis of rotation")


def _long_arrow(foot: NDArray[np.float64], direction: NDArray[np.float64], size: float, name: str) -> Sequence[Shape]:
    start, along = foot - 0.9 * size * direction, 2.4 * size * direction
    return [
        Pointers(start[None], along[None], [SPIN_AXIS], [], 0.01 * size),
        Names((start + 1.05 * along)[None], [name], [SPIN_AXIS]),
    ]


def gravity_shapes(array: AccelerometerArray, place: NDArray[np.float64]) -> Sequence[Shape]:
    """Return the arrow of gravity in world axes, beside a body that stands at a place, shape (3,), m."""
    size = drawing_size(array)
    start = place + size * np.array([-1.55, -1.35, 0.9])
    return [
        Pointers(start[None], np.array([[0.0, 0.0, -0.9 * size]]), [GRAVITY], [], 0.02 * size),
        Names((start + np.array([0.0, 0.0, 0.1 * size]))[None], ["gravity"], [GRAVITY]),
    ]


def table_shapes(array: AccelerometerArray, centre: NDArray[np.float64]) -> Mapping[str, Sequence[Shape]]:
    """Return a plain turntable under an array whose body origin stands at ``centre``, shape (3,), in the table frame.

    Returns
    -------
    mapping
        ``base`` and ``table``: a disc with a mark on its rim, top face at z = 0, and a post up to the array.
    """
    reach = float(np.linalg.norm((array.chip_positions + centre)[:, :2], axis=1).max())
    radius = _TABLE_RADIUS if is_cube(array) else max(1.25 * reach, 1.2 * drawing_size(array))
    scale, thick = radius / _TABLE_RADIUS, _TABLE_THICKNESS * radius / _TABLE_RADIUS
    mark = Box((0.02 * scale, 0.004 * scale, 0.002 * scale), (radius - 0.024 * scale, 0.0, 0.001 * scale), colour=METAL)
    return {
        "base": [
            Cylinder(0.07 * scale, 0.05 * scale, (0.0, 0.0, -thick - 0.025 * scale), colour=(52, 58, 68)),
            Cylinder(0.11 * scale, 0.012 * scale, (0.0, 0.0, -thick - 0.056 * scale), colour=(44, 50, 58)),
        ],
        "table": [Cylinder(radius, thick, (0.0, 0.0, -thick / 2)), mark, *post_shapes(array, centre)],
    }


def post_shapes(array: AccelerometerArray, centre: NDArray[np.float64]) -> Sequence[Shape]:
    """Return the post between a table and an array that is not the cube, in the table frame."""
    package = package_of(array)
    low = package.centre[2] + centre[2] - float(np.abs(package.rotation.as_matrix()[2]) @ package.half)
    if is_cube(array) or low <= 0.0:
        return []
    place = (package.centre + centre)[:2].tolist()
    return [Cylinder(0.12 * drawing_size(array), low, (*place, low / 2), colour=TABLE)]


def ghost_shapes(array: AccelerometerArray) -> Sequence[Shape]:
    """Return the shapes of the estimate's ghost: an outline and a pointer along x.

    Both are in the body frame.
    """
    package, size = package_of(array), drawing_size(array)
    half = np.maximum(1.12 * package.half, 0.08 * size)
    turn = package.rotation.as_quat(scalar_first=True).tolist()
    outline = Box(half.tolist(), package.centre.tolist(), turn, ESTIMATE, wireframe=True)
    reach = float(np.abs(package.rotation.as_matrix()[0]) @ half)
    start = package.centre + np.array([reach, 0.0, 0.0])
    return [outline, Pointers(start[None], np.array([[0.6 * size, 0.0, 0.0]]), [ESTIMATE], [], 0.03 * size)]


def _z_along(direction: NDArray[np.float64]) -> Sequence[float]:
    """Return a quaternion (w, x, y, z) that takes z to a direction."""
    helper = np.eye(3)[int(np.argmin(np.abs(direction)))]
    first = np.cross(helper, direction) / np.linalg.norm(np.cross(helper, direction))
    matrix = np.column_stack([first, np.cross(direction, first), direction])
    return [float(part) for part in Rotation.from_matrix(matrix).as_quat(scalar_first=True)]
