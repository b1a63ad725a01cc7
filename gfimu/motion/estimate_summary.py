"""Key figures of an estimate, and how it agrees with the references recorded beside the readings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.array.kinematics import null_space, omega_products
from gfimu.array.observability import unseen_motions
from gfimu.base.declared import Declared, Line, Table, cell, figure, figures, table
from gfimu.base.short_repr import short_repr
from gfimu.base.units import MILLI_G, STANDARD_GRAVITY
from gfimu.motion.earth import EarthRotation
from gfimu.motion.equivalent_errors import equivalent_p_bias, equivalent_rate_drift
from gfimu.motion.estimate import Estimate
from gfimu.motion.rest_bias import ForceAtRest, force_at_rest
from gfimu.rate.axis.mounting_fit import FittedConstant, MountingFit
from gfimu.rate.consistency import Consistency
from gfimu.rate.disagreement import Disagreement
from gfimu.rate.health.fault import ChannelHealth, FaultEntry
from gfimu.recording import Recording

__all__ = ["Agreement", "EstimateSummary", "PositionSummary", "centripetal_agreement", "summarise"]

Floats = NDArray[np.float64]
_Figures = Mapping[str, Any] | None  # as the metadata of an estimate hold them

_DRIFT = "equivalent drift of ω: 6 r/(g t³)"
_EARTH = "Earth's horizontal rate, taken off"
_STAYED = (
    "The equivalent errors hold for a body that ends where it started: r is then all error. The drift is that of the "
    "horizontal part."
)
_CENTRIPETAL = "centripetal terms against gyro"
_AXES = ("x", "y", "z")
_TURNING_RATE = 2.0


@dataclass(frozen=True)
class Agreement(Declared):
    """How well the centripetal terms in the null space agree with a gyro."""

    slope: Annotated[
        float,
        figure("Slope of measured against expected terms; 1 is perfect.", head=f"{_CENTRIPETAL}, slope", form=".4f"),
    ]
    correlation: Annotated[float, figure("Correlation of the two.", head=f"{_CENTRIPETAL}, correlation", form=".4f")]
    samples: Annotated[int, figure("Samples used: those with a gyro reading, every channel, and the body turning.")]


@dataclass(frozen=True)
class PositionSummary(Declared):
    """Where navigation ends, and the constant errors that would explain it if the body had stayed where it was."""

    after_s: Annotated[float, figure("Time since the start of navigation.", "s")]
    position_m: Annotated[Floats, figure("Position at the end, world axes.", "m", head="position x y z")]
    position_std_m: Annotated[
        Floats | None, figure("Its standard deviation; null of methods without one.", "m", head="its σ, x y z")
    ]
    equivalent_p_bias_m_s2: Annotated[Floats, figure("Constant bias of p that explains it, world axes.", "m/s²")]
    equivalent_rate_drift_deg_h: Annotated[
        float, figure("Constant drift of the rate that explains the horizontal part.", "°/h", head=_DRIFT)
    ]
    earth_horizontal_rate_deg_h: Annotated[
        float | None, figure("Horizontal part of the Earth's rate; null without a latitude.", "°/h", head=_EARTH)
    ]

    def table(self) -> Table:
        """Return it as people read it."""
        shown = figures(f"Position in the world after {self.after_s:.4g} s", self, note=_STAYED)
        count = 1 if self.position_std_m is None else 2
        places, others = shown.rows[:count], shown.rows[count:]
        bias = ("equivalent bias of p, x y z: 2 r/t²", cell(self.equivalent_p_bias_m_s2 / MILLI_G), "mg")
        return replace(shown, rows=[*places, bias, *others])


@dataclass(frozen=True)
class EstimateSummary(Declared):
    """Key figures of an estimate; unknown ones are NaN or None."""

    array: Annotated[str, figure("Name of the array.")]
    method: Annotated[str, figure("Method for the angular rate.")]
    form: Annotated[str, figure("How readings turn into p and α.")]
    samples: Annotated[int, figure("Samples.", head="samples")]
    gaps: Annotated[int, figure("Places where samples are lost.", head="gaps")]
    samples_without_estimate: Annotated[int, figure("Their channels don't suffice.", head="samples without estimate")]
    duration_s: Annotated[float, figure("Length of the recording.", "s", head="duration")]
    sample_rate_hz: Annotated[float, figure("Nominal sample rate.", "Hz", head="sample rate")]
    p_rms_m_s2: Annotated[Floats, figure("Specific force of the origin, rms.", "m/s²", head="p, rms x y z")]
    alpha_rms_rad_s2: Annotated[Floats, figure("Angular acceleration, rms.", "rad/s²", head="α, rms x y z")]
    omega_rms_rad_s: Annotated[Floats, figure("Angular rate, rms.", "rad/s", head="ω, rms x y z")]
    omega_std_rad_s: Annotated[
        Floats, figure("Standard deviation of ω at the end.", "rad/s", head="σ of ω at the end, x y z")
    ]
    angle_rad: Annotated[
        float, figure("Angle about the table's axis at the end.", "rad", head="angle at the end", form=".5g")
    ]
    angle_std_rad: Annotated[
        float | None, figure("Its standard deviation; null of methods without one.", "rad", head="its σ", form=".3g")
    ]
    attitude_std_rad: Annotated[
        Floats | None,
        figure(
            "Standard deviation of the attitude at the end: tilt, tilt, heading; null of methods without one.",
            "rad",
            head="σ of tilt x, y and heading at the end",
        ),
    ]
    tacho_rmse_rad_s: Annotated[
        float | None,
        figure("Rate against the tachometer, rms; null without one.", "rad/s", head="ω against tacho, rmse"),
    ]
    gyro_rmse_rad_s: Annotated[
        float | None, figure("Rate against the gyro, rms; null without one.", "rad/s", head="ω against gyro, rmse")
    ]
    centripetal: Annotated[Agreement | None, figure("Centripetal terms against the gyro; null without one.")]
    disagreement: Annotated[
        _Figures, figure("Disagreement of the channels; null where it is not measured.", json=Disagreement | None)
    ] = None
    restarts: Annotated[int | None, figure("How often the filter started again; null of methods without a filter.")] = (
        None
    )
    sign_undecided_samples: Annotated[
        int | None, figure("Samples whose sign of the rate is not decided.", head="samples with undecided sign")
    ] = None
    consistency: Annotated[
        _Figures, figure("Innovations against what the filter states; null without one.", json=Consistency | None)
    ] = None
    mounting: Annotated[
        _Figures, figure("Constants of the mounting that were estimated; null: it is exact.", json=MountingFit | None)
    ] = None
    position: Annotated[PositionSummary | None, figure("Where navigation ends; null without --position.")] = None
    at_rest: Annotated[ForceAtRest | None, figure("Specific force at the first rest; null without a rest.")] = None
    health: Annotated[
        _Figures, figure("Health of the channels; null of methods that do not watch it.", json=ChannelHealth | None)
    ] = None
    faults: Annotated[
        tuple[Mapping[str, Any], ...], figure("Faults, an entry for each channel.", json=list[FaultEntry])
    ] = ()
    channels_left_out: Annotated[tuple[str, ...], figure("Dead channels that were not used.")] = ()
    warnings: Annotated[tuple[str, ...], figure("What speaks against these figures.")] = ()

    __repr__ = short_repr

    def shown(self) -> Iterator[Table | str | Line]:
        """Yield the tables and sentences that people read."""
        main = figures(f"{self.array}, method {self.method}, {self.form} form", self)
        agreement = () if self.centripetal is None else figures("", self.centripetal).rows
        yield replace(main, rows=[*main.rows, *agreement, *self._rows_of_the_filter(), *self._rows_of_the_channels()])
        if self.at_rest is not None:
            yield self.at_rest.table(has_tacho=self.tacho_rmse_rad_s is not None)
        if self.position is not None:
            yield self.position.table()
        if self.mounting is not None:
            yield table(
                "Mounting, estimated with the rotation: corrections to the array file",
                [FittedConstant(**constant) for constant in self.mounting["constants"]],
                "name value std prior_std",
                note="Units are in the names; rotations and levers in body axes.",
            )
            for line in self.mounting["undetermined_combinations_in_prior_std"]:
                yield f"- not determined by these data (each in units of its prior std): {line}"
        for warning in self.warnings:
            yield Line(f"WARNING {warning}", "yellow")

    def _rows_of_the_filter(self) -> Iterator[tuple[str, object, str]]:
        if self.disagreement is not None:
            share, times = self.disagreement["share"], self.disagreement["times"]
            size = f"{times:.2g} times in {share:.0%} of the samples" if share else "below 2"
            yield "noise measured, times the stated", size, ""
        if self.restarts:
            yield "filter started again", self.restarts, "times"
        if self.consistency is not None:
            nis, bound = self.consistency["nis"], self.consistency["bound"]
            yield "innovations squared over stated (NIS)", f"{nis:.3f}", f"≤ {bound:.3f}"
            yield "innovations", "consistent" if self.consistency["consistent"] else "INCONSISTENT", ""
            if self.consistency["worst_channel"] is not None:
                yield "channel that disagrees most", self.consistency["worst_channel"], ""

    def _rows_of_the_channels(self) -> Iterator[tuple[str, object, str]]:
        if self.health is not None:
            faulty = dict.fromkeys(name for fault in self.health["faults"] for name in fault["channels"])
            yield "channels that contradict the others", ", ".join(faulty) or "none", ""
        stuck = dict.fromkeys(fault["channel"] for fault in self.faults if fault["kind"] == "stuck")
        if stuck:
            yield "channels stuck for a while", ", ".join(stuck), ""
        if self.channels_left_out:
            yield "channels left out", ", ".join(self.channels_left_out), ""


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
    known = np.isfinite(estimate.omega).all(axis=1)
    if np.isfinite(estimate.p).any():  # else the array is one that does not see p at all
        known &= np.isfinite(estimate.p).all(axis=1)
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
        angle_std_rad=None if estimate.angle_std is None else float(estimate.angle_std[last]),
        attitude_std_rad=None if estimate.attitude_std is None else estimate.attitude_std[last],
        tacho_rmse_rad_s=None if tacho is None else _rms_difference(estimate.omega @ axis, tacho),
        gyro_rmse_rad_s=None if gyro is None else _rms_difference(estimate.omega, gyro),
        centripetal=None if unseen_motions(array) else centripetal_agreement(recording, array),
        disagreement=estimate.metadata.get("disagreement"),
        restarts=estimate.metadata.get("channels", {}).get("restarts"),
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
        position_std_m=None if estimate.position_std is None else estimate.position_std[known[-1]],
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
