"""All stretches linearised about a point, every nuisance parameter integrated out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.data.cosine_basis import NoiseLevels
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.parallel import over_segments
from gfimu.diagnosis.fit.posterior import Posterior, condition, energy
from gfimu.diagnosis.terms.cause import Cause, effects_of
from gfimu.diagnosis.terms.columns import Columns
from gfimu.diagnosis.terms.drive import Drive
from gfimu.diagnosis.terms.jacobian import Jacobian
from gfimu.diagnosis.terms.library import cause_columns
from gfimu.diagnosis.terms.observed import observe
from gfimu.diagnosis.terms.residue import Residue

__all__ = ["SETTLED", "SHARES", "Linear", "Point", "energy_of", "linearise", "of_causes", "stepped", "with_residue"]

SETTLED = 0.3  # numerical: nats that a step must promise to be taken, and that it may lead uphill
SHARES = (1.0, 0.3, 0.08)
"""Numerical: of a step that leads uphill, or to where there is no prediction."""

_Products = tuple[NDArray[np.float64], NDArray[np.float64]]
ColumnsOf = Callable[[Stretch, Posterior], Columns]


@dataclass(frozen=True)
class Point:
    """All that a fit changes.

    Parameters
    ----------
    causes : tuple of Cause
        Named causes.
    drives : tuple of Drive
        Drive of every stretch.
    levels : tuple of NoiseLevels
        Noise of every stretch.
    residue : Residue, optional
        Residue of the calibration, where it is admitted; its sizes are integrated out.
    exact : bool
        Whether the derivatives by the drives hold what remembers these for long (a lightly damped mode). That is dear,
        and needed for the last digits of such a cause and of what it leaves.
    """

    causes: tuple[Cause, ...]
    drives: tuple[Any, ...]  # each a `Drive`, or a `HandDrive` of a free body
    levels: tuple[Any, ...]
    residue: Residue | None = None
    exact: bool = False


@dataclass(frozen=True)
class Linear:
    """Normal equations of P unknowns, summed over stretches, nuisance parameters integrated out.

    Parameters
    ----------
    gram, score : ndarray, shape (P, P) and (P,)
        G and b.
    energy : float
        Misfit and prior energy at the point; of the residue of a calibration at its best.
    objective : float
        The same with drives and residue at their best in a linear world, the unknowns held.
    log_volume : float
        What the freedom of the nuisance parameters costs.
    drive_steps : tuple of ndarray, each (m,)
        Step of every drive to its best, the unknowns held.
    responses : tuple of ndarray, each (m, P)
        How it follows each unknown.
    posteriors : tuple of Posterior
        Every stretch by itself, without residue.
    residue : ndarray, shape (q,)
        Most probable residue, in standard deviations, the unknowns held.
    """

    gram: NDArray[np.float64]
    score: NDArray[np.float64]
    energy: float
    objective: float
    log_volume: float
    drive_steps: tuple[NDArray[np.float64], ...]
    responses: tuple[NDArray[np.float64], ...]
    posteriors: tuple[Any, ...]  # each a `Posterior`, or a `HandPosterior` of a free body
    residue: NDArray[np.float64]

    @cached_property
    def log_noise(self) -> float:
        """−½ log det of the noise covariance: to compare points of different noise."""
        return sum(posterior.observed.log_noise for posterior in self.posteriors)


def of_causes(point: Point) -> ColumnsOf:
    """Return what makes the columns of a point's causes."""
    return lambda stretch, at: cause_columns(stretch, at.observed, at.drive, point.causes)


