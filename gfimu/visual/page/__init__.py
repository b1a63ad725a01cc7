"""Plots on an HTML page that zoom: their data, packed, and the scripts that draw them without any network."""

from gfimu.visual.page.content import page_plots
from gfimu.visual.page.limits import PlotLimits
from gfimu.visual.page.packed import Packed, enveloped

__all__ = ["Packed", "PlotLimits", "enveloped", "page_plots"]
