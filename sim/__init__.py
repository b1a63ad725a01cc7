"""The world: a turntable with a cube, its sensors, and everything that can go wrong in it.

In: a scenario, ``models/``.
Out: recordings with their truth (`simulation`); a `twin`, what a diagnosis believes of the world, predicted by
`forward` in closed form.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from sim.chips.adxl345 import quantise as quantise
    from sim.chips.data_sheet import DataSheet as DataSheet
    from sim.motions.motion import BodyState as BodyState
    from sim.motions.motion import SpinState as SpinState
    from sim.motions.motion import SplineSpin as SplineSpin
    from sim.motions.pose_sequence import POSE_SETS as POSE_SETS
    from sim.motions.pose_sequence import PoseSequence as PoseSequence
    from sim.rigs.mjcf_array import array_from_mjcf as array_from_mjcf
    from sim.rigs.turntable import prescribed_readings as prescribed_readings
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
