"""Estimate the motion of an accelerometer array from a recording: p, α, ω, attitude and table angle.

The steps are those of the GF-IMU paper: the regression matrix turns readings into p and α (step 5), a method turns α
into ω (step 10), and ω turns into attitude and angle. Beside them stands what the null space says about ω without any
integration: the six products of its components.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.array.linear_solution import linear_solution
from gfimu.array.parts.part import white_noise_std
from gfimu.base.errors import InputError
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.base.version import __version__
from gfimu.motion.attitude import from_rotation, integrate_attitude, table_angle, to_rotation
from gfimu.motion.channel_health import UsedReadings, watched_readings
from gfimu.motion.earth import EarthRotation
from gfimu.motion.estimate import FORMAT_VERSION, Estimate
from gfimu.motion.navigation import level, navigate
from gfimu.motion.references import references_of, require_references
from gfimu.rate.path_start import PathStart
from gfimu.rate.problem import RateProblem, RateSolution
from gfimu.rate.registry import rate_method
from gfimu.rate.result import BodyPath
from gfimu.rate.sensing import SensorErrors, calibrated_bias_std, step_of_readings
from gfimu.rate.solve import solve_rate
from gfimu.recording import Recording
from gfimu.recording.carried_array import array_metadata
from gfimu.recording.doubts.doubt import Doubt
from gfimu.recording.doubts.judge import dead_channels, doubts_of, refuse_or_warn, without_doubtful

__all__ = ["Estimate", "estimate"]

_LEVEL_SECONDS = 1.0


def estimate(
    recording: Recording,
    array: AccelerometerArray,
    *,
    method: str = "integrate",
    form: str = "auto",
    omega0: ArrayLike | None = None,
    quaternion0: ArrayLike | None = None,
    noise_std: ArrayLike | None = None,
    levelled: bool = False,
    with_position: bool = False,
    earth: EarthRotation | None = None,
    gravity: float = STANDARD_GRAVITY,
    use: Sequence[str] = (),
    force: bool = False,
    keep_faulty: bool = False,
    findings: Sequence[Doubt] | None = None,
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
        How readings turn into α and p; see `gfimu.array.linear_solution`.
    omega0 : array_like, shape (3,), or None
        Angular rate at the first sample, body axes, rad/s, zeros for rest. By default it is inferred from the first
        readings; ``integrate`` starts at rest.
    quaternion0 : array_like, shape (4,), optional
        Attitude (w, x, y, z) at the first sample. By default the recording's mounting, or without one the attitude
        that levels the mean of p over the first second, with heading zero; good if the origin is not accelerated then.
    noise_std : array_like, scalar or shape (c,), optional
        Standard deviation of one sample of each channel, m/s²; by default from the parts' data sheets.
    levelled : bool
        Whether the biases of the first rest, on a level table, were taken off the readings.
    with_position : bool
        Whether to integrate p to velocity and position as well, from rest at the origin.
    earth : EarthRotation, optional
        The Earth's rotation at the place: a body that starts at rest turns with it, and attitude, angle, velocity and
        position are those in the world that turns. ω stays what the array measures, the rate against the stars.
    gravity : float
        Local gravity for the position, m/s².
    use : sequence of str
        References of the recording that a recursive method uses as well, of
        `gfimu.recording.quantities.ESTIMATE_REFERENCES`.
    force : bool
        Whether to go on with a recording that its checks refuse; what they found is kept as a warning.
    keep_faulty : bool
        Use every channel, without looking for faulty ones. By default recursive methods leave out channels
        that contradict the others, while they do so (`gfimu.rate.health`): from the first sample after a rest, else
        from when the rate has settled.
    findings : sequence of Doubt, optional
        What `gfimu.recording.doubts.judge.doubts_of` found, if it was run already.
    progress : callable, optional
        Called with the share of the work that recursive methods have done so far, 0 to 1.

    Returns
    -------
    Estimate
        Its metadata hold ``warnings`` and, with recursive methods, ``consistency``
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
    found = refuse_or_warn(doubts_of(recording, array) if findings is None else findings, force=force)
    # The watch of the recursive methods finds frozen channels by itself; without one the others may diverge.
    found = tuple(one for one in found if one.kind != "frozen" or not chosen.recursive)
    known = [one for one in found if one.kind != "frozen"]
    recording = without_doubtful(recording, array, [one for one in known if one.kind != "clipped"])
    missing = np.isnan(recording.for_array(array))  # (n, c)
    recording = without_doubtful(recording, array, known)
    readings = recording.for_array(array)
    saturated = np.isnan(readings) & ~missing
    rate0 = None if omega0 is None else np.asarray(omega0, dtype=float)
    for name in use:
        chosen.refuse_references(name)
    require_references(recording, use)
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

    temperature = recording.reference.get("temperature_degC")
    errors = SensorErrors.of_recording(
        array, recording.metadata, recording.sample_rate, step=step_of_readings(readings), noise_std=noise,
    )  # fmt: skip
    references = references_of(recording, use, _table_axis(recording), errors)
    path_start = _path_start(recording, quaternion0, gravity, earth, level=levelled)
    problem = RateProblem(
        array, recording.t_s, readings, errors, calibrated_bias_std(recording.metadata, array) is not None,
        linear, rate0, references, temperature, path_start, levelled, progress,
    )  # fmt: skip
    dead = dead_channels(found)
    warnings = [one.text for one in found if not one.is_minor]
    at_rest = chosen.open_loop if rate0 is None else not rate0.any()
    if earth is not None and at_rest:  # at rest a body turns with the Earth
        first = _initial_attitude(recording, linear.motion, np.zeros((len(readings), 3)), quaternion0)
        problem = replace(problem, omega0=earth.in_body(first))
    try:
        rate = solve_rate(chosen, problem)
    except InputError as error:
        if not dead or chosen.recursive:
            raise
        names = ", ".join(dead)
        raise InputError(f"without the dead {names}: {error}; --method filter may do without it") from None
    scale = np.ones(len(readings)) if rate.noise_scale is None else rate.noise_scale
    if rate.path is None or chosen.open_loop:
        motion = linear.with_omega(rate.omega)
        start = _initial_attitude(recording, motion, rate.omega, quaternion0)
        path = _integrated(recording, motion, rate, start, gravity, earth)
        if rate.path is not None:
            path |= {name: value for name, value in _followed(rate.path, rate.omega).items() if name.endswith("_std")}
    else:
        path = _followed(rate.path, rate.omega)
    if not with_position:
        path |= dict.fromkeys(("velocity", "velocity_std", "position", "position_std"))
    return Estimate(
        t_s=recording.t_s,
        omega=rate.omega,
        omega_std=rate.omega_std,
        omega_products=linear.omega_products,
        omega_products_std=linear.omega_products_std * scale[:, None],
        **path,
        health=used.codes(array),
        sign_probability=rate.sign_probability,
        metadata={
            **array_metadata(array),
            "method": method,
            "form": linear.form,
            **rate.remarks,
            "warnings": [*warnings, *used.sentences(array), *rate.sentences()],
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


def _path_start(
    recording: Recording, attitude: ArrayLike | None, gravity: float, earth: EarthRotation | None, *, level: bool
) -> PathStart:
    """Return where the path starts: at the attitude given or mounted, exactly on a ``level`` table, else levelled."""
    start = PathStart(axis=_table_axis(recording), gravity=gravity)
    if earth is not None:
        start = replace(start, earth=earth.rate)
    if attitude is not None:
        return replace(start, attitude=np.asarray(attitude, dtype=float))
    if "mounting_rotvec_rad" not in recording.metadata:
        return start
    mounted = from_rotation(Rotation.from_rotvec(recording.mounting_rotvec))
    return replace(start, attitude=mounted, attitude_std=0.0 if level else start.policy.mounting_std)


def _table_axis(recording: Recording) -> NDArray[np.float64]:
    """Return the table's axis in body axes, shape (3,)."""
    return np.asarray(Rotation.from_rotvec(recording.mounting_rotvec).inv().apply([0.0, 0.0, 1.0]))


