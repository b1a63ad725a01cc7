"""Search of accelerometer geometries inside a box: random and symmetric starts, each polished by SLSQP.

Tri-axial chips need their positions only; chips of one or two axes a direction each (`gfimu.geometry.objective`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
import scipy.optimize
from numpy.typing import ArrayLike, NDArray

from gfimu.errors import GeometryError, InputError
from gfimu.geometry.array import AccelerometerArray, Chip
from gfimu.geometry.dilution import gdop, gdop_lower_bound
from gfimu.geometry.kinematics import require_all_motions
from gfimu.geometry.objective import GeometryObjective
from gfimu.geometry.scoring import Score, score
from gfimu.short_repr import short_repr

__all__ = ["SearchResult", "optimize"]

_CANDIDATES = 20_000
_SAME = 1e-6  # relative difference of GDOP below which two optima count as one
_LEAKAGE_FREE = 1e-9
_LEAKAGE_WEIGHTS = (1.0, 1e2, 1e4, 1e6)
_LATTICE = np.array([point for point in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(point)])  # (26, 3)

_Vector = NDArray[np.float64]


@dataclass(frozen=True)
class SearchResult:
    """Best geometry found.

    Parameters
    ----------
    array : AccelerometerArray
        The geometry; ``array.to_toml()`` is an array file.
    score : Score
        Its figures of merit in its length unit, half the longest edge of the box.
    gdop_lower_bound : float
        GDOP that no geometry of as many tri-axial chips in the cube around the box can beat; NaN for other chips.
    starts : int
        How many starts were polished.
    agreeing : int
        How many of them ended at the best GDOP: trust the result less if it is one of many.
    """

    array: AccelerometerArray
    score: Score
    gdop_lower_bound: float
    starts: int
    agreeing: int

    __repr__ = short_repr

    def to_dict(self) -> dict[str, Any]:
        """Return the content of ``gfimu optimize --json``."""
        return {
            "array": self.array.to_dict(),
            "score": self.score.to_dict(),
            "gdop_lower_bound": self.gdop_lower_bound,
            "starts": self.starts,
            "agreeing": self.agreeing,
        }


def optimize(
    n_chips: int,
    *,
    rng: np.random.Generator,
    axes_per_chip: int = 3,
    box_m: ArrayLike = (0.1, 0.1, 0.1),
    min_spacing_m: float = 0.005,
    non_recursive: bool = False,
    restarts: int = 40,
    part: str = "adxl345",
    name: str = "",
    report: Callable[[int], None] | None = None,
) -> SearchResult:
    """Search the geometry of least GDOP inside a box centred at the body origin.

    Parameters
    ----------
    n_chips : int
        Number of chips.
    rng : numpy.random.Generator
        Source of the random starts.
    axes_per_chip : int
        Sensing axes of a chip: 1, 2 or 3.
    box_m : array_like, shape (3,)
        Edges of the box along body x, y, z, m; zero makes it flat.
    min_spacing_m : float
        Least distance between two chips, m.
    non_recursive : bool
        Accept only geometries whose α = (S a)₁…₃ is free of ω².
    restarts : int
        Number of starts to polish; half from a symmetric lattice of corners, edge middles and face centres.
    part : str
        Part of the chips in the result.
    name : str
        Name of the result.
    report : callable, optional
        Called with the number of starts done.

    Raises
    ------
    GeometryError
        If no geometry of these chips in this box sees all six motions, or none is free of ω² where that is asked.
    InputError
        If an argument is out of range or the chips don't fit at that spacing.
    """
    problem = _Problem.checked(n_chips, axes_per_chip, np.asarray(box_m, dtype=float), min_spacing_m, non_recursive)
    if restarts < 1:
        raise InputError(f"restarts = {restarts}: must be at least 1")
    starts = problem.starts(restarts, rng)
    found: list[tuple[float, _Vector]] = []
    for number, start in enumerate(starts, start=1):
        end = problem.polished(start)
        if problem.feasible(end):
            found.append((math.sqrt(problem.objective.gdop_squared(end)[0]), end))
        if report is not None:
            report(number)
    if not found:
        raise problem.failure()
    best, variables = min(found, key=lambda item: item[0])
    array = problem.array(problem.rounded(variables), name or f"optimized_{n_chips}x{axes_per_chip}", part)
    return SearchResult(
        array=array,
        score=score(array)[0],
        gdop_lower_bound=gdop_lower_bound(n_chips) if axes_per_chip == 3 else math.nan,
        starts=len(starts),
        agreeing=sum(value < best * (1 + _SAME) for value, _ in found),
    )


@dataclass(frozen=True)
class _Problem:
    """The search in units of half the longest edge; variables are positions, then one direction per chip."""

    objective: GeometryObjective
    unit: float
    half: _Vector  # (3,)
    spacing: float
    non_recursive: bool

    @classmethod
    def checked(cls, n: int, axes_per_chip: int, box: _Vector, spacing: float, non_recursive: bool) -> _Problem:
        if axes_per_chip not in {1, 2, 3}:
            raise InputError(f"axes per chip = {axes_per_chip}: must be 1, 2 or 3")
        if box.shape != (3,) or not np.isfinite(box).all() or (box < 0).any() or not box.any():
            raise InputError(f"box {box.tolist()}: give three edges in m, none negative and not all zero")
        if not (math.isfinite(spacing) and spacing >= 0):
            raise InputError(f"least spacing {spacing!r}: must be zero or a positive length, m")
        if n * axes_per_chip < 6:
            raise GeometryError(
                f"{n} chips with {axes_per_chip} axes have {n * axes_per_chip} channels; "
                f"six motions need six or more: use at least {math.ceil(6 / axes_per_chip)} chips"
            )
        unit = float(box.max()) / 2.0
        return cls(GeometryObjective(n, axes_per_chip), unit, box / 2.0 / unit, spacing / unit, non_recursive)

    @property
    def n(self) -> int:
        return self.objective.n_chips

    @property
    def axes_per_chip(self) -> int:
        return self.objective.axes_per_chip

    def spacing_margin(self, variables: _Vector) -> _Vector:
        """Squared distances between chips less the squared spacing, shape (n (n − 1) / 2,)."""
        positions = variables[: 3 * self.n].reshape(-1, 3)
        first, second = np.triu_indices(self.n, 1)
        return np.sum((positions[first] - positions[second]) ** 2, axis=1) - self.spacing**2

    def spacing_slope(self, variables: _Vector) -> _Vector:
        """Jacobian of `spacing_margin`."""
        positions = variables[: 3 * self.n].reshape(-1, 3)
        first, second = np.triu_indices(self.n, 1)
        apart = 2.0 * (positions[first] - positions[second])
        slope = np.zeros((len(first), variables.size))
        rows = np.arange(len(first))[:, None]
        slope[rows, 3 * first[:, None] + np.arange(3)] = apart
        slope[rows, 3 * second[:, None] + np.arange(3)] = -apart
        return slope

    @property
    def bounds(self) -> scipy.optimize.Bounds:
        edge = np.tile(self.half, self.n)
        free = np.full(3 * self.n if self.objective.turns_matter else 0, 2.0)
        return scipy.optimize.Bounds(np.concatenate([-edge, -free]), np.concatenate([edge, free]))

    def starts(self, restarts: int, rng: np.random.Generator) -> list[_Vector]:
        """Return the best of many random and symmetric candidates, no two of the same GDOP."""
        random = rng.uniform(-1.0, 1.0, (_CANDIDATES, self.n, 3)) * self.half
        if math.comb(len(_LATTICE), self.n) <= _CANDIDATES and not self.objective.turns_matter:
            chosen = np.array(list(itertools.combinations(range(len(_LATTICE)), self.n)))
        elif self.n <= len(_LATTICE):
            chosen = rng.permuted(np.tile(np.arange(len(_LATTICE)), (_CANDIDATES, 1)), axis=1)[:, : self.n]
        else:
            chosen = rng.integers(len(_LATTICE), size=(_CANDIDATES, self.n))
        symmetric = _LATTICE[chosen] * self.half
        picks: list[_Vector] = []
        for positions, share in ((symmetric, (restarts + 1) // 2), (random, restarts)):
            directions = self.candidate_directions(len(positions), rng)
            values = self.candidate_gdop(positions, directions)
            _, order = np.unique(np.round(values, 9), return_index=True)  # ascending: best first
            order = order[np.isfinite(values[order])][: share - (len(picks) if share == restarts else 0)]
            picks += [np.concatenate([positions[i].ravel(), directions[i].ravel()]) for i in order]
        return picks

    def candidate_directions(self, count: int, rng: np.random.Generator) -> _Vector:
        if not self.objective.turns_matter:
            return np.empty((count, 0, 3))
        directions = _LATTICE[rng.integers(len(_LATTICE), size=(count, self.n))]
        return directions / np.linalg.norm(directions, axis=-1, keepdims=True)

    def candidate_gdop(self, positions: _Vector, directions: _Vector) -> _Vector:
        """GDOP of many geometries at once; infinite where chips are too close, shape (m,)."""
        if not self.objective.turns_matter:
            values = gdop(positions)
        elif self.axes_per_chip == 1:
            values = gdop(positions, directions)
        else:
            helper = np.eye(3)[np.argmin(np.abs(directions), axis=-1)]
            first = np.cross(directions, helper)
            first /= np.linalg.norm(first, axis=-1, keepdims=True)
            pair = np.concatenate([first, np.cross(directions, first)], axis=1)  # (m, 2n, 3)
            values = gdop(np.concatenate([positions, positions], axis=1), pair)
        near, far = np.triu_indices(self.n, 1)
        apart = np.linalg.norm(positions[:, near] - positions[:, far], axis=-1).min(axis=1)
        return np.where(apart >= self.spacing, values, np.inf)

    def polished(self, start: _Vector) -> _Vector:
        """Local optimum from one start."""
        constraints: list[Any] = []
        if self.spacing > 0:
            constraints = [{"type": "ineq", "fun": self.spacing_margin, "jac": self.spacing_slope}]
        point = start
        for weight in _LEAKAGE_WEIGHTS if self.non_recursive else (0.0,):
            outcome: Any = scipy.optimize.minimize(
                self.objective.gdop_squared_and_leakage if weight else self.objective.gdop_squared,
                point,
                args=(weight,) if weight else (),
                jac=True,
                method="SLSQP",
                bounds=self.bounds,
                constraints=constraints,
                options={"maxiter": 300, "ftol": 1e-12},
            )
            point = np.clip(outcome.x, self.bounds.lb, self.bounds.ub)
        return self.freed_of_leakage(point) if self.non_recursive else point

    def freed_of_leakage(self, point: _Vector) -> _Vector:
        """Nearest geometry inside the box whose α is free of ω², by bounded Gauss–Newton steps."""
        lower, upper = self.bounds.lb, self.bounds.ub
        movable = upper > lower
        inside = np.clip(point, lower, upper)[movable]

        def leakage(variables: _Vector) -> _Vector:
            whole = lower.copy()
            whole[movable] = variables
            return self.objective.alpha_leakage(whole)

        # dogbox lets chips slide along the walls, where trf would creep; the start is near, so few steps suffice.
        fit = scipy.optimize.least_squares(
            leakage,
            inside,
            bounds=(lower[movable], upper[movable]),
            method="dogbox",
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
            max_nfev=30,
        )
        whole = lower.copy()
        whole[movable] = fit.x
        return whole

    def feasible(self, variables: _Vector) -> bool:
        if self.n > 1 and self.spacing_margin(variables).min() < -1e-6 * max(self.spacing, 1e-3):
            return False
        if not self.objective.sees_all_motions(variables):
            return False
        return not self.non_recursive or bool(np.abs(self.objective.alpha_leakage(variables)).max() < _LEAKAGE_FREE)

    def rounded(self, variables: _Vector) -> _Vector:
        """Positions without the optimiser's last digits, where that costs nothing."""
        tidy = variables.copy()
        tidy[: 3 * self.n] = np.round(tidy[: 3 * self.n], 6) + 0.0
        tidy = np.clip(tidy, self.bounds.lb, self.bounds.ub)
        costs_nothing = self.objective.gdop_squared(tidy)[0] <= self.objective.gdop_squared(variables)[0] * (1 + 1e-6)
        return tidy if costs_nothing and self.feasible(tidy) else variables

    def array(self, variables: _Vector, name: str, part: str) -> AccelerometerArray:
        positions, directions = self.objective.split(variables)
        projectors = self.objective.projectors(directions)
        chips = []
        for number in range(self.n):
            if self.axes_per_chip == 3:
                axes = np.eye(3)
            elif self.axes_per_chip == 1:
                axes = directions[number : number + 1]
            else:
                axes = scipy.linalg.orth(projectors[number], rcond=0.5).T
            chips.append(Chip(f"a{number + 1}", positions[number] * self.unit, axes, part))
        condition = "least GDOP found" + (" with α free of ω²" if self.non_recursive else "")
        edges = " × ".join(f"{2 * edge * self.unit:g}" for edge in self.half)
        description = f"{condition} for {self.n} chips of {self.axes_per_chip} axes in a box of {edges} m"
        return AccelerometerArray(name, tuple(chips), self.unit, description)

    def failure(self) -> GeometryError | InputError:
        """Build the error that says why no start ended well."""
        rng = np.random.default_rng(0)
        positions = rng.uniform(-1.0, 1.0, (self.n, 3)) * self.half
        directions = self.candidate_directions(1, rng)[0]
        try:
            require_all_motions(
                self.array(np.concatenate([positions.ravel(), directions.ravel()]), "of such chips", "adxl345")
            )
        except GeometryError as error:
            return GeometryError(f"no geometry of {self.n} such chips in this box sees all motions: {error}")
        if self.non_recursive:
            return GeometryError(
                f"no geometry of {self.n} such chips in this box was found whose angular acceleration is free of ω²; "
                "use more chips, or leave out the condition and give ω to the estimator"
            )
        return InputError(
            f"{self.n} chips don't fit at {self.spacing * self.unit:g} m from each other; "
            "use a larger box or a smaller spacing"
        )
