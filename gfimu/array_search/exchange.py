"""Exchange algorithm of optimal design: one chip after the other is replaced by the best candidate until none gains.

V. V. Fedorov, Theory of Optimal Experiments, 1972; R. D. Cook & C. J. Nachtsheim, Technometrics 22(3), 1980 (the
variant that takes the design's points in turn). A chip of k axes changes JᵀJ by rank k, so all candidates for one
place are judged by one k × k update each (`gfimu.array_search.criteria.Criterion.exchanged`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.array_search.criteria import Goal
from gfimu.array_search.problem import Candidates, Design, Problem, rows_of

__all__ = ["drawn_rows", "exchange", "log_figure"]

_Vector = NDArray[np.float64]

_MOST_SWEEPS = 30  # numerical: each ends with a smaller figure; five are usual
_GAIN = 1e-9  # numerical: relative gain of an exchange that is worth it
_GAIN_BEFORE_POLISH = 3e-4  # numerical: the same where a polish follows, which makes the small steps in less time


def drawn_rows(problem: Problem, positions: _Vector, axes: _Vector, chip: NDArray[np.intp]) -> _Vector:
    """Rows of chips under every draw of the tolerance, shape (s, m, k, 12); one draw without a tolerance.

    ``positions`` (m, 3) and ``axes`` (m, k, 3) are moved as the draws move chip number ``chip`` (m,).
    """
    if problem.draws is None:
        return rows_of(positions[:, None], axes)[None]
    moved, turned = problem.draws
    places = positions + moved[:, chip]  # (s, m, 3)
    rotated = np.einsum("smij,mkj->smki", turned[:, chip], axes)
    return rows_of(places[:, :, None], rotated)


def log_figure(problem: Problem, goal: Goal, design: Design) -> float:
    """Logarithm of the figure of a design, the worst over the draws of the tolerance where they count."""
    rows = drawn_rows(problem, design.positions, design.axes, np.arange(problem.n_chips))
    return goal.exact(rows.reshape(len(rows), -1, 12))


def exchange(
    problem: Problem, goal: Goal, pool: Candidates, design: Design, rng: np.random.Generator
) -> tuple[Design, float]:
    """Return a design that no exchange of a single chip for a candidate makes better, and the logarithm of its figure.

    Single sensing axes that may point anywhere take the best direction at each place (coordinate exchange: R. K.
    Meyer & C. J. Nachtsheim, Technometrics 37(1), 1995); all others come from the pool.
    """
    n = problem.n_chips
    choices = _Choices(problem, goal, pool)
    least = _GAIN_BEFORE_POLISH if problem.shape is not None or problem.turns else _GAIN
    best = log_figure(problem, goal, design)
    quiet = 0  # chips in a row that stayed
    for chip in (int(one) for _ in range(_MOST_SWEEPS) for one in rng.permutation(n)):
        trial = choices.best(design, chip, best - least)
        if trial is not None:
            value = log_figure(problem, goal, trial)  # without the rounding of the update
            if value < best - least:
                design, best, quiet = trial, value, 0
                continue
        quiet += 1
        if quiet >= n:
            break
    return design, best


class _Choices:
    """What may take the place of a chip."""

    def __init__(self, problem: Problem, goal: Goal, pool: Candidates) -> None:
        self.problem, self.goal, self.pool = problem, goal, pool
        self.steering = goal.steering if problem.turns and problem.axes_per_chip == 1 else None
        if self.steering is not None:
            places = slice(None, None, len(problem.frames))  # the pool has each place once per direction
            self.pool = Candidates(pool.positions[places], pool.axes[places], pool.site[places])
            self._arms = rows_of(self.pool.positions[:, None], np.eye(3)[None])  # (m, 3, 12)
        self._rows: dict[int, _Vector] = {}

    def best(self, design: Design, chip: int, limit: float) -> Design | None:
        """Return the design with the best candidate in place of a chip; None where none is below the limit."""
        pool, n = self.pool, self.problem.n_chips
        others = np.arange(n) != chip
        kept = drawn_rows(self.problem, design.positions[others], design.axes[others], np.flatnonzero(others))
        free = self.problem.apart(pool, design.positions[others], design.site[others])
        if not free.any():
            return None
        flat = kept.reshape(len(kept), -1, 12)
        if self.steering is not None:
            values, directions = self.steering.steered(flat[0], self._arms[free])
            axes = directions[:, None]
        else:
            key = chip if self.problem.draws is not None else 0  # the draws differ from chip to chip
            if key not in self._rows:
                self._rows[key] = drawn_rows(self.problem, pool.positions, pool.axes, np.full(len(pool.site), chip))
            values, axes = self.goal.exchanged(flat, self._rows[key][:, free]), pool.axes[free]
        one = int(np.argmin(values))
        if values[one] >= limit:
            return None
        return design.with_chip(chip, pool.positions[free][one], axes[one], int(pool.site[free][one]))
