"""Estimate the motion of an accelerometer array from a recording: p, α, ω, attitude and table angle.

The steps are those of the GF-IMU paper: the regression matrix turns readings into p and α (step 5), a method turns α
into ω (step 10), and ω turns into attitude and angle. Beside them stands what the null space says about ω without any
integration: the six products of its components.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from gfimu import __version__
from gfimu.errors import InputError
from gfimu.files.column_file import open_columns, write_columns
from gfimu.files.table import ArrowStream
from gfimu.geometry.array import OMEGA_PRODUCTS, AccelerometerArray
from gfimu.geometry.linear_solution import linear_solution
from gfimu.motion.attitude import from_rotation, integrate_attitude, table_angle, to_rotation
from gfimu.motion.channel_health import UsedReadings, step_of_readings, watched_readings
from gfimu.motion.earth import EarthRotation
from gfimu.motion.navigation import level, navigate
from gfimu.motion.rest_navigation import navigate_with_rest
from gfimu.parts.part import white_noise_std
from gfimu.rate.consistency import judge_consistency
from gfimu.rate.disagreement import MeasuredNoise, sum_up_disagreement
from gfimu.rate.feedback import integrate_rate_recursively
from gfimu.rate.integration import integrate_rate
from gfimu.rate.kalman import FilterSettings
from gfimu.rate.methods import estimate_rate
from gfimu.rate.problem import RateProblem, RateSolution
from gfimu.rate.registry import RateMethod, rate_method
from gfimu.rate.result import RateEstimate, undecided
from gfimu.rate.sensing import SensorErrors
from gfimu.recording import Recording
from gfimu.recording.carried_array import array_metadata
from gfimu.recording.checks import Finding, check_recording, refuse_or_warn, without_dead_channels
from gfimu.recording.clipping import without_clipped
from gfimu.results import Panel, RunResult, Series, axis_series
from gfimu.short_repr import joined, timing
from gfimu.units import STANDARD_GRAVITY

__all__ = ["Estimate", "estimate"]

FORMAT_VERSION = 1
_AXES = ("x", "y", "z")
_LEVEL_SECONDS = 1.0


@dataclass(frozen=True)
class Estimate(RunResult):
    """Motion of the body at each sample of a recording; NaN where it could not be estimated.

    Parameters
    ----------
    t_s : ndarray, shape (n,)
        Sample times, s.
    p : ndarray, shape (n, 3)
        Specific force of the body origin, body axes, m/s².
    alpha : ndarray, shape (n, 3)
        Angular acceleration, body axes, rad/s².
    omega, omega_std : ndarray, shape (n, 3)
        Angular rate and its standard deviation by the channels' white noise, enlarged where they disagree by more
        (`gfimu.rate.disagreement`), body axes, rad/s.
    quaternion : ndarray, shape (n, 4)
        Attitude (w, x, y, z), body to world.
    angle : ndarray, shape (n,)
        Angle turned about the table's axis since the first sample, rad, not wrapped.
    omega_products, omega_products_std : ndarray, shape (n, 6)
        Products of ω from the null space, in the order `gfimu.geometry.array.OMEGA_PRODUCTS`, and their standard
        deviation, rad²/s²; NaN where the array doesn't see one.
    velocity, position : ndarray, shape (n, 3), optional
        Velocity, m/s, and position, m, of the body origin in the world, where asked for.
    health : mapping of str to ndarray, optional
        For each channel by name its health at each sample, shape (n,): 0 used, 1 excluded, 2 missing, 3 saturated,
        4 stuck, 5 in doubt (`gfimu.integrity.fault.HealthCode`). None where the channels were not watched and all are
        used.
    sign_probability : ndarray, shape (n,), optional
        Probability that ``omega`` and not ``−omega`` is the rate; one half at rest. Where the method judges it.
    metadata : mapping
        Array, method, form, format and software version.

    Examples
    --------
    >>> import gfimu
    >>> estimate = gfimu.estimate(gfimu.simulate("paper_run", seed=1), rest_bias=True)
    >>> estimate.omega.shape
    (3000, 3)
    >>> estimate.to_pandas().columns[:3].tolist()
    ['t_s', 'p_x_m_s2', 'p_y_m_s2']
    """

    t_s: NDArray[np.float64]
    p: NDArray[np.float64]
    alpha: NDArray[np.float64]
    omega: NDArray[np.float64]
    omega_std: NDArray[np.float64]
    quaternion: NDArray[np.float64]
    angle: NDArray[np.float64]
    omega_products: NDArray[np.float64]
    omega_products_std: NDArray[np.float64]
    velocity: NDArray[np.float64] | None = None
    position: NDArray[np.float64] | None = None
    health: Mapping[str, NDArray[Any]] | None = None
    sign_probability: NDArray[np.float64] | None = None
    metadata: Mapping[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.t_s)

    def __repr__(self) -> str:
        names = [str(self.metadata[key]) for key in ("array", "method") if key in self.metadata]
        return joined(self, [*names, timing(self.t_s), "with position" if self.position is not None else ""])

    def _facts(self) -> list[tuple[str, str]]:
        facts = [(key, str(self.metadata[key])) for key in ("array", "method", "form") if key in self.metadata]
        known = np.flatnonzero(np.isfinite(self.omega).all(axis=1))
        facts.append(("samples", timing(self.t_s)))
        if known.size:
            last = known[-1]
            rate, std = (", ".join(f"{one:.4g}" for one in values[last]) for values in (self.omega, self.omega_std))
            facts += [("rate at the end", f"({rate}) rad/s"), ("its standard deviation", f"({std}) rad/s")]
        turned = self.angle[np.isfinite(self.angle)]
        if turned.size:
            facts.append(("angle turned", f"{turned[-1]:.5g} rad"))
        excluded = [name for name, health in (self.health or {}).items() if (health == 1).any()]
        return [*facts, ("channels excluded", ", ".join(excluded))] if excluded else facts

    def _notes(self) -> tuple[str, ...]:
        return tuple(str(one) for one in self.metadata.get("warnings", ()))

    def _panels(self) -> list[Panel]:
        panels = [
            Panel("angular rate", "ω, rad/s", axis_series(self.omega, self.omega_std), self.t_s),
            Panel("angular acceleration", "α, rad/s²", axis_series(self.alpha), self.t_s),
            Panel("specific force of the origin", "p, m/s²", axis_series(self.p), self.t_s),
            Panel("angle about the table's axis", "angle, rad", (Series("", self.angle),), self.t_s),
        ]
        for title, label, values in (
            ("velocity in the world", "velocity, m/s", self.velocity),
            ("position in the world", "position, m", self.position),
        ):
            if values is not None:
                panels.append(Panel(title, label, axis_series(values), self.t_s))
        return panels

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return the columns of the Estimate file, by name with unit."""
        columns: dict[str, NDArray[Any]] = {"t_s": self.t_s}
        for attribute, names in _VECTOR_COLUMNS.items():
            values = getattr(self, attribute)
            if values is not None:
                columns |= {name: values[:, place] for place, name in enumerate(names)}
        health = {f"{_HEALTH}{name}": values for name, values in (self.health or {}).items()}
        sign = {} if self.sign_probability is None else {_SIGN: self.sign_probability}
        return columns | sign | {"angle_rad": self.angle} | health

    @property
    def sign_undecided(self) -> NDArray[np.bool_]:
        """Samples whose rate has a sign that is not decided, shape (n,)."""
        if self.sign_probability is None:
            return np.zeros(len(self), dtype=np.bool_)
        return undecided(self.sign_probability, self.omega, self.omega_std)

    def write(self, path: str | Path) -> None:
        """Write the Estimate file, ``.csv`` or ``.parquet``, whole or not at all."""
        write_columns(path, self.to_columns(), self.metadata)

    @classmethod
    def read(cls, path: str | Path | ArrowStream) -> Estimate:
        """Read an Estimate file, or a table object with its columns.

        Raises
        ------
        InputError
            If the file can't be read, lacks a column, or has another format version.
        """
        table = open_columns(path)
        version = table.metadata.get("format_version", FORMAT_VERSION)
        if version != FORMAT_VERSION:
            raise InputError(
                f"{table.file}: Estimate format {version}; this gfimu reads {FORMAT_VERSION}: estimate again"
            )
        optional = {
            attribute for attribute in ("velocity", "position") if _VECTOR_COLUMNS[attribute][0] not in table.names
        }
        vectors = {attribute: names for attribute, names in _VECTOR_COLUMNS.items() if attribute not in optional}
        sign = [name for name in (_SIGN,) if name in table.names]
        watched = [name for name in table.names if name.startswith(_HEALTH)]
        wanted = ["t_s", "angle_rad", *(name for names in vectors.values() for name in names), *sign, *watched]
        missing = [name for name in wanted if name not in table.names]
        if missing:
            raise InputError(f"{table.file}: column {missing[0]} is missing; give a file that gfimu estimate wrote")
        blocks = [np.column_stack(block) for block in table.blocks(wanted)]
        if not blocks:
            raise InputError(f"{table.file}: no samples below the header; estimate again")
        values = dict(zip(wanted, np.concatenate(blocks).T, strict=True))
        return cls(
            t_s=values["t_s"],
            angle=values["angle_rad"],
            health={name.removeprefix(_HEALTH): values[name].astype(np.int8) for name in watched} or None,
            sign_probability=values[_SIGN] if sign else None,
            metadata=table.metadata,
            **{attribute: np.column_stack([values[name] for name in names]) for attribute, names in vectors.items()},
        )


