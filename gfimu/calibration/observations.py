"""What a calibration is computed from: the readings of the poses, with their covariance.

Three inputs are offered, as the Persian calibration paper compares them (its section 2.2): every sample, the mean of
each pose with its covariance, and samples denoised by the discrete wavelet transform.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np
import pywt
from numpy.typing import ArrayLike, NDArray

from gfimu.base.errors import InputError, check_name
from gfimu.recording import Recording
from gfimu.recording.rest import Rest, mean_variance_factor

__all__ = [
    "INPUTS",
    "THRESHOLDS",
    "Observations",
    "averaged_poses",
    "denoised_samples",
    "every_sample",
    "observations_from",
    "regular_covariance",
]

Floats = NDArray[np.float64]

_COUNT_VARIANCE = 1.0 / 12.0
_MEDIAN_OF_NORMAL = 0.6745  # numerical: median of the size of a standard normal number
_DEEPEST = 12

THRESHOLDS = ("none", "soft", "hard")
"""What becomes of the details of the wavelet input."""


@dataclass(frozen=True)
class Observations:
    """Readings at rest, in rows that belong to poses.

    Parameters
    ----------
    readings : ndarray, shape (n, c)
        One row per pose (averaged) or per sample (raw, wavelet), reading unit.
    pose : ndarray of int, shape (n,)
        Pose of each row.
    covariance : ndarray, shape (p, c, c)
        Covariance of one row of each pose, independent between rows.
    channels : tuple of str
        Names of the c columns, three per chip.
    unit : str
        Reading unit.
    start_s : ndarray, shape (p,)
        Time at which each pose starts, s.
    kind : str
        Input: one of `INPUTS`.
    correlation_factor : float
        Factor by which the variance of the means exceeds that of white noise, already in ``covariance``.
    quadratic_std : ndarray, shape (c,), optional
        Standard deviation of the quadratic coefficient of each channel, 1 per reading unit
        (`gfimu.calibration.nonlinearity`); not given or zero: axes are straight.
    variance_factor : float, optional
        What does not average out of the means, as a factor of their covariance, if learned from more than these
        observations (`gfimu.calibration.fit_quality`).
    """

    readings: Floats
    pose: NDArray[np.intp]
    covariance: Floats
    channels: tuple[str, ...]
    unit: str
    start_s: Floats
    kind: str = "averaged"
    correlation_factor: float = 1.0
    quadratic_std: Floats | None = None
    variance_factor: float | None = None

    @property
    def bends(self) -> bool:
        """Whether the axes have quadratic coefficients to estimate."""
        return self.quadratic_std is not None and bool((self.quadratic_std > 0.0).any())

    @property
    def quadratic_prior(self) -> Floats:
        """Standard deviation of each quadratic coefficient, shape (c,); tiny for an axis that is straight."""
        std = np.zeros(len(self.channels)) if self.quadratic_std is None else self.quadratic_std
        largest = float(std.max(initial=0.0))
        return np.where(std > 0.0, std, 1e-6 * largest)

    @property
    def mean_covariance(self) -> Floats:
        """Covariance of the mean of each pose, shape (p, c, c)."""
        return self.covariance / np.bincount(self.pose, minlength=self.n_poses)[:, None, None]

    @property
    def n_poses(self) -> int:
        """Number of poses."""
        return len(self.covariance)

    @property
    def row_covariance(self) -> Floats:
        """Covariance of every row, shape (n, c, c)."""
        return self.covariance[self.pose]

    @property
    def means(self) -> Floats:
        """Mean of the rows of each pose, shape (p, c)."""
        count = np.bincount(self.pose, minlength=self.n_poses)
        return np.column_stack(
            [np.bincount(self.pose, column, minlength=self.n_poses) / count for column in self.readings.T]
        )

    @property
    def chips(self) -> tuple[str, ...]:
        """Names of the chips: the channel names without their axis number."""
        return tuple(channel[:-1] for channel in self.channels[::3])

    def of_chip(self, chip: str) -> Observations:
        """Return the observations of one chip; raises `InputError` that lists the chips."""
        check_name("chip", chip, self.chips)
        place = 3 * self.chips.index(chip)
        columns = slice(place, place + 3)
        return replace(
            self,
            readings=self.readings[:, columns],
            covariance=self.covariance[:, columns, columns],
            channels=self.channels[columns],
            quadratic_std=None if self.quadratic_std is None else self.quadratic_std[columns],
        )

    def keep(self, poses: ArrayLike) -> Observations:
        """Return the observations of some poses only, given their numbers from 0."""
        chosen = np.asarray(poses, dtype=np.intp)
        new_number = np.full(self.n_poses, -1)
        new_number[chosen] = np.arange(len(chosen))
        rows = new_number[self.pose] >= 0
        return replace(
            self,
            readings=self.readings[rows],
            pose=new_number[self.pose[rows]],
            covariance=self.covariance[chosen],
            start_s=self.start_s[chosen],
        )

    @classmethod
    def from_means(
        cls,
        means: ArrayLike,
        covariance: ArrayLike,
        *,
        unit: str = "m_s2",
        channels: tuple[str, ...] = ("a11", "a12", "a13"),
    ) -> Observations:
        """Build averaged observations from the means (p, c) of p poses and their covariance, (c, c) or (p, c, c)."""
        rows = np.asarray(means, dtype=float)
        shape = (len(rows), rows.shape[1], rows.shape[1])
        spread = np.broadcast_to(np.asarray(covariance, dtype=float), shape).copy()
        poses = np.arange(len(rows))
        return cls(rows, poses, spread, channels, unit, poses.astype(float))


def averaged_poses(recording: Recording, rest: Rest) -> Observations:
    """Average each pose; the covariance of the mean is that of its samples over their number.

    Correlation between samples makes means worse than that: the factor is estimated from the scatter of block means,
    pooled over the recording, and applied when it is significant.
    """
    return _build(recording, rest, "averaged")


def every_sample(recording: Recording, rest: Rest) -> Observations:
    """Take every sample at rest as it is, with the sample covariance of its pose."""
    return _build(recording, rest, "raw")


def denoised_samples(
    recording: Recording, rest: Rest, *, wavelet: str = "db4", level: int = 4, threshold: str = "none"
) -> Observations:
    """Take every sample at rest after wavelet denoising.

    Denoised neighbours are no longer independent. Each row keeps the covariance of the raw samples, so that n rows
    carry the information that n raw samples carry and no more.

    Parameters
    ----------
    recording : Recording
        Readings.
    rest : Rest
        Its stretches of rest.
    wavelet : str
        Name of a discrete wavelet of PyWavelets.
    level : int
        Level of the transform, 1 to 12; a short pose is transformed to the level that its length allows.
    threshold : {"none", "soft", "hard"}
        What becomes of the details: all are left out, or those below the universal threshold σ √(2 ln n), with σ from
        the median of the finest ones over 0.6745; ``soft`` shrinks the others by the threshold. Source: Donoho &
        Johnstone, Biometrika 81(3), 1994.

    Raises
    ------
    InputError
        If the wavelet or threshold is unknown, or the level out of range.
    """
    check_name("wavelet", wavelet, pywt.wavelist(kind="discrete"))
    check_name("threshold", threshold, THRESHOLDS)
    if not 1 <= level <= _DEEPEST:
        raise InputError(f"wavelet level {level}: give 1 to {_DEEPEST}")
    observations = _build(recording, rest, "wavelet")
    smooth = observations.readings.copy()
    for pose in range(observations.n_poses):
        rows = np.flatnonzero(observations.pose == pose)
        depth = min(level, pywt.dwt_max_level(len(rows), wavelet))
        if depth < 1:
            continue
        levels = pywt.wavedec(smooth[rows], wavelet, mode="symmetric", level=depth, axis=0)
        levels[1:] = _details(levels[1:], threshold, len(rows))
        smooth[rows] = pywt.waverec(levels, wavelet, mode="symmetric", axis=0)[: len(rows)]
    return replace(observations, readings=smooth)


def _details(details: list[Floats], threshold: str, samples: int) -> list[Floats]:
    """Return the details (k_i, c) of a pose after thresholding, the finest last."""
    if threshold == "none":
        return [np.zeros_like(detail) for detail in details]
    noise = np.median(np.abs(details[-1]), axis=0) / _MEDIAN_OF_NORMAL  # (c,)
    limit = noise * np.sqrt(2.0 * np.log(samples))
    size = [np.maximum(np.abs(one), np.finfo(float).tiny) for one in details]
    if threshold == "hard":
        return [np.where(large > limit, one, 0.0) for one, large in zip(details, size, strict=True)]
    return [one * np.maximum(1.0 - limit / large, 0.0) for one, large in zip(details, size, strict=True)]


def observations_from(recording: Recording, rest: Rest, kind: str, **options: Any) -> Observations:
    """Build the observations of a named input, with options of `denoised_samples` for ``wavelet``.

    Raises
    ------
    InputError
        If there is no such input (the message lists the inputs), or it has no such option.
    """
    check_name("input", kind, INPUTS)
    if options and kind != "wavelet":
        raise InputError("--wavelet-level and --wavelet-threshold are of the wavelet input; add --input wavelet")
    return INPUTS[kind](recording, rest, **options)


INPUTS: Mapping[str, Callable[..., Observations]] = MappingProxyType(
    {"averaged": averaged_poses, "raw": every_sample, "wavelet": denoised_samples}
)
"""What makes the observations of each input, by name."""


def _build(recording: Recording, rest: Rest, kind: str) -> Observations:
    """Collect the rows of every stretch of rest and the covariance of its samples."""
    if len(rest) == 0:
        raise InputError(
            "no rest found in the recording; hold each pose still for a few seconds, or raise the rest threshold "
            f"(now {rest.threshold:.3g})"
        )
    c = len(recording.channels)
    if c % 3:
        raise InputError(
            f"{c} channels are not three per chip ({', '.join(recording.channels)}); these methods need whole triads"
        )
    poses, covariances, starts = [], [], []
    for start, stop in zip(rest.start, rest.stop, strict=True):
        samples = recording.readings[start:stop]
        samples = samples[np.isfinite(samples).all(axis=1)]
        if len(samples) < 2:
            raise InputError(
                f"the pose at {recording.t_s[start]:.1f} s has no complete samples; a channel is missing there"
            )
        poses.append(samples)
        covariances.append(np.cov(samples, rowvar=False).reshape(c, c))
        starts.append(recording.t_s[start])
    factor = mean_variance_factor(poses)
    covariance = regular_covariance(np.array(covariances), recording.unit) * factor
    lengths = np.array([len(samples) for samples in poses])
    if kind == "averaged":
        rows = np.array([samples.mean(axis=0) for samples in poses])
        number = np.arange(len(poses))
        covariance = covariance / lengths[:, None, None]
    else:
        rows = np.concatenate(poses)
        number = np.repeat(np.arange(len(poses)), lengths)
    return Observations(rows, number, covariance, recording.channels, recording.unit, np.array(starts), kind, factor)


def regular_covariance(covariance: Floats, unit: str) -> Floats:
    """Give readings that never change within a pose the variance of rounding, or of the other poses; (p, c, c)."""
    diagonal = np.einsum("pcc->pc", covariance)
    floor = _COUNT_VARIANCE if unit == "lsb" else 0.0
    typical = np.median(diagonal, axis=0)
    least = np.maximum(floor, 1e-3 * typical)
    least = np.where(least > 0.0, least, 1e-18)
    lift = np.maximum(least - diagonal, 0.0)
    return covariance + lift[:, :, None] * np.eye(covariance.shape[1])
