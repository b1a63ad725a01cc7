"""Key figures of an estimate, and how it agrees with the references recorded beside the readings."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.geometry.array import AccelerometerArray
from gfimu.geometry.kinematics import null_space, omega_products
from gfimu.geometry.observability import unseen_motions
from gfimu.motion.earth import EarthRotation
from gfimu.motion.equivalent_errors import equivalent_p_bias, equivalent_rate_drift
from gfimu.motion.estimate import Estimate
from gfimu.motion.rest_bias import ForceAtRest, force_at_rest
from gfimu.recording import Recording
from gfimu.short_repr import short_repr
from gfimu.units import STANDARD_GRAVITY

__all__ = ["Agreement", "EstimateSummary", "PositionSummary", "centripetal_agreement", "summarise"]

_AXES = ("x", "y", "z")
_TURNING_RATE = 2.0


@dataclass(frozen=True)
class Agreement:
    """How well the centripetal terms in the null space agree with a gyro.

    Parameters
    ----------
    slope : float
        Least-squares slope through the origin of measured against expected terms; 1 is perfect.
    correlation : float
        Correlation of the two.
    samples : int
        Samples used: those with a gyro reading, every channel, and the body turning.
    """

    slope: float
    correlation: float
    samples: int


@dataclass(frozen=True)
class PositionSummary:
    """Where navigation ends, and the constant errors that would explain it if the body had stayed where it was.

    Parameters
    ----------
    after_s : float
        Time since the start of navigation, s.
    position_m : ndarray, shape (3,)
        Position of the body origin at the end, world axes, m.
    equivalent_p_bias_m_s2 : ndarray, shape (3,)
        Constant bias of p, world axes, m/s² (`gfimu.motion.equivalent_errors.equivalent_p_bias`).
    equivalent_rate_drift_deg_h : float
        Constant drift of the rate that explains the horizontal part, °/h
        (`gfimu.motion.equivalent_errors.equivalent_rate_drift`).
    earth_horizontal_rate_deg_h : float or None
        Horizontal part of the Earth's rate at the place, °/h: the drift of a unit that does not take it into account.
    """

    after_s: float
    position_m: NDArray[np.float64]
    equivalent_p_bias_m_s2: NDArray[np.float64]
    equivalent_rate_drift_deg_h: float
    earth_horizontal_rate_deg_h: float | None


@dataclass(frozen=True)
class EstimateSummary:
    """Key figures of an estimate; unknown ones are NaN or None.

    Parameters
    ----------
    array, method, form : str
        What was estimated, and how.
    samples, gaps, samples_without_estimate : int
        Samples, places where samples are lost, and samples whose channels don't suffice.
    duration_s, sample_rate_hz : float
        Length and nominal rate of the recording.
    p_rms_m_s2, alpha_rms_rad_s2, omega_rms_rad_s : ndarray, shape (3,)
        Root mean squares by body axis.
    omega_std_rad_s : ndarray, shape (3,)
        Standard deviation of the rate at the last sample, by noise alone.
    angle_rad : float
        Angle turned about the table's axis at the last sample.
    tacho_rmse_rad_s, gyro_rmse_rad_s : float or None
        Root mean square difference of the rate from the tachometer and, over all three axes, from the gyro.
    centripetal : Agreement or None
        Centripetal terms against the gyro.
    disagreement : mapping or None
        How much more than stated the channels disagree: the figures of `gfimu.rate.disagreement.Disagreement`.
    sign_undecided_samples : int or None
        Samples whose rate has a sign that is not decided.
    consistency : mapping or None
        Of the filter's or smoother's innovations: the figures of `gfimu.rate.consistency.Consistency`.
    mounting : mapping or None
        About a known axis: constants of the mounting that were estimated (`gfimu.known_axis.mounting_fit`).
    position : PositionSummary or None
        Where navigation ends, where the position was asked for.
    at_rest : ForceAtRest or None
        Mean of p at the first rest less gravity, from the readings as recorded (calibrated where that was asked for).
    health : mapping or None
        Faults of channels that were found and left out (`gfimu.integrity.fault.ChannelHealth`), where it was looked.
    faults : tuple of mapping
        The same faults, an entry for each channel (`gfimu.integrity.fault.ChannelFault.entries`).
    channels_left_out : tuple of str
        Dead channels that the estimate goes without.
    warnings : tuple of str
        What the checks of the recording found, and an inconsistent filter.
    """

    array: str
    method: str
    form: str
    samples: int
    gaps: int
    samples_without_estimate: int
    duration_s: float
    sample_rate_hz: float
    p_rms_m_s2: NDArray[np.float64]
    alpha_rms_rad_s2: NDArray[np.float64]
    omega_rms_rad_s: NDArray[np.float64]
    omega_std_rad_s: NDArray[np.float64]
    angle_rad: float
    tacho_rmse_rad_s: float | None
    gyro_rmse_rad_s: float | None
    centripetal: Agreement | None
    disagreement: Mapping[str, Any] | None = None
    sign_undecided_samples: int | None = None
    consistency: Mapping[str, Any] | None = None
    mounting: Mapping[str, Any] | None = None
    position: PositionSummary | None = None
    at_rest: ForceAtRest | None = None
    health: Mapping[str, Any] | None = None
    faults: tuple[Mapping[str, Any], ...] = ()
    channels_left_out: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    __repr__ = short_repr

    def to_dict(self) -> dict[str, Any]:
        """Return the figures by name, for JSON."""
        return asdict(self)


def summarise(estimate: Estimate, recording: Recording, array: AccelerometerArray) -> EstimateSummary:
    """Summarise an estimate and compare it with the references of its recording.

    Parameters
    ----------
    estimate : Estimate
        What `gfimu.estimate` found.
    recording : Recording
        The recording it was found from.
    array : AccelerometerArray
        The array that was recorded.

    Examples
    --------
    >>> import gfimu
    >>> run = gfimu.simulate("paper_run", seed=1)
    >>> summary = gfimu.summarise(gfimu.estimate(run, rest_bias=True), run, run.array)
    >>> type(summary).__name__
    'EstimateSummary'
    """
    known = np.isfinite(estimate.omega).all(axis=1) & np.isfinite(estimate.p).all(axis=1)
    last = int(np.flatnonzero(known)[-1]) if known.any() else -1
    turning = estimate.metadata.get("turning_axis")
    upright = Rotation.from_rotvec(recording.mounting_rotvec).inv().apply([0.0, 0.0, 1.0])
    axis = upright if turning is None else np.asarray(turning["direction"], dtype=float)
    tacho = recording.reference.get("tacho_rad_s")
    gyro = _gyro(recording)
    consistency = estimate.metadata.get("consistency")
    return EstimateSummary(
        array=array.name,
        method=str(estimate.metadata.get("method", "")),
        form=str(estimate.metadata.get("form", "")),
        samples=len(estimate),
        gaps=len(recording.gaps),
        samples_without_estimate=int(np.sum(~known)),
        duration_s=recording.duration,
        sample_rate_hz=recording.sample_rate,
        p_rms_m_s2=_rms(estimate.p[known]),
        alpha_rms_rad_s2=_rms(estimate.alpha[known]),
        omega_rms_rad_s=_rms(estimate.omega[known]),
        omega_std_rad_s=estimate.omega_std[last],
        angle_rad=float(estimate.angle[last]),
        tacho_rmse_rad_s=None if tacho is None else _rms_difference(estimate.omega @ axis, tacho),
        gyro_rmse_rad_s=None if gyro is None else _rms_difference(estimate.omega, gyro),
        centripetal=None if unseen_motions(array) else centripetal_agreement(recording, array),
        disagreement=estimate.metadata.get("disagreement"),
        sign_undecided_samples=estimate.metadata.get("sign_undecided_samples"),
        consistency=consistency,
        mounting=estimate.metadata.get("mounting"),
        position=_position(estimate),
        at_rest=force_at_rest(
            recording,
            array,
            gravity=float(estimate.metadata.get("gravity_m_s2", STANDARD_GRAVITY)),
            without=estimate.metadata.get("channels_left_out", ()),
        ),
        health=estimate.metadata.get("health"),
        faults=tuple(estimate.metadata.get("faults", ())),
        channels_left_out=tuple(estimate.metadata.get("channels_left_out", ())),
        warnings=(*estimate.metadata.get("warnings", ()), *_inconsistency(estimate, consistency)),
    )


def _position(estimate: Estimate) -> PositionSummary | None:
    """Sum up the position at the last sample that has one."""
    if estimate.position is None:
        return None
    known = np.flatnonzero(np.isfinite(estimate.position).all(axis=1))
    if len(known) < 2:
        return None
    end = estimate.position[known[-1]]
    after = float(estimate.t_s[known[-1]] - estimate.t_s[known[0]])
    latitude = estimate.metadata.get("latitude_deg")
    return PositionSummary(
        after_s=after,
        position_m=end,
        equivalent_p_bias_m_s2=equivalent_p_bias(end, after),
        equivalent_rate_drift_deg_h=float(equivalent_rate_drift(math.hypot(end[0], end[1]), after)),
        earth_horizontal_rate_deg_h=None
        if latitude is None
        else math.degrees(EarthRotation(float(latitude)).horizontal_rate) * 3600.0,
    )


def _inconsistency(estimate: Estimate, consistency: Mapping[str, Any] | None) -> list[str]:
    """Return the warning of a filter whose innovations are larger than it states, if they are."""
    if consistency is None or consistency["consistent"]:
        return []
    mean, bound = consistency["nis"], consistency["bound"]
    if mean > bound:
        what = f"the innovations are {mean:.2f} times as large as stated (NIS; {bound:.2f} at most for a right model)"
    else:
        mean, bound, start = (consistency[name] for name in ("worst_second", "worst_second_bound", "worst_second_at_s"))
        what = (
            f"the innovations are {mean:.2f} times as large as stated (NIS; {bound:.2f} at most for a right model) "
            f"in the second from {start:.4g} s on"
        )
    channel = consistency["worst_channel"]
    if channel is None:
        whose = "no single channel explains it: check gains (calibrate), array and sample times"
    else:
        whose = f"channel {channel} disagrees most: without it they are {consistency['nis_without_worst']:.2f}"
    disagreement = estimate.metadata.get("disagreement") or {}
    if channel is None and disagreement.get("notable"):  # said already, with its size
        return []
    enlarged = disagreement.get("enlarged", False)
    first = "the stated errors don't explain the readings" if enlarged else "the estimate is worse than its std says"
    return [f"{first}: {what}; {whose}"]


def centripetal_agreement(
    recording: Recording, array: AccelerometerArray, *, slowest: float = _TURNING_RATE
) -> Agreement | None:
    """Compare the centripetal terms that the null space sees with those of the reference gyro.

    Parameters
    ----------
    recording : Recording
        Readings and the references ``gyro_x_rad_s``, ``gyro_y_rad_s``, ``gyro_z_rad_s``.
    array : AccelerometerArray
        The array that was recorded.
    slowest : float
        Samples slower than this are left out, rad/s.

    Returns
    -------
    Agreement or None
        All combinations of the null space together, each weighted as the geometry weights it, m/s² against m/s²;
        None without a gyro, without a null space that sees ω, or with fewer than three samples.

    Examples
    --------
    >>> import gfimu
    >>> run = gfimu.simulate("paper_run", seed=1)
    >>> gfimu.centripetal_agreement(run, run.array) is None
    True
    """
    space = null_space(array)
    gyro = _gyro(recording)
    if space.rank == 0 or gyro is None:
        return None
    readings = recording.for_array(array)
    chosen = np.isfinite(readings).all(axis=1) & (np.linalg.norm(gyro, axis=1) > slowest)  # NaN compares false
    if chosen.sum() < 3:
        return None
    measured = (readings[chosen] @ space.basis[: space.rank].T).ravel()
    expected = (omega_products(gyro[chosen]) @ space.sensitivity[: space.rank].T).ravel()
    slope = float(measured @ expected / (expected @ expected))
    return Agreement(slope, float(np.corrcoef(measured, expected)[0, 1]), int(chosen.sum()))


def _gyro(recording: Recording) -> NDArray[np.float64] | None:
    """Return the reference gyro, shape (n, 3), rad/s; None if an axis was not recorded."""
    names = [f"gyro_{axis}_rad_s" for axis in _AXES]
    if any(name not in recording.reference for name in names):
        return None
    return np.column_stack([recording.reference[name] for name in names])


def _rms(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Root mean square of each column; NaN without rows."""
    return np.sqrt(np.mean(values**2, axis=0)) if len(values) else np.full(values.shape[1:], np.nan)


def _rms_difference(estimate: NDArray[np.float64], reference: NDArray[np.float64]) -> float | None:
    """Root mean square of the differences where both are known, each axis an observation of its own."""
    difference = (estimate - reference).ravel()
    difference = difference[np.isfinite(difference)]
    return math.sqrt(float(np.mean(difference**2))) if len(difference) else None
