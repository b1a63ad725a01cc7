"""The fit of readings by functions of another file: offset and rate error of the least squares, and their errors.

The coefficients of the functions are linear; for every offset and rate error they are solved for (variable projection:
G. Golub, V. Pereyra, SIAM J. Numer. Anal. 10, 1973). The angle of a table is known up to its random walk, and to the
gain of a tachometer where the data ask for one; these are parameters with priors. A clipped reading states that the
true value lies beyond it (J. Tobin, Econometrica 26, 1958).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft
from scipy.special import log_ndtr

from gfimu.recording.joining.basis import Basis, Readings

__all__ = ["ClockEstimate", "Fit", "leaning", "mixed", "refined"]

_BLOCKS = 20  # of the overlap, whose scatter the standard deviations are of
_LEAST_MOVED = 0.05  # of a block's gradient, that the fit to it leaves
_FLATTEST = 1e-6  # of a second derivative, in units of its diagonal
_LEAST_FREEDOM = 4.0  # degrees, of a variance from few blocks
_WALK = 12  # terms of the random walk of the angle
_UNLIKELY = 1e-3  # share of all fits, below which one does not count
_LARGER, _SIZES = 2.0, 3  # times, by which a walk is larger than the next, and how many are tried
_GAIN = 0.01  # prior standard deviation of an analogue tachometer's gain, a ratio
_SELDOM = float(np.log(9.0))  # nats: one tachometer in ten is analogue
_LEAST_WEIGHT = 1e-3  # of a clipped reading, below which it says nothing
_AT_BOUND = 0.99  # of the largest rate error
_PHASE = 0.7  # rad between tried rate errors, at the end that is further off
_MOST_TRIED, _VALLEY = 400, 4  # rate errors, and those to either side for which the shift is solved
_MARGIN, _LONGEST_MARGIN = 0.02, 1.0  # of the overlap, and s, that are left out at its ends
_ITERATIONS, _HALVINGS = 20, 10
_SETTLED = 1e-3  # nats that a last step gains
_SHIFT, _RATE, _TACHO, _OTHERS = 0, 1, 2, 3


@dataclass(frozen=True)
class ClockEstimate:
    """What a fit found, with standard deviations (shift, s, and rate error); fields as of `Alignment`."""

    std: tuple[float, float]
    explained: NDArray[np.float64]
    independent: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    coefficient_std: NDArray[np.float64]
    lost: float
    odds_of_motion: float


@dataclass(frozen=True)
class Fit:
    """The overlap of readings and functions, and the least squares over it.

    Its parameters ``at`` (p,) are the shift of the clocks in the middle, s, their rate error, the gain error of a
    tachometer, and terms of the random walk of the angle.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times of the rows on the channels' clock less their middle, s.
    readings, beyond : ndarray, shape (n, c)
        Readings, 0 where there is none; and the side of a clipped one on which the true value lies, 0 if not clipped.
    y : ndarray, shape (n, c)
        Readings, a clipped one as what it stands for at the last fit (`censored`).
    weight : ndarray, shape (n, c) or (n, 1)
        How much each counts, in one column where that is the same for all channels.
    basis : Basis
        Functions of the other file.
    middle, middle_reference : float
        Time of the middle on both clocks where the shift is zero, s.
    walk : ndarray, shape (n, terms)
        Random walk of the angle, rad, of unit parameters.
    length, step : float
        Of the overlap and of a row, s.
    most : float
        Largest rate error.
    leaning : bool
        Whether gravity at a table's angle is in the model.
    at : ndarray, shape (p,)
        The parameters.
    free : tuple of int
        Which of them are estimated.
    share : ndarray, shape (c,)
        Share of the rows that are independent.
    """

    t: NDArray[np.float64]
    readings: NDArray[np.float64]
    beyond: NDArray[np.float64]
    y: NDArray[np.float64]
    weight: NDArray[np.float64]
    basis: Basis
    middle: float
    middle_reference: float
    walk: NDArray[np.float64]
    length: float
    step: float
    most: float
    leaning: bool
    at: NDArray[np.float64]
    free: tuple[int, ...]
    share: NDArray[np.float64]

    @classmethod
    def of(
        cls, readings: Readings, basis: Basis, offset: float, rate_error: float, most: float, *, leaning: bool
    ) -> Fit:
        """Return the fit over the overlap at an offset and a rate error."""
        t, u = readings.t_s, basis.times
        begin = max(t[0], offset + (1.0 + rate_error) * u[0])
        end = min(t[-1], offset + (1.0 + rate_error) * u[-1])
        margin = min(_MARGIN * (end - begin), _LONGEST_MARGIN)
        rows = (t >= begin + margin) & (t <= end - margin)
        middle = 0.5 * (begin + end)
        terms = np.pi * (np.arange(_WALK if basis.walk else 0) + 0.5)  # Karhunen-Loève, of a random walk
        size = basis.walk * np.sqrt(2.0 * (end - begin)) / terms
        values, beyond = readings.values[rows], readings.beyond[rows]
        weight = (readings.known[rows] & (beyond == 0.0)).astype(float)
        if np.ptp(weight, axis=1).max(initial=0.0) == 0.0:  # all channels have the same rows
            weight = weight[:, :1]
        at = np.zeros(_OTHERS + len(terms))
        at[_RATE] = rate_error
        fit = cls(
            t[rows] - middle, values, beyond, weight * values, weight, basis, middle,
            (middle - offset) / (1.0 + rate_error), size * np.sin(terms * (t[rows, None] - begin) / (end - begin)),
            float(end - begin), readings.step, most, leaning, at, (_SHIFT, _RATE) if most > 0.0 else (_SHIFT,),
            np.ones(values.shape[1]),
        )  # fmt: skip
        return fit.weighted()

    @property
    def rate_error(self) -> float:
        """Seconds of the channels' clock per second of the reference's, less one."""
        return float(self.at[_RATE])

    @property
    def offset(self) -> float:
        """Time of the channels' clock at which the reference's reads zero, s."""
        return float(self.middle + self.at[_SHIFT] - (1.0 + self.at[_RATE]) * self.middle_reference)

    @property
    def at_bound(self) -> bool:
        """Whether the rate error is at the bound of its search."""
        return _RATE in self.free and abs(self.rate_error) > _AT_BOUND * self.most

    @property
    def counts(self) -> NDArray[np.float64]:
        """Rows of each channel that count, (c,), at least 1."""
        return np.maximum(self.weight.sum(axis=0), 1.0)

    @property
    def explained(self) -> NDArray[np.float64]:
        """Share of each channel's variance that the functions explain, (c,)."""
        total = self.variance(self.y - np.sum(self.weight * self.y, axis=0) / self.counts)
        return np.clip(1.0 - self.variance(self.residual()) / total, 0.0, 1.0 - 1e-12)

    def odds_over(self, explained: NDArray[np.float64] | float) -> float:
        """Return the log odds, nats, of this fit over one that explains less of the same channels."""
        gained = np.log1p(-explained) - np.log1p(-self.explained)
        return float(0.5 * np.sum(self.share * self.counts * gained))

    def with_changes(self, changes: Mapping[int, float]) -> Fit:
        """Return the fit at other parameters."""
        at = self.at.copy()
        at[list(changes)] = list(changes.values())
        return replace(self, at=at)

    def reference_times(self) -> NDArray[np.float64]:
        """Return the times of the rows on the reference's clock, (n,), s."""
        u = (self.t - self.at[_SHIFT]) / (1.0 + self.at[_RATE]) + self.middle_reference
        return np.clip(u, self.basis.times[0], self.basis.times[-1])

    def angle(self) -> NDArray[np.float64]:
        """Return the angle of a table less that in the middle, (n,), rad."""
        return np.asarray(self.basis.angle(self.reference_times()) - self.basis.angle(self.middle_reference))

    def matrix(self) -> NDArray[np.float64]:
        """Return a constant and the functions, (n, k)."""
        turned = self.walk @ self.at[_OTHERS:]
        if self.at[_TACHO]:
            turned = turned + self.at[_TACHO] * self.angle()
        return self.basis.at(self.reference_times(), turned, leaning=self.leaning)

    def solution(self, matrix: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the best coefficients of each channel, (k, c), and the inverse of its normal matrix, (c, k, k)."""
        size = np.maximum(np.sqrt(np.mean(matrix**2, axis=0)), 1e-12)
        scaled = matrix / size
        normal = np.stack([(scaled * one[:, None]).T @ scaled for one in self.weight.T])
        inverse = np.linalg.pinv(normal, rcond=_FLATTEST**2, hermitian=True) / np.outer(size, size)
        inverse = np.broadcast_to(inverse, (self.y.shape[1], *inverse.shape[1:]))
        return np.einsum("cij,jc->ic", inverse, matrix.T @ (self.weight * self.y)), inverse

    def residual(self, matrix: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Return what the best coefficients do not explain, (n, c)."""
        matrix = self.matrix() if matrix is None else matrix
        return np.asarray(self.y - matrix @ self.solution(matrix)[0])

    def variance(self, residual: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the mean square of each channel, (c,)."""
        return np.maximum(np.sum(self.weight * residual**2, axis=0) / self.counts, 1e-18)

    def censored(self) -> Fit:
        """Return the fit with clipped readings as what they stand for at its parameters.

        The likelihood of a value beyond the rail, a normal tail, is replaced by the square that has its slope and
        curvature there.
        """
        clipped = self.beyond != 0.0
        if not clipped.any():
            return self
        residual = self.residual()
        predicted = self.y - residual
        sure = replace(self, weight=np.where(clipped, 0.0, self.weight))
        size = np.sqrt(sure.variance(residual))
        z = self.beyond * (predicted - self.readings) / size  # above zero: the prediction is beyond the rail
        slope = np.exp(-0.5 * z**2 - log_ndtr(z)) / np.sqrt(2.0 * np.pi)
        curvature = slope * (slope + z)
        weight = np.where(clipped, np.where(curvature > _LEAST_WEIGHT, curvature, 0.0), self.weight)
        stands_for = predicted + self.beyond * size * slope / np.maximum(curvature, _LEAST_WEIGHT)
        y = np.where(clipped & (weight > 0.0), stands_for, np.where(clipped, 0.0, self.y))
        return replace(self, y=y, weight=weight)

    def weighted(self) -> Fit:
        """Return the fit with each channel weighted by the correlation of its residual in time."""
        residual = self.residual() * (self.weight > 0.0)
        share = _channels_that_differ(residual) / np.array([_correlation(one) for one in residual.T])
        return replace(self, share=share)

    def misfit(self) -> float:
        """Return the negative log likelihood of independent samples and priors, nats; infinite if it isn't finite."""
        value = np.sum(0.5 * self.share * self.counts * np.log(self.variance(self.residual())))
        value = value + 0.5 * np.sum(self.prior * self.at**2)
        return float(value) if np.isfinite(value) else float("inf")

    @property
    def prior(self) -> NDArray[np.float64]:
        """Inverse prior variance of all parameters, (p,)."""
        rate = self.most**-2.0 if self.most else 0.0
        return np.array([0.0, rate, _GAIN**-2.0, *np.ones(self.walk.shape[1])])

    def solved(self) -> Fit:
        """Return the fit at its least misfit from here on; a step that raises the misfit is not taken."""
        fit, free, misfit = self, list(self.free), self.misfit()
        prior = self.prior[free]
        for _ in range(_ITERATIONS):
            pull, bend = fit.curvature()
            step = -_inverse(bend.sum(axis=0) + np.diag(prior)) @ (pull.sum(axis=0) + prior * fit.at[free])
            for _ in range(_HALVINGS):
                at = fit.at.copy()
                at[free] += step
                at[_RATE] = np.clip(at[_RATE], -self.most, self.most)
                trial = replace(fit, at=at)
                value = trial.misfit()
                if value < misfit:
                    break
                step = 0.5 * step
            else:
                break
            fit, gained, misfit = trial, misfit - value, value
            if gained < _SETTLED:
                break
        return fit

    def settled(self) -> Fit:
        """Return the fit at its least misfit, with clipped readings and weights by it."""
        return self.solved().censored().weighted().solved()

    def other_rates(self) -> list[Fit]:
        """Return starts with all rate errors at which gravity has another phase, shifted as the other functions want.

        Far from the best one gravity's phase slips by whole turns: there are several minima.
        """
        if _RATE not in self.free:
            return [self]
        now, fit, valley = self.rate_error, replace(self, leaning=False, free=(_SHIFT,)), []
        for rates in (np.linspace(now, self.most, _VALLEY), np.linspace(now, -self.most, _VALLEY)[1:]):
            along = fit
            for rate in rates.tolist():
                along = along.with_changes({_RATE: rate}).solved()
                valley.append(along.at[[_RATE, _SHIFT]])
        valley.sort(key=lambda one: float(one[0]))
        rates, shifts = np.array(valley).T
        slope = (shifts[-1] - shifts[0]) / max(rates[-1] - rates[0], 1e-9)
        reach = float(np.max(np.abs(self.basis.angle(self.reference_times(), 1) * (self.t + slope)), initial=1e-9))
        tried = np.arange(-self.most, self.most, max(_PHASE / reach, 2.0 * self.most / _MOST_TRIED))
        moved = zip(np.interp(tried, rates, shifts).tolist(), tried.tolist(), strict=True)
        return [self, *(self.with_changes({_SHIFT: shift, _RATE: rate}) for shift, rate in moved)]

    def other_gains(self) -> list[Fit]:
        """Return starts with all gains of an analogue tachometer at which gravity has another phase."""
        count = int(min(3.0 * _GAIN * max(float(np.ptp(self.angle())), 1.0) / _PHASE, _MOST_TRIED)) // 2
        analogue = replace(self, free=(*self.free, _TACHO))
        return [analogue.with_changes({_TACHO: one}) for one in np.linspace(-3.0, 3.0, 2 * count + 1) * _GAIN]

    def whole(self) -> Fit:
        """Return the least misfit by all parameters that are free and the random walk, from here on."""
        fit = replace(self, free=(*self.free, *range(_OTHERS, len(self.at))))
        return fit.settled().settled()

    def like(self, other: Fit) -> Fit:
        """Return the clocks and the kind of tachometer of this fit for the rows and the noise of another."""
        shift = self.offset + (1.0 + self.rate_error) * other.middle_reference - other.middle
        return replace(other, free=self.free, at=np.r_[shift, self.at[_RATE:]])

    def with_larger_walks(self) -> list[Fit]:
        """Return fits with a random walk of the size that the noise of the rates makes, and larger while likelier.

        The rate between two samples of a tachometer is unknown, which adds to the walk of its angle.
        """
        found = [self.solved()]
        while len(self.at) > _OTHERS and len(found) < _SIZES:
            fit = found[-1]
            at = np.r_[fit.at[:_OTHERS], fit.at[_OTHERS:] / _LARGER]
            larger = replace(fit, walk=_LARGER * fit.walk, at=at).solved()
            if larger.surprise() > fit.surprise():
                break
            found.append(larger)
        return found

    def surprise(self) -> float:
        """Return the negative log evidence of the fit's model with the prior odds of its kind of tachometer, nats.

        The likelihood is integrated over the free parameters as a Gaussian about the least misfit (Laplace).
        """
        prior = self.prior[list(self.free)]
        precision = self.curvature()[1].sum(axis=0) + np.diag(prior)
        narrower = np.linalg.slogdet(precision)[1] - np.sum(np.log(prior[prior > 0.0]))
        return self.misfit() + 0.5 * float(narrower) + (_SELDOM if _TACHO in self.free else 0.0)

    def slopes(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the derivatives of the residual at constant coefficients, projected as it is, (p, n, c), and it."""
        matrix = self.matrix()
        by_time, by_angle = self.basis.slopes(self.reference_times(), matrix)
        coefficients, inverse = self.solution(matrix)
        late, turned = by_time @ coefficients, by_angle @ coefficients
        rate = 1.0 + self.at[_RATE]
        changes = {
            _SHIFT: -late / rate,
            _RATE: -late * ((self.t - self.at[_SHIFT]) / rate**2)[:, None],
            _TACHO: turned * self.angle()[:, None] if _TACHO in self.free else turned,
            **{_OTHERS + place: turned * one[:, None] for place, one in enumerate(self.walk.T)},
        }
        moved = np.stack([changes[place] for place in self.free])
        fitted = np.einsum("cij,pjc->pic", inverse, matrix.T @ (self.weight * moved))
        return matrix @ fitted - moved, self.y - matrix @ coefficients

    def curvature(self, *, exact: bool = False) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return half the gradient of the weighted squares of each block, (blocks, p), and their second derivatives.

        The squares of the slopes alone hold the slope of the reference's noise, which no shift makes less. So on
        request the derivatives by shift and rate error are ``exact``: the gradient is differentiated.
        """
        blocks = np.linspace(0, len(self.t), _BLOCKS + 1).astype(int)[:-1]
        scale = self.share / self.variance(self.residual()) * self.weight

        def pulls(fit: Fit) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
            slopes, residual = fit.slopes()
            return np.add.reduceat(np.einsum("pnc,nc->np", slopes, scale * residual), blocks, axis=0), slopes

        pull, slopes = pulls(self)
        pieces = [one.reshape(len(self.free), -1) for one in np.split(slopes * np.sqrt(scale), blocks[1:], axis=1)]
        bend = np.stack([one @ one.T for one in pieces])
        if exact:
            size = self.free.index(_RATE) + 1 if _RATE in self.free else 1
            steps = [0.1 * self.step, 0.1 * self.step / self.length][:size]
            second = np.stack(
                [
                    (
                        pulls(self.with_changes({place: self.at[place] + step}))[0]
                        - pulls(self.with_changes({place: self.at[place] - step}))[0]
                    )[:, :size]
                    / (2.0 * step)
                    for place, step in enumerate(steps)
                ]
            )  # (clocks, blocks, clocks)
            bend[:, :size, :size] = 0.5 * (second.transpose(1, 0, 2) + second.transpose(1, 2, 0))
        return pull, bend

    def estimate(self) -> ClockEstimate:
        """Return what the fit found."""
        matrix = self.matrix()
        coefficients, inverse = self.solution(matrix)
        residual = self.residual(matrix)
        prior = np.diag(self.prior[list(self.free)])
        pull, bend = self.curvature(exact=True)
        # Where few blocks hold the changes of motion, their scatter is small by chance in some recordings.
        stationary = _inverse(bend.sum(axis=0) + prior).diagonal()
        variance = np.maximum(_scattered(pull, bend, prior).diagonal(), stationary)[: len(self.free)]
        std = np.zeros(2)
        std[: min(2, len(self.free))] = np.sqrt(variance[:2])
        by_chance = np.sqrt(np.einsum("cii->ic", inverse).clip(0.0) * self.variance(residual) / self.share)
        return ClockEstimate(
            (float(std[0]), float(std[1])), self.explained, self.share * self.counts, coefficients, by_chance,
            self.lost(matrix), self.odds_over_drift(matrix),
        )  # fmt: skip

    def odds_over_drift(self, matrix: NDArray[np.float64]) -> float:
        """Return the log odds of the functions over drifts of the channels that are quadratic in time, nats.

        A rate that is linear in time makes such channels, and looks the same at any offset.
        """
        gravity = matrix[:, -2:] if self.basis.is_table else matrix[:, :0]
        drift = np.column_stack([matrix[:, 0], self.t, self.t**2, gravity])
        gained = np.log(self.variance(self.residual(drift)) / self.variance(self.residual(matrix)))
        return float(0.5 * np.sum(self.share * self.counts * gained))

    def lost(self, matrix: NDArray[np.float64]) -> float:
        """Return which share of a quarter's variance its own coefficients explain and those of the others do not.

        It is that of the quarter which loses most; a quarter that hardly moves counts as one of mean variance.
        """
        quarter = np.arange(len(self.t)) * 4 // len(self.t)
        mean = np.sum(self.weight * self.y, axis=0) / self.counts
        around, worst = float(np.sum(self.weight * (self.y - mean) ** 2)) / 4.0, 0.0
        for index in range(4):
            mine = (quarter == index)[:, None]
            own, others = (replace(self, weight=self.weight * rows) for rows in (mine, ~mine))
            missed = [
                float(np.sum(own.weight * (self.y - matrix @ one.solution(matrix)[0]) ** 2)) for one in (own, others)
            ]
            inside = np.sum(own.weight * self.y, axis=0) / own.counts
            total = max(around, float(np.sum(own.weight * (self.y - inside) ** 2)), 1e-18)
            worst = max(worst, (missed[1] - missed[0]) / total)
        return worst


def refined(readings: Readings, basis: Basis, offset: float, rate_error: float, most: float) -> Fit:
    """Return the fit at the least misfit near an offset, s, and a rate error, without gravity at a table's angle."""
    for _ in range(2):
        # The overlap is that of the best clocks yet: of a start further off, rows beyond the ends would count.
        fit = Fit.of(readings, basis, offset, rate_error, most, leaning=not basis.is_table)
        fit = fit.settled()
        offset, rate_error = fit.offset, fit.rate_error
    return fit


def leaning(fit: Fit, readings: Readings) -> list[Fit]:
    """Return starts with gravity at a table's angle near a fit without: of an exact tachometer, and an analogue one."""
    plain = replace(Fit.of(readings, fit.basis, fit.offset, fit.rate_error, fit.most, leaning=True), share=fit.share)
    kinds = [plain.other_rates(), *([plain.other_gains()] if fit.basis.walk else [])]
    return [min(starts, key=lambda one: one.misfit()).weighted() for starts in kinds]


def mixed(fits: list[Fit]) -> tuple[Fit, ClockEstimate]:
    """Return the likeliest of fits to the same rows, and its estimate with the uncertainty of which one is right.

    The variance is that of the mixture of all, by their evidence (J. Hoeting et al., Statistical Science 14, 1999).
    """
    surprise = np.array([one.surprise() for one in fits])
    weight = np.exp(surprise.min() - surprise)
    best = fits[int(np.argmax(weight))]
    found, variance = best.estimate(), np.zeros(2)
    for one, share in zip(fits, weight / weight.sum(), strict=True):
        if share > _UNLIKELY:
            std = np.array((found if one is best else one.estimate()).std)
            variance += share * (std**2 + (one.at - best.at)[[_SHIFT, _RATE]] ** 2)
    return best, replace(found, std=(float(variance[0] ** 0.5), float(variance[1] ** 0.5)))


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
