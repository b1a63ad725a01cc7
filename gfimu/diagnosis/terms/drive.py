"""The drive of a table as a nuisance parameter: a spline of its angle with a prior of how it may bend.

The fourth derivative d of the angle is white noise: in a knot interval of width w it is N(0, ρ²), with ρ²w much the
same in neighbouring intervals. The roughness ρ is learnt by MacKay's fixed point (Neural Computation 4, 1992,
eq. 2.19): ρ²w = Σ d²w / Σ γ over some neighbouring intervals, with γ the share of each number that the data determine.
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
ROUGH_FOR = 0.3  # s over which a drive is about as rough, where its knots are far apart; of as many intervals elsewhere
LEAST_ROUGHNESS = 30.0  # rad/s⁴
_LEAST_KNOWN = 0.02  # numerical: least mean γ
_ON_A_KNOT = 1e-6  # numerical: knot intervals


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
        pad = (before, after)
        halvings = (0,) * before + self.spline.halvings + (0,) * after if self.spline.halvings else ()
        spline = AngleSpline(self.spline.start - before * h, h, self.spline.intervals + before + after, halvings)
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
        spline = self.spline
        (low, high), (begun, passed) = spline.interval(np.clip(np.array([start, stop]), spline.start, spline.stop))
        low += int(begun > 1.0 - _ON_A_KNOT)
        high += int(passed > _ON_A_KNOT)
        # The functions at the ends are those of the whole where the knots about these are as far apart as beyond.
        while low and (spline.widths[max(low - DEGREE, 0) : low + 1] < spline.spacing).any():
            low -= 1
        while high < spline.intervals and (spline.widths[high - 1 : high + DEGREE] < spline.spacing).any():
            high += 1
        halvings = spline.halvings[low:high]
        return Drive(
            AngleSpline(float(spline.knots[low]), spline.spacing, int(high - low), halvings if any(halvings) else ()),
            self.coefficients[low : high + DEGREE],
            self.roughness[low:high],
            float(self.spin.at(np.array([since])).angle[0]),
            angle_std if np.isfinite(self.angle_std) else np.inf,
            since,
        )

    def cut(self, where: NDArray[np.bool_]) -> Drive:
        """Return the drive with some of its knot intervals (k,) halved: the same motion, as rough.

        The outermost intervals stay, so that the drive can be continued beyond them.
        """
        where = where.copy()
        where[:DEGREE] = where[-DEGREE:] = False
        spline = self.spline.cut(where)
        roughness = np.repeat(self.roughness * np.where(where, np.sqrt(2.0), 1.0), 1 + where)
        return replace(self, spline=spline, coefficients=spline.through(self.spin), roughness=roughness)

    @property
    def is_learnt(self) -> bool:
        """Whether its prior has parameters to learn."""
        return True

    @property
    def missed(self) -> NDArray[np.float64]:
        """What angular acceleration the spline may miss in each interval (k,), rad/s².

        As far as the fourth derivative of the angle changes from one interval to the next, it changes within them too:
        little in a swift sine, much at a corner of the acceleration.
        """
        change = np.square(np.diff(self.spline.bend(self.coefficients)))
        ends = 0.5 * (np.append(change, 0.0) + np.insert(change, 0, 0.0))
        return np.asarray(np.sqrt(ends) * self.spline.widths**2 / 16.0)

    # -- prior ---------------------------------------------------------------------------------------------------

    def energy(self) -> float:
        """Return what the prior takes of the drive: Σ (d/ρ)² and the square of the angle at first."""
        bent = self.spline.bend(self.coefficients) / self.roughness
        return float(bent @ bent + self._off() ** 2)

    def pull(self) -> NDArray[np.float64]:
        """Return minus half the gradient of the energy, shape (m,)."""
        bent = self.spline.bend(self.coefficients) / self.roughness**2
        out = np.zeros(self.spline.size)
        for index, weight in enumerate(self.spline.stencil.T):
            out[index : index + len(bent)] -= weight * bent
        if np.isfinite(self.angle_std):
            out -= self.spline.angle_row(self.since) * (self._off() / self.angle_std)
        return out

    def add_precision(self, information: NDArray[np.float64]) -> NDArray[np.float64]:
        """Add the prior's precision to a matrix (m, m), in place."""
        rows, scaled = np.arange(len(self.roughness)), self.spline.stencil.T / self.roughness
        for i, one in enumerate(scaled):
            for j, other in enumerate(scaled):
                information[rows + i, rows + j] += one * other
        if np.isfinite(self.angle_std):
            row = self.spline.angle_row(self.since) / self.angle_std
            at = np.flatnonzero(row)
            information[np.ix_(at, at)] += np.outer(row[at], row[at])
        return information

    @property
    def log_precision(self) -> float:
        """Half the log determinant of the prior's precision, where it has one.

        It is flat in angle, rate, acceleration and jerk at the start. In these and the bends it is the same density on
        all knots, so that evidences of different splines are comparable.
        """
        return self.spline.log_units - float(np.log(self.roughness).sum())

    def _off(self) -> float:
        if not np.isfinite(self.angle_std):
            return 0.0
        return float(self.spline.angle_row(self.since) @ self.coefficients - self.angle) / self.angle_std

    # -- learning ------------------------------------------------------------------------------------------------

    def relearned(self, covariance: NDArray[np.float64]) -> Drive:
        """Return the drive with the roughness that it shows, given the covariance (m, m) of its coefficients."""
        stencil, rows = self.spline.stencil, np.arange(self.spline.intervals)
        spread = np.zeros(len(rows))
        for i in range(DEGREE + 1):
            for j in range(DEGREE + 1):
                spread += stencil[:, i] * stencil[:, j] * covariance[rows + i, rows + j]
        return self._rougher(spread)

    def _rougher(self, spread: NDArray[np.float64]) -> Drive:
        """Return the drive with the roughness that it shows, given the variance (k,) of the fourth derivative."""
        window, widths = max(round(ROUGH_FOR / self.spline.spacing), 1), self.spline.widths
        known = uniform_filter1d(np.clip(1.0 - spread / self.roughness**2, 0.0, 1.0), window, mode="nearest")
        power = uniform_filter1d(self.spline.bend(self.coefficients) ** 2 * widths, window, mode="nearest") / widths
        power = np.maximum(power, 0.0)  # a running sum of very unlike numbers may round below zero
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
        for index, one in enumerate(self.spline.stencil.T):
            stencil[np.arange(self.spline.intervals) + index, np.arange(self.spline.intervals)] = one
        for _ in range(rounds):
            bands = data + drive._precision_bands()
            root = cholesky_banded(bands, lower=True, check_finite=False)
            drive = replace(drive, coefficients=np.zeros(size))
            coefficients = cho_solve_banded((root, True), right + drive.pull(), check_finite=False)
            spread = cho_solve_banded((root, True), stencil, check_finite=False)
            spread = np.einsum("mk,mk->k", stencil, spread)
            drive = replace(drive, coefficients=coefficients)._rougher(spread)
        return drive

    def _precision_bands(self) -> NDArray[np.float64]:
        """Return the lower bands of the prior's precision, shape (5, m)."""
        bands = np.zeros((DEGREE + 1, self.spline.size))
        scaled = self.spline.stencil.T / self.roughness
        for i, one in enumerate(scaled):
            for j in range(i, DEGREE + 1):
                bands[j - i, i : i + len(self.roughness)] += one * scaled[j]
        if np.isfinite(self.angle_std):
            row = self.spline.angle_row(self.since) / self.angle_std
            for apart in range(DEGREE + 1):
                bands[apart, : len(row) - apart] += row[apart:] * row[: len(row) - apart]
        return bands