def _followed(path: BodyPath, omega: NDArray[np.float64]) -> dict[str, Any]:
    """Return the columns of an estimate by a method that follows the path, where it has a rate."""
    known = path.known_at(np.asarray(np.isfinite(omega).all(axis=1)))
    return {one.name: getattr(known, one.name) for one in fields(known)}


def _integrated(
    recording: Recording,
    motion: NDArray[np.float64],
    rate: RateSolution,
    start: NDArray[np.float64],
    gravity: float,
    earth: EarthRotation | None,
) -> dict[str, Any]:
    """Return the columns of an estimate by integration of [α; p] (n, 6) and of the rate, without uncertainty."""
    t, alpha, p = recording.t_s, motion[:, :3], motion[:, 3:]
    quaternion, turning = integrate_attitude(t, rate.omega, alpha, start), rate.omega
    if earth is not None:
        quaternion = earth.attitude_in_world(t, quaternion)
        turning = rate.omega - earth.in_body(quaternion)
    travelled = navigate(t, p, quaternion, gravity=gravity, earth=earth)
    return {
        "alpha": alpha,
        "p": p,
        "quaternion": quaternion,
        "angle": table_angle(t, turning, axis=_table_axis(recording)),
        "velocity": travelled.velocity,
        "position": travelled.position,
    }


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
