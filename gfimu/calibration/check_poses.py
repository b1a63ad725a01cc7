"""A calibration on poses at rest that it has not seen: |a| − g, and whether that is as large as it states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.calibration.poses import pose_rests
from gfimu.calibration.result import Calibration
from gfimu.recording import Recording
from gfimu.recording.rest import Rest

__all__ = ["check_on_poses", "rest_means"]

_STEP = 1e-3  # of a standard deviation: the magnitude is as good as linear in the parameters there


def check_on_poses(
    calibration: Calibration, recording: Recording, *, rest_threshold: float | None = None, min_rest_s: float = 1.0
) -> dict[str, float]:
    """Compare the magnitude of the specific force with gravity on poses that the calibration has not seen.

    Parameters
    ----------
    calibration : Calibration
        Of accelerometers.
    recording : Recording
        Poses at rest, in the unit of the calibration.
    rest_threshold : float, optional
        Threshold of rest, reading unit squared; chosen by the data if not given.
    min_rest_s : float
        Shortest pose, s.

    Returns
    -------
    dict
        ``check_poses``; ``check_rms_m_s2``, the root mean square of |a| − g over poses and chips (Persian calibration
        paper); ``check_largest_m_s2``; ``check_rms_before_m_s2`` with what was read, where that is in m/s²; and
        ``check_rms_by_std``, the root mean square of |a| − g over its standard deviation by the calibration's
        covariance and the noise of the pose: 1 if the calibration is as good as it states; not of a table of poses.

    Raises
    ------
    InputError
        If the calibration is that of a gyro, the recording lacks a channel, has another unit or holds no rest.
    """
    if calibration.unit == "rad_s":
        raise InputError("--check compares |a| with gravity; the scale of a gyro does not show at rest")
    rest = pose_rests(recording, threshold=rest_threshold, min_duration_s=min_rest_s)
    off = _off(calibration, recording, rest)  # (p, k)
    found = {
        "check_poses": float(len(rest)),
        "check_rms_m_s2": float(np.sqrt(np.nanmean(off**2))),
        "check_largest_m_s2": float(np.nanmax(np.abs(off))),
    }
    if recording.unit == "m_s2":
        before = np.linalg.norm(rest_means(recording, calibration, rest), axis=2) - calibration.gravity
        found["check_rms_before_m_s2"] = float(np.sqrt(np.nanmean(before**2)))
    if rest.lengths.min() < 2:  # rows of a table, whose noise isn't in them
        return found
    variance = _noise_variance(calibration, recording, rest) + _parameter_variance(calibration, recording, rest, off)
    found["check_rms_by_std"] = float(np.sqrt(np.nanmean(off**2 / variance)))
    return found


def rest_means(recording: Recording, calibration: Calibration, rest: Rest) -> NDArray[np.float64]:
    """Return the mean reading of every rest, chip and axis, (p, k, 3)."""
    columns = [recording.channels.index(channel) for channel in calibration.channels]
    parts = zip(rest.start, rest.stop, strict=True)
    means = np.array([np.nanmean(recording.readings[a:b, columns], axis=0) for a, b in parts])
    return means.reshape(len(means), -1, 3)


def _off(calibration: Calibration, recording: Recording, rest: Rest) -> NDArray[np.float64]:
    """Return |a| − g of every pose and chip, (p, k), m/s²."""
    forces = rest_means(recording, calibration, rest)
    corrected = [calibration.models[chip].correct(forces[:, k]) for k, chip in enumerate(calibration.chips)]
    return np.linalg.norm(np.stack(corrected, axis=1), axis=2) - calibration.gravity


def _noise_variance(calibration: Calibration, recording: Recording, rest: Rest) -> NDArray[np.float64]:
    """Return the variance of |a| (p, k) by the noise of the mean over a pose, (m/s²)²."""
    columns = [recording.channels.index(channel) for channel in calibration.channels]
    variances = np.array(
        [
            np.nanvar(recording.readings[a:b, columns], axis=0) / (b - a)
            for a, b in zip(rest.start, rest.stop, strict=True)
        ]
    ).reshape(len(rest), -1, 3)
    gains = [
        np.linalg.norm(calibration.models[chip].sensitivity, axis=1) for chip in calibration.chips
    ]  # reading per m/s²
    forces = rest_means(recording, calibration, rest)
    total = np.empty(forces.shape[:2])
    for k, chip in enumerate(calibration.chips):
        along = calibration.models[chip].correct(forces[:, k]) / calibration.gravity  # (p, 3)
        total[:, k] = (along**2 * variances[:, k] / gains[k] ** 2).sum(axis=1)
    return total


def _parameter_variance(
    calibration: Calibration, recording: Recording, rest: Rest, off: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the variance of |a| (p, k) by the covariance of the parameters, (m/s²)²."""
    std = np.sqrt(np.maximum(np.diag(calibration.covariance), 0.0))
    slopes = np.zeros((len(std), *off.shape))
    for index, one in enumerate(std):
        if one > 0.0:
            step = np.zeros(len(std))
            step[index] = _STEP * one
            moved = replace(calibration, values=calibration.values + step)
            slopes[index] = (_off(moved, recording, rest) - off) / step[index]
    return np.asarray(np.einsum("ipk,ij,jpk->pk", slopes, calibration.covariance, slopes))
