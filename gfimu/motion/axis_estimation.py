"""Motion about one known axis from a recording: rate, angle, angular acceleration, with standard deviations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import OMEGA_PRODUCTS, AccelerometerArray
from gfimu.array.parts.part import white_noise_std
from gfimu.array.turning_axis import TurningAxis
from gfimu.base.errors import InputError
from gfimu.base.version import __version__
from gfimu.motion.attitude import from_rotation
from gfimu.motion.estimate import FORMAT_VERSION, Estimate
from gfimu.rate.axis.accuracy.bounds import require_visible
from gfimu.rate.axis.fit import fit_axis
from gfimu.rate.axis.problem import AxisProblem
from gfimu.rate.axis.recursion import smooth_axis
from gfimu.rate.axis.rest import begins_at_rest
from gfimu.recording import Recording
from gfimu.recording.carried_array import array_metadata
from gfimu.recording.doubts.doubt import Doubt
from gfimu.recording.doubts.judge import doubts_of, without_doubtful

__all__ = ["estimate_about_axis"]

_UNDECIDED = 5.0  # nats: below it the sign of the rate is not decided
_GIVES = "rate, angle and angular acceleration about the axis, and the specific force where the channels show it"


def estimate_about_axis(
    recording: Recording,
    array: AccelerometerArray,
    axis: TurningAxis,
    *,
    at_rest: bool | None = None,
    smooth: bool = False,
    noise_std: ArrayLike | None = None,
    findings: Sequence[Doubt] | None = None,
) -> Estimate:
    """Estimate a rotation about one known axis, with as few as one tri-axial chip.

    Parameters
    ----------
    recording : Recording
        Readings in m/s².
    array : AccelerometerArray
        The array: places and axes of its chips.
    axis : TurningAxis
        The axis, and whether it stands still or moves with a body.
    at_rest : bool
        Whether the body is at rest at the first sample, else the start is searched, and the sign of the rate with it;
        by default whether the first half second is rest (`gfimu.rate.axis.rest.begins_at_rest`).
    smooth : bool
        Whether later samples are used for earlier ones (Rauch, Tung and Striebel).
    noise_std : array_like, scalar or shape (c,), optional
        Standard deviation of one sample of each channel, m/s²; by default from the parts' data sheets. Its scale is
        learnt from the innovations.
    findings : sequence of Doubt, optional
        What `gfimu.recording.doubts.judge.doubts_of` found, if it was run already.

    Returns
    -------
    Estimate
        ``omega`` lies along the axis; its metadata hold the axis, what was learnt, and the sign's log odds.

    Raises
    ------
    GeometryError
        If the array can't see the rotation.
    InputError
        If the recording is too short.
    """
    require_visible(array, axis)
    if len(recording) < 20:
        raise InputError("a recording of fewer than twenty samples shows no rotation; record longer")
    doubts = doubts_of(recording, array) if findings is None else findings
    recording = without_doubtful(recording, array, doubts)
    t, y = recording.t_s, np.ascontiguousarray(recording.for_array(array))
    noise = white_noise_std(array, recording.sample_rate) if noise_std is None else np.asarray(noise_std, dtype=float)
    noise = np.ascontiguousarray(np.broadcast_to(noise, array.n_channels))
    if at_rest is None:
        at_rest = begins_at_rest(y, array, axis, noise, 1.0 / recording.sample_rate, recording.metadata)
    fit = fit_axis(t, y, array, axis, noise, at_rest=at_rest)
    one, channels, mounted = fit.settings, fit.channels, fit.mounting
    slopes = None if mounted is None else mounted.mounting.slopes(mounted.values)
    run = fit.on(AxisProblem(t, y, channels, noise)).run(one, fit.start, fit.start_covariance, slopes=slopes)
    found = smooth_axis(t, run, fit.mirrored) if smooth else (run.states, run.covariances, run.by_constants)
    # All noises larger by one factor leave the gains as they are: the innovations say by how much.
    mean_square = run.squares / max(run.readings, 1)
    states, variance = found[0], max(mean_square, 1.0) * found[1][:, 1, 1]
    if mounted is not None:
        by_rate = found[2][:, 1]  # (n, m)
        variance = variance + np.einsum("ni,ij,nj->n", by_rate, mounted.covariance, by_rate)
    u = axis.direction
    omega, alpha = np.outer(states[:, 1], u), np.outer(states[:, 2], u)
    std = np.sqrt(np.maximum(variance, 0.0))
    warnings = [one.text for one in doubts if one.is_no_reading]
    left = y - channels.offset - np.outer(states[:, 2], channels.by_acceleration)
    left = left - np.outer(states[:, 1] ** 2, channels.by_square)
    products = np.column_stack(
        [omega[:, "xyz".index(a)] * omega[:, "xyz".index(b)] for a, b in (tuple(pair) for pair in OMEGA_PRODUCTS)]
    )
    sign = "decided" if fit.sign_log_odds > _UNDECIDED else "undecided"
    undecided = "the sign of the rate is not decided by these data; a run that starts at rest decides it"
    return Estimate(
        t_s=t,
        p=_force(left, channels.force) @ channels.frame,
        alpha=alpha,
        omega=omega,
        omega_std=np.outer(std, np.abs(u)),
        quaternion=_attitude(states[:, 0], one.inclination, channels.frame),
        angle=states[:, 0] - states[0, 0],
        omega_products=products,
        omega_products_std=np.abs(2.0 * products) * (std / np.maximum(np.abs(states[:, 1]), 1e-9))[:, None],
        metadata={
            **array_metadata(array),
            "method": "smoother about a known axis" if smooth else "filter about a known axis",
            "form": "one axis",
            "gives": _GIVES,
            "turning_axis": replace(axis, inclination=one.inclination).to_dict(),
            "noise_over_data_sheet": one.noise_scale,
            "hub_std_m_s2": one.hub,
            "sign": sign,
            "sign_log_odds": fit.sign_log_odds if np.isfinite(fit.sign_log_odds) else None,
            "mean_normalised_innovation_squared": mean_square,
            **({} if mounted is None else {"mounting": mounted.to_dict()}),
            "warnings": [*warnings, *([] if sign == "decided" else [undecided])],
            "channels_left_out": [],
            "mounting_rotvec_rad": recording.mounting_rotvec.tolist(),
            "format_version": FORMAT_VERSION,
            "software_version": __version__,
        },
    )


def _force(left: NDArray[np.float64], force: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the specific force of the axis along u, e₁, e₂ from what rotation leaves of the channels, (n, 3)."""
    known = np.isfinite(left).all(axis=1)
    found = np.full((len(left), 3), np.nan)
    if np.linalg.matrix_rank(force) == 3:
        found[known] = left[known] @ np.linalg.pinv(force).T
    return found


def _attitude(angle: NDArray[np.float64], inclination: float, frame: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return quaternions (w, x, y, z), body to world, (n, 4): the world's z is up, its heading that of the axis.

    At angle θ up has the components (cos ι, sin ι cos θ, −sin ι sin θ) along u, e₁, e₂.
    """
    tilted = Rotation.from_rotvec([0.0, inclination, 0.0])  # takes z, the axis upright, to the axis as it stands
    turned = Rotation.from_rotvec(np.outer(angle, [0.0, 0.0, 1.0]))
    to_axis = Rotation.from_matrix(np.array([-frame[1], -frame[2], frame[0]]))  # body to (−e₁, −e₂, u)
    return from_rotation(tilted * turned * to_axis)
