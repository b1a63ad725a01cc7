"""Proven lower bounds: how small a figure can be at all, whatever the design.

**Traces of the inverse information.** For every positive semidefinite W and every symmetric H, by Cauchy and Schwarz,

    tr(W M⁻¹) · tr(HWH M) ≥ (tr WH)².                                                                     (1)

M is a sum over n chips, M = Σ A(x_i), so tr(HWH M) ≤ n max ψ(x) with ψ(x) = tr(HWH A(x)), x a place with directions,
and

    tr(W M⁻¹) ≥ (tr WH)² / (n max_x ψ(x)).                                                                (2)

Any H gives a bound; the best H is that of the approximate (weighted) A-optimal design, whose weights are found here
by a multiplicative algorithm (B. Torsney 1983; equivalence theorem of J. Kiefer and J. Wolfowitz, 1960). A(x) = F(r)
P F(r)ᵀ with F affine in the place r, so ψ is convex in r and largest at a corner of any polytope around the volume:
its maximum over a continuous volume is exact over finitely many points
(`gfimu.array_search.shapes.Shape.outer_points`). Over free directions it is the largest eigenvalue of FᵀHWHF for one
axis, the sum of the two largest for two, the trace for three. Keep-out zones and spacing only shrink the set, so (2)
holds with them.

For the cube [−1, 1]³ and the ball |r| ≤ 1 the best H is diag(a I, b I), and (2) is in closed form GDOP² ≥

    chips of           cube      ball
    three axes         9/(2n)    15/(2n)
    two axes           6/n       9/n
    one axis           12/n      18/n

**Condition number.** κ ≥ 1.

**Least fault of a channel.** The leverages of c channels are the diagonal of a projector of rank 6, so the largest is
at least 6/c.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array_search.criteria import Criterion, FaultCriterion, KappaCriterion, TraceCriterion
from gfimu.array_search.problem import Problem, Sites, rows_of
from gfimu.array_search.shapes import LATTICE, frames_across
from gfimu.base.declared import Declared, figure

__all__ = ["Certificate", "certify"]

_Vector = NDArray[np.float64]

_ROUNDS, _STEPS = 100, 60  # numerical: of the search of H; any H gives a bound that holds
_FRESH_WEIGHT = 0.3  # numerical: of all weight, given to the points that a round adds
_LEAST_WEIGHT = 1e-7  # numerical: of a support point that is kept
_CLOSE = 1e-7  # numerical: relative gap at which the search of H ends
_PATIENCE, _PROGRESS = 12, 1e-6  # numerical: it also ends after so many rounds that raise the bound by less than this
_FEW_POINTS, _LESS_PATIENCE = 100, 4  # numerical: rounds over more points cost more and are limited by the polyhedron
_FEWEST_POINTS = 150  # points of a curved volume from which weights are sought; the bound itself uses all


@dataclass(frozen=True)
class Certificate(Declared):
    """A proven lower bound of the figure, and how near the search came."""

    bound: Annotated[float, figure("No array has a smaller figure, in the unit of the objective.")]
    gap: Annotated[float, figure("Figure of the array over the bound, less one.")]
    reason: Annotated[str, figure("What the bound rests on.")]

    @property
    def text(self) -> str:
        """Description, one line."""
        if self.gap < 1e-6:
            return f"certificate: optimal, equal to a proven bound, {self.bound:.5g} ({self.reason})"
        share = f"{100.0 * self.gap:.2g}" if self.gap < 0.095 else f"{100.0 * self.gap:.0f}"
        return f"certificate: within {share} % of a proven bound, {self.bound:.5g} ({self.reason})"


def certify(problem: Problem, criterion: Criterion, value: float) -> Certificate | None:
    """Return a proven lower bound for the criterion, None where none is known.

    Parameters
    ----------
    problem : Problem
        What may be built. The nominal array is one of the draws of a tolerance, so the bound holds for the worst, too.
    criterion : Criterion
        What is to be small.
    value : float
        The figure that was found.
    """
    if isinstance(criterion, KappaCriterion):
        return Certificate(1.0, value - 1.0, "no condition number is below 1")
    if isinstance(criterion, FaultCriterion):
        channels = problem.n_chips * problem.axes_per_chip
        if channels <= 6:
            return None
        bound = criterion.least / math.sqrt(1.0 - 6.0 / channels)
        return Certificate(bound, value / bound - 1.0, f"the leverages of {channels} channels add up to 6")
    if not isinstance(criterion, TraceCriterion):
        return None
    atoms = _Atoms.of(problem)
    bound = math.sqrt(_trace_bound(atoms, criterion) / problem.n_chips)
    where = "candidate sites" if isinstance(problem.volume, Sites) else "volume"
    return Certificate(bound, max(0.0, value / bound - 1.0), f"approximate A-optimal design of the {where}")


@dataclass(frozen=True)
class _Atoms:
    """Where ψ has its largest value: places, and the frames there or none where directions are free.

    ``arms`` is F as rows of the body axes, shape (m, 3, 12); ``frames``, shape (m, k, 3), is None for free directions.
    """

    arms: _Vector
    frames: _Vector | None
    k: int

    @classmethod
    def of(cls, problem: Problem) -> _Atoms:
        if isinstance(problem.volume, Sites):
            pool = problem.candidates(np.random.default_rng(0))
            if not problem.turns:
                arms = rows_of(pool.positions[:, None], np.eye(3)[None])
                return cls(arms, pool.axes, problem.axes_per_chip)
            places = pool.positions[:: len(problem.frames)]
        else:
            assert problem.shape is not None
            places = problem.shape.outer_points
        arms = rows_of(places[:, None], np.eye(3)[None])
        if problem.turns:
            return cls(arms, None, problem.axes_per_chip)
        number = len(problem.frames)
        return cls(np.repeat(arms, number, axis=0), np.tile(problem.frames, (len(arms), 1, 1)), problem.axes_per_chip)

    def largest(self, weights: list[_Vector]) -> float:
        """Return max ψ over all places and directions, for HWH of each term mapped to twelve columns."""
        total = np.sum(weights, axis=0)  # (12, 12)
        blocks = self.arms @ total @ np.swapaxes(self.arms, 1, 2)  # FᵀHWHF, (m, 3, 3)
        if self.frames is not None:
            return float(np.einsum("mki,mij,mkj->m", self.frames, blocks, self.frames).max())
        return float(np.linalg.eigvalsh(blocks)[:, 3 - self.k :].sum(axis=1).max())

    def support(self, weights: list[_Vector]) -> _Vector:
        """Return the rows of chips for the weights to work on, shape (a, k, 12): the best frame at each place."""
        thinned = self.arms[:: max(1, len(self.arms) // _FEWEST_POINTS)] if self.frames is None else self.arms
        if self.frames is not None:
            return np.asarray(self.frames @ self.arms)
        if not weights:
            half = LATTICE[: len(LATTICE) // 2]  # one of each pair of opposite directions
            axes = half / np.linalg.norm(half, axis=1, keepdims=True)
            frames = axes[:, None] if self.k == 1 else frames_across(axes)
            return np.concatenate([frame @ thinned for frame in frames])
        blocks = thinned @ np.sum(weights, axis=0) @ np.swapaxes(thinned, 1, 2)
        vectors = np.swapaxes(np.linalg.eigh(blocks)[1], 1, 2)[:, 3 - self.k :]  # rows: the largest ones
        return np.asarray(vectors @ thinned)


def _trace_bound(atoms: _Atoms, criterion: TraceCriterion) -> float:
    """Largest bound (2) found, for one chip, n = 1."""
    best, idle = 0.0, 0
    pulled: list[_Vector] = []
    rows, share = np.empty((0, atoms.k, 12)), np.empty(0)
    for _ in range(_ROUNDS):
        added = atoms.support(pulled)
        if pulled and atoms.frames is not None:
            added = added[:0]  # a finite list is all there from the first round on
        fresh = _FRESH_WEIGHT / len(added) if len(share) and len(added) else 1.0 / max(len(added), 1)
        rows = np.concatenate([rows, added])
        share = np.concatenate([share * (1.0 - _FRESH_WEIGHT if len(added) else 1.0), np.full(len(added), fresh)])
        share /= share.sum()
        for _ in range(_STEPS):
            inverses = [_inverse(term, rows, share) for term in criterion.terms]
            pulled = [
                term.into @ inverse @ term.weight @ inverse @ term.into.T
                for term, inverse in zip(criterion.terms, inverses, strict=True)
            ]
            psi = np.einsum("aki,ij,akj->a", rows, np.sum(pulled, axis=0), rows)
            share = share * np.sqrt(psi)
            share /= share.sum()
        reached = sum(float(np.sum(t.weight * i)) for t, i in zip(criterion.terms, inverses, strict=True))
        bound = reached**2 / atoms.largest(pulled)
        idle = 0 if bound > best * (1.0 + _PROGRESS) else idle + 1
        best = max(best, bound)
        if reached / best - 1.0 < _CLOSE or idle >= (_PATIENCE if len(atoms.arms) < _FEW_POINTS else _LESS_PATIENCE):
            break
        kept = share > _LEAST_WEIGHT
        rows, share = rows[kept], share[kept]
    return best


def _inverse(term: Any, rows: _Vector, share: _Vector) -> _Vector:
    """H = (Σ w A + R)⁻¹ for the weights, shape (q, q)."""
    mapped = (rows * np.sqrt(share)[:, None, None]).reshape(-1, 12) @ term.into
    return np.asarray(term.inverse(mapped.T @ mapped))
