"""Boxes, spheres and cylinders: where chips may sit, and where they may not.

A shape is the set in which every wall function g_j(r) = c_j − b_jᵀd − dᵀA_j d, d = r − centre, is zero or positive.
The walls are scaled so that g_j is about the distance to the wall, so that one form serves the volume (all g_j ≥ 0), a
keep-out zone (some g_j ≤ 0) and the constraints of the polish.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull

from gfimu.base.errors import InputError

__all__ = ["LATTICE", "Shape", "box", "cylinder", "frames_across", "sphere"]

_Vector = NDArray[np.float64]

LATTICE = np.array([point for point in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(point)])
"""Corners, edge middles and face centres of the cube of edge 2, shape (26, 3)."""

_SIDES = 256  # numerical: of the polygon around a cylinder, which exceeds the circle by 0.0075 %
_SPHERE_POINTS = 3000  # numerical: of the polyhedron around a sphere, which exceeds it by about 0.2 %
_HALVINGS = 40  # numerical: of the step from the centre to the wall


@dataclass(frozen=True)
class Shape:
    """A convex shape.

    Parameters
    ----------
    kind : {"box", "sphere", "cylinder"}
        Which it is.
    name : str
        What it is, in words.
    centre : ndarray, shape (3,)
        Its centre, m.
    half : ndarray, shape (3,)
        Half the edges of the box around it along the body axes, m.
    quadratic : ndarray, shape (w, 3, 3)
        A of every wall, 1/m.
    linear : ndarray, shape (w, 3)
        b of every wall.
    constant : ndarray, shape (w,)
        c of every wall, m.
    anchors : ndarray, shape (a, 3)
        Points of its surface that good arrays often use, from the centre, m.
    outer : ndarray, shape (v, 3)
        Points whose convex hull contains the shape, from the centre, m.
    """

    kind: Literal["box", "sphere", "cylinder"]
    name: str
    centre: _Vector
    half: _Vector
    quadratic: _Vector
    linear: _Vector
    constant: _Vector
    anchors: _Vector
    outer: _Vector

    def walls(self, points: ArrayLike) -> _Vector:
        """Wall functions, about the distances to the walls, positive inside, shape (..., w), m."""
        apart = np.asarray(points, dtype=float) - self.centre
        bent = np.einsum("...i,wij,...j->...w", apart, self.quadratic, apart)
        return self.constant - apart @ self.linear.T - bent

    def wall_slopes(self, points: ArrayLike) -> _Vector:
        """Gradients of `walls`, shape (..., w, 3)."""
        apart = np.asarray(points, dtype=float) - self.centre
        return -self.linear - 2.0 * np.einsum("wij,...j->...wi", self.quadratic, apart)

    def contains(self, points: ArrayLike, tolerance: float = 0.0) -> NDArray[np.bool_]:
        """Whether points, shape (..., 3), lie inside or on the surface."""
        return np.asarray((self.walls(points) >= -tolerance).all(axis=-1))

    def scaled(self, factor: float) -> Shape:
        """Return the shape with every length, the centre's included, times a factor; its name stays."""
        return replace(
            self,
            centre=self.centre * factor,
            half=self.half * factor,
            quadratic=self.quadratic / factor,
            constant=self.constant * factor,
            anchors=self.anchors * factor,
            outer=self.outer * factor,
        )

    def sample(self, count: int, rng: np.random.Generator) -> _Vector:
        """Return random points, three of four on the surface, the others inside, shape (count, 3)."""
        inside = self.centre + rng.uniform(-1.0, 1.0, (4 * count, 3)) * self.half
        inside = inside[self.contains(inside, 1e-12)][:count]
        ahead = inside - self.centre
        low, high = np.ones(len(ahead)), np.full(len(ahead), 1e3)
        for _ in range(_HALVINGS):
            middle = np.sqrt(low * high)
            within = self.contains(self.centre + ahead * middle[:, None])
            low, high = np.where(within, middle, low), np.where(within, high, middle)
        low[::4] = 1.0
        return self.centre + ahead * low[:, None]

    @property
    def outer_points(self) -> _Vector:
        """Points whose convex hull contains the shape, shape (v, 3), m: a convex function is largest at one of them."""
        return self.centre + self.outer