_HEALTH = "health_"
_SIGN = "omega_sign_probability"

_VECTOR_COLUMNS: dict[str, tuple[str, ...]] = {
    "p": tuple(f"p_{axis}_m_s2" for axis in _AXES),
    "alpha": tuple(f"alpha_{axis}_rad_s2" for axis in _AXES),
    "omega": tuple(f"omega_{axis}_rad_s" for axis in _AXES),
    "omega_std": tuple(f"omega_{axis}_std_rad_s" for axis in _AXES),
    "quaternion": ("q_w", "q_x", "q_y", "q_z"),
    "omega_products": tuple(f"omega_{pair}_rad2_s2" for pair in OMEGA_PRODUCTS),
    "omega_products_std": tuple(f"omega_{pair}_std_rad2_s2" for pair in OMEGA_PRODUCTS),
    "velocity": tuple(f"velocity_{axis}_m_s" for axis in _AXES),
    "position": tuple(f"position_{axis}_m" for axis in _AXES),
}


def estimate(
    recording: Recording,
    array: AccelerometerArray,
    *,
    method: str = "integrate",
    form: str = "auto",
    omega0: ArrayLike | None = (0.0, 0.0, 0.0),
    quaternion0: ArrayLike | None = None,
    noise_std: ArrayLike | None = None,
    with_position: bool = False,
    earth: EarthRotation | None = None,
    gravity: float = STANDARD_GRAVITY,
    fuse_gyro: bool = False,
    force: bool = False,
    keep_faulty: bool = False,
    findings: Sequence[Finding] | None = None,
    progress: Callable[[float], object] | None = None,
) -> Estimate:
    """Estimate p, α, ω, attitude and table angle at every sample of a recording.

    Parameters
    ----------
    recording : Recording
        Readings in m/s². Samples that lack channels are solved from the others where those suffice.
    array : AccelerometerArray
        The array that was recorded.
    method : str
        Method for the angular rate, a key of `gfimu.rate.registry.RATE_METHODS`.
    form : {"auto", "linear", "joint", "recursive"}
        How readings turn into α and p; see `gfimu.geometry.linear_solution`.
    omega0 : array_like, shape (3,), or None
        Angular rate at the first sample, body axes, rad/s; None if it isn't known (``filter`` and ``smoother`` only).
    quaternion0 : array_like, shape (4,), optional
        Attitude (w, x, y, z) at the first sample. By default the recording's mounting, or without one the attitude
        that levels the mean of p over the first second, with heading zero; good if the origin is not accelerated then.
    noise_std : array_like, scalar or shape (c,), optional
        Standard deviation of one sample of each channel, m/s²; by default from the parts' data sheets.
    with_position : bool
        Whether to integrate p to velocity and position as well, from rest at the origin.
    earth : EarthRotation, optional
        The Earth's rotation at the place: a body that starts at rest turns with it, and attitude, angle, velocity and
        position are those in the world that turns. ω stays what the array measures, the rate against the stars.
    gravity : float
        Local gravity for the position, m/s².
    fuse_gyro : bool
        Whether ``filter`` and ``smoother`` use the recording's gyro as well.
    force : bool
        Whether to go on with a recording that its checks refuse; what they found is kept as a warning.
    keep_faulty : bool
        Use every channel, without looking for faulty ones. By default ``filter`` and ``smoother`` leave out channels
        that contradict the others, while they do so (`gfimu.integrity`): from the first sample after a rest, else
        from when the rate has settled.
    findings : sequence of Finding, optional
        What `gfimu.recording.checks.check_recording` found, if it was run already.
    progress : callable, optional
        Called with the share of the work that ``filter`` and ``smoother`` have done so far, 0 to 1.

    Returns
    -------
    Estimate
        Its metadata hold ``warnings`` and, with ``filter`` and ``smoother``, ``consistency``
        (`gfimu.rate.consistency.Consistency`).

    Raises
    ------
    InputError
        If the recording lacks channels, the method or form is unknown, no sample suffices for p and α, or the
        recording contradicts itself and another unit, order or array explains it (see ``force``).
    GeometryError
        If the array can't see all six motions; the message names those it can't.
    """
    chosen = rate_method(method)
    found = refuse_or_warn(check_recording(recording, array) if findings is None else findings, force=force)
    recording = without_dead_channels(recording, array, found)
    missing = np.isnan(recording.for_array(array))  # (n, c)
    recording, clipped = without_clipped(recording, array)
    found = (*found, *clipped)
    readings = recording.for_array(array)
    saturated = np.isnan(readings) & ~missing
    rate0 = None if omega0 is None else np.asarray(omega0, dtype=float)
    if rate0 is None:
        chosen.refuse_unknown_start()
    if fuse_gyro:
        chosen.refuse_gyro()
    if keep_faulty:
        chosen.refuse_keep_faulty()
    if rate0 is not None and (rate0.shape != (3,) or not np.isfinite(rate0).all()):
        raise InputError(f"omega0 is {omega0!r}; it must hold three finite numbers, in rad/s")
    noise = white_noise_std(array, recording.sample_rate) if noise_std is None else np.asarray(noise_std, dtype=float)
    noise = np.broadcast_to(noise, array.n_channels)
    used = UsedReadings(recording.t_s, missing, saturated)
    if chosen.recursive:
        calibrated = "calibration" in recording.metadata
        used = watched_readings(
            used, array, readings, noise, omega0=rate0, watch=not keep_faulty, calibrated=calibrated
        )
        readings = np.where(used.excluded, np.nan, readings)
    linear = linear_solution(array, readings, noise, form=form)
    usable = np.isfinite(linear.motion).all(axis=1)
    if not usable.any():
        raise InputError("no sample has enough channels for p and alpha; check the recording for missing readings")

    gyro = _gyro(recording) if fuse_gyro else None
    temperature = recording.reference.get("temperature_degC")
    problem = RateProblem(array, recording.t_s, readings, noise, linear, rate0, gyro, temperature, progress)
    dead = [name for finding in found if finding.kind == "dead" for name in finding.channels]
    if earth is not None and rate0 is not None and not rate0.any():  # at rest a body turns with the Earth
        first = _initial_attitude(recording, linear.motion, np.zeros((len(readings), 3)), quaternion0)
        problem = replace(problem, omega0=earth.in_body(first))
    try:
        rate = _solve_rate(chosen, problem)
    except InputError as error:
        if not dead or chosen.recursive:
            raise
        names = ", ".join(dead)
        raise InputError(f"without the dead {names}: {error}; --method filter may do without it") from None
    scale = np.ones(len(readings)) if rate.noise_scale is None else rate.noise_scale
    motion = linear.with_omega(rate.omega)
    alpha, p = motion[:, :3], motion[:, 3:]
    start = _initial_attitude(recording, motion, rate.omega, quaternion0)
    quaternion = integrate_attitude(recording.t_s, rate.omega, alpha, start)
    turning = rate.omega
    if earth is not None:
        quaternion = earth.attitude_in_world(recording.t_s, quaternion)
        turning = rate.omega - earth.in_body(quaternion)
    mounting = Rotation.from_rotvec(recording.mounting_rotvec)
    axis = mounting.inv().apply([0.0, 0.0, 1.0])  # the table's axis in body axes
    travelled = None
    if rate.rest is not None and rate.rest.any():  # gravity shows the tilt there, and the velocity is zero
        levelled = navigate_with_rest(recording.t_s, p, quaternion, rate.rest, gravity=gravity, earth=earth)
        quaternion = levelled.quaternion
        travelled = levelled if with_position else None
    elif with_position:
        travelled = navigate(recording.t_s, p, quaternion, gravity=gravity, earth=earth)
    return Estimate(
        t_s=recording.t_s,
        p=p,
        alpha=alpha,
        omega=rate.omega,
        omega_std=rate.omega_std,
        quaternion=quaternion,
        angle=table_angle(recording.t_s, turning, axis=axis),
        omega_products=linear.omega_products,
        omega_products_std=linear.omega_products_std * scale[:, None],
        velocity=None if travelled is None else travelled.velocity,
        position=None if travelled is None else travelled.position,
        health=used.codes(array),
        sign_probability=rate.sign_probability,
        metadata={
            **array_metadata(array),
            "method": method,
            "form": linear.form,
            **rate.remarks,
            "warnings": [finding.text for finding in found] + used.sentences(array) + rate.sentences(),
            "health": None if used.watch is None else used.watch.to_dict(),
            "faults": [entry for fault in used.faults(array) for entry in fault.entries()],
            "channels_left_out": dead,
            **({} if earth is None else earth.to_dict()),
            "gravity_m_s2": gravity,
            "mounting_rotvec_rad": recording.mounting_rotvec.tolist(),
            "format_version": FORMAT_VERSION,
            "software_version": __version__,
        },
    )


