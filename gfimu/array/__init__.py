"""Arrays: where the chips sit and what their readings say of the motion.

In: array and part files, positions and sensing axes.
Out: `AccelerometerArray`, the regression matrix J and its condition, the closed-form solutions, quadrature, gravity, a
known axis of rotation.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.array.array import OMEGA_PRODUCTS
    from gfimu.array.gravity import EARTH_RATE
    from gfimu.array.kinematics import (
        ALTERNATE_CORNERS,
        joint_covariance,
        omega_leakage,
        omega_products,
        require_all_motions,
        unseen_motions,
    )
    from gfimu.array.observability import seeing_arrays
    from gfimu.array.parts.limits import PartLimits
    from gfimu.array.parts.part import Part, white_noise_std
    from gfimu.array.parts.part_file import PartFile
    from gfimu.array.parts.plausible import largest_of_array, largest_of_part
    from gfimu.array.turning_axis import AxisUncertainty
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
