"""Held-out data: whether causes predict data that their fit never used, and what they are worth there.

With a second recording the causes are fitted to the first and judged on the second. With one recording, it is cut into
blocks of some seconds, and the odd and the even blocks are predicted from each other. The drive of a held-out block is
always unknown and marginalised; what came before the block is simulated with the drive of the whole run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.diagnosis.criticism.gain import Gain
from gfimu.diagnosis.criticism.held_out_stretch import Measured, gain_of, measure
from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.data.cosine_basis import NoiseLevels
from gfimu.diagnosis.data.stretch import RunUp, Stretch
from gfimu.diagnosis.fit.evidence import SCALES, inverse, likeliest_scale
from gfimu.diagnosis.fit.gauss_newton import Fit, fit
from gfimu.diagnosis.fit.learn import LEARNINGS, learn_noise, learn_roughness, sharpened, starting_point
from gfimu.diagnosis.fit.linear import Point, energy_of, linearise, with_residue
from gfimu.diagnosis.fit.parallel import each_apart, over_segments
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.cause import Cause, effects_of
from gfimu.diagnosis.terms.drive import MARGIN, Drive
from gfimu.model.world_model import Effect

__all__ = ["Holdout", "Part", "gate_gains", "held_out_gain", "other_recordings", "split"]


@dataclass(frozen=True)
class Part:
    """Stretches with their drives and noise.

    Parameters
    ----------
    stretches : tuple of Stretch
        The data; the residue of a calibration is not among their known effects.
    drives : tuple of Drive
        Where a fit starts, and what it takes for the roughness.
    levels : tuple of NoiseLevels
        The noise.
    """

    stretches: tuple[Stretch, ...]
    drives: tuple[Drive, ...]
    levels: tuple[NoiseLevels, ...]

    def __add__(self, other: Part) -> Part:
        """Return both parts as one."""
        return Part(self.stretches + other.stretches, self.drives + other.drives, self.levels + other.levels)

    def point(self, causes: Sequence[Cause], residue: float) -> Point:
        """Return where a fit of causes starts, their shapes held, beside a residue linear about them."""
        held = tuple(replace(cause, held=True) for cause in causes)
        point = Point(held, self.drives, self.levels)
        return with_residue(self.stretches, point, residue) if residue > 0.0 else point


@dataclass(frozen=True)
class Holdout:
    """A fitted and a held-out part.

    Parameters
    ----------
    train : Part
        The part that is fitted.
    test : Part
        The part that is predicted.
    residue : float
        Size of the residue of the calibration in units of its tolerances; 0 where none is admitted.
    """

    train: Part
    test: Part
    residue: float = 0.0


# -- pairs of fitted and held-out data -------------------------------------------------------------------------------


def split(stretches: Sequence[Stretch], found: Fit, policy: Policy, *, duration: float | None = None) -> list[Holdout]:
    """Split every stretch into an even number of blocks, alternately of one part and of the other; pair them both ways.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    found : Fit
        The fit to all of them; its causes decide how far beyond the ends of a block motion is needed (a slow clock).
    policy : Policy
        Thresholds.
    duration : float, optional
        About how long a block is, s; infinite for halves. By default `Policy.block_duration`.
    """
    residue = 0.0 if found.point.residue is None else found.point.residue.scale
    if isinstance(stretches[0], BodyStretch):
        bodies = [stretch for stretch in stretches if isinstance(stretch, BodyStretch)]
        halves = zip(*(stretch.halves() for stretch in bodies), strict=True)
        odd, even = (Part(half, found.point.drives, found.point.levels) for half in halves)
        return [Holdout(odd, even, residue), Holdout(even, odd, residue)]
    length = policy.block_duration if duration is None else duration
    parts: list[list[tuple[Stretch, Drive, NoiseLevels]]] = [[], []]
    for stretch, drive, levels in zip(stretches, found.point.drives, found.point.levels, strict=True):
        effects = effects_of(found.causes, stretch.model.array, stretch.index)
        pairs = max(1, round(float(np.ptp(stretch.run.t[stretch.counted])) / (2 * length)))
        for index, (start, stop) in enumerate(pairwise(stretch.parts(2 * pairs))):
            parts[index % 2].append((*_block(stretch, drive, effects, start, stop, policy), levels))
    odd, even = (Part(*zip(*part, strict=True)) for part in parts)
    return [Holdout(odd, even, residue), Holdout(even, odd, residue)]


def _block(
    whole: Stretch, drive: Drive, effects: Sequence[Effect], start: int, stop: int, policy: Policy
) -> tuple[Stretch, Drive]:
    """Cut the samples from ``start`` up to ``stop`` out of a stretch, and their drive out of its drive."""
    run, before = whole.run.rows(start, stop), whole.run.rows(0, start)
    bare = replace(whole, run=run)
    times = np.append(bare.counted_times(effects), run.t[bare.counted])
    std = policy.block_angle_std
    mine = drive.within(float(times.min()) - MARGIN, float(times.max()) + MARGIN, bare.since, std)
    run_up = RunUp(before.t, before.temperature, drive.spin) if start else None
    return replace(bare, start_angle=mine.angle, start_angle_std=std, run_up=run_up), mine


def other_recordings(
    stretches: Sequence[Stretch], found: Fit, held_out: Sequence[Stretch], policy: Policy
) -> list[Holdout]:
    """Pair the fitted data with other recordings.

    These have the noise of the fitted ones, the sizes of the first run where each run has its own, and drives whose
    roughness and knots are learnt beside the causes: they are no less free than those that were fitted.

    Parameters
    ----------
    stretches : sequence of Stretch
        The fitted data.
    found : Fit
        The fit to them.
    held_out : sequence of Stretch
        The other recordings.
    policy : Policy
        Thresholds.
    """
    test = tuple(replace(stretch, index=0) for stretch in held_out)
    first = found.point
    if isinstance(test[0], BodyStretch):  # its noise is that of its own motion
        own = learn_noise(test, replace(starting_point(test, policy.knots), causes=found.causes))
        return [Holdout(Part(tuple(stretches), first.drives, first.levels), Part(test, own.drives, own.levels))]
    drives = starting_point(test, first.drives[0].spline.spacing).drives

    def reaching(stretch: Stretch, drive: Drive) -> Drive:
        times = stretch.counted_times(effects_of(found.causes, stretch.model.array, 0))
        return drive.covering(np.array([float(times.min()) - MARGIN, float(times.max()) + MARGIN]))

    drives = tuple(over_segments(reaching, test, drives))
    residue = 0.0 if first.residue is None else first.residue.scale
    part = Part(test, drives, (first.levels[0],) * len(test))
    near = fit(test, part.point(found.causes, residue), policy).point
    near = sharpened(test, learn_roughness(test, near, LEARNINGS), policy)
    part = replace(part, drives=near.drives)
    return [Holdout(Part(tuple(stretches), first.drives, first.levels), part, residue)]


# -- what causes are worth there -------------------------------------------------------------------------------------


def gate_gains(
    found: Fit,
    without: Mapping[str, Fit],
    pairs: Sequence[Holdout],
    policy: Policy,
    *,
    other_recording: bool = False,
) -> dict[str, float]:
    """Return the log predictive gain of each cause on held-out data, nats, the other causes kept.

    It is the log evidence of both parts together less that of the fitted part. The halves of one run are whitened as
    one block for the joint evidence, so that slow noise common to both does not count as a repetition; many short
    blocks would each count it again. A residue of the calibration is integrated out in both. Halves of a free body's
    run are predicted from each other instead.

    Parameters
    ----------
    found : Fit
        The causes, fitted to all data but other recordings.
    without : mapping of str to Fit
        The best fit without each.
    pairs : sequence of Holdout
        The halves both ways, or the runs fitted and the runs held out.
    policy : Policy
        Thresholds.
    other_recording : bool
        Whether the held-out data are other recordings.
    """
    if not without or not pairs:
        return {}
    fits = [found, *without.values()]
    gains = []
    for pair in pairs:
        if isinstance(pair.test.stretches[0], BodyStretch) and not other_recording:
            gains.append(_squares_removed(pair, fits, policy))
            continue
        part = _evidence_of(pair.train, fits, pair.residue, policy)
        joint = [one.log_evidence for one in fits]
        if other_recording:
            joint = _evidence_of(pair.train + pair.test, fits, pair.residue, policy)
        gains.append([(joint[0] - whole) - (part[0] - trained) for whole, trained in zip(joint, part, strict=True)])
    return dict(zip(without, np.mean(gains, axis=0)[1:].tolist(), strict=True))


def _squares_removed(pair: Holdout, fits: Sequence[Fit], policy: Policy) -> list[float]:
    """Return by what each set of causes, fitted to one part of free bodies, predicts the other worse than the first.

    Slow noise is free in each part of a run: that a constant of the one is that of the other too speaks for a bias.
    """

    def one(causes: Sequence[Cause]) -> float:
        trained = fit(pair.train.stretches, pair.train.point(causes, 0.0), policy)
        return 0.5 * energy_of(pair.test.stretches, pair.test.point(trained.causes, 0.0))

    energies = each_apart(one, [other.causes for other in fits])
    return [other - energies[0] for other in energies]


def _evidence_of(part: Part, fits: Sequence[Fit], residue: float, policy: Policy) -> list[float]:
    """Return the log evidence of each set of causes on some data, their shapes held."""
    start = part.point(fits[0].causes, residue)

    def one(causes: Sequence[Cause]) -> float:
        held = tuple(replace(cause, held=True) for cause in causes)
        return fit(part.stretches, replace(start, causes=held), policy).log_evidence

    return each_apart(one, [other.causes for other in fits])


def held_out_gain(causes: Sequence[Cause], pairs: Sequence[Holdout], policy: Policy, *, label: str) -> Gain:
    """Measure what the causes, fitted on one part, are worth on the other.

    Errors are compared in the metric of the fit: squares whitened by the learnt noise (white, slow, and a random walk
    where one was found), the drive marginalised. Their expectation is the number of observations times the white noise
    that the held-out data themselves show at frequencies which the drive can't follow, so that slow noise and an error
    of its learnt level are no excess. A residue of the calibration is integrated out in the fitted part and held at
    its most probable sizes in the other; it belongs to what was found, as do faults of the data.

    Parameters
    ----------
    causes : sequence of Cause
        The causes; their shapes are kept, their sizes fitted again on each training part.
    pairs : sequence of Holdout
        Which part is fitted and which is predicted.
    policy : Policy
        Thresholds.
    label : str
        What was held out.
    """
    measured: list[Measured] = []
    for pair in pairs:
        train, test = pair.train, pair.test
        trained = fit(train.stretches, train.point(causes, pair.residue), policy)
        expected = _expected(trained, train.stretches[0].model.array)
        residue = _most_probable_residue(train, replace(trained.point, causes=expected))
        unexplained = trained.objective / max(sum(stretch.observations for stretch in train.stretches), 1)
        faults = frozenset(fault.name for stretch in train.stretches for fault in stretch.known)
        for stretch, drive, levels in zip(test.stretches, test.drives, test.levels, strict=True):
            nominal = replace(stretch, known=tuple(fault for fault in stretch.known if fault.name not in faults))
            extended = replace(stretch, known=(*stretch.known, *residue))
            measured.append(measure(nominal, extended, expected, drive, levels, unexplained, policy))
    return gain_of(measured, policy, label=label)


def _expected(trained: Fit, array: AccelerometerArray) -> tuple[Cause, ...]:
    """Return causes with the sizes to expect after a fit: the posterior mean under a prior of the likeliest scale.

    A size that one part of a recording does not determine would be extrapolated to the other part at any value. The
    prior of the fit is wide enough for a large error; how large a cause's sizes usually are follows from those of them
    that are determined.
    """
    if not trained.causes:
        return ()
    ends = np.cumsum([len(cause.coordinates) for cause in trained.causes])
    places = np.split(np.arange(ends[-1]), ends[:-1])
    precision = np.empty(ends[-1])
    for mine in places:
        others = np.setdiff1d(np.arange(ends[-1]), mine)
        free = trained.gram[np.ix_(others, others)] + np.eye(len(others)) / SCALES[-1] ** 2
        following = np.linalg.solve(free, trained.gram[np.ix_(others, mine)]).T  # how the others follow
        gram = trained.gram[np.ix_(mine, mine)] - following @ trained.gram[np.ix_(others, mine)]
        precision[mine] = likeliest_scale(gram, trained.score[mine] - following @ trained.score[others]) ** -2
    mean = inverse(trained.gram + np.diag(precision)) @ trained.score
    return tuple(
        cause.at(np.clip(mean[mine], *cause.limits(array))) for cause, mine in zip(trained.causes, places, strict=True)
    )


def _most_probable_residue(part: Part, point: Point) -> tuple[Effect, ...]:
    """Return the residue of the calibration as effects, the causes held."""
    if point.residue is None:
        return ()
    return point.residue.effects(part.stretches[0], linearise(part.stretches, point).residue)
