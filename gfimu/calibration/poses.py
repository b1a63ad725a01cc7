"""The poses of a recording: its stretches of rest, or its rows where it is a table of poses.

In a table every row is the mean of one pose, as laboratories write them down, and no sample of a series.

Rows of a series at rest repeat one another within the noise; rows of a table jump by a good part of gravity and lie on
a sphere all the same. The noise of a row is stated, or follows from the residuals of the fit: with ν surplus
conditions and the variance factor s² of a first fit, the covariance is scaled by s² ν/(ν − 2), the variance of
Student's t, so that normalised errors have a mean square of one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError, check_name
from gfimu.calibration.coverage import fit_sphere
from gfimu.calibration.faults import check_readings, without_moved_poses
from gfimu.calibration.given import CalibrationPoses
from gfimu.calibration.nonlinearity import quadratic_std
from gfimu.calibration.observations import Observations, observations_from
from gfimu.calibration.result import Calibration
from gfimu.recording import Recording
from gfimu.recording.rest import Rest, detect_rest

__all__ = [
    "ROWS",
    "UNTIMED",
    "PosesFound",
    "TablePolicy",
    "find_poses",
    "is_pose_table",
    "pose_rests",
    "table_fit",
    "table_poses",
]

ROWS = ("auto", "poses", "samples")
"""What the rows of a recording are: judged by the data, one pose each, or samples of a series."""

UNTIMED = "untimed_rows"
"""Key of the metadata of a recording whose file has no times, so that its rows can't be a series."""


@dataclass(frozen=True)
class TablePolicy:
    """When rows are poses."""

    fewest: int = 4  # rows: a sphere goes through any four
    jump: float = 0.05  # of gravity, between half the neighbouring rows: 3° of tilt, beyond the noise of any sample
    round: float = 0.1  # of gravity, rms distance from a sphere: gains within 10 %; a motion adds its own force
    contradiction: float = 1e-3  # probability of a misfit at which a stated noise is scaled up
    passes: int = 3  # fits, of which each states the noise of the next


_POLICY = TablePolicy()


@dataclass(frozen=True)
class PosesFound:
    """Poses of a recording, what to warn of, how they were found, and whether its rows are they."""

    observations: Observations
    warnings: tuple[str, ...]
    statistics: Mapping[str, float | str]
    is_table: bool


def find_poses(
    recording: Recording,
    array: AccelerometerArray | None,
    gravity: float,
    asked: CalibrationPoses,
    min_rest_s: float = 1.0,
) -> PosesFound:
    """Find the poses of a recording.

    Parameters
    ----------
    recording : Recording
        A series with rests, or a table of poses; three channels per chip.
    array : AccelerometerArray or None
        The array, whose parts state how much axes bend.
    gravity : float
        Local gravity, m/s².
    asked : CalibrationPoses
        What is to be used.
    min_rest_s : float
        Shortest pose of a series where ``asked`` has none, s.

    Raises
    ------
    InputError
        If there is no rest, a channel is stuck, or the rows of a table are no poses at rest.
    """
    if is_table := is_pose_table(recording, asked.rows):
        observations, warnings = table_poses(recording, asked.row_noise_m_s2, gravity)
        statistics: dict[str, float | str] = {}
    else:
        rest = detect_rest(recording, threshold=asked.rest_threshold, min_duration_s=asked.min_rest_s or min_rest_s)
        stuck = check_readings(recording, rest)
        rest, moved = without_moved_poses(recording, rest)
        observations, warnings = observations_from(recording, rest, asked.input_kind, **asked.wavelet), (*stuck, *moved)
        statistics = {
            "rest_threshold": rest.threshold,
            "rest_threshold_chosen_by": "data" if rest.chosen_by_data else "user",
            "poses_found": float(len(rest)),
        }
    observations = replace(observations, quadratic_std=quadratic_std(recording, array))
    return PosesFound(observations, warnings, statistics, is_table)


def pose_rests(recording: Recording, *, threshold: float | None = None, min_duration_s: float = 1.0) -> Rest:
    """Stretches of rest of a recording, or the complete rows of a table of poses, each by itself."""
    if not is_pose_table(recording, "auto"):
        return detect_rest(recording, threshold=threshold, min_duration_s=min_duration_s)
    rows = np.flatnonzero(np.isfinite(recording.readings).all(axis=1))
    return Rest(rows, rows + 1, np.inf, True, 1, recording.unit)


