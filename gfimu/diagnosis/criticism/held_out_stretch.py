"""A held-out stretch measured: misfits of the given and of the extended simulation, and their noise floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.stats import chi2

from gfimu.diagnosis.criticism.gain import Gain
from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.data.cosine_basis import NoiseLevels
from gfimu.diagnosis.data.run import smooth_rate
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.gauss_newton import fit
from gfimu.diagnosis.fit.learn import FOLLOWED, LEAST_VALID
from gfimu.diagnosis.fit.linear import Point
from gfimu.diagnosis.fit.posterior import condition
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.cause import Cause, effects_of
from gfimu.diagnosis.terms.drive import Drive
from gfimu.diagnosis.terms.hand.drive import HandDrive
from gfimu.diagnosis.terms.hand.noise import BodyNoise
from gfimu.diagnosis.terms.observed import observe
from gfimu.model.world_model import Effect, is_linear, is_of_one_recording

__all__ = ["Measured", "gain_of", "measure"]

_BLOCK = 40  # numerical: groups of samples of a free body whose gain counts as one value


@dataclass(frozen=True)
class Measured:
    """A held-out stretch: misfits of the given and of the extended simulation, and their noise floor.

    Parameters
    ----------
    before, after, carried : float
        Whitened squares, the drive marginalised: as given, extended, and extended without what belongs to one
        recording.
    floor, floor_variance : float
        Their expectation by noise alone, and its variance.
    fitted : float
        Whitened squares of as many observations of the fitted part.
    squares : tuple of float
        Sums of squares of the channels before and after, (m/s²)².
    samples, rows : int
        Readings in them, and samples.
    blocks : ndarray, shape (b,)
        Gain of log-likelihood per sample in blocks of a second.
    rates, drifts : tuple of float
        Errors of rate, rad/s, and drift, m, before and after.
    """

    before: float
    after: float
    carried: float
    floor: float
    floor_variance: float
    fitted: float
    squares: tuple[float, float]
    samples: int
    rows: int
    blocks: NDArray[np.float64]
    rates: tuple[float, float]
    drifts: tuple[float, float]


def measure(
    nominal: Stretch,
    extended: Stretch,
    causes: Sequence[Cause],
    drive: Any,
    levels: Any,
    unexplained: float,
    policy: Policy,
) -> Measured:
    """Measure causes on a stretch that they were not fitted to.

    Parameters
    ----------
    nominal, extended : Stretch
        The stretch as the given simulation has it, and with the known effects of the extended one.
    causes : sequence of Cause
        What the extended one has besides.
    drive, levels
        Where the fit of its drive starts, and its noise.
    unexplained : float
        Whitened squares per observation of the fitted part: the floor where readings are coarse, whose likelihood is
        no sum of squares.
    policy : Policy
        Thresholds.
    """
    array, index = extended.model.array, extended.index
    carried = [cause for cause in causes if not is_of_one_recording(cause.family)]
    if isinstance(extended, BodyStretch) and isinstance(nominal, BodyStretch):
        own, others = effects_of(causes, array, index), effects_of(carried, array, index)
        return _measured_body(nominal, extended, own, others, drive, levels, unexplained)

    def beside(some: Sequence[Cause]) -> Stretch:
        return replace(extended, known=(*extended.known, *effects_of(some, array, index)))

    whole = beside(causes)
    before, after = (_at_best(stretch, drive, levels, policy) for stretch in (nominal, whole))
    other = after
    if len(carried) < len(causes):
        other = _at_best(beside(carried), drive, levels, policy)
    fitted = unexplained * float(extended.observations)
    floor, variance = min(_floor(extended, drive, one.white, policy) for one in (before, after))
    use = extended.mask[:, :-1]
    rates, drifts = _motion_errors(nominal, whole, after.drive)
    return Measured(
        before=before.objective,
        after=after.objective,
        carried=other.objective,
        floor=fitted if extended.steps.coarse else floor,
        floor_variance=variance,
        fitted=fitted,
        squares=(float(np.sum(before.residual[use] ** 2)), float(np.sum(after.residual[use] ** 2))),
        samples=int(use.sum()),
        rows=len(extended.run.t),
        blocks=_seconds(0.5 * np.sum(before.white**2 - after.white**2, axis=1), extended),
        rates=rates,
        drifts=drifts,
    )


def _measured_body(
    nominal: BodyStretch,
    extended: BodyStretch,
    effects: Sequence[Effect],
    carried: Sequence[Effect],
    drive: HandDrive,
    levels: BodyNoise,
    unexplained: float,
) -> Measured:
    """Measure effects on a free body, all and those that another recording has, its motion marginalised alike."""
    plain = replace(levels, misfit=1.0)
    before, after = condition(nominal, drive, (), plain), condition(extended, drive, effects, plain)
    other = after if len(carried) == len(effects) else condition(extended, drive, carried, plain)
    use = extended.counted[:, None] & extended.run.valid
    gains = (0.5 * (before.squares - after.squares) / np.maximum(extended.count, 1))[extended.on]
    whole = len(gains) // _BLOCK * _BLOCK
    return Measured(
        before=before.objective,
        after=after.objective,
        carried=other.objective,
        floor=float(extended.observations),
        floor_variance=2.0 * extended.observations,
        fitted=unexplained * levels.misfit * extended.observations,
        squares=(float(np.sum(before.without_motion[use] ** 2)), float(np.sum(after.without_motion[use] ** 2))),
        samples=int(use.sum()),
        rows=int(extended.counted.sum()),
        blocks=gains[:whole].reshape(-1, _BLOCK).mean(axis=1) if whole else gains,
        rates=(np.nan, np.nan),
        drifts=(np.nan, np.nan),
    )


def gain_of(measured: Sequence[Measured], policy: Policy, *, label: str) -> Gain:
    """Put the measures of all held-out stretches together."""
    samples = sum(one.samples for one in measured)
    if samples == 0:
        return Gain()
    before, after, carried = (
        float(sum(getattr(one, name) for one in measured)) for name in ("before", "after", "carried")
    )
    floor, fitted = (float(sum(getattr(one, name) for one in measured)) for name in ("floor", "fitted"))
    error = float(np.sqrt(sum(one.floor_variance for one in measured)))
    # A misfit of the fitted part within the error of the floor is noise whose learnt level is too low.
    floor += float(np.clip(fitted - floor, 0.0, policy.noise_stds * error))
    share, std = _share(before - floor, after - floor, error, floor, policy)
    blocks = np.concatenate([one.blocks for one in measured])
    rms = np.sqrt(np.sum([one.squares for one in measured], axis=0) / samples)
    rates = np.sqrt(np.mean(np.square([one.rates for one in measured]), axis=0))
    drifts = np.mean([one.drifts for one in measured], axis=0)
    return Gain(
        held_out=label,
        rms_before=float(rms[0]),
        rms_after=float(rms[1]),
        share_of_excess_removed=share,
        log_likelihood_per_sample=0.5 * (before - after) / sum(one.rows for one in measured),
        log_likelihood_std=float(blocks.std(ddof=1) / np.sqrt(len(blocks))) if len(blocks) > 1 else float("nan"),
        rate_rmse_before=float(rates[0]),
        rate_rmse_after=float(rates[1]),
        drift_before=float(drifts[0]),
        drift_after=float(drifts[1]),
        share_std=std,
        share_in_any_recording=_share(before - floor, carried - floor, error, floor, policy)[0],
    )


@dataclass(frozen=True)
class _AtBest:
    """A simulation of a stretch with its drive at the posterior.

    Parameters
    ----------
    objective : float
        Whitened squares, the drive marginalised.
    drive : Drive
        The drive.
    white : ndarray, shape (n, c + 1)
        Residual in units of white noise, slow noise whitened.
    residual : ndarray, shape (n, c)
        Residual of the channels, m/s², without the excess of a random walk that was found.
    """

    objective: float
    drive: Drive
    white: NDArray[np.float64]
    residual: NDArray[np.float64]


def _at_best(stretch: Stretch, drive: Drive, levels: NoiseLevels, policy: Policy) -> _AtBest:
    """Move the drive to its posterior under the known effects of a stretch."""
    found = fit([stretch], Point((), (drive,), (levels,)), policy)
    best = found.point.drives[0]
    prediction = stretch.predict((), best.spin)
    white = stretch.basis.whitened(observe(stretch, prediction, levels).residual, levels) / levels.white
    residual = np.where(stretch.mask, stretch.measured - prediction, 0.0)
    if levels.walk > 0.0:
        walk = NoiseLevels(levels.white, np.zeros(len(levels.white)), levels.walk)
        residual = stretch.basis.whitened(residual, walk)
    return _AtBest(found.objective, best, white, residual[:, :-1])


def _floor(stretch: Stretch, drive: Drive, white: NDArray[np.float64], policy: Policy) -> tuple[float, float]:
    """Return the expected squares of whitened residuals (n, c + 1) by noise alone, and their variance.

    The white noise is that of the fast half, which the drive does not follow; squares are clipped, so that a line does
    not count as noise.
    """
    count, limit = len(white), policy.noise_stds**2
    first = min(int(2 * count * stretch.run.sample_period * FOLLOWED / drive.spline.spacing), count // 2)
    power = stretch.basis.transform(white)[first:] ** 2 / stretch.mask.mean(axis=0).clip(LEAST_VALID)
    expectation = chi2.cdf(limit, 3) + limit * chi2.sf(limit, 1)  # of a squared standard normal, clipped
    level = np.minimum(power, limit).mean(axis=0) / expectation
    valid = stretch.mask.sum(axis=0)
    slow = valid * first / count
    return float(valid @ level), float(np.sum(2.0 * slow * (1.0 + slow / (valid - slow).clip(1.0))))


def _share(before: float, after: float, error: float, floor: float, policy: Policy) -> tuple[float, float]:
    """Return the share of an excess that is removed and its standard error; NaN where there is no excess.

    ``error`` is the standard error of the floor, which both excesses share.
    """
    if before < max(policy.excess_stds * error, policy.noise_accuracy * floor):
        return float("nan"), float("nan")
    share = 1.0 - max(after, 0.0) / before
    # Beside the floor, the noise correlates with what there is to remove and with what remains.
    variance = (share * error) ** 2 + 4.0 * max(after, 0.0) + 4.0 * before * (1.0 - share) ** 2
    return share, float(np.sqrt(variance)) / before


def _seconds(values: NDArray[np.float64], stretch: Stretch) -> NDArray[np.float64]:
    """Return means over blocks of a second."""
    size = max(int(1.0 / stretch.run.sample_period), 1)
    whole = len(values) // size * size
    return np.asarray(values[:whole].reshape(-1, size).mean(axis=1)) if whole else values[:1]


def _motion_errors(
    nominal: Stretch, extended: Stretch, drive: Drive
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Rate against the reference and position drift, with readings as they are and corrected by the extension.

    On a linear axis nothing turns: there are none.
    """
    run = extended.run
    if is_linear(extended.model):
        return (np.nan, np.nan), (np.nan, np.nan)
    pseudo_inverse = np.linalg.pinv(extended.model.array.regression_matrix)
    reference = smooth_rate(run, is_angle=extended.is_angle)
    believed = nominal.predict((), drive.spin)[:, :-1]
    correction = extended.predict((), drive.spin)[:, :-1] - believed
    measured = np.where(run.valid, run.readings, believed + correction)
    truth = extended.motion(extended.known, drive.spin).at(run.t)
    results = []
    for readings in (measured, measured - correction):
        alpha = (readings - believed) @ pseudo_inverse.T
        rate = reference[0] + cumulative_trapezoid(alpha[:, 2] + truth.acceleration, run.t, initial=0.0)
        error = alpha[:, 3:]
        cos, sin = np.cos(truth.angle), np.sin(truth.angle)
        world = np.column_stack(
            [cos * error[:, 0] - sin * error[:, 1], sin * error[:, 0] + cos * error[:, 1], error[:, 2]]
        )
        velocity = cumulative_trapezoid(world, run.t, axis=0, initial=0.0)
        position = cumulative_trapezoid(velocity, run.t, axis=0, initial=0.0)
        results.append((float(np.sqrt(np.mean((rate - reference) ** 2))), float(np.linalg.norm(position[-1]))))
    return (results[0][0], results[1][0]), (results[0][1], results[1][1])
