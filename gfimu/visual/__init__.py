"""Pictures in rerun: a run with its estimate, and a measurement beside its predictions.

Knows arrays of numbers only: whoever has a model of the rig hands its geometry over as boxes, cylinders and meshes.
"""

from gfimu.visual.comparison import write_comparison
from gfimu.visual.motion import ExpectedDrift, KnownMotion
from gfimu.visual.plots import Line, Plot
from gfimu.visual.run import write_run
from gfimu.visual.scene import Body, Box, Cylinder, Mesh, Names, Path, Pointers, Scene, SensingArrows

__all__ = [
    "Body",
    "Box",
    "Cylinder",
    "ExpectedDrift",
    "KnownMotion",
    "Line",
    "Mesh",
    "Names",
    "Path",
    "Plot",
    "Pointers",
    "Scene",
    "SensingArrows",
    "write_comparison",
    "write_run",
]
