"""Learning of what is not searched: the noise of every run and the roughness of every drive, at a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.data.cosine_basis import NoiseLevels
from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.data.stretch import Stretch, make_stretches
from gfimu.diagnosis.fit.linear import Linear, Point, linearise, stepped
from gfimu.diagnosis.fit.parallel import over_segments
from gfimu.diagnosis.fit.posterior import Posterior
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.coloured_noise import estimate_flicker, likeliest_flicker, white_level
from gfimu.diagnosis.terms.drive import Drive
from gfimu.diagnosis.terms.hand.drive import HandDrive
from gfimu.diagnosis.terms.hand.learning import first_noise, learnt_noise
from gfimu.diagnosis.terms.jacobian import Jacobian
from gfimu.diagnosis.terms.slow_modes import WeighedModes, WeighedPowers
from gfimu.diagnosis.terms.spline import PushedSpin
from gfimu.model.world_model import WorldModel, is_linear

__all__ = [
    "FOLLOWED",
    "LEARNINGS",
    "LEAST_VALID",
    "learn_noise",
    "learn_roughness",
    "predicted_by_reference",
    "sharpened",
    "starting_point",
]

FOLLOWED = 0.6
"""Over the spacing of the knots, Hz: what is faster the drive does not follow.

Numerical: just beyond the Nyquist frequency of the knots, 0.5 over their spacing.
"""
LEARNINGS = 3
"""Numerical: rounds of the fixed point of the roughness."""
LEAST_VALID = 0.01
"""Numerical: share of the samples that count."""
_LEAST_WIDTH = 0.4  # numerical: sample periods of a knot interval that is cut
_HALVINGS = 5  # numerical: of a knot interval
_BLUR = 0.5  # numerical: standard deviations that a drive misses in an interval that is worth a try
_REFERENCE_ROUNDS = 5  # numerical: to the roughness of a drive from its reference alone, and to invert its errors


def starting_point(stretches: Sequence[Stretch], spacing: float) -> Point:
    """Return the drives that the references alone give, and the noise of the data sheet.

    Of a free body the noise is learnt at once: how much the motion adds to it no data sheet says.
    """
    if stretches and isinstance(stretches[0], BodyStretch):
        bodies = [one for one in stretches if isinstance(one, BodyStretch)]
        hands = tuple(HandDrive.of(body) for body in bodies)
        return learn_noise(stretches, Point((), hands, tuple(first_noise(one) for one in bodies)))
    drives = tuple(over_segments(lambda stretch: _by_reference(stretch, spacing), stretches))
    return Point((), drives, tuple(stretch.first_levels for stretch in stretches))


def _by_reference(stretch: Stretch, spacing: float) -> Drive:
    knots = max(spacing, stretch.run.sample_period)
    times, seen = stretch.counted_times(), stretch.counted
    std = np.inf if stretch.is_angle else stretch.start_angle_std
    drive = Drive.still(times, stretch.since, knots, stretch.start_angle, std)
    noise = stretch.steps.reference_noise(float(stretch.first_levels.white[-1]))
    weights = np.where(stretch.run.reference_valid, noise, np.inf)
    order = 0 if stretch.is_angle else 1
    reading = stretch.run.reference[seen]
    found = drive.by_reference(times[:, -1], reading, weights[seen], order, _REFERENCE_ROUNDS)
    # The command of a linear axis is its motion; what a table's reference does fast may be an error of the reference.
    for _ in range(_HALVINGS if is_linear(stretch.model) else 0):
        missed = _missed_intervals(found, times[:, -1], reading, weights[seen], order)
        closer = found.cut(missed & (found.spline.widths > 2.0 * stretch.run.sample_period))
        if closer.spline == found.spline:
            break
        found = closer.by_reference(times[:, -1], reading, weights[seen], order, _REFERENCE_ROUNDS)
    if not any(effect.place == "reference" for effect in (*stretch.model.effects, *stretch.known)):
        return found
    # The twin's model of its reference is inverted: d = reading - (predicted reading of d - d).
    for _ in range(_REFERENCE_ROUNDS):
        state = found.spin.at(times[:, -1])
        error = stretch.predict([], found.spin)[seen, -1] - (state.angle if stretch.is_angle else state.rate)
        found = drive.by_reference(times[:, -1], reading - error, weights[seen], order, _REFERENCE_ROUNDS)
    return found


def _missed_intervals(
    drive: Drive, t: NDArray[np.float64], values: NDArray[np.float64], std: NDArray[np.float64], order: int
) -> NDArray[np.bool_]:
    """Return the knot intervals (k,) in which a drive misses its reference by more than noise; none if it rarely does.

    A reference that is faster than the knots, as the command of a printer's axis, needs closer ones before any channel
    is looked at.
    """
    state = drive.spin.at(t)
    squares = np.square((values - (state.rate if order else state.angle)) / std)
    seen, most = np.isfinite(std), 1.0 + Policy().usual_excess
    if squares[seen].mean() < most:
        return np.zeros(drive.spline.intervals, dtype=bool)
    place = drive.spline.interval(t)[0][seen]
    counts = np.bincount(place, minlength=drive.spline.intervals)
    return np.bincount(place, squares[seen], minlength=drive.spline.intervals) > most * counts


def predicted_by_reference(model: WorldModel, run: Run) -> NDArray[np.float64]:
    """Predict the channels (n, c), m/s², of a run as its reference alone drives a model."""
    stretches = make_stretches(model, [run], [[]])
    point = starting_point(stretches, Policy().knots)
    parts = [stretch.predict([], drive.spin)[:, :-1] for stretch, drive in zip(stretches, point.drives, strict=True)]
    return np.concatenate(parts)


def learn_roughness(stretches: Sequence[Stretch], point: Point, rounds: int = 1) -> Point:
    """Return the point with the roughness that its drives show under its causes."""
    jacobians: Sequence[Jacobian | None] | None = None
    for _ in range(rounds if all(drive.is_learnt for drive in point.drives) else 0):
        try:
            linear = linearise(stretches, point, jacobians=jacobians)
        except np.linalg.LinAlgError:
            if jacobians is None:
                raise
            break  # what was learnt last is as rough as can be solved
        jacobians = [posterior.jacobian for posterior in linear.posteriors]
        moved = stepped(stretches, point, linear).drives
        drives = tuple(drive.relearned(one.covariance) for drive, one in zip(moved, linear.posteriors, strict=True))
        point = replace(point, drives=drives)
    return point


def sharpened(stretches: Sequence[Stretch], point: Point, policy: Policy) -> Point:
    """Return the point with knots closer where a drive bends sharply and that makes the data far more probable.

    Closer knots take away most of what corners leave, and little of what something else does. Where the fit is poor and
    stays so, the drive would be bent to what no drive did: then the knots stay.
    """
    if not all(drive.is_learnt for drive in point.drives):
        return point
    observations = sum(stretch.observations for stretch in stretches)
    now = linearise(stretches, point)
    drives = list(stepped(stretches, point, now).drives)
    acuities = [_acuity(*one) for one in zip(stretches, drives, point.levels, strict=True)]
    best = [_log_evidence(posterior) for posterior in now.posteriors]
    gaining = np.ones(len(drives), dtype=bool)
    found, excess = point, now.objective / observations - 1.0
    for _ in range(_HALVINGS):
        cuts = [
            drive.cut(_is_blurred(drive, stretch, levels, acuity) & again)
            for drive, stretch, levels, acuity, again in zip(
                drives, stretches, point.levels, acuities, gaining, strict=True
            )
        ]
        gaining = np.array([cut.spline != drive.spline for cut, drive in zip(cuts, drives, strict=True)])
        if not gaining.any():
            break
        try:
            closer = learn_roughness(stretches, replace(point, drives=tuple(cuts)))
            there = linearise(stretches, closer)
        except np.linalg.LinAlgError:  # so many knots can't be solved for
            break
        for place in np.flatnonzero(gaining):
            value = _log_evidence(there.posteriors[place])
            gaining[place] = value - best[place] > policy.knot_odds
            if gaining[place]:
                drives[place], best[place] = closer.drives[place].moved(there.drive_steps[place]), value
        left = there.objective / observations - 1.0
        if not gaining.any() or left > max(policy.usual_excess, 0.5 * excess):
            break
        found, excess = replace(point, drives=tuple(drives)), left
    return found if excess < policy.usual_excess else point


def _log_evidence(posterior: Posterior) -> float:
    return posterior.log_volume - 0.5 * posterior.objective


def _is_blurred(drive: Drive, stretch: Stretch, levels: NoiseLevels, acuity: float) -> NDArray[np.bool_]:
    """Return in which intervals (k,) of a drive the observations show what its spline misses."""
    missed, widths = drive.missed, drive.spline.widths
    # It goes to and fro once per interval.
    misread = missed * (widths / (2.0 * np.pi)) ** (2 if stretch.is_angle else 1)
    seen = np.hypot(missed * acuity, misread / stretch.steps.reference_noise(float(levels.white[-1])))
    return (seen > _BLUR) & (widths > _LEAST_WIDTH * stretch.run.sample_period)


def _acuity(stretch: Stretch, drive: Drive, levels: NoiseLevels) -> float:
    """Return how far a unit of angular acceleration moves all channels together, standard deviations per rad/s²."""
    unit = 1.0  # rad/s²
    change = stretch.predict((), PushedSpin(drive.spin, unit)) - stretch.predict((), drive.spin)
    power = np.square(np.where(stretch.mask, change, 0.0)[:, :-1] / levels.white[:-1]).sum(axis=1)
    return float(np.sqrt(np.median(power)))


def learn_noise(
    stretches: Sequence[Stretch], point: Point, jacobians: Sequence[Jacobian | None] | None = None
) -> Point:
    """Return the point with the noise that its causes and drives leave, each run's stretches together.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    point : Point
        Where.
    jacobians : sequence of Jacobian, optional
        Derivatives by the drives, where they are at hand.
    """
    if stretches and isinstance(stretches[0], BodyStretch):
        rows = (stretches, point.drives, point.levels)
        learnt = over_segments(lambda s, drive, one: learnt_noise(s, drive, point.causes, one), *rows)
        return replace(point, levels=tuple(learnt))
    linear = linearise(stretches, point, jacobians=jacobians)
    lefts = [_left(stretch, point, linear, index) for index, stretch in enumerate(stretches)]
    levels = list(point.levels)
    for run in {stretch.index for stretch in stretches}:
        mine = [place for place, stretch in enumerate(stretches) if stretch.index == run]
        counts = np.array([stretches[place].mask.sum(axis=0) for place in mine], dtype=float)
        shares = np.maximum(counts, 1e-9) / np.maximum(counts, 1e-9).sum(axis=0)  # (stretches, c + 1)
        white = np.sqrt(sum(share * lefts[place].white ** 2 for share, place in zip(shares, mine, strict=True)))
        first = stretches[mine[0]]
        quantum = first.model.expected_noise(first.run.output_data_rate).quantum
        white[:-1] = np.maximum(white[:-1], 0.5 * quantum / np.sqrt(12.0))
        white[-1] = max(white[-1], first.finest)
        walk = point.levels[mine[0]].walk
        flickers = [lefts[place].flicker(stretches[place], white, walk) for place in mine]
        flicker = np.sqrt(sum(share * one**2 for share, one in zip(shares, flickers, strict=True)))
        flicker[-1] = 0.0
        for place in mine:
            levels[place] = NoiseLevels(white, flicker, walk)
    return replace(point, levels=tuple(levels))


@dataclass(frozen=True)
class _Left:
    """Residual (n, c + 1) with the drive at its best, its weights, its cosines, and the white noise that it shows."""

    residual: NDArray[np.float64]
    weight: NDArray[np.float64]
    cosines: NDArray[np.float64]
    white: NDArray[np.float64]

    def flicker(self, stretch: Stretch, white: NDArray[np.float64], walk: float) -> NDArray[np.float64]:
        """Return the bias instability of channels and reference, shape (c + 1,)."""
        if not stretch.steps.channels:
            return estimate_flicker(self.cosines, white, stretch.basis, walk)
        slow = WeighedPowers.of(stretch.basis, self.residual, self.weight)
        return likeliest_flicker(slow.power, white, slow.flicker, slow.walk * walk**2)


def _left(stretch: Stretch, point: Point, linear: Linear, place: int) -> _Left:
    posterior = linear.posteriors[place]
    seen = posterior.observed
    residual = seen.residual - posterior.jacobian.times(linear.drive_steps[place])
    if point.residue is not None:
        residual = residual - point.residue.columns[place].times(linear.residue)
    cosines = stretch.basis.transform(residual)
    level = white_level(cosines, FOLLOWED / posterior.drive.spline.spacing, stretch.run.sample_period)
    # Missing samples stand as zeros, as where the reference comes at a lower rate.
    level = level / np.sqrt(np.maximum(stretch.mask.mean(axis=0), LEAST_VALID))
    if stretch.steps.coarse:
        error = np.where(stretch.mask, stretch.measured - seen.prediction, np.nan)
        if isinstance(seen.modes, WeighedModes):
            error = error - seen.modes.slow_noise(residual)
        level = stretch.steps.noise_before(error, seen.levels.white, level)
    return _Left(residual, seen.weight, cosines, level)
