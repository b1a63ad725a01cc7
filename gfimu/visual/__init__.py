"""Pictures in rerun: a run with its estimate, and a measurement beside its predictions.

Knows arrays of numbers only: whoever has a model of the rig hands its geometry over as boxes, cylinders and meshes.
"""

from typing import TYPE_CHECKING

from gfimu.lazy_names import names_on_first_use

if TYPE_CHECKING:
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

if not TYPE_CHECKING:  # colours and words are used where rerun is not installed
    __getattr__ = names_on_first_use(
        __name__,
        {
            "write_comparison": "comparison",
            "ExpectedDrift": "motion",
            "KnownMotion": "motion",
            "Line": "plots",
            "Plot": "plots",
            "write_run": "run",
            "Body": "scene",
            "Box": "scene",
            "Cylinder": "scene",
            "Mesh": "scene",
            "Names": "scene",
            "Path": "scene",
            "Pointers": "scene",
            "Scene": "scene",
            "SensingArrows": "scene",
        },
        needs=("a rerun recording", "rerun"),
        without=("ExpectedDrift", "KnownMotion"),
    )
