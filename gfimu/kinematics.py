"""`gfimu.geometry.kinematics` by its former name, for programs that import it from here."""

from gfimu.geometry.kinematics import (
    ALTERNATE_CORNERS,
    MOTION_NAMES,
    JointEstimate,
    MotionEstimate,
    NullSpace,
    closed_form,
    joint_covariance,
    joint_form,
    motion_from_readings,
    null_space,
    omega_leakage,
    omega_products,
    pseudo_inverse,
    require_all_motions,
    specific_force,
    unseen_motions,
)
from gfimu.lazy_names import former_name

__all__ = [
    "ALTERNATE_CORNERS",
    "MOTION_NAMES",
    "JointEstimate",
    "MotionEstimate",
    "NullSpace",
    "closed_form",
    "joint_covariance",
    "joint_form",
    "motion_from_readings",
    "null_space",
    "omega_leakage",
    "omega_products",
    "pseudo_inverse",
    "require_all_motions",
    "specific_force",
    "unseen_motions",
]

former_name(__name__, "gfimu.geometry.kinematics", removed="0.4")
