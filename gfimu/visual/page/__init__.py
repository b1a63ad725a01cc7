"""HTML pages: the head and style that all share, and plots that zoom, with their data, packed, and their scripts."""

from gfimu.visual.page.content import page_plots
from gfimu.visual.page.limits import PlotLimits
from gfimu.visual.page.packed import Packed, enveloped
from gfimu.visual.page.style import STILL_POLICY, page_basics, page_style
from gfimu.visual.page.template import page_text

__all__ = ["STILL_POLICY", "Packed", "PlotLimits", "enveloped", "page_basics", "page_plots", "page_style", "page_text"]
