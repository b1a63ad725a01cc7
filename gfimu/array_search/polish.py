"""Polish of a design by SLSQP with exact gradients: positions inside the volume, directions where they are free."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from gfimu.array_search.criteria import Goal
from gfimu.array_search.exchange import log_figure
from gfimu.array_search.problem import Design, Problem, rows_of, slopes_by_design
from gfimu.array_search.shapes import frames_across

__all__ = ["alpha_leakage", "feasible", "leakage_and_slope", "leaks", "polish"]

_Vector = NDArray[np.float64]

_SHARPNESS = (30.0, 300.0, 3000.0)  # numerical: powers of the ℓ_p norms one after the other, where a figure has kinks
_LEAKAGE_WEIGHTS = (1.0, 1e2, 1e4, 1e6)  # numerical: of the penalty for ω² in α, one after the other
_LEAKAGE_FREE = 1e-9  # numerical: largest product of ω left in α of an array that counts as free of it
_NEAR = 0.5  # of the unit: pairs of chips nearer than this, beyond the spacing, are watched during the polish
_SLACK = 1e-7  # numerical: of the unit, by which a constraint may fail
_SPACING_SLACK, _SPACING_ROUNDING = 1e-6, 1e-9  # numerical: relative, and of the unit, by which the spacing may fail
_LONGEST = 2.0  # numerical: bound of each number of a direction, whose length is free
_STEPS, _FEWEST_STEPS = 300, 30  # numerical: for up to `_MANY` variables, and for very many: a step costs their cube
_MANY = 100
_PRECISION = 1e-12  # numerical: of the logarithm of the figure


@dataclass(frozen=True)
class _Variables:
    """Which numbers of a design vary: positions unless they are sites, then one direction per chip where it is free."""

    problem: Problem
    start: Design

    @cached_property
    def movable(self) -> bool:
        return self.problem.shape is not None

    @property
    def turning(self) -> int:
        """Index of the first number of the directions."""
        return 3 * self.problem.n_chips if self.movable else 0

    def pack(self) -> _Vector:
        parts = [self.start.positions.ravel()] if self.movable else []
        if self.problem.turns:
            axes = self.start.axes
            parts.append((axes[:, 0] if axes.shape[1] == 1 else np.cross(axes[:, 0], axes[:, 1])).ravel())
        return np.concatenate(parts) if parts else np.empty(0)

    def positions(self, numbers: _Vector) -> _Vector:
        return numbers[: self.turning].reshape(-1, 3) if self.movable else self.start.positions

    def directions(self, numbers: _Vector) -> _Vector:
        return numbers[self.turning :].reshape(-1, 3)

    def design(self, numbers: _Vector) -> Design:
        axes = self.start.axes
        if self.problem.turns:
            turned = self.directions(numbers)
            units = turned / np.linalg.norm(turned, axis=1, keepdims=True)
            axes = units[:, None] if self.problem.axes_per_chip == 1 else frames_across(units)
        return Design(self.positions(numbers), axes, self.start.site)

    def slope(self, numbers: _Vector, by_position: _Vector, by_axis: _Vector) -> _Vector:
        """Carry derivatives by positions, (n, 3), and axes, (n, k, 3), over to the numbers."""
        parts = [by_position.ravel()] if self.movable else []
        if self.problem.turns:
            turned = self.directions(numbers)
            length = np.linalg.norm(turned, axis=1, keepdims=True)
            units = turned / length
            by_unit = by_axis[:, 0] if by_axis.shape[1] == 1 else _by_normal(units, by_axis)
            across = by_unit - np.sum(by_unit * units, axis=1, keepdims=True) * units
            parts.append((across / length).ravel())
        return np.concatenate(parts)

    @cached_property
    def bounds(self) -> scipy.optimize.Bounds:
        lower, upper = [], []
        if self.problem.shape is not None:
            shape, n = self.problem.shape, self.problem.n_chips
            lower.append(np.tile(shape.centre - shape.half, n))
            upper.append(np.tile(shape.centre + shape.half, n))
        if self.problem.turns:
            lower.append(np.full(3 * self.problem.n_chips, -_LONGEST))
            upper.append(np.full(3 * self.problem.n_chips, _LONGEST))
        return scipy.optimize.Bounds(np.concatenate(lower), np.concatenate(upper))


def polish(problem: Problem, goal: Goal, design: Design) -> Design:
    """Return the local optimum near a design; the design itself where nothing varies or nothing is gained.

    Parameters
    ----------
    problem : Problem
        What may be built.
    goal : Goal
        What is to be small.
    design : Design
        Where to begin: a design that keeps volume, zones and spacing.
    """
    kinks = goal.kinks
    weights: tuple[float, ...] = _LEAKAGE_WEIGHTS if problem.non_recursive else (0.0,)
    stages = [(sharpness, weight) for weight in weights for sharpness in (_SHARPNESS if kinks else (1.0,))]
    for sharpness, weight in stages:
        variables = _Variables(problem, design)
        numbers = variables.pack()
        if not len(numbers):
            return design
        outcome: Any = scipy.optimize.minimize(
            _objective(variables, goal, sharpness, weight),
            numbers,
            jac=True,
            method="SLSQP",
            bounds=variables.bounds,
            constraints=_constraints(variables, numbers),
            options={"maxiter": _steps(len(numbers)), "ftol": _PRECISION},
        )
        if not np.isfinite(outcome.x).all():
            continue
        found = variables.design(np.clip(outcome.x, variables.bounds.lb, variables.bounds.ub))
        better = weight > 0 or log_figure(problem, goal, found) <= log_figure(problem, goal, design)
        if better and feasible(problem, found):
            design = found
    return _freed_of_leakage(problem, design) if problem.non_recursive else design


def _steps(variables: int) -> int:
    return max(_FEWEST_STEPS, int(_STEPS * min(1.0, (_MANY / max(variables, 1)) ** 2)))


def feasible(problem: Problem, design: Design) -> bool:
    """Whether a design keeps volume, keep-out zones and spacing."""
    shape, places = problem.shape, design.positions
    if shape is not None and not shape.contains(places, _SLACK).all():
        return False
    if any((zone.walls(places) > _SLACK).all(axis=-1).any() for zone in problem.zones):
        return False
    first, second = np.triu_indices(problem.n_chips, 1)
    apart = np.linalg.norm(places[first] - places[second], axis=1)
    return not len(apart) or bool(apart.min() >= problem.spacing * (1.0 - _SPACING_SLACK) - _SPACING_ROUNDING)


def leaks(design: Design) -> bool:
    """Whether α = (S a)₁…₃ of a design holds products of ω."""
    return bool(np.abs(alpha_leakage(design.rows)).max() >= _LEAKAGE_FREE)


def alpha_leakage(rows: _Vector) -> _Vector:
    """Products of ω left in α by the linear solution S a, shape (18,), of rows of shape (c, 12)."""
    inverse = np.linalg.pinv(rows[:, :6])
    return np.asarray((inverse @ rows[:, 6:])[:3].ravel())


def leakage_and_slope(rows: _Vector) -> tuple[float, _Vector]:
    """Sum of the squares of `alpha_leakage`, and its gradient, shape (c, 12).

    With L = M⁻¹N, M = JᵀJ and N = JᵀQ, the gradient of φ = ‖L_α‖² is B = M⁻¹ 2L_α by N and −(B Lᵀ + L Bᵀ)/2 by M.
    """
    kept, field = rows[:, :6], rows[:, 6:]
    inverse = np.linalg.inv(kept.T @ kept + 1e-12 * np.eye(6))
    leakage = inverse @ kept.T @ field
    of_alpha = np.vstack([leakage[:3], np.zeros((3, 6))])
    by_product = inverse @ (2.0 * of_alpha)
    mixed = by_product @ leakage.T
    slope = np.hstack([field @ by_product.T - kept @ (mixed + mixed.T), kept @ by_product])
    return float(np.sum(of_alpha**2)), slope


def _objective(variables: _Variables, goal: Goal, sharpness: float, weight: float) -> Any:
    problem = variables.problem
    draws = problem.draws

    def value_and_slope(numbers: _Vector) -> tuple[float, _Vector]:
        design = variables.design(numbers)
        places, axes = design.positions[None, :, None], design.axes[None]  # (1, n, 1, 3), (1, n, k, 3)
        if draws is not None:
            places = places + draws[0][:, :, None]
            axes = np.einsum("snij,nkj->snki", draws[1], design.axes)
        rows = rows_of(places, axes)  # (s, n, k, 12)
        flat = rows.reshape(len(rows), -1, 12)
        value, slope = goal.smooth(flat, sharpness)
        slope = slope.reshape(rows.shape)
        if weight:
            leak, leak_slope = leakage_and_slope(flat[0])
            value += weight * leak
            slope[0] += weight * leak_slope.reshape(rows.shape[1:])
        by_place, by_axis = slopes_by_design(slope, *np.broadcast_arrays(places, axes))
        if draws is not None:
            by_axis = np.einsum("snij,snki->snkj", draws[1], by_axis)
        return value, variables.slope(numbers, by_place.sum(axis=(0, 2)), by_axis.sum(axis=0))

    return value_and_slope


def _constraints(variables: _Variables, numbers: _Vector) -> list[dict[str, Any]]:
    """Return the curved walls, the zones and the spacing as inequalities of SLSQP; flat walls of boxes are bounds."""
    problem, shape = variables.problem, variables.problem.shape
    if shape is None:
        return []
    places = variables.positions(numbers)
    chips = np.arange(problem.n_chips)
    found = []
    curved = np.flatnonzero(shape.quadratic.any(axis=(1, 2)))
    found += [_wall(shape, chips, np.full(len(chips), wall), 1.0, numbers.size) for wall in curved]
    # A zone is left by one of its walls: that nearest to the open, at the start of the polish.
    found += [_wall(zone, chips, np.argmin(zone.walls(places), axis=-1), -1.0, numbers.size) for zone in problem.zones]
    first, second = np.triu_indices(problem.n_chips, 1)
    near = np.linalg.norm(places[first] - places[second], axis=1) < problem.spacing + _NEAR
    if problem.spacing > 0 and near.any():
        found.append(_spacing(problem.spacing, first[near], second[near], numbers.size))
    return found


def _wall(shape: Any, chips: NDArray[np.intp], walls: NDArray[np.intp], sign: float, size: int) -> dict[str, Any]:
    def values(numbers: _Vector) -> _Vector:
        return sign * shape.walls(numbers[: 3 * len(chips)].reshape(-1, 3))[chips, walls]

    def slopes(numbers: _Vector) -> _Vector:
        gradient = sign * shape.wall_slopes(numbers[: 3 * len(chips)].reshape(-1, 3))[chips, walls]
        result = np.zeros((len(chips), size))
        result[chips[:, None], 3 * chips[:, None] + np.arange(3)] = gradient
        return result

    return {"type": "ineq", "fun": values, "jac": slopes}


def _spacing(spacing: float, first: NDArray[np.intp], second: NDArray[np.intp], size: int) -> dict[str, Any]:
    count = int(max(first.max(), second.max())) + 1

    def values(numbers: _Vector) -> _Vector:
        places = numbers[: 3 * count].reshape(-1, 3)
        return np.sum((places[first] - places[second]) ** 2, axis=1) - spacing**2

    def slopes(numbers: _Vector) -> _Vector:
        places = numbers[: 3 * count].reshape(-1, 3)
        apart = 2.0 * (places[first] - places[second])
        result, pair = np.zeros((len(first), size)), np.arange(len(first))[:, None]
        result[pair, 3 * first[:, None] + np.arange(3)] = apart
        result[pair, 3 * second[:, None] + np.arange(3)] = -apart
        return result

    return {"type": "ineq", "fun": values, "jac": slopes}


def _by_normal(normals: _Vector, by_axis: _Vector) -> _Vector:
    """Carry derivatives by the two axes of `frames_across`, (n, 2, 3), over to the normals, (n, 3)."""
    sign = np.where(normals[:, 2] < 0, -1.0, 1.0)
    below = 1.0 + np.abs(normals[:, 2])
    mirror = normals + sign[:, None] * np.array([0.0, 0.0, 1.0])
    along = np.einsum("nki,ni->nk", by_axis, mirror)  # (n, 2)
    result = -np.einsum("nk,nki->ni", normals[:, :2], by_axis) / below[:, None]
    result[:, :2] -= along / below[:, None]
    result[:, 2] += sign * np.einsum("nk,nk->n", normals[:, :2], along) / below**2
    return result


def _freed_of_leakage(problem: Problem, design: Design) -> Design:
    """Nearest design inside the bounds whose α is free of ω², by bounded Gauss–Newton steps."""
    variables = _Variables(problem, design)
    lower, upper = variables.bounds.lb, variables.bounds.ub
    movable = upper > lower
    inside = np.clip(variables.pack(), lower, upper)

    def whole(numbers: _Vector) -> _Vector:
        filled = lower.copy()
        filled[movable] = numbers
        return filled

    # dogbox lets chips slide along the walls, where trf would creep; the start is near, so few steps suffice.
    fit = scipy.optimize.least_squares(
        lambda numbers: alpha_leakage(variables.design(whole(numbers)).rows),
        inside[movable],
        bounds=(lower[movable], upper[movable]),
        method="dogbox",
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-14,
        max_nfev=30,
    )
    return variables.design(whole(fit.x))
