"""Shapes: what is inside, what surrounds them, bad numbers."""

import numpy as np
import pytest
from scipy.optimize import approx_fprime
from scipy.spatial import Delaunay

from gfimu import InputError
from gfimu.array_search.shapes import box, cylinder, sphere

CENTRE = np.array([0.01, -0.02, 0.03])
SHAPES = {
    "box": box((0.1, 0.06, 0.02), CENTRE),
    "sphere": sphere(0.05, CENTRE),
    "cylinder": cylinder(0.03, 0.1, "x", CENTRE),
}


def inside(name, points):
    """Whether points are inside, from the definition of each shape."""
    x, y, z = (points - CENTRE).T
    return {
        "box": (np.abs(x) <= 0.05) & (np.abs(y) <= 0.03) & (np.abs(z) <= 0.01),
        "sphere": x**2 + y**2 + z**2 <= 0.05**2,
        "cylinder": (y**2 + z**2 <= 0.03**2) & (np.abs(x) <= 0.05),
    }[name]


@pytest.mark.parametrize("name", SHAPES)
def test_points_are_inside_where_the_definition_says_so(name):
    points = CENTRE + np.random.default_rng(0).uniform(-0.06, 0.06, (5000, 3))
    expected = inside(name, points)
    assert 10 < expected.sum() < 4990
    np.testing.assert_array_equal(SHAPES[name].contains(points), expected)


@pytest.mark.parametrize("name", SHAPES)
def test_the_outer_points_surround_the_shape_closely(name):
    shape = SHAPES[name]
    sample = shape.sample(500, np.random.default_rng(1))
    assert shape.contains(sample, 1e-9).all()
    hull = Delaunay(shape.outer_points)
    assert (hull.find_simplex(sample, tol=1e-6) >= 0).all()
    assert shape.contains(CENTRE + (shape.outer_points - CENTRE) * 0.997, 0.0).all()
    on_surface = np.abs(shape.walls(sample)).min(axis=1) < 1e-9
    assert 0.7 < on_surface.mean() < 0.8


@pytest.mark.parametrize("name", SHAPES)
def test_slopes_of_the_walls_are_derivatives(name):
    shape, point = SHAPES[name], CENTRE + np.array([0.004, 0.013, -0.006])
    for wall in range(len(shape.constant)):
        numeric = approx_fprime(point, lambda p, w=wall: shape.walls(p)[w], 1e-7)
        np.testing.assert_allclose(shape.wall_slopes(point)[wall], numeric, atol=1e-5)


@pytest.mark.parametrize("name", SHAPES)
def test_a_scaled_shape_has_scaled_walls(name):
    points = CENTRE + np.random.default_rng(0).uniform(-0.06, 0.06, (50, 3))
    np.testing.assert_allclose(SHAPES[name].scaled(20.0).walls(points * 20.0), 20.0 * SHAPES[name].walls(points))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: box((0.1, -0.1, 0.1)), "three edges"),
        (lambda: box((0.1, np.nan, 0.1)), "three edges"),
        (lambda: sphere(0.0), "radius 0.0: must be a positive length"),
        (lambda: sphere(0.1, (0, 0, np.inf)), "centre"),
        (lambda: cylinder(0.1, -1.0), "height -1.0"),
        (lambda: cylinder(0.1, 1.0, "w"), "unknown axis 'w'; valid: x, y, z"),
    ],
)
def test_bad_shapes_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()
