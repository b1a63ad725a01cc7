"""The refinement of an alignment: offset and rate error of the least squares over the overlap, and their errors.

The coefficients of the functions are linear; for every offset and rate error they are solved for (variable projection:
G. Golub, V. Pereyra, SIAM J. Numer. Anal. 10, 1973). The angle of a table is known up to its random walk, and to the
gain and offset of a tachometer where the data ask for them; these are parameters with priors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft
from scipy.interpolate import CubicSpline

from gfimu.recording.joining.signals import Alignment, Signals

__all__ = ["Refinement", "refined"]

_BLOCKS = 20  # of the overlap, whose scatter the standard deviations are of
_LEAST_MOVED = 0.05  # of a block's gradient, that the fit to it leaves
_STEP = 0.25  # of the grid, for derivatives
_FLATTEST = 1e-6  # of a second derivative, in units of its diagonal
_LEAST_FREEDOM = 4.0  # degrees, of a variance from few blocks
_WALK = 6  # terms of the random walk of the angle
_GAIN, _BIAS = 0.01, 0.02  # prior standard deviation of an analogue tachometer's gain, a ratio, and offset, rad/s
_SELDOM = float(np.log(9.0))  # nats: one tachometer in ten is analogue
_SURE = 30.0  # nats by which that is decided: with residuals as correlated as here, ten come by chance
_PER_WINDOW = 4  # rows of the fit per smoothing window
_AT_BOUND = 0.99  # of the largest rate error
_PHASE = 0.7  # rad between tried rate errors, at the end that is further off
_MOST_TRIED, _STARTS = 400, 3
_ITERATIONS, _HALVINGS = 20, 10
_SETTLED = 1e-3  # nats that a last step gains
_SHIFT, _RATE, _TACHO = 0, 1, (2, 3)


@dataclass(frozen=True)
class Refinement:
    """Where the misfit over an overlap is least, and which parameters were free to get there.

    Where it is not decided whether the tachometer is an analogue one, ``rival`` is the best of the other kind, and the
    standard deviations cover it.
    """

    fit: _Fit
    at: NDArray[np.float64]
    free: Sequence[int] = ()
    rival: NDArray[np.float64] | None = None

    @property
    def odds(self) -> float:
        """Log odds over channels that are constant, nats."""
        return float(-0.5 * np.sum(self.fit.share * self.fit.counts * np.log1p(-self.fit.explained(self.at))))

    @property
    def alignment(self) -> Alignment:
        """The alignment, with standard deviations if it is `whole`."""
        found = self.fit.alignment(self.at, self.free)
        if self.rival is None:
            return found
        shift, rate = np.abs(self.rival - self.at)[[_SHIFT, _RATE]]
        offset_std, rate_std = np.hypot([found.offset_std, found.rate_error_std], [shift, rate]).tolist()
        return replace(found, offset_std=offset_std, rate_error_std=rate_std)

    @property
    def whole(self) -> Refinement:
        """The least misfit by all parameters, from the offset and the rate error of this one on."""
        fit = self.fit
        clocks = [_SHIFT, _RATE] if fit.most > 0.0 else [_SHIFT]
        if fit.table is None:
            return Refinement(fit, self.at, clocks)
        table = [*clocks, *range(_TACHO[-1] + 1, len(self.at))]
        at = fit.solved(self.at, table)
        fit = fit.weighted_at(at)
        at = fit.solved(at, table)
        if not fit.walk.any():
            return Refinement(fit, at, table)
        analogue = sorted([*table, *_TACHO])
        starts = [fit.solved(one, sorted([*clocks, *_TACHO])) for one in (at, *fit.best(fit.gains_around(at), 1))]
        other = fit.solved(fit.best(starts, 1)[0], analogue)
        gained = fit.misfit(at) - fit.misfit(other) - _SELDOM - fit.occam(other, analogue)
        if gained > _SURE:
            return Refinement(fit, other, analogue)
        return Refinement(fit, at, table, other if gained > 0.0 else None)


def refined(signals: Signals, offset: float, rate_error: float, most_rate_error: float | None) -> Refinement:
    """Refine offset and rate error by least squares over the overlap.

    Parameters
    ----------
    signals : Signals
        Channels and reference.
    offset, rate_error : float
        Where the search starts.
    most_rate_error : float, optional
        Largest rate error; None evaluates the start alone.
    """
    most = most_rate_error or 0.0
    fit = _Fit.of(signals, offset, rate_error, most)
    at = fit.start(rate_error)
    if most_rate_error is None:
        return Refinement(replace(fit, leaning=fit.table is not None).weighted_at(at), at)
    clocks = [_SHIFT, _RATE] if most > 0.0 else [_SHIFT]
    for leaning in (False, False, True, True) if fit.table is not None else (False, False):
        # The overlap is that of the best clocks yet: of a start further off, rows beyond the ends would count.
        fit = replace(_Fit.of(signals, fit.offset(at), float(at[_RATE]), most), leaning=leaning)
        at = fit.start(float(at[_RATE]))
        fit = fit.weighted_at(at)
        starts = fit.best(fit.rates_around(at, clocks), _STARTS) if leaning else [at]
        [at] = fit.best([fit.solved(start, clocks) for start in starts], 1)
        fit = fit.weighted_at(at)
    return Refinement(fit, at)


@dataclass(frozen=True)
class _Fit:
    """The overlap of channels and reference, and the least squares over it.

    Its parameters are the shift of the clocks in the middle, s, their rate error, the gain error of a tachometer, its
    offset, rad/s, and terms of the random walk of the angle.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times of the rows on the channels' clock less their middle, s.
    y : ndarray, shape (n, c)
        Channels, m/s².
    counted : ndarray, shape (n, c)
        1 where a reading counts, else 0.
    middle, middle_reference : float
        Time of the middle on both clocks where the shift is zero, s.
    ends : tuple of float
        First and last time of the reference, s.
    functions, rate : CubicSpline
        Functions of the reference and its rate by its time.
    table : tuple of CubicSpline, optional
        Angle θ of a table, rad, and smoothed exp(iθ) over exp(iθ).
    turn : float
        Range of the angle, rad, at least 1.
    walk : ndarray, shape (n, terms)
        Random walk of the angle, rad, of unit parameters.
    length : float
        Of the overlap, s.
    step : float
        Of the grid, s.
    most : float
        Largest rate error.
    leaning : bool
        Whether gravity at the table's angle is in the model.
    weight, share : ndarray, shape (c,)
        Inverse variance of an independent sample times the share of samples that are independent; that share.
    """

    t: NDArray[np.float64]
    y: NDArray[np.float64]
    counted: NDArray[np.float64]
    middle: float
    middle_reference: float
    ends: tuple[float, float]
    functions: CubicSpline
    rate: CubicSpline
    table: tuple[CubicSpline, CubicSpline] | None
    turn: float
    walk: NDArray[np.float64]
    length: float
    step: float
    most: float
    leaning: bool
    weight: NDArray[np.float64]
    share: NDArray[np.float64]

    @classmethod
    def of(cls, signals: Signals, offset: float, rate_error: float, most: float) -> _Fit:
        """Return the fit over the overlap at an offset and a rate error."""
        t = signals.start + np.arange(len(signals.readings)) * signals.step
        u = signals.start_reference + np.arange(len(signals.functions)) * signals.step
        begin = max(t[0], offset + (1.0 + rate_error) * u[0])
        end = min(t[-1], offset + (1.0 + rate_error) * u[-1])
        margin = min(0.02 * (end - begin), 1.0)
        rows = np.flatnonzero((t >= begin + margin) & (t <= end - margin))[:: max(signals.width // _PER_WINDOW, 1)]
        middle = 0.5 * (begin + end)
        y, counted = signals.readings[rows], signals.counted[rows]
        terms = np.pi * (np.arange(_WALK if signals.angle_walk else 0) + 0.5)  # Karhunen-Loève, of a random walk
        size = signals.angle_walk * np.sqrt(2.0 * (end - begin)) / terms
        table, turn = None, 1.0
        if signals.angle is not None:
            table = (CubicSpline(u, signals.angle), CubicSpline(u, signals.gravity * np.exp(-1j * signals.angle)))
            turn = max(float(np.ptp(signals.angle)), turn)
        one = np.ones(y.shape[1])
        fit = cls(
            t[rows] - middle,
            np.where(counted, y, 0.0),
            counted.astype(float),
            middle,
            (middle - offset) / (1.0 + rate_error),
            (float(u[0]), float(u[-1])),
            CubicSpline(u, signals.functions),
            CubicSpline(u, signals.rate),
            table,
            turn,
            size * np.sin(terms * (t[rows, None] - begin) / (end - begin)),
            float(end - begin),
            signals.step,
            most,
            False,
            one,
            one,
        )
        return fit.weighted_at(fit.start(rate_error))

    def start(self, rate_error: float) -> NDArray[np.float64]:
        """Return the parameters of no shift and no error but that of the rate."""
        at = np.zeros(_TACHO[-1] + 1 + self.walk.shape[1])
        at[_RATE] = rate_error
        return at

    def offset(self, at: NDArray[np.float64]) -> float:
        """Return the time of the channels' clock at which the reference's reads zero, s."""
        return float(self.middle + at[_SHIFT] - (1.0 + at[_RATE]) * self.middle_reference)

    def reference_times(self, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the times of the rows on the reference's clock, (n,), s."""
        return np.clip((self.t - at[_SHIFT]) / (1.0 + at[_RATE]) + self.middle_reference, *self.ends)

    def matrix(self, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a constant, the functions of the reference and gravity at the angle, (n, 1 + k + 2)."""
        u = self.reference_times(at)
        functions = self.functions(u)
        gain, bias = at[list(_TACHO)]
        if bias:
            functions[:, 0] += 2.0 * bias * self.rate(u)[:, 0]
        columns = [np.ones(len(u)), functions]
        if self.leaning and self.table is not None:
            angle_of, envelope = self.table
            angle = angle_of(u)
            turned = angle + gain * (angle - angle_of(self.middle_reference))
            turned = turned + bias * (u - self.middle_reference) + self.walk @ at[_TACHO[-1] + 1 :]
            wave = envelope(u) * np.exp(1j * turned)
            columns += [wave.real, wave.imag]
        return np.column_stack(columns)

    def coefficients(self, matrix: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the best coefficients of each channel, (1 + k + 2, c), and the inverse of its normal matrix."""
        size = np.maximum(np.sqrt(np.mean(matrix**2, axis=0)), 1e-12)
        scaled = matrix / size
        products = (scaled[:, :, None] * scaled[:, None, :]).reshape(len(scaled), -1)
        normal = (self.counted.T @ products).reshape(-1, len(size), len(size))
        inverse = np.linalg.pinv(normal, rcond=_FLATTEST**2, hermitian=True) / np.outer(size, size)
        return np.einsum("cij,jc->ic", inverse, matrix.T @ self.y), inverse

    def residual(self, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what the best coefficients do not explain, (n, c); 0 where a reading does not count."""
        matrix = self.matrix(at)
        return np.asarray(self.y - self.counted * (matrix @ self.coefficients(matrix)[0]))

    @property
    def counts(self) -> NDArray[np.float64]:
        """Rows of each channel that count, (c,), at least 1."""
        return np.maximum(self.counted.sum(axis=0), 1.0)

    def best(self, starts: Sequence[NDArray[np.float64]], count: int) -> list[NDArray[np.float64]]:
        """Return the parameters of least misfit, the best first."""
        return sorted(starts, key=self.misfit)[:count]

    def variance(self, residual: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the mean square of each channel, (c,)."""
        return np.maximum(np.sum(residual**2, axis=0) / self.counts, 1e-18)

    def explained(self, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the share of each channel's variance that the functions explain, (c,)."""
        total = self.variance(self.y - self.counted * (self.y.sum(axis=0) / self.counts))
        return np.clip(1.0 - self.variance(self.residual(at)) / total, 0.0, 1.0 - 1e-12)

    def weighted_at(self, at: NDArray[np.float64]) -> _Fit:
        """Return the fit with each channel weighted by its residual there and its correlation in time."""
        residual = self.residual(at)
        share = _channels_that_differ(residual) / np.array([_correlation(one) for one in residual.T])
        return replace(self, share=share, weight=share / self.variance(residual))

    def misfit(self, at: NDArray[np.float64]) -> float:
        """Return the negative log likelihood of independent samples and priors, nats; infinite if it isn't finite."""
        value = np.sum(0.5 * self.share * self.counts * np.log(self.variance(self.residual(at))))
        value = value + 0.5 * np.sum(self.prior(range(len(at))) * at**2)
        return float(value) if np.isfinite(value) else float("inf")

    def prior(self, free: Sequence[int]) -> NDArray[np.float64]:
        """Return the inverse prior variance of parameters."""
        whole = [0.0, self.most**-2.0 if self.most else 0.0, _GAIN**-2.0, _BIAS**-2.0, *np.ones(self.walk.shape[1])]
        return np.array(whole)[list(free)]

    def solved(self, at: NDArray[np.float64], free: Sequence[int]) -> NDArray[np.float64]:
        """Return the parameters of least misfit from a start on; a step that raises the misfit is not taken."""
        free, prior, misfit = list(free), self.prior(free), self.misfit(at)
        for _ in range(_ITERATIONS):
            pull, bend = self.curvature(at, free)
            step = -_inverse(bend.sum(axis=0) + np.diag(prior)) @ (pull.sum(axis=0) + prior * at[free])
            for _ in range(_HALVINGS):
                trial = at.copy()
                trial[free] += step
                trial[_RATE] = np.clip(trial[_RATE], -self.most, self.most)
                value = self.misfit(trial)
                if value < misfit:
                    break
                step = 0.5 * step
            else:
                break
            at, gained, misfit = trial, misfit - value, value
            if gained < _SETTLED:
                break
        return at

    def scales(self, size: int) -> NDArray[np.float64]:
        """Return the size of a change of each parameter that matters, (p,)."""
        shift = _STEP * self.step
        return np.array([shift, shift / self.length, 0.1 / self.turn, 0.1 / self.length, *np.full(size - 4, 0.1)])

    def rates_around(self, at: NDArray[np.float64], free: Sequence[int]) -> list[NDArray[np.float64]]:
        """Return starts with all rate errors at which gravity has another phase, shifted as the other functions want.

        Far from the best one gravity's phase slips by whole turns: there are several minima.
        """
        if _RATE not in free:
            return [at]
        plain = replace(self, leaning=False)
        slopes = plain.slopes(at, [_SHIFT, _RATE])
        valley = -float(np.sum(self.weight * slopes[0] * slopes[1]) / max(np.sum(self.weight * slopes[0] ** 2), 1e-300))
        reach = float(np.max(np.abs(self.rate(self.reference_times(at))[:, 0] * (self.t + valley)), initial=1e-9))
        step = max(_PHASE / reach, 2.0 * self.most / _MOST_TRIED)
        starts = [at]
        for rate in np.arange(-self.most, self.most, step):
            one = at.copy()
            one[_SHIFT], one[_RATE] = at[_SHIFT] + valley * (rate - at[_RATE]), rate
            starts.append(one)
        return starts

    def gains_around(self, at: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        """Return starts with all gains of an analogue tachometer at which gravity has another phase."""
        count = int(min(3.0 * _GAIN * self.turn / _PHASE, _MOST_TRIED)) // 2
        starts = []
        for gain in np.linspace(-3.0, 3.0, 2 * count + 1) * _GAIN if count else [0.0]:
            one = at.copy()
            one[_TACHO[0]] = gain
            starts.append(one)
        return starts

    def slopes(self, at: NDArray[np.float64], free: Sequence[int]) -> NDArray[np.float64]:
        """Return the derivatives of the residual at constant coefficients, projected as it is, (p, n, c)."""
        matrix = self.matrix(at)
        coefficients, inverse = self.coefficients(matrix)
        steps = np.diag(self.scales(len(at)))[list(free)]
        slopes = np.empty((len(steps), *self.y.shape))
        for slope, step in zip(slopes, steps, strict=True):
            change = (self.matrix(at + step) - self.matrix(at - step)) / (2.0 * step.sum())
            moved = self.counted * (change @ coefficients)
            slope[:] = self.counted * (matrix @ np.einsum("cij,jc->ic", inverse, matrix.T @ moved)) - moved
        return slopes

    def occam(self, at: NDArray[np.float64], free: Sequence[int]) -> float:
        """Return how much narrower the tachometer's gain and offset are than their priors, nats."""
        precision = self.curvature(at, free)[1].sum(axis=0) + np.diag(self.prior(free))
        places = [list(free).index(place) for place in _TACHO]
        posterior = np.linalg.pinv(precision)[np.ix_(places, places)]
        return float(-0.5 * np.linalg.slogdet(posterior)[1] - np.log(1.0 / (_GAIN * _BIAS)))

    def curvature(
        self, at: NDArray[np.float64], free: Sequence[int]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return half the gradient of the weighted squares of each block, (blocks, p), and their second derivatives.

        The squares of the slopes alone hold the slope of the reference's noise, which no shift makes less: by shift
        and rate error the gradient is differentiated.
        """
        root, edges = np.sqrt(self.weight), np.searchsorted(self.t / self.length + 0.5, np.arange(1, _BLOCKS) / _BLOCKS)

        def blocks(series: NDArray[np.float64]) -> list[NDArray[np.float64]]:
            return [one.reshape(len(series), -1) for one in np.split(series * root, edges, axis=1)]

        def pulls(at: NDArray[np.float64], slopes: NDArray[np.float64]) -> NDArray[np.float64]:
            residual = blocks(self.residual(at)[None])
            return np.array([one @ other[0] for one, other in zip(blocks(slopes), residual, strict=True)])

        slopes = self.slopes(at, free)
        bend = np.array([one @ one.T for one in blocks(slopes)])
        clocks = [place for place in free if place <= _RATE]
        steps = np.diag(self.scales(len(at)))[clocks]
        second = np.stack(
            [
                (pulls(at + step, self.slopes(at + step, clocks)) - pulls(at - step, self.slopes(at - step, clocks)))
                / (2.0 * step.sum())
                for step in steps
            ]
        )  # (clocks, blocks, clocks)
        size = len(clocks)
        bend[:, :size, :size] = 0.5 * (second.transpose(1, 0, 2) + second.transpose(1, 2, 0))
        return pulls(at, slopes), bend

    def spread(self, at: NDArray[np.float64], free: Sequence[int]) -> NDArray[np.float64]:
        """Return the standard deviations of shift and rate error, (2,); 0 of a rate error that isn't free."""
        if not free:
            return np.full(2, np.nan)
        pull, bend = self.curvature(at, free)
        prior = np.diag(self.prior(free))
        stationary = _inverse(bend.sum(axis=0) + prior)
        # Where few blocks hold the changes of motion, their scatter is small by chance in some recordings.
        variance = np.maximum(_scattered(pull, bend, prior).diagonal(), stationary.diagonal())
        return np.sqrt(variance[:2]) if _RATE in free else np.array([np.sqrt(variance[0]), 0.0])

    def alignment(self, at: NDArray[np.float64], free: Sequence[int]) -> Alignment:
        """Return the alignment that these parameters are."""
        residual, matrix = self.residual(at), self.matrix(at)
        fit, variance, counts = self.weighted_at(at), self.variance(residual), self.counts
        k = self.functions.c.shape[-1]
        coefficients, inverse = self.coefficients(matrix)
        std = np.sqrt(np.maximum(np.einsum("cii->ic", inverse), 0.0) * variance / fit.share)
        rate = float(at[_RATE])
        spread = fit.spread(at, free)
        return Alignment(
            self.offset(at),
            float(spread[0]),
            rate,
            float(spread[1]),
            self.length,
            self.explained(at),
            fit.share * counts,
            coefficients[1 : 1 + k],
            std[1 : 1 + k],
            float("nan"),
            np.zeros(len(counts)),
            self.predicted(matrix) if free else float("nan"),
            _RATE in free and abs(rate) > _AT_BOUND * self.most,
            fit.odds_over_drift(at),
        )

    def odds_over_drift(self, at: NDArray[np.float64]) -> float:
        """Return the log odds of the functions over drifts of the channels that are quadratic in time, nats.

        A rate that is linear in time makes such channels, and looks the same at any offset.
        """
        matrix, k = self.matrix(at), self.functions.c.shape[-1]
        drift = np.column_stack([matrix[:, 0], self.t, self.t**2, matrix[:, 1 + k :]])
        other = self.y - self.counted * (drift @ self.coefficients(drift)[0])
        gained = np.log(self.variance(other) / self.variance(self.residual(at)))
        return float(0.5 * np.sum(self.share * self.counts * gained))

    def predicted(self, matrix: NDArray[np.float64]) -> float:
        """Return the share of a quarter's variance that coefficients from the other three explain, of the worst."""
        quarter = np.minimum(((self.t / self.length + 0.5) * 4).astype(int), 3)
        around = self.y - self.counted * (self.y.sum(axis=0) / self.counts)
        worst = 1.0
        for index in range(4):
            mine = quarter == index
            others = replace(self, counted=self.counted * ~mine[:, None], y=self.y * ~mine[:, None])
            missed = self.y[mine] - self.counted[mine] * (matrix[mine] @ others.coefficients(matrix)[0])
            inside = replace(self, counted=self.counted[mine], y=self.y[mine])
            own = inside.y - inside.counted * (inside.y.sum(axis=0) / inside.counts)
            total = max(float(np.sum(around**2)) / 4.0, float(np.sum(own**2)), 1e-18)
            worst = min(worst, 1.0 - float(np.sum(missed**2)) / total)
        return worst


def _scattered(pull: NDArray[np.float64], bend: NDArray[np.float64], prior: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the covariance of the parameters, (p, p), by the scatter of the blocks' gradients.

    Neither the noise of the reference nor what the functions don't describe is independent from sample to sample: both
    are slow, common to all channels, and large where the motion changes, in few of the blocks. What a block moves of
    its own gradient is corrected for (R. Bell, D. McCaffrey, Survey Methodology 28, 2002: bias-reduced linearization).

    Parameters
    ----------
    pull : ndarray, shape (blocks, p)
        Half the gradient of each block's squares.
    bend : ndarray, shape (blocks, p, p)
        Half their second derivatives.
    prior : ndarray, shape (p, p)
        Inverse covariance of the parameters beforehand.
    """
    whole = bend.sum(axis=0) + prior
    inverse = _inverse(whole)
    size = np.sqrt(inverse.diagonal())
    power, turn = np.linalg.eigh(inverse / np.outer(size, size))
    root = size[:, None] * turn * np.sqrt(np.maximum(power, 1e-300))  # root @ root.T is the inverse
    moved, turns = np.linalg.eigh(np.eye(len(whole)) - root.T @ bend @ root)
    lifted = (turns / np.sqrt(np.maximum(moved, _LEAST_MOVED))[:, None, :]) @ turns.transpose(0, 2, 1)
    scatter = np.einsum("ij,bjk,lk,bl->bi", root, lifted, root, pull)
    # Few blocks may hold nearly all of it. Then it is a variance of few degrees of freedom (F. E. Satterthwaite,
    # Biometrics Bulletin 2, 1946; of Gaussian blocks the fourth power is three times the square of the second), and
    # what it divides has the wider spread of Student's t.
    power = np.maximum(np.square(scatter), 1e-300)
    freedom = np.maximum(3.0 * power.sum(axis=0) ** 2 / np.square(power).sum(axis=0), _LEAST_FREEDOM)
    wider = np.sqrt(freedom / (freedom - 2.0))
    return np.asarray(scatter.T @ scatter * np.outer(wider, wider) + inverse @ prior @ inverse)


def _inverse(bend: NDArray[np.float64]) -> NDArray[np.float64]:
    """Invert second derivatives, (p, p), by absolute values: far from the best fit a step still goes down."""
    size = 1.0 / np.sqrt(np.maximum(np.abs(bend.diagonal()), 1e-300))
    power, turn = np.linalg.eigh(bend * np.outer(size, size))
    power = np.maximum(np.abs(power), _FLATTEST)
    return np.asarray(np.outer(size, size) * ((turn / power) @ turn.T))


def _channels_that_differ(residual: NDArray[np.float64]) -> float:
    """Return which share of the channels counts: an error of the reference is common to all of them."""
    scaled = residual / np.maximum(residual.std(axis=0), 1e-12)
    correlation = scaled.T @ scaled / len(scaled)
    return float(np.trace(correlation) ** 2 / np.sum(correlation**2) / len(correlation))


def _correlation(residual: NDArray[np.float64]) -> float:
    """Return how many samples of a residual count as one: its integrated autocorrelation, at least 1."""
    n = len(residual)
    spectrum = rfft(residual - residual.mean(), next_fast_len(2 * n))
    covariance = irfft(np.abs(spectrum) ** 2, next_fast_len(2 * n))[: n // 2]
    if covariance[0] <= 0.0:
        return 1.0
    normal = covariance / covariance[0]
    below = np.flatnonzero(normal < 0.0)
    stop = int(below[0]) if len(below) else len(normal)
    return float(max(1.0 + 2.0 * normal[1:stop].sum(), 1.0))