def is_pose_table(recording: Recording, rows: str) -> bool:
    """Whether every row of a recording is a pose: as ``rows`` states (`ROWS`), or by the data.

    Raises
    ------
    InputError
        If ``rows`` is none of `ROWS`.
    """
    check_name("kind of rows", rows, ROWS)
    if rows != "auto" or UNTIMED in recording.metadata:
        return rows != "samples"
    values = recording.readings[np.isfinite(recording.readings).all(axis=1)]
    try:
        radius, scatter = _sphere(values)
    except InputError:
        return False
    jumps = np.linalg.norm(np.diff(values[:, :3], axis=0), axis=1)
    return bool(np.median(jumps) > _POLICY.jump * radius and scatter < _POLICY.round * radius)


def table_poses(
    recording: Recording, row_noise_m_s2: float | None, gravity: float
) -> tuple[Observations, tuple[str, ...]]:
    """Take every row as a pose; rows with a missing value and exact copies of a row are left out, with a warning.

    Parameters
    ----------
    recording : Recording
        One row per pose, three channels per chip.
    row_noise_m_s2 : float, optional
        Standard deviation of every reading, m/s².
    gravity : float
        Local gravity, m/s².

    Raises
    ------
    InputError
        If the rows lie on no sphere, so that they are no poses at rest, or the noise is not positive.
    """
    if row_noise_m_s2 is not None and not 0.0 < row_noise_m_s2 < np.inf:
        raise InputError(f"--row-noise {row_noise_m_s2:g}: a standard deviation is positive")
    if len(recording.channels) % 3:
        raise InputError(f"{len(recording.channels)} channels are not three per chip; these methods need whole triads")
    complete = np.isfinite(recording.readings).all(axis=1)
    _, first = np.unique(recording.readings, axis=0, return_index=True)
    single = np.isin(np.arange(len(recording)), first)
    warnings = [
        f"rows {', '.join(map(str, np.flatnonzero(out)[:10] + 1))} {why}; left out"
        for out, why in ((~complete, "lack a value"), (complete & ~single, "repeat another one to the last digit"))
        if out.any()
    ]
    kept = np.flatnonzero(complete & single)
    means = recording.readings[kept]
    radius, scatter = _sphere(means)
    if scatter > _POLICY.round * radius:
        raise InputError(
            f"the {len(means)} rows lie on no sphere (they scatter by {scatter / radius:.0%} of its radius): they are "
            "one pose alone, or no poses at rest; --rows samples takes them as a series"
        )
    noise = _POLICY.jump * 0.1 * radius if row_noise_m_s2 is None else row_noise_m_s2 * radius / gravity
    poses = Observations.from_means(
        means, noise**2 * np.eye(means.shape[1]), unit=recording.unit, channels=recording.channels
    )
    return replace(poses, start_s=recording.t_s[kept], kind="rows"), tuple(warnings)


def table_fit(
    fit: Callable[[Observations], Calibration], poses: Observations, row_noise_m_s2: float | None
) -> Calibration:
    """Fit a table of poses, with its own noise from the residuals where none is stated or they contradict it.

    Raises
    ------
    InputError
        If the rows are as many as the parameters, so that their noise can't be estimated.
    """
    result = fit(replace(poses, variance_factor=1.0))
    for _ in range(_POLICY.passes - 1):
        freedom, factor = (float(result.statistics[key]) for key in ("redundancy", "variance_factor"))
        if row_noise_m_s2 is not None:
            agrees = not factor > chdtri(freedom, _POLICY.contradiction) / freedom
            return result if agrees else fit(replace(poses, variance_factor=factor))
        if not freedom > 0.0:
            raise InputError(
                f"{poses.n_poses} rows don't show their own noise beside the parameters; state it: --row-noise, m/s²"
            )
        scaled = poses.covariance * factor * freedom / max(freedom - 2.0, 1.0)
        poses = replace(poses, covariance=scaled, variance_factor=1.0)
        result = fit(poses)
    noise = float(np.sqrt(np.einsum("pcc->", poses.covariance) / poses.covariance[:, 0].size))
    return replace(result, statistics={**result.statistics, f"row_noise_{poses.unit}": noise})


def _sphere(values: NDArray[np.float64]) -> tuple[float, float]:
    """Radius of the sphere through the first triad's rows, and their rms distance from it; raises as `fit_sphere`."""
    centre, radius = fit_sphere(values[:, :3])
    return radius, float(np.sqrt(np.mean((np.linalg.norm(values[:, :3] - centre, axis=1) - radius) ** 2)))
