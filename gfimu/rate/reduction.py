"""Readings reduced to α and the null space, with missing, saturated and stuck channels left out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.rate.channel_errors import ChannelErrors, features_of
from gfimu.rate.channel_sets import ChannelSets
from gfimu.rate.filter_state import Samples
from gfimu.rate.result import ChannelReport
from gfimu.rate.sensing import SensorErrors

__all__ = ["Reduction", "equal_since", "stuck_readings"]

_GAP = 1.5  # periods from which on a step is a gap
_NEIGHBOURS = np.array([-3.0, 12.0, 12.0, -3.0]) / 18.0  # a parabola's value between two samples on either side
_LEAST_PARITY = 3  # combinations that no motion changes, from which a single sample shows the noise


class Reduction:
    """Reduces the samples of a stream, piece by piece.

    Parameters
    ----------
    sets : ChannelSets
        The array, with c channels and their noise.
    errors : SensorErrors
        Range, and from how many equal readings in a row on a channel is stuck.
    period : float
        Sample period, s.
    considered, stated : ChannelErrors, optional
        Errors of the channels that are considered one by one, and all that are stated.
    """

    def __init__(
        self,
        sets: ChannelSets,
        errors: SensorErrors,
        period: float,
        considered: ChannelErrors | None = None,
        stated: ChannelErrors | None = None,
    ) -> None:
        self.sets, self._errors, self._period = sets, errors, period
        nothing = ChannelErrors(np.zeros((0, sets.array.n_channels, 12)))
        self.considered, self._stated = considered or nothing, stated or nothing
        self._feature_sum = np.zeros(12)
        self._parity_sum = np.zeros(len(sets.parity_rows))
        self.parity_mean = np.zeros(len(sets.parity_rows))
        self._parity_count = 0
        self._tally = np.zeros((3, sets.array.n_channels), dtype=np.int64)  # missing, saturated, stuck
        self._blind = self._gaps = 0

    def report(self) -> ChannelReport:
        """Return what was wrong with the channels so far."""
        missing, saturated, stuck = (
            {name: int(count) for name, count in zip(self.sets.array.channels, counts, strict=True) if count}
            for counts in self._tally
        )
        return ChannelReport(missing, saturated, stuck, self._blind, self._gaps)

    def none(self, references: int) -> Samples:
        """Return no samples, with so many references."""
        return self._samples(np.zeros(0), np.zeros((0, self.sets.array.n_channels)), np.zeros((0, references)))

    def _samples(self, t: NDArray[np.float64], rows: NDArray[np.float64], references: NDArray[np.float64]) -> Samples:
        n, m, q = len(t), self.sets.products, len(self.considered)
        return Samples(
            t, np.zeros((n, m)), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3)), np.full((n, 2), np.nan),
            np.zeros(n, dtype=np.int64), np.full(n, np.nan), references, np.zeros(n, dtype=np.int64),
            np.zeros(n), np.zeros((n, 12 if q else 0)), *(np.zeros((n, rows, q)) for rows in (3, 3, 3, m)),
        )  # fmt: skip

    def reduce(
        self,
        past: NDArray[np.float64],
        before: Samples,
        t: NDArray[np.float64],
        rows: NDArray[np.float64],
        references: NDArray[np.float64],
    ) -> Samples:
        """Reduce further samples.

        Parameters
        ----------
        past : ndarray, shape (h, c)
            Readings before, as far as they are kept.
        before : Samples
            The same, reduced.
        t, rows, references : ndarray, shapes (n,), (n, c), (n, f)
            Times, s; readings, m/s²; values beside the readings.
        """
        n = len(t)
        samples = self._samples(t, rows, references)
        missing = np.isnan(rows)
        saturated = ~missing & ~(np.abs(rows) < self._errors.limits)
        after = self._errors.stuck_after
        tail = past[max(0, len(past) - after) :]
        stuck = stuck_readings(np.concatenate([tail, rows]), after)[len(tail) :] & ~missing & ~saturated
        self._tally += np.array([faults.sum(axis=0) for faults in (missing, saturated, stuck)])
        present = ~(missing | saturated | stuck)
        places = self.sets.indices(present)
        clean = np.where(present, rows, 0.0)
        parity = clean @ self.sets.parity_rows.T
        complete = places == 0
        counts = self._parity_count + np.cumsum(complete)
        sums = self._parity_sum + np.cumsum(np.where(complete[:, None], parity, 0.0), axis=0)
        if n:
            self._parity_count, self._parity_sum = int(counts[-1]), sums[-1]
        means = sums / np.maximum(counts, 1)[:, None]
        self.parity_mean = means[-1] if n else self.parity_mean
        if len(self.sets.parity_rows) >= _LEAST_PARITY:
            lost = np.maximum(1.0 - 1.0 / np.maximum(counts, 2), 0.5)  # of the variance, to the mean
            square = np.mean((parity - means) ** 2, axis=1) / lost
            if len(self._stated):
                features = features_of(self.sets.array, clean, np.ones(clean.shape[1], dtype=np.bool_))
                moved = self._feature_sum + np.cumsum(np.where(complete[:, None], features, 0.0), axis=0)
                self._feature_sum = moved[-1] if n else self._feature_sum
                changed = features - moved / np.maximum(counts, 1)[:, None]
                square /= 1.0 + self._stated.variance_of(self.sets.parity_rows, changed)
            samples.parity[:] = np.where(complete & (counts > 1), square, np.nan)
        self._add_timing(past, before, samples, clean, present)
        for place in np.unique(places):
            here, channels = places == place, self.sets.sets[place]
            if channels.rows < 0:
                samples.channel_set[here] = -1
                continue
            samples.channel_set[here] = place
            samples.alpha[here] = clean[here] @ channels.alpha_rows.T
            samples.force[here] = clean[here] @ channels.force_rows.T
            samples.z[here] = clean[here] @ channels.product_rows.T
            if len(self.considered):
                samples.features[here] = features_of(self.sets.array, clean[here], present[np.argmax(here)])
            if place:
                samples.alpha[here] -= means[here] @ channels.alpha_parity.T
                samples.force[here] -= means[here] @ channels.force_parity.T
                samples.z[here] -= means[here] @ channels.product_parity.T
        seen = samples.channel_set >= 0
        self._blind += int(np.count_nonzero(~seen))
        if not seen.all():  # α is held
            last = np.maximum.accumulate(np.where(seen, np.arange(n), -1))
            for new, old in ((samples.alpha, before.alpha), (samples.force, before.force)):
                held = old[-1] if len(before.t) else np.zeros(3)
                new[:] = np.where((last >= 0)[:, None], new[np.maximum(last, 0)], held)
        keep = min(5, len(before.t))
        steps = np.diff(np.concatenate([before.t[len(before.t) - keep :], t]))
        self._gaps += int(np.count_nonzero(steps[max(keep - 1, 0) :] > _GAP * self._period))
        self._difference(before, samples, keep, steps)
        return samples

    def add_errors(self, samples: Samples, first: int) -> None:
        """Fill in what the errors of the channels make of the samples from ``first`` on."""
        if not len(self.considered):
            return
        features, rows = samples.features, np.arange(first, len(samples.t))
        motion = self.smooth_motion(samples, first)
        for place in np.unique(samples.channel_set[first:]):
            if place >= 0:
                here = samples.channel_set[first:] == place
                channels = self.sets.sets[place]
                samples.alpha_errors[rows[here]] = self.considered.of_rows(channels.alpha_rows, features[first:][here])
                samples.force_errors[rows[here]] = self.considered.of_rows(channels.force_rows, features[first:][here])
                samples.product_errors[rows[here]] = self.considered.of_rows(channels.product_rows, motion[here])

    def smooth_motion(self, samples: Samples, first: int = 0) -> NDArray[np.float64]:
        """Return the features (n, 12) of the motion from sample ``first`` on, by the neighbours of each sample.

        The parabola through two on either side is taken, because a sample's own noise looks like an error of a gain.
        """
        features, n = samples.features, len(samples.t)
        around = np.arange(first, n)[:, None] + np.array([-2, -1, 1, 2])  # (n, 4)
        whole = (around >= 0).all(axis=1) & (around < n).all(axis=1)
        whole &= np.ptp(samples.t[np.clip(around, 0, n - 1)], axis=1) < 2.0 * (1.0 + _GAP) * self._period
        motion = features[first:].copy()
        motion[whole] = np.einsum("i,nif->nf", _NEIGHBOURS, features[around[whole]])
        return motion

    def _add_timing(
        self,
        past: NDArray[np.float64],
        before: Samples,
        samples: Samples,
        clean: NDArray[np.float64],
        present: NDArray[np.bool_],
    ) -> None:
        """Fill in the variance that stated errors of the sampling times make, by the slope of the readings."""
        if not self._errors.timing_std > 0.0:
            return
        share = np.where(present, 1.0, 0.0) / np.maximum(present.sum(axis=1, keepdims=True), 1)
        t = np.concatenate([before.t[-1:], samples.t])
        rows = np.concatenate([past[-1:], clean])
        slope = np.diff(rows, axis=0) / np.diff(t)[:, None] / self.sets.noise_std
        moved = np.sum(share[-len(slope) :] * np.nan_to_num(slope) ** 2, axis=1)
        samples.model_error[len(samples.t) - len(slope) :] = self._errors.timing_std**2 * moved

    def _difference(self, before: Samples, samples: Samples, keep: int, steps: NDArray[np.float64]) -> None:
        """Fill in the squares of the fourth and fifth differences of α, where six samples in a row are complete."""
        alpha = np.concatenate([before.alpha[len(before.t) - keep :], samples.alpha])
        places = np.concatenate([before.channel_set[len(before.t) - keep :], samples.channel_set])
        if len(alpha) < 6:
            return
        fourth = np.sum(np.diff(alpha, 4, axis=0) ** 2, axis=1)
        fifth = np.sum(np.diff(alpha, 5, axis=0) ** 2, axis=1)
        joined = np.concatenate([[False], (steps < _GAP * self._period) & (places[1:] == 0) & (places[:-1] == 0)])
        run = np.convolve(joined, np.ones(5))[: len(joined)]
        rows = np.arange(5, len(alpha))
        good = run[5:] > 4.5
        values = np.column_stack([0.5 * (fourth[1:] + fourth[:-1]), fifth])
        target = rows - keep
        fresh = good & (target >= 0)
        samples.differences[target[fresh]] = values[fresh]


def stuck_readings(readings: NDArray[np.float64], after: int) -> NDArray[np.bool_]:
    """Mark readings (n, c) from the ``after``-th equal one in a row on; none where ``after`` is below 2."""
    if after < 2:
        return np.zeros(readings.shape, dtype=np.bool_)
    return np.asarray(np.arange(len(readings))[:, None] - equal_since(readings) + 1 >= after)


def equal_since(readings: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the row of the first of the equal readings in a row that each of (n, c) is one of, shape (n, c)."""
    new = np.ones(readings.shape, dtype=np.bool_)
    new[1:] = readings[1:] != readings[:-1]  # NaN differs from all
    rows = np.arange(len(readings))[:, None]
    return np.asarray(np.maximum.accumulate(np.where(new, rows, 0), axis=0))
