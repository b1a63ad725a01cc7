"""Faults of calibration data: poses that moved, saturated or stuck channels, repeated poses, a wrong gravity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.calibration.coverage import distinct_poses, pose_directions, pose_label
from gfimu.calibration.result import Calibration
from gfimu.recording import Recording
from gfimu.recording.rest import Rest

__all__ = ["check_gravity", "check_readings", "moved_poses", "repeated_poses", "scale_warning", "without_moved_poses"]

Floats = NDArray[np.float64]

_GRAVITY_RANGE = (9.76, 9.84)
_GRAVITY_ABSURD = (9.5, 10.1)
_SATURATED_SHARE = 0.2
_STUCK_SHARE = 0.01
_MOVED_SHARE = 5e-4
_MOVED_SIGMA = 8.0
_COMMON_SCALE = 0.01


@dataclass(frozen=True)
class PosePolicy:
    """When the samples of a stretch of rest are those of several poses; how many repeated ones a warning names."""

    unlike: float = 0.3  # of gravity: scatter in all directions, beyond the noise of any sample at rest
    turned: float = 0.02  # of gravity: scatter along one direction, beyond that of coarse counts
    turned_ratio: float = 3.0  # of that scatter over the least one across it; noise of axes differs by less than twice
    named_groups: int = 6


_POLICY = PosePolicy()


def check_gravity(gravity: float) -> tuple[str, ...]:
    """Refuse a gravity that can't be one in m/s²; warn of one that the Earth's surface doesn't have.

    Raises
    ------
    InputError
        If it is outside 9.5 to 10.1 m/s².
    """
    if not _GRAVITY_ABSURD[0] <= gravity <= _GRAVITY_ABSURD[1]:
        raise InputError(
            f"gravity {gravity:g} is not one in m/s²; give the local gravity (9.78 to 9.83), or latitude and height"
        )
    if not _GRAVITY_RANGE[0] <= gravity <= _GRAVITY_RANGE[1]:
        text = f"gravity {gravity:g} m/s² is found nowhere on the Earth's surface (9.76 to 9.84); all scales follow it"
        return (text,)
    return ()


def check_readings(recording: Recording, rest: Rest) -> tuple[str, ...]:
    """Refuse stuck channels and warn of saturated ones.

    A channel is stuck when its readings hardly differ between poses while others do. It is saturated in a pose when
    it sits at its own extreme value there for a fifth of the samples or more, although it is noisy elsewhere.

    Raises
    ------
    InputError
        If a channel is stuck; the message names it.
    """
    if len(rest) < 2:
        return ()
    parts = [recording.readings[a:b] for a, b in zip(rest.start, rest.stop, strict=True)]
    means = np.array([np.nanmean(part, axis=0) for part in parts])
    spread = np.ptp(means, axis=0)
    stuck = np.flatnonzero(spread < _STUCK_SHARE * np.median(spread[spread > 0.0]) if np.any(spread > 0.0) else [])
    if len(stuck):
        names = ", ".join(recording.channels[channel] for channel in stuck)
        raise InputError(
            f"channel {names} reads the same in all {len(parts)} poses: stuck or not connected; "
            "repair it, or leave its chip out"
        )
    noisy = np.median([np.nanstd(part, axis=0) for part in parts], axis=0) > 0.0
    top, bottom = np.nanmax(recording.readings, axis=0), np.nanmin(recording.readings, axis=0)
    texts: list[str] = []
    for index, part in enumerate(parts):
        at_limit = np.maximum(np.mean(part == top, axis=0), np.mean(part == bottom, axis=0))
        texts.extend(
            f"channel {recording.channels[channel]} is saturated in pose {index + 1} "
            f"({recording.t_s[rest.start[index]]:.1f} s): {at_limit[channel]:.0%} of its samples are at its limit; "
            "choose a larger range"
            for channel in np.flatnonzero(noisy & (at_limit > _SATURATED_SHARE) & (len(part) > 20))
            if at_limit[channel] > 3.0 * _typical_limit_share(recording.readings[:, channel], part[:, channel])
        )
    return tuple(texts)


def moved_poses(recording: Recording, rest: Rest) -> list[int]:
    """Find the poses (from 0) whose first and last third differ by more than noise and 0.05 % of the full range.

    Such a pose turned or crept while it was recorded. So did one whose samples scatter far more along one direction
    than along another, or by a good part of gravity: several poses do, and noise doesn't.
    """
    parts = [recording.readings[a:b] for a, b in zip(rest.start, rest.stop, strict=True)]
    unlike = [index for index, part in enumerate(parts) if _is_unlike(part[:, :3], recording)]
    if len(parts) < 2 or len(unlike) == len(parts):
        return unlike
    scale = float(np.max(np.ptp([np.nanmean(part, axis=0) for part in parts], axis=0)))
    noise = np.sqrt(np.median([np.nanvar(part, axis=0) for part in parts], axis=0))
    moved = unlike
    for index, part in enumerate(parts):
        third = len(part) // 3
        if third < 3 or index in unlike:
            continue
        step = np.abs(np.nanmean(part[-third:], axis=0) - np.nanmean(part[:third], axis=0))
        if np.any((step > _MOVED_SIGMA * noise * np.sqrt(2.0 / third)) & (step > _MOVED_SHARE * scale)):
            moved.append(index)
    return sorted(moved)


def _is_unlike(part: Floats, recording: Recording) -> bool:
    """Whether the samples (n, 3) of a stretch of rest are those of several poses."""
    samples = part[np.isfinite(part).all(axis=1)]
    if len(samples) < 2:
        return False
    counts = float(np.nanmedian(np.linalg.norm(recording.readings[:, :3], axis=1)))
    shares = np.linalg.eigvalsh(np.cov(samples.T)) / (STANDARD_GRAVITY if recording.unit == "m_s2" else counts) ** 2
    turned = shares[2] > _POLICY.turned**2 and shares[2] > _POLICY.turned_ratio**2 * shares[0]
    return bool(turned or shares[2] > _POLICY.unlike**2)


def without_moved_poses(recording: Recording, rest: Rest) -> tuple[Rest, tuple[str, ...]]:
    """Leave out poses that moved while they were recorded, and say which.

    Raises
    ------
    InputError
        If every pose moved.
    """
    moved = moved_poses(recording, rest)
    if not moved:
        return rest, ()
    places = ", ".join(f"{number + 1} ({recording.t_s[rest.start[number]]:.1f} s)" for number in moved)
    kept = np.setdiff1d(np.arange(len(rest)), moved)
    if not len(kept):
        raise InputError(
            f"the samples of all {len(rest)} stretches of rest differ as those of several poses do; "
            "hold each pose still, or, where every row is a pose, add --rows poses"
        )
    text = f"poses that moved while recorded, left out: {places}"
    return replace(rest, start=rest.start[kept], stop=rest.stop[kept]), (text,)


def repeated_poses(means: Floats) -> tuple[str, ...]:
    """Name the poses of one triad that repeat another one (within 8°): they add weight, not coverage."""
    directions = pose_directions(means)
    groups = [group for group in distinct_poses(directions) if len(group) > 1]
    if not groups:
        return ()
    names = "; ".join(
        f"{', '.join(str(number + 1) for number in group)} ({pose_label(directions[group[0]])})"
        for group in groups[: _POLICY.named_groups]
    )
    names += f" and {len(groups) - _POLICY.named_groups} groups more" if len(groups) > _POLICY.named_groups else ""
    return (f"poses that repeat each other: {names}; they add weight but no coverage",)


def scale_warning(calibration: Calibration, sizes: Mapping[str, float]) -> tuple[str, ...]:
    """Warn when all three scale factors of a chip are off by the same share: the gravity or the unit is wrong.

    Parameters
    ----------
    calibration : Calibration
        The result.
    sizes : mapping of str to float
        Nominal scale of each chip, reading units per m/s² (1 for readings in m/s²); chips without one are skipped.
    """
    texts = []
    for chip, model in calibration.models.items():
        if chip not in sizes:
            continue
        ratio = np.linalg.norm(model.sensitivity, axis=1) / sizes[chip]
        common, scatter = float(np.mean(ratio)) - 1.0, float(np.std(ratio))
        if abs(common) > max(_COMMON_SCALE, 4.0 * scatter):
            texts.append(
                f"all three scale factors of {chip} are {common:+.2%} from nominal: "
                "the gravity, the range or the unit is probably wrong"
            )
    return tuple(texts)


def _typical_limit_share(channel: Floats, part: Floats) -> float:
    """Share of samples at the commonest inner value of a pose: coarse counts repeat without any limit."""
    values, counts = np.unique(part[np.isfinite(part)], return_counts=True)
    inner = (values > np.nanmin(channel)) & (values < np.nanmax(channel))
    return float(counts[inner].max() / len(part)) if inner.any() else 0.0
