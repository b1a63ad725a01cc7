"""The sign of the rate as a probability per sample: a chain of two states with α as the only witness.

One sample gives ω up to its sign. The integral of α from sample to sample says which signs go together: with s = ±1 the
sign of each sample's estimate w, the rate predicted from the sample before is m, and

    r = s w − m,    V = C + P + Q

is its misfit, with C the covariance of w and P that of the rate before. Q is what the integral of α over the interval
may be off: noise, the bias of α, and what α does between two samples, of which half of its change from one to the next
is taken, (½ Δt |Δα|)². Misfits of a hand-held or undersampled motion have heavy tails, so the likelihood of a step is
Student's t with four degrees of freedom.

At constant ω both signs explain the readings equally well, but the noise of α would make a random walk of their
likelihoods, which ends as far from zero as one likes. So α is first shrunk to what of it is real: by the share of its
power, over half a second, that noise and bias don't explain with near certainty (a Wiener filter). Without a manoeuvre
nothing remains, and no sign is decided.

Each of the two signs of a sample carries a rate and its covariance, a mixture of the two histories that lead to it,
collapsed to one (after the second-order generalised pseudo-Bayesian filter, Y. Bar-Shalom, X. R. Li & T. Kirubarajan,
Estimation with Applications to Tracking and Navigation, 2001, ch. 11.6). The chain runs forward; for a recording it
runs backward over the later samples as well and the two probabilities are multiplied (two-filter smoother). A passage
through zero so slow that neither sign stands out leaves both probable, until a later manoeuvre shows the sign again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gfimu.base.compiled import compiled

__all__ = ["SignChain", "SignPolicy", "SignSteps", "sign_probabilities"]


@dataclass(frozen=True)
class SignPolicy:
    """Numbers of the chain.

    Parameters
    ----------
    tail : float
        Degrees of freedom of Student's t of a step.
    change : float
        Share of the change of α from one sample to the next by which its integral may be off, a ratio.
    window_s : float
        Length over which the power of α is averaged, s.
    noise_deviate : float
        Standard deviations by which that power must exceed the noise's.
    bias_square : float
        The same of the bias, in its variance per axis: χ² of three axes.
    floor : float
        Probability that a step is explained by nothing of this (a shock, a lost sample): a sign is never surer.
    """

    tail: float = 4.0
    change: float = 0.5
    window_s: float = 0.5
    noise_deviate: float = 5.0
    bias_square: float = 11.3
    floor: float = 1e-6


_POLICY = SignPolicy()


@dataclass(frozen=True)
class SignSteps:
    """What the chain is given.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Sample times, s.
    alpha : ndarray, shape (n, 3)
        Angular acceleration, rad/s²; NaN where there is none.
    omega : ndarray, shape (n, 3)
        Rate of each sample but for its sign, rad/s; NaN where there is none.
    covariance : ndarray, shape (n, 3, 3)
        Its covariance, finite where ``omega`` is, (rad/s)².
    alpha_covariance : ndarray, shape (3, 3)
        Covariance of one sample of α by the stated noise, (rad/s²)².
    scale : ndarray, shape (n,)
        Factor of its standard deviation (`gfimu.rate.disagreement.measured_scale`).
    alpha_bias_std : float
        Standard deviation of the constant bias of α, rad/s².
    rest : ndarray of bool, shape (n,)
        Samples at which the body is at rest.
    rest_std : float
        Standard deviation of the rate there, rad/s: a slow departure can go unseen for a while.
    start : ndarray, shape (3,), or None
        Known rate at the first sample, rad/s.
    start_std : float
        Its standard deviation, rad/s.
    """

    t: NDArray[np.float64]
    alpha: NDArray[np.float64]
    omega: NDArray[np.float64]
    covariance: NDArray[np.float64]
    alpha_covariance: NDArray[np.float64]
    scale: NDArray[np.float64]
    alpha_bias_std: float
    rest: NDArray[np.bool_]
    rest_std: float
    start: NDArray[np.float64] | None
    start_std: float


class _ChainState(NamedTuple):
    """What the chain carries from sample to sample."""

    mean: NDArray[np.float64]  # (2, 3) of the rate with either sign of the last estimate, rad/s
    spread: NDArray[np.float64]  # (2, 3, 3) its covariance, (rad/s)²
    share: NDArray[np.float64]  # (2,) probability of either sign
    known: NDArray[np.bool_]  # (1,) whether there is a rate yet

    @classmethod
    def begin(cls, start: NDArray[np.float64] | None, std: float) -> _ChainState:
        """Return the state before the first sample, whose rate (3,) may be known."""
        mean = np.zeros(3) if start is None else np.asarray(start, dtype=float)
        spread = np.tile(std**2 * np.eye(3), (2, 1, 1))
        return cls(np.tile(mean, (2, 1)), spread, np.full(2, 0.5), np.array([start is not None]))


def sign_probabilities(steps: SignSteps) -> NDArray[np.float64]:
    """Return the probability, shape (n,), that each sample's rate is ``omega`` and not ``−omega``; NaN without one.

    Parameters
    ----------
    steps : SignSteps
        Rates but for their sign, and α.
    """
    half = max(1, round(0.5 * _POLICY.window_s / _period(steps.t)))
    real = replace(steps, alpha=_real_part(steps, half, half, _POLICY))
    ahead = _run(real, _ChainState.begin(steps.start, steps.start_std), 0, -1, _period(steps.t), _POLICY)
    # Backward in time, α changes its sign: ω(t − Δt) = ω(t) − Δt α.
    columns: dict[str, Any] = {name: np.ascontiguousarray(getattr(real, name)[::-1]) for name in _COLUMNS}
    turned = replace(real, **columns | {"t": -columns["t"], "alpha": -columns["alpha"]})
    back = _run(turned, _ChainState.begin(None, 1.0), 0, -1, _period(steps.t), _POLICY)[::-1]
    both = ahead * back
    return both / (both + (1.0 - ahead) * (1.0 - back))


class SignChain:
    """The chain while samples arrive: each probability is from the samples up to its own alone.

    Parameters
    ----------
    period : float
        Sample period, s.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self._window = max(1, round(_POLICY.window_s / period))
        self._state: _ChainState | None = None
        self._past: SignSteps | None = None  # the last samples, over which the power of α is averaged

    def push(self, steps: SignSteps) -> NDArray[np.float64]:
        """Return the probabilities (n,) of further samples; ``start`` counts for the first ones alone."""
        if self._state is None:
            self._state = _ChainState.begin(steps.start, steps.start_std)
        all_steps, count = steps, len(steps.t)
        if self._past is not None:
            joined: dict[str, Any] = {
                name: np.concatenate([getattr(self._past, name), getattr(steps, name)]) for name in _COLUMNS
            }
            all_steps = replace(steps, **joined)
        first = len(all_steps.t) - count
        used = np.isfinite(all_steps.alpha[:, 0]) & (np.isfinite(all_steps.omega[:, 0]) | all_steps.rest)
        seen = np.flatnonzero(used[:first])
        real = replace(all_steps, alpha=_real_part(all_steps, self._window, 0, _POLICY))
        last = int(seen[-1]) if seen.size else -1
        found = _run(real, self._state, first, last, self._period, _POLICY)[first:]
        tail: dict[str, Any] = {name: getattr(all_steps, name)[-self._window :] for name in _COLUMNS}
        self._past = replace(steps, **tail)
        return found


