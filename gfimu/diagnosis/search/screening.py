"""Screening: the normal equations of the whole library about a set of causes, and every hypothesis over them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.linear import Point, linearise
from gfimu.diagnosis.fit.posterior import Posterior
from gfimu.diagnosis.terms.cause import Cause, effects_of, mixing_of
from gfimu.diagnosis.terms.columns import Columns
from gfimu.diagnosis.terms.library import family_columns
from gfimu.model.world_model import EffectFamily, Whitened, prior_of, shapes_to_screen

__all__ = ["Hypothesis", "Screening", "Signature", "columns_of_run", "hypotheses_of", "screen"]

_OF_MOTION = frozenset({"motion", "timing", "reference"})  # a table at rest shows nothing of these


@dataclass(frozen=True)
class Signature:
    """One effect in one shape.

    Parameters
    ----------
    family : EffectFamily
        The kind of effect.
    shape : mapping
        Shape parameters.
    columns : ndarray of int, shape (m,) or (runs · m,)
        The columns of its sizes; an effect that each run has anew has a block for each.
    looks : float
        Number of shapes that this one was chosen from.
    """

    family: EffectFamily
    shape: Mapping[str, float]
    columns: NDArray[np.intp]
    looks: float


@dataclass(frozen=True)
class Hypothesis:
    """A cause without sizes, and the signature whose columns it uses."""

    cause: Cause
    signature: Signature
    positive: NDArray[np.bool_]


@dataclass(frozen=True)
class Screening:
    """Normal equations in P columns, relative to no effects at all.

    Parameters
    ----------
    signatures : tuple of Signature
        Every effect in every shape.
    hypotheses : tuple of Hypothesis
        Every effect at every place.
    gram, score : ndarray, shape (P, P) and (P,)
        G and b.
    base : ndarray, shape (P,)
        The causes about which they are, in the columns.
    responses : tuple of ndarray, each (m, P)
        How the drive of every stretch follows the columns.
    """

    signatures: tuple[Signature, ...]
    hypotheses: tuple[Hypothesis, ...]
    gram: NDArray[np.float64]
    score: NDArray[np.float64]
    base: NDArray[np.float64]
    responses: tuple[NDArray[np.float64], ...]

    def drive_moves(self, members: Sequence[int], causes: Sequence[Cause]) -> list[NDArray[np.float64]]:
        """Return how far every drive would follow from the base to other causes in a linear world."""
        move = -self.base
        for number, cause in zip(members, causes, strict=True):
            move[self.hypotheses[number].signature.columns] += cause.mixing @ cause.coordinates
        return [response @ move for response in self.responses]


def screen(stretches: Sequence[Stretch], point: Point, *, only: Collection[str] | None = None) -> Screening:
    """Linearise the whole library, or ``only`` some effects besides those of the point, about a point."""
    array, causes = stretches[0].model.array, point.causes
    runs = len({stretch.index for stretch in stretches})

    first = linearise(stretches, replace(point, residue=None))
    signatures, count = _plan(stretches, first.posteriors, causes, runs, only)

    def columns(stretch: Stretch, at: Posterior) -> Columns:
        parts = [family_columns(stretch, at.observed, at.drive, causes, s.family, s.shape) for s in signatures]
        numbers = np.concatenate([columns_of_run(s, array, stretch.index) for s in signatures])
        return Columns.together(parts).among(numbers, count)

    jacobians = [posterior.jacobian for posterior in first.posteriors]
    linear = linearise(stretches, point, columns, jacobians=jacobians)
    base = np.zeros(count)
    for cause in causes:
        base[next(s for s in signatures if s.family.name == cause.name).columns] = cause.mixing @ cause.coordinates
    hypotheses = tuple(hypotheses_of(signatures, array, runs))
    score = linear.score + linear.gram @ base
    return Screening(tuple(signatures), hypotheses, linear.gram, score, base, linear.responses)


def columns_of_run(signature: Signature, array: AccelerometerArray, run: int) -> NDArray[np.intp]:
    """Return the columns of a signature's sizes in a run, shape (m,)."""
    count = len(signature.family.sizes(array))
    block = run if len(signature.columns) > count else 0
    return signature.columns[block * count : (block + 1) * count]


def _plan(
    stretches: Sequence[Stretch],
    posteriors: Sequence[Posterior],
    causes: Sequence[Cause],
    runs: int,
    only: Collection[str] | None,
) -> tuple[list[Signature], int]:
    """List the signatures to compute; returns them and the number of their columns."""
    model = stretches[0].model
    duration = max(float(s.run.t[-1] - s.start) for s in stretches)
    rate = 1.0 / stretches[0].run.sample_period
    warm = any(s.run.temperature is not None for s in stretches)
    still = all(s.at_rest for s in stretches)
    present = {cause.name: cause for cause in causes}
    body = isinstance(stretches[0], BodyStretch)
    left = [] if body else [_whitened(s, p, causes) for s, p in zip(stretches, posteriors, strict=True)]
    signatures: list[Signature] = []
    columns = 0
    for name, family in model.families().items():
        count = len(family.sizes(model.array))
        if (
            not count
            or (only is not None and name not in only and name not in present)
            or (getattr(family, "needs_temperature", False) and not warm)
            or (still and family.place in _OF_MOTION)
        ):
            continue
        if name in present:
            shapes: Sequence[Mapping[str, float]] = [present[name].shape]
            looks = float(np.exp(-present[name].log_prior))
        else:
            shapes, looks = shapes_to_screen(family, left, duration, rate)
        width = count * (runs if family.per_run else 1)
        for shape in shapes:
            signatures.append(Signature(family, dict(shape), np.arange(columns, columns + width), looks))
            columns += width
    return signatures, columns


def _whitened(stretch: Stretch, posterior: Posterior, causes: Sequence[Cause]) -> Whitened:
    effects = effects_of(causes, stretch.model.array, stretch.index)
    return Whitened(
        posterior.whitened,
        posterior.observed.weights,
        stretch.run.t,
        stretch.motion(effects, posterior.drive.spin).at(stretch.run.t),
        stretch.model.array,
    )


def hypotheses_of(signatures: Sequence[Signature], array: AccelerometerArray, runs: int) -> list[Hypothesis]:
    """List every effect at every place it can take, with its prior."""
    families = list({str(signature.family.name): signature.family for signature in signatures}.values())
    out = []
    for signature in signatures:
        # A pattern may be empty for few chips, as delays between chips are for one.
        patterns = [pattern for pattern in signature.family.patterns(array) if pattern.mixing.shape[1]]
        anew = len(signature.columns) > len(signature.family.sizes(array))
        for index, pattern in enumerate(patterns):
            # The freest place is as probable as all others together, which are equally so.
            share = 1.0 / (min(len(patterns), 2) * (1 if index == 0 else len(patterns) - 1))
            prior = float(np.log(share * prior_of(signature.family, families) / signature.looks))
            mixing = mixing_of(pattern, runs) if anew else pattern.mixing
            cause = Cause(signature.family, pattern.name, mixing, signature.shape, np.zeros(mixing.shape[1]), prior)
            out.append(Hypothesis(cause, signature, cause.positive(array)))
    return out
