"""Calibration of a tri-axial gyro on a rate table: scale factors, misalignments and biases from stretches of one rate.

On a plateau the table turns at a rate w that its tachometer reads, about its vertical axis, which has the direction n
(up) in the body frame of the mounting. The gyro reads l = M ((w + e_v) n + e_h) + b, with e_v the vertical part of the
Earth's rate and e_h its horizontal part, which turns in the body as the table does. Mountings with n along three
different axes and two rates each determine M and b. What is uncertain of the true input goes into the covariance: the
noise of the tachometer, the tilt of each mounting, the heading of e_h, and e_v where the latitude is not given. The
equations are those of the Persian calibration paper's six positions (eqs 5-8), with rates of the table for gravity.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.gravity import EARTH_RATE
from gfimu.array.integration import integrate_samples
from gfimu.base.errors import InputError
from gfimu.base.units import GYRO_COLUMNS
from gfimu.calibration.error_model import free_elements
from gfimu.calibration.fit_quality import covariance_scale
from gfimu.calibration.known_poses import forward_design
from gfimu.calibration.observations import regular_covariance
from gfimu.calibration.parameter_names import parameter_names
from gfimu.calibration.result import Calibration
from gfimu.recording import Recording
from gfimu.recording.importing.guessing.likely_reference import reference_remedy
from gfimu.recording.rest import detect_rest, mean_variance_factor
from gfimu.recording.timing.reference_times import reference_on_rows

__all__ = ["Plateaus", "body_axis", "find_plateaus", "rate_table_gyro"]

Floats = NDArray[np.float64]

_TABLE_RATES = ("tacho_rad_s", "command_rad_s")
"""References that the table's rate is taken from; the first one that is there."""

_GAUGE = "poses"
_RANK = 1e-9  # numerical: of the largest singular value of the true inputs, rad/s
_JITTER = 1e-13  # numerical: of the largest variance, by which a covariance stays positive definite
_PASSES = 3  # numerical: the covariance needs M, which is one to a few per cent


@dataclass(frozen=True)
class Plateaus:
    """Stretches of constant rate in one mounting of the gyro on the table.

    Parameters
    ----------
    axis : ndarray, shape (3,)
        Direction of the table's axis, up, in body axes.
    rate, rate_variance : ndarray, shape (p,)
        Mean rate of the table, rad/s, and the variance of that mean by the noise of its reading, rad²/s².
    turned, angle : ndarray, shape (p,)
        Angle turned in each, and the table's angle in the middle of each since the start of the recording, rad.
    means : ndarray, shape (p, 3)
        Mean reading of the gyro, rad/s.
    covariance : ndarray, shape (p, 3, 3)
        Its covariance by the noise.
    """

    axis: Floats
    rate: Floats
    rate_variance: Floats
    turned: Floats
    angle: Floats
    means: Floats
    covariance: Floats


def body_axis(name: str) -> Floats:
    """Return the direction named x, y, z, −x … (with - or +), shape (3,); raises `InputError` for another word."""
    sign, letter = (-1.0, name[1:]) if name[:1] == "-" else (1.0, name.removeprefix("+"))
    if letter not in {"x", "y", "z"}:
        raise InputError(f"axis {name!r} of the gyro along the table's: give x, y, z, -x, -y or -z")
    return sign * np.eye(3)["xyz".index(letter)]