def _integrate(problem: RateProblem) -> RateSolution:
    """Integrate α from the first sample (paper, step 10 d); the variance of white noise adds up."""
    linear, t = problem.linear, problem.t_s
    start = np.zeros(3) if problem.omega0 is None else problem.omega0
    alpha = linear.motion[:, :3]
    leakage = linear.leakage[:, :3]
    if leakage.any():
        omega = integrate_rate_recursively(t, alpha, leakage, linear.pattern, start)
    else:
        omega = integrate_rate(t, alpha, start)
    return RateSolution(
        omega, np.sqrt(_integrated_variance(t, np.where(np.isnan(omega), np.nan, linear.alpha_variance)))
    )


def _solve_rate(method: RateMethod, problem: RateProblem) -> RateSolution:
    """Find the angular rate: the solution for α integrated, or the sensors' errors taken from their data sheets."""
    return _integrate(problem) if method.open_loop else _with_sensor_errors(method, problem)


def _with_sensor_errors(method: RateMethod, problem: RateProblem) -> RateSolution:
    """Run a method of `gfimu.rate.methods` with the sensors' errors from their data sheets."""
    problem, names = _of_living_channels(problem)
    rate = 1.0 / float(np.median(np.diff(problem.t_s)))
    step = step_of_readings(problem.readings)
    errors = SensorErrors.from_parts(problem.array, rate, step=step, noise_std=problem.noise_std)
    settings = FilterSettings(start_omega=problem.omega0)
    found = estimate_rate(
        problem.array, problem.t_s, problem.readings, errors, method=method.name, settings=settings,
        gyro=problem.gyro, progress=problem.progress,
    )  # fmt: skip
    disagreement = None if found.scale is None else sum_up_disagreement(found.scale, found.omega)
    remarks = {
        "sign": found.sign.state,
        "sign_undecided_samples": int(found.sign_undecided.sum()),
        "disagreement": None if disagreement is None else disagreement.to_dict(),
        "sign_decided_at_s": found.sign.decided_at_s if np.isfinite(found.sign.decided_at_s) else None,
        "mean_normalised_innovation_squared": found.mean_nis if np.isfinite(found.mean_nis) else None,
        "share_at_rest": float(found.rest.mean()),
        "channels": _renamed(found.channels.to_dict(), names),
    }
    if method.recursive:
        consistency = judge_consistency(
            problem.array, problem.readings, errors, found, temperature=problem.temperature,
            filter_again=_filter_again(problem, errors, found),
        )  # fmt: skip
        if consistency is not None and consistency.worst_channel is not None:
            consistency = replace(consistency, worst_channel=names[consistency.worst_channel])
        remarks["consistency"] = None if consistency is None else consistency.to_dict()
    std = np.where(np.isfinite(found.std), found.std, np.nan)
    probability = found.sign_probability
    if probability is None:
        probability = np.full(len(found), 0.5 if found.sign.state == "undecided" else 1.0)
    return RateSolution(found.omega, std, found.rest, found.scale, probability, remarks)


