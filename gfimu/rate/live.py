"""The rate filter: of a stream in pieces, or of a recording fed at once.

The first half second is waited for, because it shows how the run starts (`gfimu.rate.start`) and how large the noise
is. A start that moves has two mirrored rates, which read the same: both are followed until the sign is decided.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.rate.body_rate import follow, smooth_back
from gfimu.rate.channel_errors import ChannelErrors, features_of, usual_moments
from gfimu.rate.channel_sets import ChannelSets
from gfimu.rate.constants import Constants
from gfimu.rate.filter_state import (
    LAST_ALPHA,
    RESTING,
    SOLVED,
    STARTED,
    STILL,
    TIME,
    Carried,
    Estimates,
    Given,
    Places,
    Samples,
    SingleRates,
    Tuning,
    no_rates,
)
from gfimu.rate.increments import integrals
from gfimu.rate.kernel import Record
from gfimu.rate.measured_noise import measured_noise, timing_noise
from gfimu.rate.open_loop import integrate_open
from gfimu.rate.path import ROWS, TILT, rest_on_path
from gfimu.rate.path_start import PathStart, levelled, settled, with_attitude
from gfimu.rate.reduction import Reduction
from gfimu.rate.references import Reference, rows_of
from gfimu.rate.rest_test import DOUBTED, MOVES, RESTS, RestJudge, RestTest, still_blocks
from gfimu.rate.result import (
    DECIDED,
    BodyPath,
    ChannelReport,
    RateEstimate,
    SignDecision,
    clear_of_zero,
    full_covariance,
    joined_estimates,
)
from gfimu.rate.sensing import SensorErrors
from gfimu.rate.settings import QUADRATURES, FilterSettings
from gfimu.rate.signs import DISAGREEING, DISAGREES_OFTEN, SignJudge, likelier, merged, with_filter, with_signs
from gfimu.rate.start import Start, infer_start
from gfimu.rate.tuning import tuning_of

__all__ = ["LiveRateFilter"]

_HISTORY = 8  # numerical: samples kept before the next one, for stencils and differences of α
_DOUBT_S = 5.0  # numerical: of the stream, over which the share of samples in disagreement is counted
_PASSES = 8  # numerical: of the smoother about its last rates
_STAYS = 0.02  # numerical: mean change of a rate in its standard deviations at which it stays
_SMOOTHER_BLOCK = 512  # numerical: samples whose record is kept at once


class LiveRateFilter:
    """Rate filter for a stream of samples.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions, with c channels.
    errors : SensorErrors
        Errors of its sensors.
    period : float
        Nominal sample period, s.
    settings : FilterSettings, optional
        Start, quadrature, rest, noise.
    references : sequence of Reference
        What is measured beside the readings.
    path : PathStart, optional
        Where the path starts, if attitude, velocity and position of a whole recording are to be followed as well.
    progress : callable, optional
        Called with the share of each block of samples that is filtered, 0 to 1.

    Raises
    ------
    GeometryError
        If the array can't see all six motions.

    Examples
    --------
    >>> live = LiveRateFilter(array, SensorErrors.from_parts(array, 100.0), 0.01)  # doctest: +SKIP
    >>> for t, reading in stream:  # doctest: +SKIP
    ...     estimate = live.push(t, reading)
    """

    def __init__(
        self,
        array: AccelerometerArray,
        errors: SensorErrors,
        period: float,
        settings: FilterSettings | None = None,
        *,
        references: Sequence[Reference] = (),
        path: PathStart | None = None,
        progress: Callable[[float], object] | None = None,
    ) -> None:
        self.array, self.errors, self.period = array, errors, period
        self.settings = settings or FilterSettings()
        self.sets = ChannelSets(array, errors.noise_std)
        stencil = QUADRATURES[self.settings.quadrature]
        self._ahead = stencil.points - 2 + stencil.before[0]
        self._test = self.settings.rest or RestTest()
        self._window = self._test.window(period)
        self._references, self._reference_std = rows_of(references)
        of_rate = self._references.weights[self._references.first < TILT]
        self.sign_is_measured = len(of_rate) > 0
        self._rate_is_measured = bool(np.linalg.matrix_rank(of_rate) == 3)
        self._path, self._progress = path, progress
        self._waiting: list[tuple[NDArray[np.float64], ...]] = []
        self._last_time = -np.inf
        self._received = 0
        self.start: Start | None = None
        self.carried: list[Carried] = []
        self._stated_errors = ChannelErrors.stated(array, errors)
        self._reduction = Reduction(self.sets, errors, period)
        self._samples = self._reduction.none(len(self._references.variance))
        self._raw = np.zeros((0, array.n_channels))
        self._base = self._done = 0  # number in the stream of buffer row 0; buffer row to filter next
        self._resumed = 0  # buffer row to filter next, behind a first block that rests
        self._pending: dict[int, list[Carried]] = {}  # states before the ends of blocks that may be rest, by number
        self.restarts = 0
        self._sign = SignDecision()
        self._disagreeing = 0.0  # share of the last samples whose channels disagree

    @property
    def started(self) -> bool:
        """Whether the start was inferred."""
        return self.start is not None

    @property
    def sign(self) -> SignDecision:
        """Whether the sign of the rate is certain, after the samples so far."""
        return self._sign

    @property
    def report(self) -> ChannelReport:
        """What was wrong with the channels so far."""
        return replace(self._reduction.report(), restarts=self.restarts)

    def push(self, t: ArrayLike, readings: ArrayLike, references: ArrayLike | None = None) -> RateEstimate:
        """Take one sample or a block; returns the estimates that are ready.

        Parameters
        ----------
        t : array_like, scalar or shape (n,)
            Sample times, s, later than all before.
        readings : array_like, shape (c,) or (n, c)
            Specific force, m/s²; NaN where a channel is missing.
        references : array_like, shape (f,) or (n, f), optional
            Values of all references, in their order, as of a gyro (3,), rad/s; NaN where there is none.

        Raises
        ------
        InputError
            If the shapes don't fit, time does not increase, or the path is asked for.
        """
        if self._path is not None:
            raise InputError("a stream has no path: give the whole recording to filter_rate")
        times, rows, beside = self._checked(t, readings, references)
        found = []
        # The last sample of each block of the rest test by itself, so that the answer is that of single samples.
        to_end = self._window - self._received % self._window
        ends = range(to_end, len(times) + 1, self._window)
        edges = sorted({0, len(times), *ends, *(end - 1 for end in ends)})
        for first, last in pairwise(edges):
            self._waiting.append((times[first:last], rows[first:last], beside[first:last]))
            self._received += last - first
            if not self.started and self._received >= self._window + self._ahead:
                self._begin(self._window)
            if self.started:
                found.append(self._estimate(*self._advance(closing=False)))
        return joined_estimates(found) if found else self._estimate(*self._nothing())

    def finish(self) -> RateEstimate:
        """Return the estimates of the last samples."""
        if not self.started:
            if not self._waiting:
                return self._estimate(*self._nothing())
            self._begin(self._window)
        return self._estimate(*self._advance(closing=True))

    def _nothing(self) -> tuple[Samples, list[Estimates]]:
        return self._reduction.none(len(self._references.variance)), [Estimates.empty(0)]

    def _checked(
        self, t: ArrayLike, readings: ArrayLike, references: ArrayLike | None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return samples as arrays (n,), (n, c) and (n, f)."""
        times = np.atleast_1d(np.asarray(t, dtype=float))
        rows = np.atleast_2d(np.asarray(readings, dtype=float))
        if rows.shape != (len(times), self.array.n_channels):
            raise InputError(
                f"readings have shape {rows.shape}; {len(times)} times of array {self.array.name!r} need "
                f"({len(times)}, {self.array.n_channels})"
            )
        if len(times) and not (
            np.isfinite(times).all() and times[0] > self._last_time and np.all(times[1:] > times[:-1])
        ):
            raise InputError("sample times must be finite and increase; drop repeated or reordered samples")
        shape = (len(times), len(self._references.variance))
        beside = np.full(shape, np.nan)
        if references is not None:
            beside = np.atleast_2d(np.asarray(references, dtype=float))
            if beside.shape != shape:
                raise InputError(f"references have shape {beside.shape}; {len(times)} times need {shape}")
        if len(times):
            self._last_time = float(times[-1])
        return times, rows, beside

    def _take_recording(self, t: ArrayLike, readings: ArrayLike, references: ArrayLike | None = None) -> None:
        """Take a whole recording, begin and reduce it."""
        self._waiting = [self._checked(t, readings, references)]
        self._begin(len(self._waiting[0][0]), whole=True)

    def _begin(self, known: int, *, whole: bool = False) -> None:
        """Measure the noise by the first ``known`` samples, or the ``whole`` recording; infer the start."""
        t, rows, _ = (np.concatenate(column)[:known] for column in zip(*self._waiting, strict=True))
        usable = np.where(np.abs(rows) < self.errors.limits, rows, np.nan)
        if self.settings.measure_noise:
            self.sets = ChannelSets(self.array, measured_noise(self.sets, usable, self.period))
            times = timing_noise(self.sets, t, usable)
            self.errors = replace(self.errors, timing_std=max(self.errors.timing_std, times))
        self._consider(usable, whole=whole)
        sets, m, q = self.sets, self.sets.products, len(self._reduction.considered)
        first = usable[: self._window]
        complete = first[np.isfinite(first).all(axis=1)]
        noise = self.errors.noise_at_rest(sets.noise_std)
        still = bool(np.any(still_blocks(first, noise, self.period, self._test.of_start)))
        prior = sets.bias_covariance(np.diag(self.errors.bias_std**2), path=self._path is not None)
        self.start = start = self._inferred(complete, prior, still=still)
        prior = start.bias_factor * prior
        at = Places.of(m, q, path=self._path is not None, references=len(self._reference_std))
        self.tuning: Tuning = tuning_of(
            sets, self.errors, self.period, self.settings, at=at, compares=start.sign_open,
            solved_in_motion=at.end if self._rate_is_measured else at.products,
            path=(self._path or PathStart()).tuning(self._window),
            references=self._references,
        )  # fmt: skip
        self._judge = RestJudge(sets.full.alpha_noise / self._window, self._test)
        self._signs = SignJudge(sets, start, self.period)
        before = self._covariance_before(prior)
        carried = Carried.at_start(
            t[0],
            start.omega,
            start.std,
            before,
            prior[3 : 3 + m, 3 : 3 + m] + self._errors_of_products,
            sets.full.sensitivity,
        )
        if start.sign_open:
            carried.counts[SOLVED] = self.tuning.solved_in_motion
        elif still and self.settings.rest is not None and not start.omega.any() and len(complete) == len(first):
            self._learnt(prior, complete).put(carried, self.tuning.at)
            carried.last_z[:] = sets.full.product_rows @ complete[-1]
            carried.counts[[STARTED, RESTING]], carried.counts[STILL] = 1, self.tuning.rest_entry
            carried.scalars[[TIME, LAST_ALPHA]] = t[len(complete) - 1]
            self._resumed = len(complete)
        self.carried = [carried]
        if start.sign_open and start.omega.any():
            mirrored = carried.copy()
            mirrored.x[:3] = -start.omega
            self.carried.append(mirrored)

    def _inferred(self, complete: NDArray[np.float64], prior: NDArray[np.float64], *, still: bool) -> Start:
        """Return the start that is stated, or that the complete readings (k, c) of the first block show."""
        if self.settings.start_omega is not None:
            std = np.full(3, self.settings.start_std)
            return Start("given", self.settings.start_omega, std, np.diag(std**2))
        turned = self._errors_of_mean(complete)
        seen = slice(3, 3 + self.sets.products)
        spread = prior[seen, seen] + turned[seen] @ turned[seen].T
        z = complete @ self.sets.full.product_rows.T
        return infer_start(self.sets, z, spread, still=still, rest_std=self._test.rate_std)

    def _covariance_before(self, biases: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the covariance of the state before the run, but for the rate, (n, n)."""
        at = self.tuning.at
        references, errors = range(at.references, at.errors), range(at.errors, at.end)
        before = np.zeros((at.end, at.end))
        settled = (1.0 + self.tuning.overshoot) / (1.0 - self.tuning.overshoot)
        before[3:6, 3:6] = settled * self.sets.full.alpha_noise
        before[at.alpha : at.references, at.alpha : at.references] = biases
        before[references, references] = self._reference_std**2
        before[errors, errors] = 1.0
        return before

    def _advance(self, *, closing: bool) -> tuple[Samples, list[Estimates]]:
        """Filter the samples that are ready; returns them, and the estimates of each track."""
        until = self._prepare(closing=closing)
        first = self._done
        if until == first:
            return self._nothing()
        outputs = [self._resting(first, until) for _ in self.carried]
        self._filter(self._resumed, until, outputs, -first)
        self._done = self._resumed = until
        self.restarts += int(outputs[0].restart.sum())
        ready = Samples._make(column[first:until] for column in self._samples)
        self._trim()
        return ready, outputs

    def _resting(self, first: int, last: int) -> Estimates:
        """Return room for rows ``first`` to ``last − 1``, with the estimates of a first block that rests."""
        out = Estimates.empty(last - first, path=self._path is not None)
        if first < self._resumed:
            rows = slice(0, self._resumed - first)
            out.omega[rows], out.covariance[rows] = 0.0, 0.0
            out.covariance[rows, :3] = self.tuning.rest_variance
            out.rest[[end - 1 - first for end in range(self._window, self._resumed + 1, self._window)]] = True
        return out

    def _filter(self, first: int, last: int, outputs: list[Estimates], offset: int) -> None:
        """Filter rows ``first`` to ``last − 1`` with each track, and keep the states before ends of open blocks."""
        tables, record = self.sets.tables(), self._record(0)
        ends = self._block_ends(first, last)
        window = self._window
        open_ends = [end for end in ends if (end + self._base) // window >= self._judge.final]
        for begin, end in pairwise([first, *open_ends, last]):
            if begin in open_ends:
                self._pending[begin + self._base] = [carried.copy() for carried in self.carried]
            for carried, out in zip(self.carried, outputs, strict=True):
                follow(self._samples, Given.nothing(), begin, end, tables, self.tuning, carried, out, offset, record)

    def _block_ends(self, first: int, last: int) -> range:
        """Return the rows among ``first`` to ``last − 1`` at which a block for the rest test ends."""
        if self.settings.rest is None:
            return range(0)
        window = self._window
        return range(first + (-(first + self._base) - 1) % window, last, window)

    def _prepare(self, *, closing: bool) -> int:
        """Reduce the samples that wait and judge them for rest; returns the row up to which they can be filtered."""
        if self._waiting:
            t, rows, beside = (np.concatenate(column) for column in zip(*self._waiting, strict=True))
            self._waiting = []
            new = self._reduction.reduce(self._raw, self._samples, t, rows, beside)
            self._samples = Samples._make(
                np.concatenate([old, added]) for old, added in zip(self._samples, new, strict=True)
            )
            self._raw = np.concatenate([self._raw, rows])
        samples, n = self._samples, len(self._samples.t)
        until = n if closing else max(self._done, n - self._ahead)
        low = max(0, self._done - _HISTORY)
        self._reduction.add_errors(samples, max(0, self._done - self._ahead))
        columns = np.concatenate([samples.alpha[low:, :, None], samples.alpha_errors[low:]], axis=2)
        rates, quadrature = columns.reshape(n - low, -1), self.settings.quadrature
        integrated = integrals(samples.t[low:], rates, samples.channel_set[low:], self.period, quadrature)
        integrated = integrated.reshape(columns.shape)[self._done - low :]
        samples.increment[self._done : n] = integrated[:, :, 0]
        samples.error_increment[self._done : n] = integrated[:, :, 1:]
        self._judge_blocks(closing=closing)
        return until

    def _record(self, length: int) -> Record:
        m = self.sets.products
        at = self.tuning.at
        return Record.empty(length, at.alpha, at.end, m + 15 + len(self._references.variance))

    def _judge_blocks(self, *, closing: bool) -> None:
        """Mark the blocks that are decided to be rest or not; filter again from the end of one that is decided anew."""
        window, samples = self._window, self._samples
        first = len(self._judge) * window - self._base
        if self.settings.rest is None or (len(self._raw) - first < window and not closing):
            return
        noise = self.errors.noise_at_rest(self.sets.noise_std)
        still = still_blocks(self._raw[first:], noise, self.period, self._test)
        alpha = samples.alpha[first : first + len(still) * window].reshape(-1, window, 3).mean(axis=1)
        for block, verdict in self._judge.decide(still, alpha, closing=closing):
            row = (block + 1) * window - 1 - self._base
            if row < 0 or row < self._resumed - self._done:  # the first block, from which the filter started
                continue
            changes, samples.still[row] = samples.still[row] != verdict, verdict
            final = block < self._judge.final
            before = self._pending.pop(row + self._base, None) if final else None
            if changes and before is not None:
                self.carried = before
                again = [Estimates.empty(self._done - row) for _ in before]
                self._filter(row, self._done, again, -row)

    def _trim(self) -> None:
        """Drop rows that nothing needs any longer."""
        pending = [row - self._base for row in self._pending]
        keep = min(self._done - max(_HISTORY, self._window), *pending, len(self._raw))
        keep = min(keep, len(self._judge) * self._window - self._base, len(self._raw) - self.errors.stuck_after)
        if keep > 4 * self._window:
            self._samples = Samples._make(column[keep:].copy() for column in self._samples)
            self._raw = self._raw[keep:].copy()
            self._base += keep
            self._done -= keep
            self._resumed -= keep

    @property
    def noise_ratio(self) -> float:
        """Measured noise of the channels over the stated one, root mean square."""
        return float(np.sqrt(np.mean(np.square(self.sets.noise_std / self.errors.noise_std))))

    @property
    def samples(self) -> Samples:
        """The samples that are kept, of a recording all."""
        return self._samples

    def run_recording(
        self,
        t: ArrayLike,
        readings: ArrayLike,
        references: ArrayLike | None = None,
        *,
        smooth: bool,
        until_stays: bool = False,
    ) -> list[Estimates]:
        """Filter a whole recording at once, and smooth it if asked; returns the estimates of each rate followed.

        ``until_stays``: the smoother is repeated about its last rates until they stay, whatever the run.

        The statistics of the innovations are those of the filter.
        """
        self._take_recording(t, readings, references)
        until = self._prepare(closing=True)
        outputs = []
        for index, carried in enumerate(self.carried):
            if self._path is not None:
                self._start_path(carried, self._path)
            start, out = carried.copy(), self._resting(0, until)
            self._rest_path(carried, out, carried.attitude, np.diag(carried.covariance)[TILT:])
            report = partial(self._report_progress, index)
            kept = self._forward(carried, Given.nothing(), out, report)
            if smooth:
                end = self._smooth(start, carried, kept, out, report, until_stays=until_stays)
                if self._path is not None and until > self._resumed:
                    path = out.path
                    self._rest_path(end, out, path.attitude[self._resumed], path.variance[self._resumed])
            outputs.append(out)
        self._done = self._resumed = until
        self.restarts += int(outputs[0].restart.sum())
        return outputs

    def _start_path(self, carried: Carried, path: PathStart) -> None:
        """Put the attitude at the first sample into a state, and what a first block of rest shows."""
        samples, policy, at = self._samples, path.policy, self.tuning.at
        if path.attitude is None:
            bias = carried.covariance[range(at.alpha, at.products), range(at.alpha, at.products)].max()
            enough = np.sqrt(2.0 * policy.level_turn / np.sqrt(bias)) if bias > 0.0 else np.inf
            first = samples.t <= samples.t[0] + min(policy.level_s, enough)
            if self._resumed:
                attitude, _ = levelled(samples.t[first], 0.0 * samples.alpha[first], samples.force[first], np.zeros(3))
                std = policy.unknown_tilt_std
            else:
                attitude, std = levelled(samples.t[first], samples.alpha[first], samples.force[first], carried.x[:3])
        else:
            attitude, std = path.attitude / np.linalg.norm(path.attitude), path.attitude_std
        carried.attitude[:] = attitude
        carried.covariance[TILT, TILT] = carried.covariance[TILT + 1, TILT + 1] = std**2
        if self._resumed:
            tables, gain = self.sets.tables(), np.zeros(len(carried.x))
            rest_on_path(
                samples, 0, self._resumed - 1, tables, self.tuning, carried, len(carried.x), 1.0, gain,
                self._record(0), -1,
            )  # fmt: skip
            with_attitude(carried, settled(carried))

    def _rest_path(
        self, known: Carried, out: Estimates, attitude: NDArray[np.float64], variance: NDArray[np.float64]
    ) -> None:
        """Fill in the path over a first block that rests, with the constants of a state."""
        if self._path is None or not self._resumed:
            return
        rows = slice(0, self._resumed)
        samples = Samples._make(column[rows] for column in self._samples)
        path, constants = out.path, Constants.of_state(known, self.tuning.at)
        path.attitude[rows], path.line[rows], path.variance[rows] = attitude, 0.0, variance[:ROWS]
        for part, values, (lasting, slopes), noise in (
            (slice(0, 3), samples.alpha, constants.of_alpha(samples), self.sets.full.alpha_noise),
            (slice(3, 6), samples.force, constants.of_force(samples), self.sets.full.force_noise),
        ):
            path.motion[rows, part] = values - lasting
            spread = constants.variance_by(slopes) + noise
            path.motion_variance[rows, part] = np.diagonal(spread, axis1=1, axis2=2)

    def _forward(
        self, carried: Carried, given: Given, out: Estimates, report: Callable[[float], object]
    ) -> list[tuple[int, int, Carried]]:
        """Filter a whole recording; returns blocks of it, each with the state before."""
        kept, until = [], len(out.nis)
        tables, record = self.sets.tables(), self._record(0)
        for first in range(self._resumed, until, _SMOOTHER_BLOCK):
            last = min(first + _SMOOTHER_BLOCK, until)
            kept.append((first, last, carried.copy()))
            follow(self._samples, given, first, last, tables, self.tuning, carried, out, 0, record)
            report(0.4 * last / until)
        return kept

    def _smooth(
        self,
        start: Carried,
        end: Carried,
        kept: list[tuple[int, int, Carried]],
        out: Estimates,
        report: Callable[[float], object],
        *,
        until_stays: bool,
    ) -> Carried:
        """Replace estimates of a filter by smoothed ones; returns the last state.

        If asked, or where the errors of the null space were not estimated from the first sample on, everything is
        linearised about the last rates and estimated anew, until the rates stay: Gauss and Newton's method for the
        whole run (B. M. Bell, The iterated Kalman smoother as a Gauss-Newton method, SIAM J. Optim. 4, 1994).
        """
        solved = start.counts[SOLVED] == len(start.x) and not out.restart.any()
        if solved:
            self._backward(end, kept, Given.nothing(), out, report)
            if not until_stays and (self._path is None or not out.rest[self._resumed :].any()):
                return end
        start.counts[SOLVED] = len(start.x)
        for _ in range(_PASSES):
            before, attitude = out.omega.copy(), out.path.attitude.copy()
            given = Given(before, out.inflation, out.rest, out.restart, attitude, out.path.levelled)
            again = self._resting(0, len(out.nis))
            end = start.copy() if self._path is None else with_attitude(start.copy(), attitude[0])
            kept = self._forward(end, given, again, report)
            self._backward(end, kept, given, out, report)
            moved = np.abs(out.omega - before) / np.sqrt(out.covariance[:, :3])
            if np.nanmean(moved) < _STAYS:
                break
        return end

    def _backward(
        self,
        end: Carried,
        kept: list[tuple[int, int, Carried]],
        given: Given,
        out: Estimates,
        report: Callable[[float], object],
    ) -> None:
        """Smooth blocks of a recording from the last to the first; fills the rates and their covariance."""
        size, until = len(kept[0][2].x) if kept else 0, len(out.nis)
        adjoint, curvature = np.zeros(size), np.zeros((size, size))
        tables, record, again = (
            self.sets.tables(),
            self._record(_SMOOTHER_BLOCK),
            Estimates.empty(_SMOOTHER_BLOCK, path=self._path is not None),
        )
        for first, last, state in reversed(kept):
            follow(self._samples, given, first, last, tables, self.tuning, state, again, -first, record)
            smooth_back(
                self._samples,
                record,
                out.restart,
                first,
                last,
                tables,
                self.tuning,
                end,
                adjoint,
                curvature,
                out,
                again,
            )
            report(1.0 - 0.6 * first / until)

    def follow_rates(self, single: SingleRates | None = None) -> Estimates:
        """Integrate a recording whose leading rest is known: α, or the path of rates of single samples."""
        carried, until = self.carried[0], len(self._samples.t)
        if single is not None and not self._resumed:
            known = np.flatnonzero(np.isfinite(single.omega).all(axis=1))
            carried.x[:3] = single.omega[known[0]] if known.size else 0.0
        if self._path is not None:
            self._start_path(carried, self._path)
        out = self._resting(0, until)
        self._rest_path(carried, out, carried.attitude, np.diag(carried.covariance)[TILT:])
        integrate_open(
            self._samples, Given.nothing(), single or no_rates(), self._resumed, until, self.sets.tables(),
            self.tuning, carried, out,
        )  # fmt: skip
        return out

    def leading_rest(self, t: ArrayLike, readings: ArrayLike) -> tuple[Constants, NDArray[np.bool_]]:
        """Reduce a whole recording, and begin behind the rest at its start, if any.

        Returns the constants by that rest, and the samples (n,) of it.
        """
        self._take_recording(t, readings)
        self._prepare(closing=True)
        window, at = self._window, self.tuning.at
        rest = np.zeros(len(self._samples.t), dtype=np.bool_)
        prior = self.carried[0].prior[at.alpha : at.references, at.alpha : at.references]
        if self._resumed:
            verdicts = self._samples.still[2 * window - 1 :: window]
            moves = np.flatnonzero(np.append(verdicts, MOVES) < DOUBTED)[0]
            rests = np.flatnonzero(verdicts[:moves] == RESTS)  # a block in doubt is rest where the rest goes on
            rest[: (1 + (int(rests[-1]) + 1 if rests.size else 0)) * window] = True
        usable = np.where(np.abs(self._raw) < self.errors.limits, self._raw, np.nan)[rest]
        constants = self._learnt(prior, usable[np.isfinite(usable).all(axis=1)])
        if self._resumed:
            self._resumed = int(rest.sum())
            constants.put(self.carried[0], at)
            self.carried[0].scalars[[TIME, LAST_ALPHA]] = self._samples.t[self._resumed - 1]
        return constants, rest

    def constants(self, index: int = 0) -> Constants:
        """Return biases and errors of the channels as a track knows them now."""
        return Constants.of_state(self.carried[index], self.tuning.at)

    def channel_biases(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the biases (c,), m/s², that α, the null space and the parity rows show now, and their covariance.

        They are the least ones: what of a bias looks like a specific force stays unknown.
        """
        parity, known = self.sets.parity_rows, 3 + self.sets.products
        back = np.linalg.pinv(np.vstack([self.sets.rows(), parity]))
        constants = self.constants()
        values = np.concatenate([constants.values[:known], self._reduction.parity_mean])
        spread = np.zeros((len(values), len(values)))
        spread[:known, :known] = constants.covariance[:known, :known]
        return np.asarray(back @ values), np.asarray(back @ spread @ back.T)

    def _consider(self, readings: NDArray[np.float64], *, whole: bool) -> None:
        """Choose the errors of the channels that are considered, by the motion in readings (n, c).

        Of a stream that is not ``whole``, further motion in all directions is expected.
        """
        considered, m = None, self.sets.products
        self._errors_of_products = np.zeros((m, m))
        if len(self._stated_errors):
            complete = readings[np.isfinite(readings).all(axis=1)]
            features = features_of(self.array, complete, np.ones(self.array.n_channels, dtype=np.bool_))
            moments = features.T @ features / max(len(features), 1)
            if not whole:
                moments = moments + usual_moments()
            considered = self._stated_errors.excited(self.sets, moments, self.period, path=self._path is not None)
            self._errors_of_products = considered.covariance_of(self.sets.full.product_rows, moments)
        self._reduction = Reduction(self.sets, self.errors, self.period, considered, self._stated_errors)
        self._samples = self._reduction.none(len(self._references.variance))

    def _errors_of_mean(self, readings: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what each considered error makes of the mean of [A y; Z y] over complete readings, (3 + m, q)."""
        considered = self._reduction.considered
        if not (len(considered) and len(readings)):
            return np.zeros((3 + self.sets.products, len(considered)))
        features = features_of(self.array, readings, np.ones(self.array.n_channels, dtype=np.bool_)).mean(axis=0)
        return considered.of_rows(self.sets.rows(), features[None])[0]

    def channel_errors(self, readings: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
        """Return what the errors of the channels, as known now, make of the readings (n, c), m/s², and what is left.

        What is left of all stated errors is a gain error of each channel by itself that would move the null space, with
        its parity rows, as much. Errors that only parity rows show are not estimated, and left whole. A sample that was
        left out has the motion of these readings.
        """
        considered, rows = self._reduction.considered, self.sets.full.null_rows
        if not len(considered):
            return np.zeros(readings.shape), np.inf
        errors = slice(self.tuning.at.errors, self.tuning.at.end)
        values, spread = self.carried[0].x[errors], self.carried[0].covariance[errors, errors]
        blind = (self._samples.channel_set < 0) & np.isfinite(readings).all(axis=1)
        self._samples.features[blind] = features_of(self.array, readings[blind], np.ones(readings.shape[1], dtype=bool))
        motion = self._reduction.smooth_motion(self._samples)
        shown = np.einsum("q,qcf,nf->nc", values, considered.patterns, motion, optimize=True)
        moments = np.cov(motion.T, bias=True)
        seen = rows @ considered.patterns  # (q, d, 12)
        learnt = np.einsum("qdf,fg,rdg,qr->", seen, moments, seen, np.eye(len(values)) - spread, optimize=True)
        moved = np.trace(self._stated_errors.covariance_of(rows, moments)) - learnt
        stated = float(np.sum(rows**2 @ np.ma.masked_invalid(readings).var(axis=0).filled(0.0)))
        return shown, float(np.sqrt(max(moved, 0.0) / stated)) if stated > 0.0 else np.inf

    def _learnt(self, prior: NDArray[np.float64], readings: NDArray[np.float64]) -> Constants:
        """Return the constants after complete readings (n, c) at rest.

        ``prior`` is the covariance of the biases, [b_α; b_z] and where the path is followed b_p.
        """
        count, q = len(prior), len(self._reduction.considered)
        covariance = np.zeros((count + q, count + q))
        covariance[:count, :count] = prior
        covariance[range(count, count + q), range(count, count + q)] = 1.0
        if not len(readings):
            return Constants(np.zeros(count + q), covariance)
        slopes = np.hstack([np.eye(3 + self.sets.products, count), self._errors_of_mean(readings)])
        spread = slopes @ covariance @ slopes.T + self._noise_of_mean(len(readings))
        gain = np.linalg.solve(spread, slopes @ covariance).T
        shown = self.sets.rows() @ readings.mean(axis=0)
        return Constants(gain @ shown, covariance - gain @ spread @ gain.T)

    def _noise_of_mean(self, count: int) -> NDArray[np.float64]:
        """Covariance of the mean of [A y; Z y] over so many samples at rest, shape (3 + m, 3 + m)."""
        rows = self.sets.rows()
        noise = rows * self.sets.noise_std**2 @ rows.T / count
        noise[range(3), range(3)] += 2.0 * (self._test.rate_std / (count * self.period)) ** 2
        return np.asarray(noise)

    def _report_progress(self, track: int, share: float) -> None:
        if self._progress is not None:
            self._progress((track + share) / len(self.carried))

    def _estimate(self, samples: Samples, tracks: list[Estimates]) -> RateEstimate:
        """Return the estimate of the rate that is followed, or of the more probable one of two."""
        out = tracks[0]
        found = self.estimate_of(samples.t, out)
        if not len(found) or self.start is None:
            return found
        for large in out.inflation > DISAGREEING:
            self._disagreeing += (large - self._disagreeing) * self.period / _DOUBT_S
        doubt = self.start.sign_open or self.restarts > 0 or self._disagreeing >= DISAGREES_OFTEN
        if self.sign_is_measured:
            if len(tracks) > 1:
                best, sure = likelier(*self.carried)
                found = self.estimate_of(samples.t, tracks[best], index=best)
                self._decide(best, sure)
                return replace(found, sign_probability=np.full(len(found), sure))
            return replace(found, sign_probability=np.ones(len(found)))
        if not (self._signs.possible and doubt):
            return replace(found, sign_probability=np.full(len(found), 0.5 if self.start.sign_open else 1.0))
        chance = self._signs.of_stream(samples, self.constants(), out, found.rest)
        if len(tracks) > 1:
            best, sure = likelier(*self.carried)
            other = self.estimate_of(samples.t, tracks[1], index=1)
            sure = 1.0 if merged(found, other) else sure
            if sure < DECIDED and clear_of_zero(found.omega[-1:], found.std[-1:])[0]:
                best, sure = int(chance[-1] < 0.5), max(chance[-1], 1.0 - chance[-1])
            self._decide(best, sure)
        if not self.start.sign_open or len(self.carried) == 1:
            chance = with_filter(chance)
        signed = with_signs(found, chance, known=not self.start.sign_open)
        self._sign = signed.sign
        return signed

    def _decide(self, best: int, sure: float) -> None:
        """Follow one of two rates alone, where it is sure enough."""
        if sure >= DECIDED:
            self.carried = [self.carried[best]]
            self._pending = {row: [kept[best]] for row, kept in self._pending.items()}

    def estimate_of(
        self, t: NDArray[np.float64], out: Estimates, method: str = "filter", index: int = 0
    ) -> RateEstimate:
        """Return a result of a track's output."""
        sign = SignDecision("undecided", 0.0) if len(self.carried) > 1 or self.restarts else SignDecision()
        carried = self.carried[index] if self.carried else None
        biases = slice(self.tuning.at.alpha, self.tuning.at.errors) if self.carried else slice(0)
        return RateEstimate(
            method, t, out.omega, full_covariance(out.covariance), out.nis, out.dof,
            spread_rest(out.rest, self._window), sign,
            bias=None if carried is None else carried.x[biases].copy(),
            bias_covariance=None if carried is None else carried.covariance[biases, biases].copy(),
            channels=self.report, scale=self.noise_ratio * np.sqrt(out.inflation), stated_nis=out.stated,
            start=self.start, path=None if self._path is None or not len(t) else self._body_path(out),
        )  # fmt: skip

    def _body_path(self, out: Estimates) -> BodyPath:
        """Return the path of a recording; no α and p where too few channels are there."""
        path, std = out.path, np.sqrt(np.maximum(out.path.variance, 0.0))
        seen = (self._samples.channel_set >= 0)[:, None]
        motion, spread = (np.where(seen, one, np.nan) for one in (path.motion, np.sqrt(path.motion_variance)))
        return BodyPath(
            path.attitude, std[:, :3], path.line[:, :3], std[:, 3:6], path.line[:, 3:6], std[:, 6:9], path.line[:, 6],
            std[:, 9], motion[:, :3], spread[:, :3], motion[:, 3:], spread[:, 3:],
        )  # fmt: skip


def spread_rest(ends: NDArray[np.bool_], window: int) -> NDArray[np.bool_]:
    """Mark every sample of the blocks of rest of ``window`` samples that end at ``ends``, shape (n,)."""
    rest = np.zeros(len(ends), dtype=bool)
    for end in np.flatnonzero(ends):
        rest[max(end - window + 1, 0) : end + 1] = True
    return rest