def find_plateaus(
    recording: Recording, *, axis: Floats | None = None, threshold: float | None = None, min_duration_s: float = 1.0
) -> Plateaus:
    """Find the stretches of constant rate in a recording of a gyro on a rate table.

    Parameters
    ----------
    recording : Recording
        With the columns of a gyro of three axes and the table's rate (``tacho_rad_s``, or ``command_rad_s``).
    axis : ndarray, shape (3,), optional
        Direction of the table's axis, up, in body axes; by default that of the recording's mounting.
    threshold : float, optional
        Largest norm of the variances of gyro and rate in a window of 1 s, rad²/s²; chosen by the data if not given.
    min_duration_s : float
        Shortest plateau, s.

    Raises
    ------
    InputError
        If a column is missing or there is no plateau.
    """
    run = reference_on_rows(recording)
    missing = [name for name in GYRO_COLUMNS if name not in run.reference]
    if missing:
        likely = reference_remedy(run.extra, missing[0])
        raise InputError(
            f"the recording lacks {', '.join(missing)}; a gyro calibration needs all three"
            + f"; {likely}" * bool(likely)
        )
    table = next((name for name in _TABLE_RATES if name in run.reference), None)
    if table is None:
        likely = reference_remedy(run.extra, _TABLE_RATES[0])
        raise InputError("the recording lacks tacho_rad_s; " + (likely or "the rate of the table is the reference"))
    readings = np.column_stack([run.reference[name] for name in (*GYRO_COLUMNS, table)])  # (n, 4)
    seen = replace(run, readings=readings, channels=("gyro1", "gyro2", "gyro3", "table"), reference={}, unit="rad_s")
    rest = detect_rest(seen, threshold=threshold, min_duration_s=min_duration_s)
    complete = np.asarray(np.isfinite(readings).all(axis=1))
    rows = [np.arange(start, stop)[complete[start:stop]] for start, stop in zip(rest.start, rest.stop, strict=True)]
    rows = [row for row in rows if len(row) > 1]
    if not rows:
        raise InputError(
            f"no stretch of constant rate of {min_duration_s:g} s; hold each rate longer, or raise --rest-threshold "
            f"(now {rest.threshold:.3g} rad²/s²)"
        )
    stretches = [readings[one] for one in rows]
    counts = np.array([len(stretch) for stretch in stretches])
    means = np.array([one.mean(axis=0) for one in stretches])
    noise = regular_covariance(np.array([np.cov(one, rowvar=False) for one in stretches]), seen.unit)
    noise *= mean_variance_factor(stretches) / counts[:, None, None]  # of the means
    known = np.isfinite(readings[:, 3])
    rate = np.interp(run.t_s, run.t_s[known], readings[known, 3])
    angle = integrate_samples(run.t_s, rate[:, None], np.zeros(1), method="trapezoid")[:, 0]
    up = Rotation.from_rotvec(run.mounting_rotvec).inv().apply([0.0, 0.0, 1.0]) if axis is None else axis
    return Plateaus(
        np.asarray(up, dtype=np.float64),
        means[:, 3],
        noise[:, 3, 3],
        np.array([angle[one[-1]] - angle[one[0]] for one in rows]),
        np.array([0.5 * (angle[one[-1]] + angle[one[0]]) for one in rows]),
        means[:, :3],
        noise[:, :3, :3],
    )


def rate_table_gyro(
    mountings: Sequence[Plateaus], *, latitude_deg: float | None = None, levelling_std_rad: float = 0.0
) -> Calibration:
    """Calibrate a gyro from the plateaus of one or more mountings on a rate table.

    Parameters
    ----------
    mountings : sequence of Plateaus
        The plateaus of each mounting.
    latitude_deg : float, optional
        Latitude, degrees: the vertical part of the Earth's rate is taken off, and the heading of its horizontal part is
        uncertain in each mounting. Without it the whole Earth's rate is uncertain.
    levelling_std_rad : float
        Standard deviation of the tilt of a mounting against the table's axis, per axis, rad.

    Returns
    -------
    Calibration
        M and b of the gyro, l = M ω + b, in the frame of the mountings. What the plateaus don't determine is as in an
        ideal gyro (M of one, no bias), and is in ``null_space`` and the statements.

    Raises
    ------
    InputError
        If the latitude or the standard deviation is out of range.
    """
    if latitude_deg is not None and not -90.0 <= latitude_deg <= 90.0:
        raise InputError(f"latitude {latitude_deg:g}° is outside −90…90; give it in degrees")
    if not 0.0 <= levelling_std_rad < math.inf:
        raise InputError(f"--levelling-std is {levelling_std_rad:g} rad; it must be zero or above")
    vertical = 0.0 if latitude_deg is None else EARTH_RATE * math.sin(math.radians(latitude_deg))
    axes = np.concatenate([np.tile(mounting.axis, (len(mounting.rate), 1)) for mounting in mountings])  # (p, 3)
    true = (np.concatenate([one.rate for one in mountings]) + vertical)[:, None] * axes
    readings = np.concatenate([one.means for one in mountings])
    design = forward_design(true, free_elements(_GAUGE)).reshape(-1, 12)  # (3p, 12)
    start = np.concatenate([np.eye(3).ravel(), np.zeros(3)])
    determined, open_ = _directions(true)
    values = start
    for _ in range(_PASSES):
        covariance = _covariance(mountings, values[:9].reshape(3, 3), latitude_deg, levelling_std_rad)
        root = np.linalg.cholesky(covariance)
        white = np.linalg.solve(root, design @ determined)  # (3p, u)
        misclosure = np.linalg.solve(root, readings.ravel() - design @ start)
        q, triangle = np.linalg.qr(white)
        found = np.linalg.solve(triangle, q.T @ misclosure)
        values = start + determined @ found
    residual = misclosure - white @ found
    redundancy = len(misclosure) - determined.shape[1]
    factor = float(residual @ residual) / redundancy if redundancy else float("nan")
    scale, warnings = covariance_scale(factor, redundancy)
    inverse = determined @ np.linalg.inv(triangle)
    left = readings.ravel() - design @ values
    return Calibration(
        "gyro-rate-table",
        "rad_s",
        ("gyro_x", "gyro_y", "gyro_z"),
        _GAUGE,
        EARTH_RATE,
        parameter_names("gyro", _GAUGE),
        values,
        inverse @ inverse.T * scale,
        open_,
        statements=(
            *_open_statements(true),
            "scale factors are those against the table's rate, and an error of it is theirs",
            "a tilt of a mounting against the table's axis goes into the misalignments",
        ),
        warnings=warnings,
        statistics={
            "mountings": float(len(mountings)),
            "plateaus": float(len(true)),
            "largest_rate_rad_s": float(np.abs(true).max()),
            "redundancy": float(redundancy),
            "variance_factor": factor,
            "covariance_factor": scale,
            "residual_rms_rad_s": float(np.sqrt(np.mean(left**2))),
        },
    )


