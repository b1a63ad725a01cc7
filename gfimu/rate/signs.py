"""The sign of a filter's rates, where it is in doubt: ω and −ω give the same products.

Each sample's own rate, known but for its sign, is put into the chain of signs (`gfimu.rate.sign_chain`), which compares
its change with the integral of α. The filter's rate then has the sign of the chain with the probability that both rates
are alike.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gfimu.rate.channel_sets import ChannelSets
from gfimu.rate.constants import Constants
from gfimu.rate.filter_state import LIKELIHOOD, WANDER, Carried, Estimates, Samples
from gfimu.rate.maximum_likelihood import rates_of_null_space
from gfimu.rate.residual import bounded_covariance, least_curvature, residual_of
from gfimu.rate.result import DECIDED, RateEstimate, SignDecision, clear_of_zero, full_covariance
from gfimu.rate.sign_chain import SignChain, SignSteps, sign_probabilities
from gfimu.rate.start import Start

__all__ = [
    "DISAGREEING",
    "DISAGREES_OFTEN",
    "UNDECIDABLE",
    "SignJudge",
    "decision",
    "likelier",
    "merged",
    "same_sign",
    "sign_steps",
    "with_filter",
    "with_signs",
]

DISAGREEING = 4.0
"""Variance of the noise over the stated one from which the channels of a sample disagree."""

DISAGREES_OFTEN = 0.05
"""Share of such samples from which the sign of the rate is judged."""

UNDECIDABLE = 0.01
"""Numerical: a probability so near one half says nothing; the sign is carried on."""


_FILTER = 0.97  # share of right signs of a filter where single samples say nothing: hand motion far undersampled
_MERGED = 0.9  # share of the samples with a sign in which two rates agree once they are one
_WANDERS = 4.0  # standard deviations of a log likelihood ratio that are no evidence


class SignJudge:
    """Judges the signs of the rates of one run.

    Parameters
    ----------
    sets : ChannelSets
        The array.
    start : Start
        How the run starts.
    period : float
        Sample period, s.
    """

    def __init__(self, sets: ChannelSets, start: Start, period: float) -> None:
        self._sets, self._start = sets, start
        sensitivity = sets.full.sensitivity
        self.possible = sets.products > 0 and bool(np.linalg.matrix_rank(sensitivity, tol=1e-9) >= 3)
        self._curvature = least_curvature(sensitivity) if self.possible else np.inf
        self._chain = SignChain(period)

    def of_recording(
        self, samples: Samples, constants: Constants, out: Estimates, rest: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """Return the probability (n,) that each rate, and not its mirror image, is the true one, by all samples."""
        steps, covariance = self._steps(samples, constants, out, rest)
        return self._of_rates(sign_probabilities(steps), steps, covariance, out)

    def of_stream(
        self, samples: Samples, constants: Constants, out: Estimates, rest: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """Return the same of further samples of a stream, by those so far."""
        steps, covariance = self._steps(samples, constants, out, rest)
        return self._of_rates(self._chain.push(steps), steps, covariance, out)

    def _steps(
        self, samples: Samples, constants: Constants, out: Estimates, rest: NDArray[np.bool_]
    ) -> tuple[SignSteps, NDArray[np.float64]]:
        full = self._sets.full
        complete = (samples.channel_set == 0)[:, None]
        of_alpha, by_alpha = constants.of_alpha(samples)
        of_products, by_products = constants.of_products(samples)
        alpha = np.where(complete, samples.alpha - of_alpha, np.nan)
        z = np.where(complete, samples.z - of_products, np.nan)
        omega, covariance = rates_of_null_space(z, full.sensitivity)
        residual = residual_of(z, full.sensitivity, omega, self._curvature)
        steps = sign_steps(
            self._sets, samples.t, alpha, omega, residual.information, out.inflation, rest, self._start,
            alpha_bias=float(np.mean(np.trace(constants.variance_by(by_alpha), axis1=1, axis2=2))) / 3.0,
            null_bias=float(np.linalg.eigvalsh(constants.variance_by(by_products).mean(axis=0))[-1]),
        )  # fmt: skip
        return steps, covariance * out.inflation[:, None, None]

    def _of_rates(
        self, chance: NDArray[np.float64], steps: SignSteps, covariance: NDArray[np.float64], out: Estimates
    ) -> NDArray[np.float64]:
        alike = same_sign(steps.omega, covariance, out.omega, full_covariance(out.covariance))
        return _filled(alike * chance + (1.0 - alike) * (1.0 - chance))


def sign_steps(
    sets: ChannelSets,
    t: NDArray[np.float64],
    alpha: NDArray[np.float64],
    omega: NDArray[np.float64],
    information: NDArray[np.float64],
    inflation: NDArray[np.float64],
    rest: NDArray[np.bool_],
    start: Start,
    *,
    alpha_bias: float,
    null_bias: float,
) -> SignSteps:
    """Return what the chain of signs is given.

    Parameters
    ----------
    sets : ChannelSets
        The array.
    t : ndarray, shape (n,)
        Times, s.
    alpha, omega : ndarray, shape (n, 3)
        Angular acceleration without its bias, rad/s², and rates but for their signs, rad/s; NaN where there are none.
    information : ndarray, shape (n, 3, 3)
        Of the rates by the noise of the null space, s²/rad².
    inflation : ndarray, shape (n,)
        Variance of the noise over the stated one.
    rest : ndarray of bool, shape (n,)
        Samples at rest.
    start : Start
        How the run starts.
    alpha_bias, null_bias : float
        Variance of the bias of α, per axis, (rad/s²)², and the largest of those of the null space.
    """
    curvature = least_curvature(sets.full.sensitivity)
    return SignSteps(
        t, alpha, omega, bounded_covariance(information, np.sqrt(inflation + null_bias), curvature),
        sets.full.alpha_noise, np.sqrt(inflation), float(np.sqrt(alpha_bias)), rest, float(curvature**-0.5),
        None if start.sign_open else start.omega, float(start.std.max()),
    )  # fmt: skip


def likelier(first: Carried, second: Carried) -> tuple[int, float]:
    """Return which of two mirrored rates the readings prefer, 0 or 1, and the probability of it.

    At a constant rate both fit alike, and the difference of their log likelihoods wanders with the noise of α: its
    variance is 4 R (S − R)/S² for each innovation of variance S with the noise R. Only what exceeds that counts.
    """
    ratio = float(first.scalars[LIKELIHOOD] - second.scalars[LIKELIHOOD])
    spread = np.sqrt(max(first.scalars[WANDER], second.scalars[WANDER]))
    clear = max(0.0, abs(ratio) - _WANDERS * float(spread))
    return int(ratio < 0.0), float(1.0 / (1.0 + np.exp(-min(clear, 50.0))))


def merged(first: RateEstimate, second: RateEstimate) -> bool:
    """Return whether two rates that began as mirror images have the same sign where they have one, but for a tenth."""
    clear = clear_of_zero(first.omega, first.std) & clear_of_zero(second.omega, second.std)
    same = np.sum(first.omega * second.omega, axis=1)[clear] > 0.0
    return bool(len(same) > 0 and np.mean(same) > _MERGED)


def same_sign(
    omega: NDArray[np.float64],
    covariance: NDArray[np.float64],
    other: NDArray[np.float64],
    other_covariance: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the probability (n,) that rates (n, 3) that are known but for their sign have the sign of others."""
    spread = covariance + other_covariance
    known = np.asarray(np.isfinite(spread).all(axis=(1, 2)) & np.isfinite(omega).all(axis=1))
    along = np.zeros(len(omega))
    solved = np.linalg.solve(spread[known], other[known][..., None])[..., 0]
    along[known] = np.sum(omega[known] * solved, axis=1)
    return np.asarray(1.0 / (1.0 + np.exp(-np.clip(2.0 * along, -50.0, 50.0))))


