"""Whether the twin's numbers are all a little off, as after any calibration, instead of one thing being wrong.

Without this a residue of many small errors is taken for whichever wide effect comes closest. The search is run again
with the residue among the unknowns, and kept where that makes the data more probable.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.adequacy import left_over
from gfimu.diagnosis.calibration_residue import CalibrationResidue, tolerance_of
from gfimu.diagnosis.causes import Cause, Signature, effects_of_run
from gfimu.diagnosis.data.prepared_runs import PreparedRuns
from gfimu.diagnosis.explanation import Explanation
from gfimu.diagnosis.fit import Fit
from gfimu.diagnosis.holdout import Holdout
from gfimu.diagnosis.long_run import explain_any_length
from gfimu.diagnosis.pruning import prune
from gfimu.diagnosis.refinement import FAIR_FIT, refine
from gfimu.diagnosis.segment import Segment
from gfimu.diagnosis.signatures import signature_columns
from gfimu.diagnosis.stochastic import LARGEST_USUAL_FLICKER, log_probability
from gfimu.world_model import Effect, EffectFamily, WorldModel

__all__ = ["LooseCalibration", "loosen", "relearned"]

_USUAL, _LARGE = 1.0, 3.0  # of the tolerances
_MUCH = 500.0
_SUPERFLUOUS = 100.0  # nats: more than dropping causes that a residue makes superfluous brings
_PLAIN = 25.0  # standard deviations: some 300 nats, and a cause is kept from 4 to 15
# That everything is a little off is what anybody expects; that all is three times as much, hardly.
_LEAST_ODDS = {_USUAL: 3.0, _LARGE: 7.0}


@dataclass(frozen=True)
class LooseCalibration:
    """An explanation in which the twin's calibration has a residue.

    Parameters
    ----------
    scale : float
        Size of the residue in units of `TOLERANCE`.
    effects : tuple of Effect
        Its most probable values.
    explanation : Explanation
        The causes beside it, judged with the residue marginalised; ``fixed`` has the effects, the segments no more
        unknowns of their own.
    held : Explanation
        The same, judged with the residue held at its most probable values.
    """

    scale: float
    effects: tuple[Effect, ...]
    explanation: Explanation
    held: Explanation


def loosen(
    plain: Explanation, prepared: PreparedRuns, model: WorldModel
) -> tuple[LooseCalibration | None, Explanation]:
    """Return the explanation with a calibration residue where it is more probable than the one without.

    Besides, the one without, which knows what would be named with a residue.
    """
    tolerance = tolerance_of(model.families())
    if not tolerance or not all(_fits(segment) for segment in plain.segments):
        return None, plain
    runs = len(prepared.runs)
    reference = log_probability(plain.segments, plain.fit)
    if plain.given_up and not plain.left_for and _is_hopeless(plain, prepared, tolerance, reference):
        return None, plain
    value, start = _trial(plain, plain.fit.causes, tolerance, _USUAL)
    scale = _USUAL
    larger, other = _trial(plain, start.causes, tolerance, _LARGE)
    if larger > value:
        value, scale, start = larger, _LARGE, other
    if value < reference:
        return None, _with_rival(plain, start, value - reference - _LEAST_ODDS[scale])
    left = left_over(plain.segments, plain.fit, plain.fixed, prepared.spikes, rounded=prepared.rounded)
    if left.log_odds > max(_MUCH, value - reference):  # of something that is no residue
        return None, plain
    segments, _ = prepared.segments(model)
    fixed = plain.fixed
    for segment, old in zip(segments, plain.segments, strict=True):
        segment.adopt(old)
    _admit(segments, start.causes, fixed, start.drives, tolerance, scale)
    found = explain_any_length(segments, fixed, runs, start=start.causes)
    odds = log_probability(segments, found.fit) - reference
    if found.fit.key == start.key:
        # Noise learnt anew may leave it less probable than it was under the noise of the plain explanation.
        odds = max(odds, value - reference)
    if odds < _LEAST_ODDS[scale]:
        return None, _with_rival(plain, found.fit, odds - _LEAST_ODDS[scale])
    effects = _most_probable(segments, found.fit, fixed, tolerance, scale)
    known = tuple((*before, *effects) for before in fixed)
    for segment in segments:
        segment.calibration_residue = None
    fit = refine(segments, found.fit.causes, known, drives=found.fit.drives)
    held = Explanation(
        fit,
        (),
        refine(segments, (), known, drives=fit.drives),
        {name: refine(segments, other.causes, known, drives=fit.drives) for name, other in found.without.items()},
        found.segments,
        known,
        found.signatures,
    )
    for segment, drive in zip(segments, fit.drives, strict=True):
        segment.coefficients = drive
    whole = replace(found.fit, drives=fit.drives)
    return LooseCalibration(scale, effects, replace(found, fit=whole, fixed=known), held), plain


def _with_rival(plain: Explanation, beside: Fit, odds: float) -> Explanation:
    """Let an explanation know what would be named beside a residue, and the log odds for that, prior odds included."""
    if not np.isfinite(odds):
        return plain
    return replace(plain, beside_residue=replace(beside, log_posterior=plain.fit.log_posterior + odds))


def relearned(loose: LooseCalibration, causes: Sequence[Cause], pairs: Sequence[Holdout]) -> list[Holdout]:
    """Return pairs of fitted and held-out data in which the residue beside causes comes from the fitted part alone."""
    return [_relearned(loose, causes, pair) for pair in pairs]


def _relearned(loose: LooseCalibration, causes: Sequence[Cause], pair: Holdout) -> Holdout:
    old = set(map(id, loose.effects))
    train, test = (
        [[effect for effect in known if id(effect) not in old] for known in fixed]
        for fixed in (pair.train_fixed, pair.test_fixed)
    )
    tolerance = tolerance_of(pair.train[0].model.families())
    drives = [segment.coefficients for segment in pair.train]
    _admit(pair.train, causes, train, drives, tolerance, loose.scale)
    fit = refine(pair.train, causes, train, drives=drives, shapes=False)
    effects = _most_probable(pair.train, fit, train, tolerance, loose.scale)
    for segment, drive in zip(pair.train, fit.drives, strict=True):
        segment.calibration_residue, segment.coefficients = None, drive
    return Holdout(
        pair.train, [[*known, *effects] for known in train], pair.test, [[*known, *effects] for known in test]
    )


def _fits(segment: Segment) -> bool:
    """Tell whether errors as small as a residue can be judged: readings are fine, and nothing large is left in them."""
    return not segment.rounding.channels and float(np.median(segment.levels.flicker[:-1])) < LARGEST_USUAL_FLICKER


def _is_hopeless(plain: Explanation, prepared: PreparedRuns, tolerance: dict[str, float], reference: float) -> bool:
    """Tell whether a search was given up for what no residue takes off, whichever causes that makes superfluous."""
    value, start = _trial(plain, plain.fit.causes, tolerance, _USUAL, pruned=False)
    larger, _ = _trial(plain, start.causes, tolerance, _LARGE, pruned=False)
    left = left_over(plain.segments, plain.fit, plain.fixed, prepared.spikes, rounded=prepared.rounded)
    return left.log_odds > max(_MUCH, max(value, larger) + _SUPERFLUOUS - reference)


def _trial(
    plain: Explanation, causes: Sequence[Cause], tolerance: dict[str, float], scale: float, *, pruned: bool = True
) -> tuple[float, Fit]:
    """Admit a residue beside causes and drop those that it makes superfluous; returns the log probability too.

    That is −∞ where what is missing is larger than any residue.
    """
    segments, fixed = plain.segments, plain.fixed
    _admit(segments, causes, fixed, plain.fit.drives, tolerance, scale)
    try:
        fit = refine(segments, causes, fixed, drives=plain.fit.drives)
        if fit.objective > FAIR_FIT * sum(int(segment.weight_mask.sum()) for segment in segments):
            return -np.inf, fit
        if pruned and any(cause.power < _PLAIN**2 for cause in fit.causes):  # others need not be tried without
            fit = prune(segments, fit, fixed)[0]
        return log_probability(segments, fit), fit
    finally:
        for segment, drive in zip(segments, plain.fit.drives, strict=True):
            segment.calibration_residue, segment.coefficients = None, drive


def _families(model: WorldModel, tolerance: dict[str, float]) -> list[tuple[EffectFamily, NDArray[np.float64]]]:
    """Return each family of the residue with the standard deviation of its sizes."""
    families = [model.families()[name] for name in tolerance]
    return [(family, np.full(len(family.sizes(model.array)), tolerance[family.name])) for family in families]


def _admit(
    segments: Sequence[Segment],
    causes: Sequence[Cause],
    fixed: Sequence[Sequence[Effect]],
    drives: Sequence[NDArray[np.float64]],
    tolerance: dict[str, float],
    scale: float,
) -> None:
    """Let every segment have a residue, linear about the present causes."""
    model = segments[0].model
    signatures, spread = [], []
    for family, std in _families(model, tolerance):
        prior = np.array([size.prior_std for size in family.sizes(model.array)])
        signatures.append(Signature(family, {}, np.arange(len(std))))
        spread.append(scale * std / prior)
    for segment, known, drive in zip(segments, fixed, drives, strict=True):
        segment.coefficients = drive
        segment.prepare_weights()
        present = effects_of_run(causes, model.array, segment.index)
        columns, _ = signature_columns(segment, signatures, (), [*known, *present])
        columns *= np.concatenate(spread)[:, None]
        segment.calibration_residue = CalibrationResidue.of_columns(columns)


def _most_probable(
    segments: Sequence[Segment],
    fit: Fit,
    fixed: Sequence[Sequence[Effect]],
    tolerance: dict[str, float],
    scale: float,
) -> tuple[Effect, ...]:
    """Return the effects of one residue common to all segments, the causes held."""
    model = segments[0].model
    families = _families(model, tolerance)
    count = sum(len(std) for _, std in families)
    information, score = np.eye(count), np.zeros(count)
    for segment, known, drive in zip(segments, fixed, fit.drives, strict=True):
        segment.coefficients = drive
        line = segment.linearise([*known, *effects_of_run(fit.causes, model.array, segment.index)])
        inner, right = line.drive.residue()
        information += inner - np.eye(count)
        score += right
    sizes = scale * np.linalg.solve(information, score)
    ends = np.cumsum([len(std) for _, std in families])[:-1]
    return tuple(
        family.from_sizes(model.array, part * std, {})
        for (family, std), part in zip(families, np.split(sizes, ends), strict=True)
    )
