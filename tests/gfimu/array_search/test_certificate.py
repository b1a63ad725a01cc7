"""Proven bounds: closed forms, no design below them, equality where it is known."""

import numpy as np
import pytest

from gfimu import GeometryError
from gfimu.array_search.certificate import certify
from gfimu.array_search.objectives import Conditions, objective
from gfimu.array_search.problem import Problem, Sites
from gfimu.array_search.shapes import box, cylinder, sphere

CUBE, BALL, CAN = box((0.1, 0.1, 0.1)), sphere(0.05), cylinder(0.05, 0.08)


def bound(problem, name="gdop"):
    found = certify(problem, objective(name, problem, Conditions()).criterion, 1.0)
    return None if found is None else found.bound


@pytest.mark.parametrize(
    ("volume", "k", "square"),
    [(CUBE, 3, 4.5), (CUBE, 2, 6.0), (CUBE, 1, 12.0), (BALL, 3, 7.5), (BALL, 2, 9.0), (BALL, 1, 18.0)],
)
def test_the_bound_is_the_closed_form(volume, k, square):
    """GDOP² ≥ 9(a + b)²/(n max ψ) with H = diag(a I, b I): see the page on geometry."""
    limit = np.sqrt(square / 8)
    slack = 1e-4 if volume is CUBE else 2e-3  # a polyhedron around the ball
    assert limit * (1 - slack) < bound(Problem(8, k, volume)) < limit * (1 + 1e-9)


@pytest.mark.parametrize("name", ["gdop", "gdop_joint", "sigma_alpha", "sigma_p", "rate", "drift", "kappa", "fault"])
@pytest.mark.parametrize("volume", [CUBE, BALL, CAN])
def test_no_random_array_is_below_the_bound(name, volume):
    """Chips drawn on the surface, where good arrays are."""
    problem = Problem(14, 1, volume, min_spacing_m=0.0)
    criterion = objective(name, problem, Conditions()).criterion
    rng = np.random.default_rng(0)
    pool = problem.candidates(rng)
    logs = [float(criterion.exact(problem.random_design(pool, rng).rows)) for _ in range(300)]
    assert np.exp(min(logs)) > bound(problem, name)


def test_sites_have_a_bound_of_their_own_which_an_exact_design_meets():
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.05
    assert bound(Problem(4, 3, Sites(corners))) == pytest.approx(np.sqrt(9 / 8), rel=1e-6)
    inner = Problem(4, 3, Sites(np.vstack([corners * 0.5, [[0.05, 0, 0]]])))
    assert bound(inner) > np.sqrt(9 / 8)


def test_directions_along_the_body_raise_the_bound():
    free, body = Problem(8, 1, CUBE), Problem(8, 1, CUBE, directions=np.eye(3))
    assert bound(body) > 1.02 * bound(free)


@pytest.mark.parametrize(("name", "chips"), [("fault", 6), ("rate", 8), ("gdop_joint", 8)])
def test_too_few_channels_have_no_finite_figure(name, chips):
    with pytest.raises(GeometryError, match=f"{chips} channels; it is infinite for fewer than {chips + 1}"):
        bound(Problem(chips, 1, CUBE), name)