def _directions(true: Floats) -> tuple[Floats, Floats]:
    """Return orthonormal directions of the twelve parameters, (12, u) and (12, k): those determined and the others.

    Each row of M, with its bias, is seen through the rows [true, 1] of the plateaus, the same for all three.
    """
    seen = np.column_stack([true, np.ones(len(true))])
    _, sizes, directions = np.linalg.svd(seen, full_matrices=True)
    count = int(np.sum(sizes > _RANK * sizes[0]))
    groups = []
    for rows in (directions[:count], directions[count:]):
        columns = [
            np.concatenate([np.outer(np.eye(3)[i], row[:3]).ravel(), row[3] * np.eye(3)[i]])
            for row in rows
            for i in range(3)
        ]
        groups.append(np.array(columns).reshape(-1, 12).T)
    return groups[0], groups[1]


def _open_statements(true: Floats) -> tuple[str, ...]:
    """Say which parameters the plateaus leave open, and what to record for them."""
    seen = np.column_stack([true, np.ones(len(true))])
    unit = np.eye(4)
    projection = np.linalg.pinv(seen, rcond=_RANK) @ seen
    free = [not np.allclose(projection @ one, one, atol=1e-6) for one in unit]  # numerical
    named = [name for name, is_free in zip("xyz", free, strict=False) if is_free]
    texts = []
    if named and not free[3]:
        texts.append(
            f"the response to rates about {', '.join(named)} is not determined and taken as ideal: record the gyro "
            "with these axes along the table's too"
        )
    elif free[3]:
        texts.append(
            "biases and scale factors are not separated, as each mounting has one rate: record two rates or more, best "
            "with both signs"
        )
    return tuple(texts)


def _covariance(
    mountings: Sequence[Plateaus], sensitivity: Floats, latitude_deg: float | None, levelling_std_rad: float
) -> Floats:
    """Covariance of all means, (3p, 3p): noise, and what is uncertain of the true inputs, through M."""
    count = sum(len(mounting.rate) for mounting in mountings)
    matrix = np.zeros((count, 3, count, 3))
    sources = []  # of one number each: what it moves in the true input of every plateau, (p, 3)
    spin_up = np.zeros((count, 3))
    if latitude_deg is None:  # a direction that may be any: Ω²/3 along each axis
        horizontal = vertical = EARTH_RATE / math.sqrt(3.0)
    else:
        horizontal, vertical = EARTH_RATE * math.cos(math.radians(latitude_deg)) / math.sqrt(2.0), 0.0
    first = 0
    for one in mountings:
        places = np.arange(first, first + len(one.rate))
        along = sensitivity @ one.axis
        matrix[places, :, places, :] = one.covariance + one.rate_variance[:, None, None] * np.outer(along, along)
        spin_up[places] = vertical * one.axis
        east = np.linalg.svd(one.axis[None])[2][1]
        north = np.cross(one.axis, east)
        seen = horizontal * np.sinc(one.turned / (2.0 * np.pi))  # of a vector that turns by this angle
        cos, sin = seen * np.cos(one.angle), seen * np.sin(one.angle)
        for moves in (
            np.outer(levelling_std_rad * one.rate, east),
            np.outer(levelling_std_rad * one.rate, north),
            np.outer(cos, east) - np.outer(sin, north),
            np.outer(sin, east) + np.outer(cos, north),
        ):
            sources.append(np.zeros((count, 3)))
            sources[-1][places] = moves
        first += len(one.rate)
    sources.append(spin_up)
    shift = (np.array(sources) @ sensitivity.T).reshape(len(sources), -1)  # (s, 3p)
    whole = matrix.reshape(3 * count, 3 * count) + shift.T @ shift
    return np.asarray(whole + _JITTER * whole.diagonal().max() * np.eye(len(whole)))
