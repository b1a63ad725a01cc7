"""What an array is drawn as: its package, chips with names and axes, the axis of rotation, gravity, a table below."""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.visual.rig.package import Package, drawing_size, is_cube, package_of, stand_height
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
else:
    __getattr__, __dir__, __all__ = declared_names(
        __name__,
        needs=("a rerun recording", "rerun"),
        without=("Package", "drawing_size", "is_cube", "package_of", "stand_height"),
    )
