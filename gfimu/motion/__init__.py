"""Motion of the body: what a recording says of rate, attitude, velocity and position.

In: a recording, with a calibration if there is one.
Out: `Estimate` with its covariances, attitude, navigation, an impact and its criteria (`impact`).
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.motion.attitude import ATTITUDE_METHODS, from_rotation, table_angle, to_rotation
    from gfimu.motion.axis_estimation import estimate_about_axis
    from gfimu.motion.body_drive import BodyDrive
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