_COLUMNS = ("t", "alpha", "omega", "covariance", "scale", "rest")


def _period(t: NDArray[np.float64]) -> float:
    return float((t[-1] - t[0]) / max(len(t) - 1, 1))


def _run(
    steps: SignSteps, state: _ChainState, first: int, last: int, period: float, policy: SignPolicy
) -> NDArray[np.float64]:
    """Run the chain over samples from ``first`` on, behind sample ``last`` (−1: none); ``alpha`` is its real part."""
    return np.asarray(_chain(
        steps.t, steps.alpha, steps.omega, steps.covariance, steps.scale, steps.rest, state, first, last, period,
        steps.alpha_covariance, steps.alpha_bias_std, policy.change, policy.tail, steps.rest_std, policy.floor,
    ))  # fmt: skip


def _real_part(steps: SignSteps, before: int, behind: int, policy: SignPolicy) -> NDArray[np.float64]:
    """Shrink α (n, 3) by the share of its power, over so many samples around, that noise and bias don't explain."""
    present = np.isfinite(steps.alpha).all(axis=1) & ~steps.rest
    n = len(present)
    white = np.trace(steps.alpha_covariance) * steps.scale**2
    sums = np.zeros((n + 1, 3))
    sums[1:, 0] = np.cumsum(np.where(present, np.sum(np.square(np.nan_to_num(steps.alpha)), axis=1), 0.0))
    sums[1:, 1] = np.cumsum(np.where(present, white, 0.0))
    sums[1:, 2] = np.cumsum(present)
    place = np.arange(n)
    seen = sums[np.minimum(place + behind + 1, n)] - sums[np.maximum(place - before, 0)]
    count = np.maximum(seen[:, 2], 1.0)
    noise = seen[:, 1] / count
    allowed = noise * (1.0 + policy.noise_deviate * np.sqrt(2.0 / (3.0 * count)))
    allowed += policy.bias_square * steps.alpha_bias_std**2
    excess = np.maximum(seen[:, 0] / count - allowed, 0.0)
    return steps.alpha * (excess / np.maximum(excess + allowed, 1e-300))[:, None]


