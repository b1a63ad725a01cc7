"""What may be built: how many chips, where they may sit, which directions their axes may take, how exactly.

A design is the positions of the chips, shape (n, 3), and their sensing axes, shape (n, k, 3), with lengths in a unit of
half the longest edge around the volume. Every criterion is a function of the rows [r × θ, θ, centripetal], shape
(n k, 12), of the sensing axes: the rows of [J Q] (GF-IMU paper, step 4).
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray, Chip
from gfimu.array_search.shapes import LATTICE, Shape, frames_across
from gfimu.base.errors import GeometryError, InputError
from gfimu.base.files.schema import NotNegative, Table, about

__all__ = ["Candidates", "Design", "Problem", "Sites", "ToleranceTable", "rows_of", "slopes_by_design"]

_Vector = NDArray[np.float64]

_RANDOM_POINTS, _POINTS_PER_CHIP = 100, 5  # least number of positions added to the anchors of a volume in each start
_PLACINGS = 30  # random orders tried before chips are said not to fit
_TOUCH = 1e-9  # numerical: of the unit
_PERPENDICULAR = 1e-6  # numerical: cosine of two axes of one chip


@dataclass(frozen=True)
class Sites:
    """A finite list of places for chips.

    Parameters
    ----------
    positions : ndarray, shape (m, 3)
        The places, body frame, m.
    axes : tuple of ndarray
        For each place the sensing axes that are given there, each of shape (a, 3); empty where axes are chosen freely.
    name : str
        Where the list comes from.
    """

    positions: _Vector
    axes: tuple[_Vector, ...] = ()
    name: str = "candidate sites"

    def __post_init__(self) -> None:
        if self.positions.ndim != 2 or self.positions.shape[1:] != (3,) or not np.isfinite(self.positions).all():
            raise InputError(f"{self.name}: candidate sites must be rows of three finite numbers, m")
        if not all(np.isfinite(axis).all() for axis in self.axes):
            raise InputError(f"{self.name}: an axis of a candidate site is not finite")


class ToleranceTable(Table, frozen=True):
    """Machining and mounting: each chip is off by up to this, uniformly distributed."""

    position_m: Annotated[NotNegative, about("Of each coordinate of each chip.", "m")] = 0.0
    angle_rad: Annotated[NotNegative, about("Of the turn of each chip about each body axis.", "rad")] = 0.0
    draws: Annotated[
        int, about("Drawn arrays of which the worst counts, the same for every design.", ge=1, le=1000)
    ] = 32


@dataclass(frozen=True)
class Design:
    """One array in units of the problem.

    Parameters
    ----------
    positions : ndarray, shape (n, 3)
        Of the chips.
    axes : ndarray, shape (n, k, 3)
        Unit vectors.
    site : ndarray of int, shape (n,)
        Index of the place of each chip; −1 in a volume.
    """

    positions: _Vector
    axes: _Vector
    site: NDArray[np.intp]

    @property
    def rows(self) -> _Vector:
        """Rows of [J Q], shape (n k, 12)."""
        return rows_of(self.positions[:, None], self.axes).reshape(-1, 12)

    def with_chip(self, chip: int, position: _Vector, axes: _Vector, site: int) -> Design:
        """Return the design with one chip elsewhere: position (3,), axes (k, 3)."""
        positions, every, sites = self.positions.copy(), self.axes.copy(), self.site.copy()
        positions[chip], every[chip], sites[chip] = position, axes, site
        return Design(positions, every, sites)


@dataclass(frozen=True)
class Candidates:
    """Chips from which an exchange chooses: m places with directions; fields as of `Design`."""

    positions: _Vector
    axes: _Vector
    site: NDArray[np.intp]


@dataclass(frozen=True)
class Problem:
    """A search; lengths in m, but those of designs in `unit`.

    Parameters
    ----------
    n_chips, axes_per_chip : int
        Number of chips, and sensing axes of each: 1, 2 or 3.
    volume : Shape or Sites
        Where chips may sit.
    keep_out : tuple of Shape
        Where they may not.
    min_spacing_m : float
        Least distance between two chips.
    directions : ndarray, shape (d, 3), optional
        Directions that sensing axes may take; free without them. Not used for tri-axial chips, nor where sites give
        them.
    non_recursive : bool
        Whether α = (S a)₁…₃ must be free of ω².
    tolerance : ToleranceTable, optional
        Of the worst case.
    length_unit_m : float, optional
        Half the longest edge around the volume by default.
    """

    n_chips: int
    axes_per_chip: int
    volume: Shape | Sites
    keep_out: tuple[Shape, ...] = ()
    min_spacing_m: float = 0.005
    directions: _Vector | None = None
    non_recursive: bool = False
    tolerance: ToleranceTable | None = None
    length_unit_m: float | None = None

    def __post_init__(self) -> None:
        n, k = self.n_chips, self.axes_per_chip
        if k not in {1, 2, 3}:
            raise InputError(f"axes per chip = {k}: must be 1, 2 or 3")
        if not (math.isfinite(self.min_spacing_m) and self.min_spacing_m >= 0):
            raise InputError(f"least spacing {self.min_spacing_m!r}: must be zero or a positive length, m")
        if n * k < 6:
            raise GeometryError(
                f"{n} chips with {k} axes have {n * k} channels; "
                f"six motions need six or more: use at least {math.ceil(6 / k)} chips"
            )
        if isinstance(self.volume, Sites):
            self._check_sites(self.volume)

    def _check_sites(self, sites: Sites) -> None:
        free, n = self.allowed(sites.positions), self.n_chips
        if free.sum() < n:
            outside = f" outside the keep-out zones ({len(free)} in all)" if self.keep_out else ""
            raise InputError(f"{sites.name}: {free.sum()} candidate sites{outside} for {n} chips; give at least {n}")
        if self.non_recursive:
            raise InputError("a search free of ω² moves chips; give a volume in place of candidate sites")

    @cached_property
    def unit(self) -> float:
        """Length that designs count as 1, m."""
        if isinstance(self.volume, Shape):
            return float(self.volume.half.max())
        return float(np.ptp(self.volume.positions, axis=0).max()) / 2.0 or 1.0

    @cached_property
    def shape(self) -> Shape | None:
        """The volume in units; None for candidate sites."""
        return self.volume.scaled(1.0 / self.unit) if isinstance(self.volume, Shape) else None

    @cached_property
    def zones(self) -> tuple[Shape, ...]:
        """The keep-out zones in units."""
        return tuple(zone.scaled(1.0 / self.unit) for zone in self.keep_out)

    @property
    def spacing(self) -> float:
        """Least distance between chips in units."""
        return self.min_spacing_m / self.unit

    @property
    def turns(self) -> bool:
        """Whether directions are free variables: the turn of a tri-axial chip changes nothing."""
        given = isinstance(self.volume, Sites) and bool(self.volume.axes)
        return self.axes_per_chip < 3 and self.directions is None and not given

    def allowed(self, points_m: _Vector) -> NDArray[np.bool_]:
        """Whether points, shape (m, 3), m, are outside every keep-out zone."""
        allowed = np.ones(len(points_m), dtype=bool)
        for zone in self.keep_out:
            allowed &= (zone.walls(points_m) <= _TOUCH * zone.half.max()).any(axis=-1)
        return allowed

    @cached_property
    def frames(self) -> _Vector:
        """Sensing axes that a chip may have at any place, shape (d, k, 3); the coarse list of free directions."""
        if self.axes_per_chip == 3:
            return np.eye(3)[None]
        chosen = self.directions
        if chosen is None:
            half = LATTICE[: len(LATTICE) // 2]  # one of each pair of opposite directions
            chosen = half / np.linalg.norm(half, axis=1, keepdims=True)
            return chosen[:, None] if self.axes_per_chip == 1 else frames_across(chosen)
        return _combinations(chosen, self.axes_per_chip, "directions")

    def candidates(self, rng: np.random.Generator) -> Candidates:
        """Return chips to choose from: the sites, or anchors and random points of the volume."""
        if isinstance(self.volume, Sites):
            places = self.volume.positions
            free = np.flatnonzero(self.allowed(places))
            if not self.volume.axes or self.axes_per_chip == 3:
                return self._everywhere(places[free] / self.unit, free)
            frames = [
                _combinations(self.volume.axes[one], self.axes_per_chip, f"{self.volume.name}: site {one + 1}")
                for one in free
            ]
            site = np.repeat(free, [len(frame) for frame in frames])
            return Candidates(places[site] / self.unit, np.concatenate(frames), site)
        shape = self.volume
        points = np.vstack(
            [shape.centre + shape.anchors, shape.sample(max(_RANDOM_POINTS, _POINTS_PER_CHIP * self.n_chips), rng)]
        )
        points = points[self.allowed(points)]
        if not len(points):
            raise InputError(f"the keep-out zones leave nothing of {shape.name}; make them smaller")
        return self._everywhere(points / self.unit, np.full(len(points), -1))

    def _everywhere(self, points: _Vector, site: NDArray[np.intp]) -> Candidates:
        number = len(self.frames)
        axes = np.tile(self.frames, (len(points), 1, 1))
        return Candidates(np.repeat(points, number, axis=0), axes, np.repeat(site, number))

    def random_design(self, pool: Candidates, rng: np.random.Generator) -> Design:
        """Draw a design from the pool that keeps the spacing; raises `InputError` where none was found."""
        out = np.linalg.norm(pool.positions - pool.positions.mean(axis=0), axis=1)
        outermost = np.argsort(-out, kind="stable")[: max(1, len(out) // 20)]
        for trial in range(_PLACINGS):
            left = np.arange(len(pool.site))
            chosen: list[int] = []
            dense = trial >= _PLACINGS // 2  # from far out, each as near to the others as the spacing lets it
            while len(left) and len(chosen) < self.n_chips:
                one = int(rng.choice(left if chosen or not dense else outermost))
                if dense and chosen:
                    one = int(left[np.argmin(_nearest(pool.positions[left], pool.positions[chosen]))])
                chosen.append(one)
                left = left[self.apart(pool, pool.positions[chosen[-1:]], pool.site[chosen[-1:]])[left]]
            if len(chosen) == self.n_chips:
                return Design(pool.positions[chosen], pool.axes[chosen], pool.site[chosen])
        where = self.volume.name
        raise InputError(
            f"{self.n_chips} chips don't fit at {self.min_spacing_m:g} m from each other in {where}; "
            "use a larger box or a smaller spacing"
        )

    def apart(self, pool: Candidates, positions: _Vector, site: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Whether candidates keep the spacing to chips and don't share their sites, shape (m,)."""
        free = ~np.isin(pool.site, site[site >= 0])
        if self.spacing > 0 and len(positions):
            free &= _nearest(pool.positions, positions) >= self.spacing * (1.0 - _TOUCH)
        return free

    @cached_property
    def draws(self) -> tuple[_Vector, _Vector] | None:
        """Displacements, shape (d, n, 3), and rotations, shape (d, n, 3, 3); the first draw is the nominal array."""
        if self.tolerance is None:
            return None
        rng, size = np.random.default_rng(0), (self.tolerance.draws + 1, self.n_chips, 3)
        moved = rng.uniform(-1.0, 1.0, size) * self.tolerance.position_m / self.unit
        turned = rng.uniform(-1.0, 1.0, size) * self.tolerance.angle_rad
        moved[0], turned[0] = 0.0, 0.0
        return moved, Rotation.from_rotvec(turned.reshape(-1, 3)).as_matrix().reshape(*size, 3)

    def array(self, design: Design, name: str, part: str, description: str) -> AccelerometerArray:
        """Return a design as an array."""
        chips = tuple(
            Chip(f"a{index + 1}", position * self.unit, axes, part)
            for index, (position, axes) in enumerate(zip(design.positions, design.axes, strict=True))
        )
        return AccelerometerArray(name, chips, self.length_unit_m or self.unit, description)