def _of_living_channels(problem: RateProblem) -> tuple[RateProblem, dict[str, str]]:
    """Return the problem without channels that never have a reading, where the others see all motions.

    An array of the others can recognise rest, which needs all of its channels. Its channels are numbered anew; the
    second value gives their real names.
    """
    array = problem.array
    alive: NDArray[np.bool_] = np.asarray(np.isfinite(problem.readings).any(axis=0))
    living = [name for name, lives in zip(array.channels, alive, strict=True) if lives]
    if alive.all() or np.linalg.matrix_rank(array.regression_matrix[alive] / _length_scale(array), tol=1e-6) < 6:
        return problem, {name: name for name in array.channels}
    chips = [replace(chip, axes=chip.axes[alive[array.chip_of_channel == k]]) for k, chip in enumerate(array.chips)]
    fewer = replace(array, chips=tuple(chip for chip in chips if len(chip.axes)))
    readings, noise = problem.readings[:, alive], problem.noise_std[alive]
    reduced = replace(problem, array=fewer, readings=readings, noise_std=noise)
    return reduced, dict(zip(fewer.channels, living, strict=True))


def _length_scale(array: AccelerometerArray) -> NDArray[np.float64]:
    return np.array([array.length_unit] * 3 + [1.0] * 3)


def _renamed(report: dict[str, Any], names: Mapping[str, str]) -> dict[str, Any]:
    """Return a channel report with the channels' real names."""
    return {
        key: {names[name]: count for name, count in value.items()} if isinstance(value, dict) else value
        for key, value in report.items()
    }


