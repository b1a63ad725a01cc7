"""What a calibration leaves of the errors of an array, to first order.

``rest``: each channel's mean over the rest at the start, less its share of gravity, is taken off as bias
(`gfimu.motion.rest_bias`). What is constant disappears; of an error that depends on the motion its value at rest does.

``poses``: the array is calibrated from static poses (`gfimu.calibration.array_static`). Bias, gain, cross-axis
sensitivity and the rotation of each chip against the others disappear. The rotation that all chips have in common
remains, and so does the placement; temperature changes after the calibration. The uncertainty of the fit comes in as a
cause of its own, ``calibration``, with the covariance that the fit predicts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError, check_name
from gfimu.base.short_repr import short_repr
from gfimu.budget.tolerances.known_motion import KnownMotion
from gfimu.budget.tolerances.signatures import axis_pairs, signatures, turned_readings
from gfimu.budget.tolerances.tolerances import Tolerances
from gfimu.calibration.array_static import array_static
from gfimu.calibration.nonlinearity import quadratic_std
from gfimu.calibration.observations import Observations
from gfimu.calibration.result import Calibration
from gfimu.recording import Recording

__all__ = [
    "CALIBRATIONS",
    "Poses",
    "Remaining",
    "calibrations_of",
    "check_calibration",
    "remaining",
    "uses_poses",
    "uses_rest",
]

Floats = NDArray[np.float64]

CALIBRATIONS: Mapping[str, str] = {
    "none": "as the data sheets have it",
    "rest": "biases read at the rest before the motion",
    "poses": "chips calibrated from static poses",
    "poses+rest": "both",
}
"""Calibrations by name."""

LEAST_REST_S = 1.0
"""Shortest rest from which biases are read (`gfimu.motion.rest_bias`), s."""

_NEGLIGIBLE = 1e-12  # numerical: of the largest eigenvalue of a covariance


@dataclass(frozen=True)
class Poses:
    """Static poses of a calibration.

    Parameters
    ----------
    directions : ndarray, shape (p, 3)
        Unit vectors of up, body axes.
    samples : int
        Samples averaged in each pose.
    """

    directions: Floats
    samples: int

    def posterior(self, array: AccelerometerArray, noise: Floats, gravity: float) -> Calibration:
        """Calibrate a perfect unit: its parameters, and the covariance that noise (c,), m/s², gives them."""
        means = gravity * self.directions @ array.axes.T  # (p, c)
        spread = np.diag(noise**2 / self.samples)
        observations = Observations.from_means(means, spread, channels=array.channels)
        recording = Recording.from_arrays(np.arange(len(means), dtype=float), means, array)
        observations = replace(observations, quadratic_std=quadratic_std(recording, array))
        found = array_static(observations, array, gravity=gravity)
        # Means without noise leave no misfit, of which the fit would conclude that it is better than it states.
        factor = float(found.statistics["covariance_factor"])
        return replace(found, covariance=found.covariance / factor)


@dataclass(frozen=True)
class Remaining:
    """Errors of the channels that a calibration leaves.

    Parameters
    ----------
    signatures : mapping of str to ndarray, shape (n, c, m)
        By cause, of one standard deviation of each of m independent parameters, m/s².
    rest : int
        Number of samples from the start whose mean is taken off the readings; 0 for none.
    """

    signatures: Mapping[str, Floats]
    rest: int

    __repr__ = short_repr


def uses_rest(calibration: str) -> bool:
    """Whether biases are read at the rest before the motion."""
    return "rest" in calibration.split("+")


def uses_poses(calibration: str) -> bool:
    """Whether the chips are calibrated from static poses."""
    return "poses" in calibration.split("+")


def calibrations_of(array: AccelerometerArray, motion: KnownMotion) -> tuple[str, ...]:
    """Return the calibrations that an array and a motion allow."""
    return tuple(name for name in CALIBRATIONS if _refusal(name, array, motion) is None)


def check_calibration(calibration: str, array: AccelerometerArray, motion: KnownMotion) -> None:
    """Raise `InputError` for a calibration that is unknown, or that the array or the motion do not allow."""
    check_name("calibration", calibration, CALIBRATIONS)
    reason = _refusal(calibration, array, motion)
    if reason is not None:
        raise InputError(f"calibration {calibration!r}: {reason}")


def _refusal(calibration: str, array: AccelerometerArray, motion: KnownMotion) -> str | None:
    """Return why a calibration is not possible."""
    if uses_rest(calibration) and motion.rest * motion.step < LEAST_REST_S:
        return f"the motion does not begin with {LEAST_REST_S:g} s of rest; use another scenario or calibration"
    triads = all(len(chip.axes) == 3 and np.allclose(chip.axes @ chip.axes.T, np.eye(3)) for chip in array.chips)
    if uses_poses(calibration) and not triads:
        return f"array {array.name!r} has chips without three orthogonal axes, which poses don't calibrate; use rest"
    return None


def remaining(
    calibration: str,
    array: AccelerometerArray,
    motion: KnownMotion,
    tolerances: Tolerances,
    poses: Poses,
) -> Remaining:
    """Work out what a calibration leaves of the errors of the channels.

    Parameters
    ----------
    calibration : str
        A key of `CALIBRATIONS`.
    array : AccelerometerArray
        The drawing.
    motion : KnownMotion
        The motion of the run.
    tolerances : Tolerances
        Errors before the calibration.
    poses : Poses
        Poses of the calibration from poses.

    Raises
    ------
    InputError
        As `check_calibration`.
    """
    check_calibration(calibration, array, motion)
    found = dict(signatures(array, motion, tolerances))
    if uses_poses(calibration):
        found = _after_poses(found, array, motion, tolerances, poses)
    rest = motion.rest if uses_rest(calibration) else 0
    if rest:
        found = {name: columns - columns[:rest].mean(axis=0) for name, columns in found.items()}
    found = {name: columns for name, columns in found.items() if np.abs(columns).max() > _NEGLIGIBLE}
    return Remaining(found, rest)


def _after_poses(
    before: Mapping[str, Floats],
    array: AccelerometerArray,
    motion: KnownMotion,
    tolerances: Tolerances,
    poses: Poses,
) -> dict[str, Floats]:
    left = {name: before[name] for name in ("placement", "temperature") if name in before}
    turned = turned_readings(array, motion) / len(array.chips)  # (n, c, 3): by the mean rotation
    if "angles" in before:
        left["angles"] = np.tile(turned * tolerances.angle_std, (1, 1, len(array.chips)))
    if "cross-axis" in before:
        # x θ_i θ_jᵀ turns the chip by x/2 θ_i × θ_j; the rest of it is fitted.
        turns = [0.5 * tolerances.cross_axis[i] * np.cross(array.axes[i], array.axes[j]) for i, j in axis_pairs(array)]
        left["cross-axis"] = np.einsum("nci,mi->ncm", turned, np.array(turns))
    least = max(1e-3 * float(tolerances.noise.max()), 1e-6)  # m/s²: the fit needs a weight where no noise is stated
    posterior = poses.posterior(array, np.maximum(tolerances.noise, least), motion.gravity)
    if tolerances.noise.any():
        left["calibration"] = _of_posterior(posterior, array, motion)
    return left


def _of_posterior(posterior: Calibration, array: AccelerometerArray, motion: KnownMotion) -> Floats:
    """Return what each independent combination of the parameters' errors adds to corrected readings, (n, c, m)."""
    readings = motion.readings(array)
    values, vectors = np.linalg.eigh(posterior.covariance)
    kept = values > _NEGLIGIBLE * values.max()
    ideal = _corrected(posterior, array, readings)
    columns = [
        _corrected(replace(posterior, values=posterior.values + step), array, readings) - ideal
        for step in (vectors[:, kept] * np.sqrt(values[kept])).T
    ]
    return np.stack(columns, axis=2)


def _corrected(calibration: Calibration, array: AccelerometerArray, readings: Floats) -> Floats:
    """Return readings (n, c) corrected by a calibration of an array."""
    found = np.empty_like(readings)
    for index, chip in enumerate(array.chips):
        mine = array.chip_of_channel == index
        found[:, mine] = calibration.models[chip.name].correct(readings[:, mine])
    return found
