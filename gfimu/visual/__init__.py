"""Pictures: runs and comparisons in rerun, plots of HTML pages.

In: arrays of numbers; a rig as boxes, cylinders and meshes.
Out: ``.rrd`` recordings and live streams, and the interactive plots and the style of HTML pages (`page`).
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.visual.comparison import write_comparison as write_comparison
    from gfimu.visual.motion import ExpectedDrift as ExpectedDrift
    from gfimu.visual.motion import KnownMotion as KnownMotion
    from gfimu.visual.plots import Line as Line
    from gfimu.visual.plots import Plot as Plot
    from gfimu.visual.run import write_run as write_run
    from gfimu.visual.scene import Body as Body
    from gfimu.visual.scene import Box as Box
    from gfimu.visual.scene import Cylinder as Cylinder
    from gfimu.visual.scene import Mesh as Mesh
    from gfimu.visual.scene import Names as Names
    from gfimu.visual.scene import Path as Path
    from gfimu.visual.scene import Pointers as Pointers
    from gfimu.visual.scene import Scene as Scene
    from gfimu.visual.scene import SensingArrows as SensingArrows
else:
    __getattr__, __dir__, __all__ = declared_names(
        __name__, needs=("a rerun recording", "rerun"), without=("ExpectedDrift", "KnownMotion")
    )