@compiled
def _chain(  # type: ignore[no-untyped-def]
    t, alpha, omega, covariance, scale, rest, state, first_new, last, period, noise, bias, change, tail, rest_std, floor
):
    """Run the chain forward; returns the probability of the sign that ``omega`` has, (n,)."""
    n = len(t)
    plus = np.full(n, np.nan)
    mean = state.mean
    spread = state.spread
    share = state.share
    moved = np.zeros((2, 3))  # the same, carried to the present sample
    inverse = np.zeros((3, 3))  # of V
    gain = np.zeros((2, 3, 3))
    kept = np.zeros((2, 3, 3))  # covariance behind the update
    misfit = np.zeros((2, 2, 3))  # sign now, sign before
    square = np.zeros((2, 2))
    logs = np.zeros((2, 2))
    weight = np.zeros(2)
    part = np.zeros((2, 3))
    extra = np.zeros((3, 3))
    total = np.zeros((3, 3))
    known = state.known[0]
    for k in range(first_new, n):
        if rest[k]:
            mean[:] = 0.0
            spread[:] = 0.0
            for a in range(3):
                spread[0, a, a] = rest_std * rest_std
                spread[1, a, a] = rest_std * rest_std
            share[0] = 0.5
            share[1] = 0.5
            known = True
            last = k if np.isfinite(alpha[k, 0]) else last
            if np.isfinite(omega[k, 0]):
                plus[k] = 0.5
            continue
        if not (np.isfinite(omega[k, 0]) and np.isfinite(alpha[k, 0])):
            continue
        if not known:
            for a in range(3):
                mean[0, a] = omega[k, a]
                mean[1, a] = -omega[k, a]
            spread[0] = covariance[k]
            spread[1] = covariance[k]
            plus[k] = 0.5
            known = True
            last = k
            continue
        step = t[k] - t[last] if last >= 0 else 0.0
        size = 0.0
        for a in range(3):
            size += omega[k, a] * omega[k, a]
        jump = 0.0
        for a in range(3):
            for b in range(3):
                extra[a, b] = covariance[k, a, b]
        if last >= 0:
            gap = step > 1.5 * period
            for a in range(3):
                if gap:
                    jump += (abs(alpha[k, a]) + abs(alpha[last, a])) ** 2
                else:
                    jump += (alpha[k, a] - alpha[last, a]) ** 2
            both = 0.25 * step * step * (scale[k] * scale[k] + scale[last] * scale[last])
            rough = (change * step) ** 2 * jump + bias * step * np.sqrt(size)
            for a in range(3):
                for b in range(3):
                    extra[a, b] += both * noise[a, b]
                extra[a, a] += rough
        largest = -np.inf
        for before in range(2):
            for a in range(3):
                integral = 0.5 * step * (alpha[k, a] + alpha[last, a]) if last >= 0 else 0.0
                moved[before, a] = mean[before, a] + integral
            for a in range(3):
                for b in range(3):
                    total[a, b] = extra[a, b] + spread[before, a, b]
            determinant = _invert(total, inverse)
            for a in range(3):
                for b in range(3):
                    value = 0.0
                    for c in range(3):
                        value += (total[a, c] - covariance[k, a, c]) * inverse[c, b]
                    gain[before, a, b] = value
            for a in range(3):
                for b in range(3):
                    value = 0.0
                    for c in range(3):
                        value += gain[before, a, c] * covariance[k, c, b]
                    kept[before, a, b] = value
            for now in range(2):
                side = 1.0 if now == 0 else -1.0
                value = 0.0
                for a in range(3):
                    misfit[now, before, a] = side * omega[k, a] - moved[before, a]
                for a in range(3):
                    for b in range(3):
                        value += misfit[now, before, a] * inverse[a, b] * misfit[now, before, b]
                square[now, before] = value
                logs[now, before] = -0.5 * np.log(determinant) - 0.5 * (tail + 3.0) * np.log1p(value / tail)
                largest = max(largest, logs[now, before])
        before_plus = share[0]
        for now in range(2):
            weight[0] = np.exp(logs[now, 0] - largest)
            weight[1] = np.exp(logs[now, 1] - largest)
            share[now] = before_plus * weight[0] + (1.0 - before_plus) * weight[1]
            # Rates are collapsed as if both signs had been alike before: else the sharper of them would gain by that.
            first = weight[0] / max(weight[0] + weight[1], 1e-300)
            for before in range(2):
                for a in range(3):
                    value = moved[before, a]
                    for b in range(3):
                        value += gain[before, a, b] * misfit[now, before, b]
                    part[before, a] = value
            # A t distribution widens with its misfit.
            wide0 = first * max(1.0, (tail + square[now, 0]) / (tail + 3.0))
            wide1 = (1.0 - first) * max(1.0, (tail + square[now, 1]) / (tail + 3.0))
            for a in range(3):
                mean[now, a] = first * part[0, a] + (1.0 - first) * part[1, a]
                for b in range(a + 1):
                    apart = (part[0, a] - part[1, a]) * (part[0, b] - part[1, b])
                    value = wide0 * kept[0, a, b] + wide1 * kept[1, a, b] + first * (1.0 - first) * apart
                    spread[now, a, b] = value
                    spread[now, b, a] = value
        mass = share[0] + share[1]
        share[0] = (1.0 - floor) * share[0] / mass + 0.5 * floor
        share[1] = 1.0 - share[0]
        plus[k] = share[0]
        last = k
    state.known[0] = known
    return plus


@compiled
def _invert(m, out):  # type: ignore[no-untyped-def]
    """Invert a symmetric matrix (3, 3) into ``out``; returns the determinant."""
    c00 = m[1, 1] * m[2, 2] - m[1, 2] * m[1, 2]
    c01 = m[0, 2] * m[1, 2] - m[0, 1] * m[2, 2]
    c02 = m[0, 1] * m[1, 2] - m[0, 2] * m[1, 1]
    determinant = m[0, 0] * c00 + m[0, 1] * c01 + m[0, 2] * c02
    out[0, 0] = c00 / determinant
    out[0, 1] = c01 / determinant
    out[0, 2] = c02 / determinant
    out[1, 1] = (m[0, 0] * m[2, 2] - m[0, 2] * m[0, 2]) / determinant
    out[1, 2] = (m[0, 1] * m[0, 2] - m[0, 0] * m[1, 2]) / determinant
    out[2, 2] = (m[0, 0] * m[1, 1] - m[0, 1] * m[0, 1]) / determinant
    out[1, 0] = out[0, 1]
    out[2, 0] = out[0, 2]
    out[2, 1] = out[1, 2]
    return determinant
