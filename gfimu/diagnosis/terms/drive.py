"""The drive of a table as a nuisance parameter: a spline of its angle with a prior of how it may bend.

The fourth derivative of the angle in knot interval i is N(0, ρ_i²). The roughness ρ is learnt by MacKay's fixed point
(Neural Computation 4, 1992, eq. 2.19): ρ² = Σ d² / Σ γ over some neighbouring intervals, with γ the share of each
number that the data determine.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.ndimage import uniform_filter1d

from gfimu.diagnosis.terms.spline import DEGREE, AngleSpline, SplineSpin

__all__ = ["Drive"]

MARGIN = 0.4  # s beyond the samples: late chips and fast clocks ask for the motion there
FIRST_ROUGHNESS = 3e3  # rad/s⁴
ROUGH_FOR = 0.3  # s over which a drive is about as rough
LEAST_ROUGHNESS = 30.0  # rad/s⁴
_LEAST_KNOWN = 0.02  # numerical: least mean γ
_ON_A_KNOT = 1e-6  # numerical: knot intervals
_STENCIL = np.array([1.0, -4.0, 6.0, -4.0, 1.0])  # numerical: fourth difference


@dataclass(frozen=True)
class Drive:
    """The drive of one stretch, in units of its reference.

    Parameters
    ----------
    spline : AngleSpline
        The spline.
    coefficients : ndarray, shape (m,)
        The drive.
    roughness : ndarray, shape (m − 4,)
        Standard deviation ρ of the fourth derivative of the angle in each interval, rad/s⁴.
    angle, angle_std : float
        What the angle at ``since`` is known to be, rad; an infinite standard deviation where it is not.
    since : float
        Time of the first sample, s.
    """

    spline: AngleSpline
    coefficients: NDArray[np.float64]
    roughness: NDArray[np.float64]
    angle: float
    angle_std: float
    since: float

    @classmethod
    def still(cls, times: NDArray[np.float64], since: float, spacing: float, angle: float, angle_std: float) -> Drive:
        """Return a drive that is at rest, over times (any shape), s."""
        margin = max(MARGIN, DEGREE * spacing)
        spline = AngleSpline.over(float(times.min()) - margin, float(times.max()) + margin, spacing)
        still = np.full(spline.size, angle if np.isfinite(angle_std) else 0.0)
        return cls(spline, still, np.full(spline.intervals, FIRST_ROUGHNESS), angle, angle_std, since)

    @property
    def spin(self) -> SplineSpin:
        """The motion, in units of the reference."""
        return self.spline.spin(self.coefficients)

    def moved(self, step: NDArray[np.float64]) -> Drive:
        """Return the drive with a step (m,) added."""
        return replace(self, coefficients=self.coefficients + step)

    def covering(self, times: NDArray[np.float64]) -> Drive:
        """Return the drive on a spline that reaches over times, s; the same where it does so already."""
        h = self.spline.spacing
        before = max(int(np.ceil((self.spline.start - float(times.min())) / h)), 0)
        after = max(int(np.ceil((float(times.max()) - self.spline.stop) / h)), 0)
        if not (before or after):
            return self
        spline = AngleSpline(self.spline.start - before * h, h, self.spline.intervals + before + after)
        pad = (before, after)
        first, last = (self.coefficients[1] - self.coefficients[0], self.coefficients[-1] - self.coefficients[-2])
        coefficients = np.pad(self.coefficients, pad)
        coefficients[:before] = self.coefficients[0] - first * np.arange(before, 0, -1)
        if after:
            coefficients[-after:] = self.coefficients[-1] + last * np.arange(1, after + 1)
        return replace(self, spline=spline, coefficients=coefficients, roughness=np.pad(self.roughness, pad, "edge"))

    def following(self, other: Drive) -> Drive:
        """Return this drive's spline and prior with the motion of another."""
        same = other.spline == self.spline
        return replace(self, coefficients=other.coefficients if same else self.spline.through(other.spin))

    def within(self, start: float, stop: float, since: float, angle_std: float) -> Drive:
        """Return the part of the drive over a span of time, s, on its own knots.

        Parameters
        ----------
        start, stop : float
            Times that it must reach over, as far as the whole does, s.
        since : float
            Time of its first sample, s.
        angle_std : float
            Standard deviation of the angle there, rad, where the whole has one.
        """
        h = self.spline.spacing
        first, last = (
            np.clip(np.array([start, stop]) - self.spline.start, 0.0, self.spline.stop - self.spline.start) / h
        )
        low, high = int(np.floor(first + _ON_A_KNOT)), int(np.ceil(last - _ON_A_KNOT))
        return Drive(
            AngleSpline(self.spline.start + low * h, h, high - low),
            self.coefficients[low : high + DEGREE],
            self.roughness[low:high],
            float(self.spin.at(np.array([since])).angle[0]),
            angle_std if np.isfinite(self.angle_std) else np.inf,
            since,
        )

    def on(self, spacing: float) -> Drive:
        """Return the drive with other distances of the knots, s."""
        spline = AngleSpline.over(self.spline.start, self.spline.stop, spacing)
        centres = spline.start + spline.spacing * (np.arange(spline.intervals) + 0.5)
        mine = self.spline.start + self.spline.spacing * (np.arange(self.spline.intervals) + 0.5)
        roughness = np.interp(centres, mine, self.roughness)
        return replace(self, spline=spline, coefficients=spline.through(self.spin), roughness=roughness)

    @property
    def is_learnt(self) -> bool:
        """Whether its prior has parameters to learn."""
        return True

    # -- prior ---------------------------------------------------------------------------------------------------

    def energy(self) -> float:
        """Return what the prior takes of the drive: Σ (d/ρ)² and the square of the angle at first."""
        bent = self.spline.bend(self.coefficients) / self.roughness
        return float(bent @ bent + self._off() ** 2)

    def pull(self) -> NDArray[np.float64]:
        """Return minus half the gradient of the energy, shape (m,)."""
        bent = self.spline.bend(self.coefficients) / self.roughness**2 / self.spline.spacing**DEGREE
        out = np.zeros(self.spline.size)
        for place, weight in enumerate(_STENCIL):
            out[place : place + len(bent)] -= weight * bent
        if np.isfinite(self.angle_std):
            out -= self.spline.angle_row(self.since) * (self._off() / self.angle_std)
        return out

    def add_precision(self, information: NDArray[np.float64]) -> NDArray[np.float64]:
        """Add the prior's precision to a matrix (m, m), in place."""
        scale = 1.0 / (self.roughness * self.spline.spacing**DEGREE) ** 2
        rows = np.arange(len(scale))
        for i, one in enumerate(_STENCIL):
            for j, other in enumerate(_STENCIL):
                information[rows + i, rows + j] += one * other * scale
        if np.isfinite(self.angle_std):
            row = self.spline.angle_row(self.since) / self.angle_std
            at = np.flatnonzero(row)
            information[np.ix_(at, at)] += np.outer(row[at], row[at])
        return information

    @property
    def log_precision(self) -> float:
        """Half the log determinant of the prior's precision, up to a constant."""
        return -float(np.log(self.roughness * self.spline.spacing**DEGREE).sum())

    def _off(self) -> float:
        if not np.isfinite(self.angle_std):
            return 0.0
        return float(self.spline.angle_row(self.since) @ self.coefficients - self.angle) / self.angle_std

    # -- learning ------------------------------------------------------------------------------------------------

    def relearned(self, covariance: NDArray[np.float64]) -> Drive:
        """Return the drive with the roughness that it shows, given the covariance (m, m) of its coefficients."""
        spread = np.diff(np.diff(covariance, DEGREE, axis=0), DEGREE, axis=1).diagonal()
        return self._rougher(spread / self.spline.spacing ** (2 * DEGREE))

    def _rougher(self, spread: NDArray[np.float64]) -> Drive:
        """Return the drive with the roughness that it shows, given the variance (k,) of the fourth derivative."""
        window = max(round(ROUGH_FOR / self.spline.spacing), 1)
        known = uniform_filter1d(np.clip(1.0 - spread / self.roughness**2, 0.0, 1.0), window, mode="nearest")
        power = uniform_filter1d(self.spline.bend(self.coefficients) ** 2, window, mode="nearest")
        return replace(self, roughness=np.sqrt(power / np.maximum(known, _LEAST_KNOWN) + LEAST_ROUGHNESS**2))

    def by_reference(
        self, t: NDArray[np.float64], values: NDArray[np.float64], std: NDArray[np.float64], order: int, rounds: int
    ) -> Drive:
        """Return the drive that a reference alone gives, and the roughness that it shows.

        Parameters
        ----------
        t : ndarray, shape (n,)
            Times at which the reference was read, s.
        values : ndarray, shape (n,)
            Angle, rad, or rate, rad/s, in units of the reference.
        std : ndarray, shape (n,)
            Standard deviations; infinite where a value does not count.
        order : int
            0 for an angle, 1 for a rate.
        rounds : int
            How often the roughness is learnt.
        """
        first, rows = self.spline.rows(t, order)  # (n,), (n, 5)
        weight, size = 1.0 / std**2, self.spline.size
        data, right = np.zeros((DEGREE + 1, size)), np.zeros(size)
        for i in range(DEGREE + 1):
            np.add.at(right, first + i, rows[:, i] * weight * values)
            for j in range(i, DEGREE + 1):
                np.add.at(data[j - i], first + i, rows[:, i] * weight * rows[:, j])
        drive = replace(self, coefficients=np.zeros(size))
        stencil = np.zeros((size, self.spline.intervals))
        for place, one in enumerate(_STENCIL):
            stencil[np.arange(self.spline.intervals) + place, np.arange(self.spline.intervals)] = one
        for _ in range(rounds):
            bands = data + drive._precision_bands()
            root = cholesky_banded(bands, lower=True, check_finite=False)
            drive = replace(drive, coefficients=np.zeros(size))
            coefficients = cho_solve_banded((root, True), right + drive.pull(), check_finite=False)
            spread = cho_solve_banded((root, True), stencil, check_finite=False)
            spread = np.einsum("mk,mk->k", stencil, spread) / self.spline.spacing ** (2 * DEGREE)
            drive = replace(drive, coefficients=coefficients)._rougher(spread)
        return drive

    def _precision_bands(self) -> NDArray[np.float64]:
        """Return the lower bands of the prior's precision, shape (5, m)."""
        bands = np.zeros((DEGREE + 1, self.spline.size))
        scale = 1.0 / (self.roughness * self.spline.spacing**DEGREE) ** 2
        for i, one in enumerate(_STENCIL):
            for j in range(i, DEGREE + 1):
                bands[j - i, i : i + len(scale)] += one * _STENCIL[j] * scale
        if np.isfinite(self.angle_std):
            row = self.spline.angle_row(self.since) / self.angle_std
            for apart in range(DEGREE + 1):
                bands[apart, : len(row) - apart] += row[apart:] * row[: len(row) - apart]
        return bands