def box(edges_m: ArrayLike, centre_m: ArrayLike = (0.0, 0.0, 0.0)) -> Shape:
    """Return a box along the body axes.

    Parameters
    ----------
    edges_m : array_like, shape (3,)
        Edges, m; zero makes it flat.
    centre_m : array_like, shape (3,)
        Its centre, m.

    Raises
    ------
    InputError
        If an edge is negative or not finite, or all are zero.
    """
    edges = np.asarray(edges_m, dtype=float)
    if edges.shape != (3,) or not np.isfinite(edges).all() or (edges < 0).any() or not edges.any():
        raise InputError(f"box {edges.tolist()}: give three edges in m, none negative and not all zero")
    half = edges / 2.0
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3))) * half
    return Shape(
        "box",
        "a box of " + " × ".join(f"{edge:g}" for edge in edges) + " m",
        _centre(centre_m),
        half,
        np.zeros((6, 3, 3)),
        np.vstack([np.eye(3), -np.eye(3)]),
        np.concatenate([half, half]),
        np.unique(LATTICE * half, axis=0),
        np.unique(corners, axis=0),
    )


def sphere(radius_m: float, centre_m: ArrayLike = (0.0, 0.0, 0.0)) -> Shape:
    """Return a ball of a radius, m.

    Raises
    ------
    InputError
        If the radius is not a positive length.
    """
    _require_length(radius_m, "sphere: radius")
    turns = np.arange(_SPHERE_POINTS) + 0.5
    height = 1.0 - 2.0 * turns / _SPHERE_POINTS  # Fibonacci points
    angle, across = math.pi * (1.0 + math.sqrt(5.0)) * turns, np.sqrt(1.0 - height**2)
    points = np.column_stack([across * np.cos(angle), across * np.sin(angle), height])
    points = np.vstack([points, _directions()])
    reach = float(-ConvexHull(points).equations[:, 3].max())  # radius of the ball inside the polyhedron
    return Shape(
        "sphere",
        f"a sphere of radius {radius_m:g} m",
        _centre(centre_m),
        np.full(3, float(radius_m)),
        np.eye(3)[None] / (2.0 * radius_m),
        np.zeros((1, 3)),
        np.array([radius_m / 2.0]),
        _directions() * radius_m,
        points * radius_m / reach,
    )


def cylinder(radius_m: float, height_m: float, axis: str = "z", centre_m: ArrayLike = (0.0, 0.0, 0.0)) -> Shape:
    """Return a cylinder along a body axis: radius and height, m; a height of zero makes it a disc.

    Raises
    ------
    InputError
        If the radius is not positive, the height negative, or the axis not x, y or z.
    """
    _require_length(radius_m, "cylinder: radius")
    if not (math.isfinite(height_m) and height_m >= 0):
        raise InputError(f"cylinder: height {height_m!r}: must be zero or a positive length, m")
    if axis not in {"x", "y", "z"}:
        raise InputError(f"cylinder: unknown axis {axis!r}; valid: x, y, z")
    along = np.eye(3)["xyz".index(axis)]
    side, other = np.roll(along, 1), np.roll(along, 2)

    def rings(number: int, radius: float, heights: tuple[float, ...]) -> _Vector:
        angles = np.arange(number) * 2.0 * math.pi / number
        ring = radius * (np.cos(angles)[:, None] * side + np.sin(angles)[:, None] * other)
        return np.concatenate([ring + level * along for level in heights])

    half = height_m / 2.0
    levels = (-half, half) if half else (0.0,)
    middles = (-half, 0.0, half) if half else (0.0,)
    return Shape(
        "cylinder",
        f"a cylinder of radius {radius_m:g} m and height {height_m:g} m along {axis}",
        _centre(centre_m),
        np.where(along > 0, half, radius_m),
        np.stack([(np.eye(3) - np.outer(along, along)) / (2.0 * radius_m), np.zeros((3, 3)), np.zeros((3, 3))]),
        np.stack([np.zeros(3), along, -along]),
        np.array([radius_m / 2.0, half, half]),
        rings(12, radius_m, middles),
        rings(_SIDES, radius_m / math.cos(math.pi / _SIDES), levels),
    )


def frames_across(normals: _Vector) -> _Vector:
    """Two sensing axes across each unit normal, shape (n, 2, 3): columns of the reflection of z onto the normal."""
    sign = np.where(normals[:, 2] < 0, -1.0, 1.0)
    mirror = normals + sign[:, None] * np.array([0.0, 0.0, 1.0])
    share = normals[:, :2] / (1.0 + np.abs(normals[:, 2:]))
    return np.eye(3)[:2] - mirror[:, None] * share[:, :, None]


def _directions() -> _Vector:
    return LATTICE / np.linalg.norm(LATTICE, axis=1, keepdims=True)


def _centre(centre_m: ArrayLike) -> _Vector:
    centre = np.asarray(centre_m, dtype=float)
    if centre.shape != (3,) or not np.isfinite(centre).all():
        raise InputError(f"centre {centre.tolist()}: give three finite numbers, m")
    return centre


def _require_length(value: float, what: str) -> None:
    if not (math.isfinite(value) and value > 0):
        raise InputError(f"{what} {value!r}: must be a positive length, m")
