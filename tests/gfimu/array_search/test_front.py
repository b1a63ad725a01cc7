"""Fronts of two objectives: nothing dominated, ends at the single optima, refusals."""

import numpy as np
import pytest

from gfimu import InputError
from gfimu.array_search.front import find_front
from gfimu.array_search.objectives import Conditions, objective
from gfimu.array_search.problem import Problem, Sites, ToleranceTable
from gfimu.array_search.search import search
from gfimu.array_search.shapes import box

CUBE = box((0.1, 0.1, 0.1))


def front(problem, *names, most_chips=6, starts=2):
    return find_front(problem, Conditions(), names, np.random.default_rng(0), most_chips=most_chips, starts=starts)


def test_more_chips_see_better_and_each_keeps_its_bound():
    found = front(Problem(4, 3, CUBE), "chips", "gdop", most_chips=8)
    assert [point.values[0] for point in found.points] == [4, 5, 6, 7, 8]
    for point in found.points:
        assert len(point.array.chips) == point.values[0]
        assert point.bounds[1] == pytest.approx(np.sqrt(9 / (2 * point.values[0])), rel=1e-6)
        assert point.bounds[1] * (1 - 1e-9) <= point.values[1] < 1.05 * point.bounds[1]
    turned = front(Problem(4, 3, CUBE), "gdop", "chips", most_chips=5, starts=1)
    assert [one.unit for one in turned.objectives] == ["", ""]
    assert [point.values[1] for point in turned.points] == [5, 4]


def test_two_objectives_trade_and_the_ends_are_their_own_optima():
    """Equal sight of all motions asks for a smaller array than the best sight of α."""
    problem = Problem(5, 3, box((0.1, 0.1, 0.05)))
    found = front(problem, "kappa", "sigma_alpha", starts=6)
    values = np.array([point.values for point in found.points])
    assert len(values) >= 4
    assert (np.diff(values[:, 0]) > 0).all()
    assert (np.diff(values[:, 1]) < 0).all()
    best = search(problem, objective("sigma_alpha", problem, Conditions()), np.random.default_rng(1), starts=2).value
    assert values[-1, 1] == pytest.approx(best, rel=1e-3)


def test_a_smaller_volume_costs_in_one_unit_of_length():
    found = front(Problem(4, 3, CUBE, min_spacing_m=0.001), "size", "gdop", starts=1)
    sizes, values = np.array([point.values for point in found.points]).T
    assert sizes[-1] == pytest.approx(0.1)
    np.testing.assert_allclose(values, np.sqrt(0.375 * (0.1 / sizes) ** 2 + 0.75), rtol=1e-6)
    assert found.points[0].array.description.endswith("in a box of 0.1 × 0.1 × 0.1 m with all lengths times 0.3")
    assert found.points[-1].array.description.endswith("in a box of 0.1 × 0.1 × 0.1 m")


def test_worst_case_against_nominal():
    problem = Problem(5, 3, CUBE, tolerance=ToleranceTable(0.004, 0.0, 4))
    found = front(problem, "gdop", "gdop_worst", starts=1)
    assert all(point.values[0] <= point.values[1] * (1 + 1e-9) for point in found.points)


@pytest.mark.parametrize(
    ("volume", "names", "message"),
    [
        (CUBE, ("gdop", "gdop"), "two different objectives"),
        (CUBE, ("chips", "size"), "two different objectives"),
        (CUBE, ("gdop", "gdp"), "unknown objective 'gdp'"),
        (CUBE, ("chips", "gdop"), "must exceed 6"),
        (Sites(np.eye(6)[:, :3]), ("size", "gdop"), "candidate sites have none"),
    ],
)
def test_bad_fronts_are_refused(volume, names, message):
    with pytest.raises(InputError, match=message):
        front(Problem(6, 1, volume), *names)