def linearise(
    stretches: Sequence[Stretch],
    point: Point,
    columns_of: ColumnsOf | None = None,
    *,
    jacobians: Sequence[Jacobian | None] | None = None,
    responses: bool = True,
) -> Linear:
    """Linearise stretches about a point.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    point : Point
        Where.
    columns_of : callable, optional
        From a stretch and its posterior to the columns of the unknowns, numbered alike in all stretches.
    jacobians : sequence of Jacobian, optional
        Derivatives by the drives, where they are taken as they were.
    responses : bool
        Whether it matters how the drives follow the unknowns.

    Raises
    ------
    numpy.linalg.LinAlgError
        If there is no prediction at the point, or its equations have no solution.
    """
    residues = point.residue.columns if point.residue is not None else (None,) * len(stretches)
    follow = responses or point.residue is not None
    known = jacobians if jacobians is not None else (None,) * len(stretches)

    def one(
        stretch: Stretch, drive: Drive, levels: NoiseLevels, jacobian: Jacobian | None, residue: Columns | None
    ) -> tuple[Posterior, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        effects = effects_of(point.causes, stretch.model.array, stretch.index)
        posterior = condition(stretch, drive, effects, levels, jacobian=jacobian, exact=point.exact)
        parts = [] if residue is None else [residue]
        parts += [] if columns_of is None else [columns_of(stretch, posterior)]
        if not parts:
            return posterior, np.zeros((0, 0)), np.zeros(0), np.zeros((len(posterior.step), 0))
        gram, score, across = posterior.products(Columns.together(parts))
        return posterior, gram, score, posterior.response(across) if follow else across[:, :0]

    rows = over_segments(one, stretches, point.drives, point.levels, known, residues)
    posteriors, grams, scores, ways = zip(*rows, strict=True)
    if not all(np.isfinite(part).all() for part in (*grams, *scores, *(own.objective for own in posteriors))):
        raise np.linalg.LinAlgError("the normal equations are not finite")
    whole = Linear(
        np.sum(grams, axis=0),
        np.sum(scores, axis=0),
        sum(one.energy for one in posteriors),
        sum(one.objective for one in posteriors),
        sum(one.log_volume for one in posteriors),
        tuple(one.step for one in posteriors),
        tuple(ways),
        tuple(posteriors),
        np.zeros(0),
    )
    if point.residue is None:
        return whole
    return _without_residue(whole, point.residue.columns[0].count, _explained(point.residue, posteriors))


def _without_residue(whole: Linear, count: int, explained: float) -> Linear:
    """Integrate out the first unknowns, which have unit prior."""
    inner = whole.gram[:count, :count] + np.eye(count)
    root = np.linalg.cholesky(inner)
    solved = np.linalg.solve(inner, np.column_stack([whole.score[:count], whole.gram[:count, count:]]))
    best, gain = np.asarray(solved[:, 0], dtype=np.float64), solved[:, 1:]
    return Linear(
        whole.gram[count:, count:] - whole.gram[count:, :count] @ gain,
        whole.score[count:] - whole.gram[count:, :count] @ best,
        whole.energy - explained,
        whole.objective - float(whole.score[:count] @ best),
        whole.log_volume - float(np.log(root.diagonal()).sum()),
        tuple(own + way[:, :count] @ best for own, way in zip(whole.drive_steps, whole.responses, strict=True)),
        tuple(way[:, count:] - way[:, :count] @ gain for way in whole.responses),
        whole.posteriors,
        np.asarray(best, dtype=np.float64),
    )


def energy_of(stretches: Sequence[Stretch], point: Point) -> float:
    """Return misfit and prior energy of a point, its drives held, a residue at its best; ∞ without a prediction."""

    def one(stretch: Stretch, drive: Drive, levels: NoiseLevels, residue: Columns | None) -> tuple[float, _Products]:
        effects = effects_of(point.causes, stretch.model.array, stretch.index)
        if residue is None:
            return energy(stretch, drive, effects, levels), (np.zeros((0, 0)), np.zeros(0))
        seen = observe(stretch, stretch.predict(effects, drive.spin), levels)
        return seen.misfit + drive.energy(), seen.products(residue)

    residues = point.residue.columns if point.residue is not None else (None,) * len(stretches)
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            rows = over_segments(one, stretches, point.drives, point.levels, residues)
            taken = 0.0 if point.residue is None else _taken([row[1] for row in rows])
            total = float(sum(row[0] for row in rows)) - taken
    except np.linalg.LinAlgError:
        return np.inf
    return total if np.isfinite(total) else np.inf


def stepped(stretches: Sequence[Stretch], point: Point, linear: Linear) -> Point:
    """Return the point with its drives moved to their best in a linear world; they stay where that leads uphill."""
    for share in SHARES:
        steps = zip(point.drives, linear.drive_steps, strict=True)
        moved = replace(point, drives=tuple(drive.moved(share * step) for drive, step in steps))
        if energy_of(stretches, moved) <= linear.energy + SETTLED:
            return moved
    return point


def _explained(residue: Residue, posteriors: Sequence[Posterior]) -> float:
    return _taken([one.observed.products(columns) for one, columns in zip(posteriors, residue.columns, strict=True)])


def _taken(products: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]]) -> float:
    gram = np.sum([one for one, _ in products], axis=0)
    score = np.sum([other for _, other in products], axis=0)
    return float(score @ np.linalg.solve(gram + np.eye(len(score)), score))


def with_residue(stretches: Sequence[Stretch], point: Point, scale: float) -> Point:
    """Return the point with a residue of the calibration of some size admitted, linear about the point."""
    bare = replace(point, residue=None)
    seen = [
        observe(s, s.predict(effects_of(bare.causes, s.model.array, s.index), drive.spin), levels)
        for s, drive, levels in zip(stretches, bare.drives, bare.levels, strict=True)
    ]
    return replace(point, residue=Residue.beside(scale, stretches, seen, point.drives, point.causes))
