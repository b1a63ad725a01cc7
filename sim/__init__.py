"""The world: a turntable with a cube, its sensors, and everything that can go wrong in it.

In: a scenario, ``models/``.
Out: recordings with their truth (`simulation`); a `twin`, what a diagnosis believes of the world, predicted by
`forward` in closed form.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from sim.chips.adxl345 import Sensor, SensorErrors, SensorSettings, quantise
    from sim.chips.conversions import conversion_groups
    from sim.chips.data_sheet import DataSheet
    from sim.motions.carried import Carriage
    from sim.motions.motion import BodyState, SpinState, SplineSpin
    from sim.motions.pose_sequence import POSE_SETS, PoseSequence
    from sim.motions.profiles import Chirp, Hold, Ramp, Sine, Tumble, paper_run, speed_sweep, spin_profile
    from sim.rigs.dc_motor import DcMotor
    from sim.rigs.driven import Drive, drive, drive_all
    from sim.rigs.mjcf_array import array_from_mjcf
    from sim.rigs.rig_model import channel_places, free_spec, turntable_model
    from sim.rigs.turntable import prescribed_readings
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