def rows_of(positions: _Vector, axes: _Vector) -> _Vector:
    """Rows [r × θ, θ, centripetal] of [J Q], shape (..., 12), for positions and axes of shape (..., 3)."""
    x, y, z = np.moveaxis(positions, -1, 0)
    a, b, c = np.moveaxis(axes, -1, 0)
    columns = [
        y * c - z * b, z * a - x * c, x * b - y * a, a + 0.0 * x, b + 0.0 * x, c + 0.0 * x,
        -(b * y + c * z), -(a * x + c * z), -(a * x + b * y), a * y + b * x, a * z + c * x, b * z + c * y,
    ]  # fmt: skip
    return np.stack(columns, axis=-1)


def slopes_by_design(slope: _Vector, positions: _Vector, axes: _Vector) -> tuple[_Vector, _Vector]:
    """Carry derivatives by the rows, shape (..., 12), over to positions and axes, each of shape (..., 3)."""
    lever, direct, field_slope = slope[..., :3], slope[..., 3:6], slope[..., 6:]
    xx, yy, zz, xy, xz, yz = np.moveaxis(field_slope, -1, 0)
    product = np.stack([-(yy + zz), xy, xz, xy, -(xx + zz), yz, xz, yz, -(xx + yy)], axis=-1)
    product = product.reshape(*product.shape[:-1], 3, 3)  # symmetric: θᵀ (its) r is the centripetal part
    by_position = np.cross(axes, lever) + np.einsum("...ij,...j->...i", product, axes)
    by_axis = np.cross(lever, positions) + direct + np.einsum("...ij,...j->...i", product, positions)
    return by_position, by_axis


def _combinations(directions: _Vector, k: int, where: str) -> _Vector:
    """Return sets of k directions that are perpendicular to each other, shape (d, k, 3)."""
    norms = np.linalg.norm(directions, axis=1)
    if directions.ndim != 2 or not np.isfinite(norms).all() or (norms == 0).any():
        raise InputError(f"{where}: must be rows of three finite numbers, not all zero")
    units = directions / norms[:, None]
    found = [
        units[list(chosen)]
        for chosen in itertools.combinations(range(len(units)), k)
        if all(abs(units[i] @ units[j]) < _PERPENDICULAR for i, j in itertools.combinations(chosen, 2))
    ]
    if not found:
        raise InputError(f"{where}: no {k} of its directions are perpendicular to each other; a chip needs {k}")
    return np.array(found)


def _nearest(points: _Vector, others: _Vector) -> _Vector:
    return np.linalg.norm(points[:, None] - others[None], axis=-1).min(axis=1)
