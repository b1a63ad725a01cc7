"""Biases of the channels read off at rest, as the GF-IMU paper does (its step 10 b, Table 1).

While nothing moves, each channel should read its share of gravity; what it reads beyond that is taken as its bias.
Levelling is assumed: a tilt of the table goes into the biases. What is left afterwards is the noise of the average,
and it grows into the rate with time.

`force_at_rest` is the paper's Table 1 itself: what p of the whole array reads beyond gravity.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.array.kinematics import specific_force
from gfimu.array.parts.limits import PartLimits
from gfimu.base.declared import Declared, Table, figure
from gfimu.base.errors import InputError
from gfimu.base.short_repr import short_repr
from gfimu.base.units import MILLI_G, STANDARD_GRAVITY
from gfimu.motion.estimate import Estimate
from gfimu.motion.estimation import estimate
from gfimu.recording import Recording
from gfimu.recording.doubts.doubt import Doubt
from gfimu.recording.doubts.judge import dead_channels, doubts_of, refuse_or_warn, without_doubtful
from gfimu.recording.rest import Rest, detect_rest, mean_variance_factor

__all__ = ["ForceAtRest", "RestBias", "estimate_from_rest", "force_at_rest", "rest_bias"]


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

    def findings(self) -> tuple[Doubt, ...]:
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
            f"{self.bias[worst] / MILLI_G:+.0f} mg beyond gravity at rest; "
            f"its data sheet allows {limit[worst] / MILLI_G:.0f} mg{others}: the table is not level or the mounting "
            "another, the unit, order, sign or array is wrong, the body turned, or the chip is damaged"
        )
        return (Doubt("rest_bias", text, True, (self.array.channels[worst],)),)


@dataclass(frozen=True)
class ForceAtRest(Declared):
    """Specific force p of the body origin at rest, less gravity: Table 1 of the GF-IMU paper."""

    start_s: Annotated[float, figure("Start of the rest.", "s")]
    stop_s: Annotated[float, figure("Its end.", "s")]
    bias_mg: Annotated[
        NDArray[np.float64],
        figure("Mean of p less gravity, body axes: the equivalent biases of p, if the unit stands level.", "mg"),
    ]
    std_mg: Annotated[
        NDArray[np.float64], figure("Standard uncertainty of that mean by the noise of the stretch.", "mg")
    ]
    lean_rad: Annotated[
        float,
        figure("Angle between p and the upright of the recording's mounting: the lean that reads the same.", "rad"),
    ]
    magnitude_mg: Annotated[float, figure("|p| less gravity, which no lean makes.", "mg")]
    magnitude_std_mg: Annotated[float, figure("Its standard uncertainty.", "mg")]

    __repr__ = short_repr

    def table(self, *, has_tacho: bool) -> Table:
        """Return what p reads beyond gravity, and the lean that would read the same, as people read it."""
        steady = "" if has_tacho else "Without a tachometer a steady spin may pass for one. "
        return Table(
            f"Equivalent biases of p, first rest ({self.start_s:.4g} to {self.stop_s:.4g} s), mg",
            ("mean less gravity", "x", "y", "z", "magnitude"),
            [
                ("bias of p", *(f"{value:+.2f}" for value in (*self.bias_mg, self.magnitude_mg))),
                ("standard uncertainty", *(f"{value:.2g}" for value in (*self.std_mg, self.magnitude_std_mg))),
            ],
            note="The first rest is the first stretch in which no reading varies beyond its noise. "
            f"{steady}At rest a bias and a lean are one: a lean of {math.degrees(self.lean_rad):.2g}° reads the same "
            "across the vertical. No lean makes the magnitude.",
        )


def force_at_rest(
    recording: Recording,
    array: AccelerometerArray,
    *,
    gravity: float = STANDARD_GRAVITY,
    without: Collection[str] = (),
) -> ForceAtRest | None:
    """Average p over the first rest of a recording and take gravity off (GF-IMU paper, Table 1).

    Parameters
    ----------
    recording : Recording
        Readings in m/s², with their biases; the recording's mounting says how the unit lay.
    array : AccelerometerArray
        Geometry of the channels.
    gravity : float
        Local gravity, m/s².
    without : collection of str
        Channels to leave out.

    Returns
    -------
    ForceAtRest or None
        None where nothing rests for a second, or the channels don't see p.

    Notes
    -----
    p = S a with S the left inverse of the regression matrix (paper, eq. 22). Noise that is correlated over the stretch
    raises the uncertainty (`gfimu.recording.rest.mean_variance_factor`); errors that last longer than it do not show.
    """
    used = np.array([name not in without for name in array.channels])
    regression = array.regression_matrix[used]  # (c, 6)
    if np.linalg.matrix_rank(regression) < 6:
        return None
    try:
        rest = _first_rest(recording, array, used)
    except InputError:
        return None
    rows = slice(int(rest.start[0]), int(rest.stop[0]))
    readings = recording.for_array(array)[rows][:, used]  # (n, c)
    readings = readings[np.isfinite(readings).all(axis=1)]
    if len(readings) < 2:
        return None
    p = readings @ np.linalg.pinv(regression)[3:].T  # (n, 3)
    covariance = np.cov(p, rowvar=False) * (mean_variance_factor([p]) / len(p))  # of the mean
    mean = p.mean(axis=0)
    up = _upright(recording)
    direction = mean / np.linalg.norm(mean)
    t = recording.t_s[rows]
    return ForceAtRest(
        float(t[0]),
        float(t[-1]),
        (mean - gravity * up) / MILLI_G,
        np.sqrt(np.diag(covariance)) / MILLI_G,
        float(np.arctan2(np.linalg.norm(np.cross(up, mean)), up @ mean)),
        float(np.linalg.norm(mean) - gravity) / MILLI_G,
        float(np.sqrt(direction @ covariance @ direction)) / MILLI_G,
    )


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
    rest = _first_rest(recording, array, used, min_duration_s)
    rows = slice(int(rest.start[0]), int(rest.stop[0]))
    readings = np.where(used, readings[rows], 0.0)
    count = np.isfinite(readings).sum(axis=0)  # the rest was found with at least half of every window there
    expected = specific_force(array, gravity * _upright(recording), np.zeros(3), np.zeros(3))[0]  # (c,)
    t = recording.t_s[rows]
    return RestBias(
        array,
        np.where(used, np.nanmean(readings, axis=0) - expected, 0.0),
        np.nanstd(readings, axis=0, ddof=1) / np.sqrt(count),
        float(t[0]),
        float(t[-1]),
    )


def _first_rest(
    recording: Recording, array: AccelerometerArray, used: NDArray[np.bool_], min_duration_s: float = 1.0
) -> Rest:
    """Return the stretches of rest by the channels used, shape (c,); raises `InputError` if there is none."""
    names = tuple(name for name, kept in zip(array.channels, used, strict=True) if kept)
    readings = recording.for_array(array)
    seen = recording if used.all() else replace(recording, readings=readings[:, used], channels=names)
    rest = detect_rest(seen, min_duration_s=min_duration_s)
    if len(rest) == 0:
        raise InputError(
            f"no rest of {min_duration_s:g} s in the recording to read biases off; record one, or calibrate first"
        )
    return rest


def _upright(recording: Recording) -> NDArray[np.float64]:
    """Return the world's up in the body axes of the recording's mounting, shape (3,)."""
    return np.asarray(Rotation.from_rotvec(recording.mounting_rotvec).inv().apply([0.0, 0.0, 1.0]))


def estimate_from_rest(
    recording: Recording,
    array: AccelerometerArray,
    *,
    method: str = "integrate",
    gravity: float = STANDARD_GRAVITY,
    force: bool = False,
    **options: Any,
) -> Estimate:
    """Estimate the motion after subtracting the biases read at the first rest.

    Parameters
    ----------
    recording : Recording
        Readings in m/s²; the table level and at rest for a second or more before it moves.
    array : AccelerometerArray
        Geometry of the channels.
    method : str
        Method for the angular rate.
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

    Examples
    --------
    >>> import gfimu
    >>> run = gfimu.simulate("paper_run", seed=1)
    >>> gfimu.estimate_from_rest(run, run.array)
    Estimate(cube12, integrate, 3000 samples, 29.99 s at 100 Hz)
    """
    findings = refuse_or_warn(doubts_of(recording, array), force=force)
    recording = without_doubtful(recording, array, [one for one in findings if one.kind != "frozen"])
    dead = dead_channels(findings)
    found = rest_bias(recording, array, gravity=gravity, without=dead)
    findings += refuse_or_warn(found.findings(), force=force)
    result = estimate(
        found.remove(recording), array, method=method, findings=findings, force=force, gravity=gravity,
        levelled=True, **options,
    )  # fmt: skip
    biases = dict(zip(array.channels, found.bias.tolist(), strict=True))
    return replace(result, metadata={**result.metadata, "rest_bias_m_s2": biases})
