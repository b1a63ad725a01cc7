"""What a tachometer or a gyro shows of the rotation of an array, for the calibration from motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs, savgol_filter

from gfimu.base.errors import InputError
from gfimu.recording import Recording
from gfimu.recording.importing.guessing.likely_reference import reference_remedy
from gfimu.recording.rest import detect_rest
from gfimu.recording.timing.reference_times import reference_on_rows

__all__ = ["MotionReference", "has_reference", "motion_reference"]

Floats = NDArray[np.float64]

_STANDING_RATE = 0.5
_LONGEST = 3000
_SMOOTHING_S = 0.3


@dataclass(frozen=True)
class MotionReference:
    """What a reference shows of the rotation at the samples used.

    Parameters
    ----------
    kind : {"turntable", "gyro"}
        ``turntable``: spin about body z only, from the tachometer; ``gyro``: any rotation.
    rows : ndarray of int, shape (n,)
        Samples of the recording in motion and with a reference.
    omega : ndarray, shape (n, 3)
        Reference rate, rad/s.
    omega_std : float
        Its standard deviation, rad/s.
    alpha : ndarray, shape (n,)
        Derivative of the turntable's rate, rad/s²; zero for a gyro.
    alpha_std : float
        Its standard deviation; infinite for a gyro.
    """

    kind: str
    rows: NDArray[np.intp]
    omega: Floats
    omega_std: float
    alpha: Floats
    alpha_std: float


_GYRO = tuple(f"gyro_{axis}_rad_s" for axis in "xyz")


def has_reference(recording: Recording) -> bool:
    """Whether a recording has a gyro of three axes or a tachometer."""
    return all(name in recording.reference for name in _GYRO) or "tacho_rad_s" in recording.reference


def motion_reference(recording: Recording, *, omega_std: float | None = None) -> MotionReference:
    """Take the reference of the rotation from a recording: its gyro if it has one, else its tachometer.

    Parameters
    ----------
    recording : Recording
        With ``gyro_x_rad_s`` … or ``tacho_rad_s``.
    omega_std : float, optional
        Standard deviation of the reference, rad/s; by default from its scatter about a smooth curve (tachometer) or
        0.05 rad/s (gyro).

    Raises
    ------
    InputError
        If there is neither, or nothing moves.
    """
    recording = reference_on_rows(recording)
    if all(name in recording.reference for name in _GYRO):
        omega = np.column_stack([recording.reference[name] for name in _GYRO])
        omega = omega - _rate_at_rest(recording, omega)
        kind, alpha, alpha_std, rate_std = "gyro", np.zeros(len(omega)), np.inf, 0.05
    elif "tacho_rad_s" in recording.reference:
        tacho = recording.reference["tacho_rad_s"]
        window = max(round(_SMOOTHING_S * recording.sample_rate) | 1, 7)
        filled = np.interp(recording.t_s, recording.t_s[np.isfinite(tacho)], tacho[np.isfinite(tacho)])
        smooth = savgol_filter(filled, window, 3)
        alpha = savgol_filter(filled, window, 3, deriv=1, delta=recording.sample_period)
        noise = float(np.nanstd(tacho - smooth))
        rate_std = max(noise, 1e-9)
        slope = savgol_coeffs(window, 3, deriv=1, delta=recording.sample_period)
        # Slopes within one window share their errors: together they count as one.
        alpha_std = max(noise * float(np.linalg.norm(slope)) * np.sqrt(window), 1e-6)
        kind, omega = "turntable", np.column_stack([np.zeros((len(tacho), 2)), tacho])
    else:
        likely = reference_remedy({**recording.extra, **recording.reference}, "tacho_rad_s")
        raise InputError(
            "positions need a reference of the rotation: the recording has neither tacho_rad_s nor gyro_x/y/z_rad_s"
            + f"; {likely}" * bool(likely)
        )
    moving = np.linalg.norm(omega, axis=1) > _STANDING_RATE
    rows = np.flatnonzero(moving & np.isfinite(omega).all(axis=1) & np.isfinite(recording.readings).all(axis=1))
    if len(rows) < 100:
        raise InputError(
            f"only {len(rows)} samples turn faster than {_STANDING_RATE} rad/s; turn the array to find positions"
        )
    if len(rows) > _LONGEST:
        rows = rows[np.linspace(0, len(rows) - 1, _LONGEST).astype(int)]
    return MotionReference(kind, rows, omega[rows], omega_std or rate_std, alpha[rows], alpha_std)


def _rate_at_rest(recording: Recording, omega: Floats) -> Floats:
    """Mean of the gyro over the rests of the recording, its bias; zero if there is no rest."""
    rest = detect_rest(recording)
    rows = [omega[start:stop] for start, stop in zip(rest.start, rest.stop, strict=True)]
    if not rows:
        return np.zeros(3)
    still = np.concatenate(rows)
    return (
        np.asarray(np.nanmean(still, axis=0)) if np.nanmax(np.nanstd(still, axis=0)) < _STANDING_RATE else np.zeros(3)
    )