def _filter_again(
    problem: RateProblem, errors: SensorErrors, found: RateEstimate
) -> Callable[[slice, NDArray[np.float64]], RateEstimate]:
    """Return a filter of some rows with other readings that starts as the one before did, or from what it found."""
    stated = MeasuredNoise.as_stated(problem.t_s)

    def run(rows: slice, readings: NDArray[np.float64]) -> RateEstimate:
        if rows.start == 0 and problem.omega0 is not None:
            settings = FilterSettings(start_omega=problem.omega0, noise=stated)
        else:
            std = float(np.nan_to_num(found.std[rows.start]).max())
            settings = FilterSettings(found.omega[rows.start], max(std, 1e-3), noise=stated)
        gyro = None if problem.gyro is None else problem.gyro[rows]
        return estimate_rate(
            problem.array, problem.t_s[rows], readings, errors, method="filter", settings=settings, gyro=gyro
        )

    return run


def _integrated_variance(t: NDArray[np.float64], variance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Variance of the integral of white samples, each weighted with half the time to its neighbours; (n, 3)."""
    valid = np.isfinite(variance).all(axis=1)
    steps = np.diff(t[valid])
    squared = variance[valid]
    result = np.full_like(variance, np.nan)
    if not valid.any():
        return result
    half_before = np.concatenate([[0.0], steps / 2.0])[:, None]
    half_after = np.concatenate([steps / 2.0, [0.0]])[:, None]
    passed = np.cumsum(squared * (half_before + half_after) ** 2, axis=0)
    last = squared * (half_before**2 - (half_before + half_after) ** 2)  # the newest sample has no time after it yet
    result[valid] = np.maximum(passed + last, 0.0)
    result[np.argmax(valid)] = 0.0
    return result


def _gyro(recording: Recording) -> NDArray[np.float64]:
    """Return the recording's gyro, shape (n, 3), rad/s."""
    names = [f"gyro_{axis}_rad_s" for axis in _AXES]
    missing = [name for name in names if name not in recording.reference]
    if missing:
        raise InputError(f"the recording has no {', '.join(missing)}; record a gyro, or estimate without one")
    return np.column_stack([recording.reference[name] for name in names])


def _initial_attitude(
    recording: Recording, motion: NDArray[np.float64], omega: NDArray[np.float64], given: ArrayLike | None
) -> NDArray[np.float64]:
    """Attitude at the first sample: as given, else as mounted if the recording says so, else levelled."""
    if given is not None:
        return np.asarray(given, dtype=float)
    if "mounting_rotvec_rad" in recording.metadata:
        return from_rotation(Rotation.from_rotvec(recording.mounting_rotvec))
    known = np.flatnonzero(np.isfinite(motion).all(axis=1) & np.isfinite(omega).all(axis=1))
    if not known.size:
        raise InputError("p is unknown at every sample; check the recording for missing readings")
    t = recording.t_s[known]
    first = known[t < t[0] + _LEVEL_SECONDS]
    # Turn each p back into the axes of the first sample, so that a body that turns meanwhile is levelled too.
    turned = to_rotation(integrate_attitude(recording.t_s[first], omega[first], motion[first, :3]))
    return level(turned.apply(motion[first, 3:]))
