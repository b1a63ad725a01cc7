"""What an array is drawn as: its package, chips with names and axes, the axis of rotation, gravity, a table below."""

from typing import TYPE_CHECKING

from gfimu.lazy_names import names_on_first_use
from gfimu.visual.rig.package import Package, drawing_size, is_cube, package_of, stand_height

if TYPE_CHECKING:
    from gfimu.visual.rig.shapes import (
        array_shapes,
        axes_shapes,
        axis_shapes,
        channel_shapes,
        chip_names,
        ghost_shapes,
        gravity_shapes,
        post_shapes,
        table_axis_shapes,
        table_shapes,
    )

__all__ = [
    "Package",
    "array_shapes",
    "axes_shapes",
    "axis_shapes",
    "channel_shapes",
    "chip_names",
    "drawing_size",
    "ghost_shapes",
    "gravity_shapes",
    "is_cube",
    "package_of",
    "post_shapes",
    "stand_height",
    "table_axis_shapes",
    "table_shapes",
]

if not TYPE_CHECKING:  # a package is measured where rerun is not installed
    __getattr__ = names_on_first_use(
        __name__,
        dict.fromkeys(
            (
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
            ),
            "shapes",
        ),
        needs=("a rerun recording", "rerun"),
    )
