"""gfimu: a gyro-free inertial measurement unit in software.

Glossary
--------
specific force, f = a − g
    What an accelerometer reads: at rest +g along "up". Never called acceleration here. m/s².
p
    Specific force of the body origin, in body axes, m/s².
alpha, α
    Angular acceleration of the body, in body axes, rad/s².
omega, ω
    Angular rate of the body against the world, in body axes, rad/s.
J, Q
    Regression matrix (c × 6) and centripetal matrix (c × 6): reading = J [α; p] + Q s, s the six products of ω.
GDOP
    √tr((JᵀJ)⁻¹) with lengths in the array's length unit (half the cube's edge).
bias, scale factor, misalignment, cross-axis
    Constant offset, gain error, wrong direction of a sensing axis, pick-up of a neighbouring axis.
velocity random walk N, bias instability B, acceleration random walk K
    Coefficients of the Allan deviation of an accelerometer.

Frames: world with z up; table frame turned by θ about the table's axis; body (cube) frame with its origin at the
cube's centre. Attitude quaternions (w, x, y, z) turn body axes into world axes.
Units: SI inside, everywhere; angles in rad, rates in rad/s. Units stand in every column name and file key.
"""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.1.0"

_PUBLIC = {
    "LiveRateFilter": "gfimu.rate.live",
    "RateEstimate": "gfimu.rate.result",
    "SensorErrors": "gfimu.rate.sensing",
    "estimate_rate": "gfimu.rate.methods",
    "posterior_rate_bound": "gfimu.bounds",
    "AccelerometerArray": "gfimu.array",
    "Calibration": "gfimu.calibration.result",
    "Chip": "gfimu.array",
    "ErrorSources": "gfimu.drift_forms",
    "Estimate": "gfimu.estimation",
    "GeometryError": "gfimu.errors",
    "GfimuError": "gfimu.errors",
    "InputError": "gfimu.errors",
    "Recording": "gfimu.recording",
    "allan_deviation": "gfimu.noise",
    "calibrate": "gfimu.calibration.methods",
    "calibrate_array": "gfimu.calibration.array_calibration",
    "centripetal_agreement": "gfimu.estimate_summary",
    "closed_form": "gfimu.kinematics",
    "design": "gfimu.diagnosis.design",
    "drift_budget": "gfimu.drift",
    "equivalent_rate_drift": "gfimu.drift",
    "estimate_from_rest": "gfimu.rest_bias",
    "estimate": "gfimu.estimation",
    "gdop": "gfimu.dilution",
    "identify_noise": "gfimu.noise",
    "integrate_attitude": "gfimu.attitude",
    "integrate_rate": "gfimu.rate.integration",
    "joint_form": "gfimu.kinematics",
    "level": "gfimu.navigation",
    "load_calibration": "gfimu.calibration.result",
    "local_gravity": "gfimu.gravity",
    "monte_carlo_drift": "gfimu.drift_monte_carlo",
    "motion_from_readings": "gfimu.kinematics",
    "navigate": "gfimu.navigation",
    "null_space": "gfimu.kinematics",
    "open_recording": "gfimu.recording_formats",
    "optimize": "gfimu.geometry_search",
    "pseudo_inverse": "gfimu.kinematics",
    "rate_bound": "gfimu.bounds",
    "read_mimu4444": "gfimu.mimu4444",
    "recording_noise": "gfimu.noise",
    "score": "gfimu.scoring",
    "specific_force": "gfimu.kinematics",
    "summarise": "gfimu.estimate_summary",
    "update_array_calibration": "gfimu.calibration.array_calibration",
}

__all__ = ["__version__"]
__all__ += list(_PUBLIC)


def __getattr__(name: str) -> Any:
    # Public names load on first use, so that `gfimu --help` does not wait for numba and scipy.
    if name in _PUBLIC:
        return getattr(importlib.import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'gfimu' has no attribute {name!r}")
