"""What an array is drawn as: its package, chips with names and axes, the axis of rotation, gravity, a table below."""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.visual.rig.package import Package as Package
    from gfimu.visual.rig.package import drawing_size as drawing_size
    from gfimu.visual.rig.package import is_cube as is_cube
    from gfimu.visual.rig.package import package_of as package_of
    from gfimu.visual.rig.package import stand_height as stand_height
    from gfimu.visual.rig.shapes import array_shapes as array_shapes
    from gfimu.visual.rig.shapes import axes_shapes as axes_shapes
    from gfimu.visual.rig.shapes import axis_shapes as axis_shapes
    from gfimu.visual.rig.shapes import channel_shapes as channel_shapes
    from gfimu.visual.rig.shapes import chip_names as chip_names
    from gfimu.visual.rig.shapes import ghost_shapes as ghost_shapes
    from gfimu.visual.rig.shapes import gravity_shapes as gravity_shapes
    from gfimu.visual.rig.shapes import post_shapes as post_shapes
    from gfimu.visual.rig.shapes import table_axis_shapes as table_axis_shapes
    from gfimu.visual.rig.shapes import table_shapes as table_shapes
else:
    __getattr__, __dir__, __all__ = declared_names(
        __name__,
        needs=("a rerun recording", "rerun"),
        without=("Package", "drawing_size", "is_cube", "package_of", "stand_height"),
    )