def with_filter(chance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the probabilities (n,) of signs by single samples, with those of a filter that started with the right one.

    A filter that follows the rate carries its sign over samples that don't show it.
    """
    return np.asarray(_FILTER * chance / (_FILTER * chance + (1.0 - _FILTER) * (1.0 - chance)))


def with_signs(found: RateEstimate, probability: NDArray[np.float64], *, known: bool) -> RateEstimate:
    """Return rates with their more probable signs; ``probability`` (n,) is that of the signs they have."""
    wrong = probability < 0.5 - UNDECIDABLE
    signed = replace(
        found,
        omega=np.where(wrong[:, None], -found.omega, found.omega),
        sign_probability=np.where(wrong, 1.0 - probability, probability),
    )
    return replace(signed, sign=decision(signed, known=known))


def decision(found: RateEstimate, *, known: bool) -> SignDecision:
    """Sum the probabilities up in one word for the run."""
    probability = found.sign_probability
    assert probability is not None
    clear = clear_of_zero(found.omega, found.std)
    decided = clear & (probability > DECIDED)
    if not clear.any() or not decided.any():
        return SignDecision("known" if known and not clear.any() else "undecided", 0.0)
    if np.array_equal(decided, clear):
        return SignDecision("known") if known else SignDecision("decided", np.inf, float(found.t_s[np.argmax(decided)]))
    return SignDecision("partly", 0.0, float(found.t_s[np.argmax(decided)]))


def _filled(probability: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return probabilities (n,) with those of samples without one taken from the sample before."""
    place = np.where(np.isfinite(probability), np.arange(len(probability)), 0)
    return np.nan_to_num(probability[np.maximum.accumulate(place)], nan=0.5)
