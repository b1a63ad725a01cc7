"""Biases of the channels read off at rest, as the GF-IMU paper does (its step 10 b, Table 1).

While nothing moves, each channel should read its share of gravity; what it reads beyond that is taken as its bias.
Levelling is assumed: a tilt of the table goes into the biases. What is left afterwards is the noise of the average,
and it grows into the rate with time; `RestBias.rate_std` says how much.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.errors import InputError
from gfimu.geometry.array import AccelerometerArray
from gfimu.geometry.kinematics import specific_force
from gfimu.motion.estimation import Estimate, estimate
from gfimu.parts.limits import PartLimits
from gfimu.rate.registry import rate_method
from gfimu.recording import Recording
from gfimu.recording.checks import Finding, check_recording, refuse_or_warn, without_dead_channels
from gfimu.recording.rest import detect_rest
from gfimu.short_repr import short_repr
from gfimu.units import STANDARD_GRAVITY

__all__ = ["RestBias", "estimate_from_rest", "rest_bias"]

_MILLI_G = STANDARD_GRAVITY / 1000.0


@dataclass(frozen=True)
class RestBias:
    """Biases of the channels of an array, read off at rest.

    Parameters
    ----------
    array : AccelerometerArray
        The array, with c channels.
    bias : ndarray, shape (c,)
        Mean reading beyond gravity, m/s².
    std : ndarray, shape (c,)
        Standard deviation of that mean by the noise seen, m/s².
    start_s, stop_s : float
        The stretch of rest, s.
    """

    array: AccelerometerArray
    bias: NDArray[np.float64]
    std: NDArray[np.float64]
    start_s: float
    stop_s: float

    __repr__ = short_repr

    def remove(self, recording: Recording) -> Recording:
        """Return the recording without these biases, in the channel order of the array."""
        readings = recording.for_array(self.array) - self.bias
        return replace(recording, readings=readings, channels=self.array.channels)

    def rate_std(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the standard deviation that what is left of the biases gives an integrated rate, rad/s, (n, 3).

        ``t`` has shape (n,), s; the integration starts at its first value.
        """
        pseudo_inverse = np.linalg.pinv(self.array.regression_matrix)  # (6, c)
        alpha_std = np.sqrt(pseudo_inverse[:3] ** 2 @ self.std**2)  # (3,)
        return (t - t[0])[:, None] * alpha_std

    def findings(self) -> tuple[Finding, ...]:
        """Return the channel whose bias exceeds its data sheet's limit most, as a reason to refuse; empty if none does.

        Parts without a data sheet are not judged.
        """
        try:
            limit = PartLimits.of(self.array, 100.0).bias
        except InputError:
            return ()
        ratio = np.abs(self.bias) / limit
        worst = int(np.argmax(ratio))
        if not ratio[worst] > 1.0:
            return ()
        beyond = int(np.count_nonzero(ratio > 1.0))
        others = f" (and {beyond - 1} more channels exceed theirs)" if beyond > 1 else ""
        text = (
            f"channel {self.array.channels[worst]} of array {self.array.name!r} reads "
            f"{self.bias[worst] / _MILLI_G:+.0f} mg beyond gravity at rest; "
            f"its data sheet allows {limit[worst] / _MILLI_G:.0f} mg{others}: the table is not level or the mounting "
            "another, the unit, order, sign or array is wrong, the body turned, or the chip is damaged"
        )
        return (Finding("rest_bias", text, True, (self.array.channels[worst],)),)


def rest_bias(
    recording: Recording,
    array: AccelerometerArray,
    *,
    gravity: float = STANDARD_GRAVITY,
    min_duration_s: float = 1.0,
    without: Collection[str] = (),
) -> RestBias:
    """Read the biases off the first rest of a recording.

    Parameters
    ----------
    recording : Recording
        Readings in m/s²; the recording's mounting says how the cube lay.
    array : AccelerometerArray
        Geometry of the channels.
    gravity : float
        Local gravity, m/s².
    min_duration_s : float
        Shortest rest to use, s.
    without : collection of str
        Channels to leave out; their bias is zero.

    Raises
    ------
    InputError
        If nothing rests that long, or a channel has no reading at all.
    """
    readings = recording.for_array(array)
    used = np.array([name not in without for name in array.channels])
    silent = used & ~np.isfinite(readings).any(axis=0)
    if silent.any():
        raise InputError(f"channel {array.channels[int(np.argmax(silent))]} has no readings; check its wiring")
    names = tuple(name for name, kept in zip(array.channels, used, strict=True) if kept)
    seen = recording if used.all() else replace(recording, readings=readings[:, used], channels=names)
    rest = detect_rest(seen, min_duration_s=min_duration_s)
    if len(rest) == 0:
        raise InputError(
            f"no rest of {min_duration_s:g} s in the recording to read biases off; record one, or calibrate first"
        )
    rows = slice(int(rest.start[0]), int(rest.stop[0]))
    readings = np.where(used, readings[rows], 0.0)
    count = np.isfinite(readings).sum(axis=0)  # the rest was found with at least half of every window there
    up = Rotation.from_rotvec(recording.mounting_rotvec).inv().apply([0.0, 0.0, gravity])
    expected = specific_force(array, up, np.zeros(3), np.zeros(3))[0]  # (c,)
    t = recording.t_s[rows]
    return RestBias(
        array,
        np.where(used, np.nanmean(readings, axis=0) - expected, 0.0),
        np.nanstd(readings, axis=0, ddof=1) / np.sqrt(count),
        float(t[0]),
        float(t[-1]),
    )


def estimate_from_rest(
    recording: Recording,
    array: AccelerometerArray,
    *,
    method: str = "integrate",
    gravity: float = STANDARD_GRAVITY,
    force: bool = False,
    **options: Any,
) -> Estimate:
    """Estimate the motion with the biases of the first rest taken off.

    Parameters
    ----------
    recording : Recording
        Readings in m/s²; the table level and at rest for a second or more before it moves.
    array : AccelerometerArray
        Geometry of the channels.
    method : str
        Method for the angular rate. The standard deviation of ``integrate`` grows by the uncertainty of the biases.
    gravity : float
        Local gravity, m/s².
    force : bool
        Whether to go on where the recording's checks or a bias beyond its data sheet's limit would refuse it.
    **options
        As for `gfimu.motion.estimation.estimate`.

    Raises
    ------
    InputError
        As `rest_bias` and `gfimu.motion.estimation.estimate`; also if a bias exceeds its data sheet's limit.
    """
    findings = refuse_or_warn(check_recording(recording, array), force=force)
    recording = without_dead_channels(recording, array, findings)
    dead = [name for finding in findings if finding.kind == "dead" for name in finding.channels]
    found = rest_bias(recording, array, gravity=gravity, without=dead)
    findings += refuse_or_warn(found.findings(), force=force)
    result = estimate(
        found.remove(recording), array, method=method, findings=findings, force=force, gravity=gravity, **options
    )
    left = found.rate_std(result.t_s) if rate_method(method).open_loop else 0.0
    biases = dict(zip(array.channels, found.bias.tolist(), strict=True))
    return replace(
        result,
        omega_std=np.hypot(result.omega_std, left),
        metadata={**result.metadata, "rest_bias_m_s2": biases},
    )
