"""Pictures: runs and comparisons in rerun, plots of HTML pages.

In: arrays of numbers; a rig as boxes, cylinders and meshes.
Out: ``.rrd`` recordings and live streams, and the interactive plots and the style of HTML pages (`page`).
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.visual.colours import PAGE
    from gfimu.visual.comparison import write_comparison
    from gfimu.visual.motion import ExpectedDrift, KnownMotion
    from gfimu.visual.page import STILL_POLICY, page_plots, page_style
    from gfimu.visual.page.packed import Packed
    from gfimu.visual.plots import Line, Plot
    from gfimu.visual.run import write_run
    from gfimu.visual.run_plots import free_rate_plots
    from gfimu.visual.scene import Box, Cylinder, Mesh, Names, Pointers
else:
    __getattr__, __dir__, __all__ = declared_names(
        __name__, needs=("a rerun recording", "rerun"), without=("PAGE", "ExpectedDrift", "KnownMotion")
    )
