"""Searches in every kind of volume: constraints kept, known optima, agreement, certificate, refusals."""

import numpy as np
import pytest

from gfimu import GeometryError, InputError
from gfimu.array_search.objectives import Conditions, objective
from gfimu.array_search.problem import Problem, Sites, ToleranceTable
from gfimu.array_search.search import search
from gfimu.array_search.shapes import box, cylinder, sphere

CUBE = box((0.1, 0.1, 0.1))
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.05


def found(problem, name="gdop", starts=3, seed=0):
    return search(problem, objective(name, problem, Conditions()), np.random.default_rng(seed), starts=starts)


def test_single_axes_reach_the_proven_bound_and_agree():
    """Eight single axes in the cube: GDOP² ≥ 12/8 is attained."""
    result = found(Problem(8, 1, CUBE), starts=6)
    assert result.value == pytest.approx(np.sqrt(12 / 8), rel=1e-8)
    assert result.certificate.gap < 1e-4
    assert result.agreeing >= result.starts / 2


@pytest.mark.parametrize(("n", "k"), [(4, 3), (6, 3), (9, 1)])
def test_the_ball_keeps_its_chips_inside_and_near_the_bound(n, k):
    result = found(Problem(n, k, sphere(0.05)), starts=2)
    assert (np.linalg.norm(result.array.chip_positions, axis=1) <= 0.05 * (1 + 1e-6)).all()
    assert np.sqrt({3: 7.5, 1: 18.0}[k] / n) * (1 - 1e-9) < result.value < 1.02 * np.sqrt({3: 7.5, 1: 18.0}[k] / n)


def test_zones_walls_and_spacing_are_kept():
    zones = (sphere(0.03, (0.05, 0.0, 0.04)), box((0.02, 0.02, 0.2)), cylinder(0.015, 0.2, "y", (0.0, 0.0, -0.04)))
    problem = Problem(7, 1, cylinder(0.05, 0.08), zones, min_spacing_m=0.03)
    places = found(problem, starts=2).array.chip_positions
    assert (np.hypot(places[:, 0], places[:, 1]) <= 0.05 + 1e-7).all()
    assert (np.abs(places[:, 2]) <= 0.04 + 1e-7).all()
    assert (np.linalg.norm(places - [0.05, 0.0, 0.04], axis=1) >= 0.03 - 1e-7).all()
    assert (np.abs(places[:, :2]).max(axis=1) >= 0.01 - 1e-7).all()
    assert (np.hypot(places[:, 0], places[:, 2] + 0.04) >= 0.015 - 1e-7).all()
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1)[np.triu_indices(7, 1)]
    assert apart.min() >= 0.03 * (1 - 1e-5)


def test_a_keep_out_zone_costs_and_the_bound_still_holds():
    free = found(Problem(4, 3, CUBE))
    barred = found(Problem(4, 3, CUBE, (sphere(0.03, (0.05, 0.05, 0.05)), sphere(0.03, (-0.05, 0.05, 0.05)))))
    assert barred.value > 1.01 * free.value
    places = barred.array.chip_positions
    apart = np.linalg.norm(places[:, None] - [[0.05, 0.05, 0.05], [-0.05, 0.05, 0.05]], axis=-1)
    assert np.abs(apart - 0.03).min() < 1e-6  # the polish slides along the wall of a zone
    assert barred.certificate.bound == pytest.approx(free.value, rel=1e-6)


def test_of_candidate_sites_the_best_four_are_found_with_a_certificate():
    sites = Sites(np.vstack([CORNERS * 0.7, CORNERS, np.random.default_rng(0).uniform(-0.04, 0.04, (40, 3))]))
    result = found(Problem(4, 3, sites))
    np.testing.assert_allclose(np.abs(result.array.chip_positions), 0.05)
    assert result.value == pytest.approx(np.sqrt(9 / 8))
    assert result.certificate.gap < 1e-6
    assert len(np.unique(result.array.chip_positions, axis=0)) == 4


def test_an_exchange_over_sites_finds_what_trying_all_finds():
    import itertools

    rng = np.random.default_rng(2)
    places = rng.uniform(-0.05, 0.05, (9, 3))
    axes = rng.normal(size=(9, 2, 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    problem = Problem(6, 1, Sites(places, tuple(axes)), min_spacing_m=0.0)
    criterion = objective("gdop", problem, Conditions()).criterion
    pool = problem.candidates(rng)
    from gfimu.array_search.problem import rows_of

    rows = rows_of(pool.positions, pool.axes[:, 0]).reshape(9, 2, 12)
    chosen = np.array(list(itertools.combinations(range(9), 6)))
    best = min(
        float(criterion.exact(rows[chosen, np.array(turn)]).min()) for turn in itertools.product((0, 1), repeat=6)
    )
    assert np.log(found(problem, starts=10).value) == pytest.approx(best, abs=1e-9)


@pytest.mark.parametrize("directions", [np.eye(3), np.array([[1.0, 1, 0], [1, -1, 0], [0, 0, 2]])])
def test_axes_take_the_directions_of_the_list(directions):
    result = found(Problem(6, 1, CUBE, directions=directions), starts=2)
    units = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    assert np.isclose(np.abs(result.array.axes @ units.T), 1.0, atol=1e-9).any(axis=1).all()
    two = found(Problem(4, 2, CUBE, directions=directions), starts=1)
    assert np.isclose(np.abs(two.array.axes @ units.T), 1.0, atol=1e-9).any(axis=1).all()


def test_as_few_channels_as_can_separate_the_rate_are_searched():
    """Without one of nine channels the information on α, p and the products of ω is singular."""
    problem = Problem(9, 1, CUBE, min_spacing_m=0.0)
    result = found(problem, "gdop_joint", starts=2)
    assert result.value == pytest.approx(result.score.gdop_joint, rel=1e-5)


def test_the_least_condition_number_and_fault_meet_their_bounds():
    kappa = found(Problem(8, 1, CUBE), "kappa", starts=1)
    assert kappa.value == pytest.approx(kappa.score.condition_number, rel=1e-6)
    assert 1.0 <= kappa.value < 1.001
    assert found(Problem(8, 1, CUBE), "fault", starts=1).certificate.gap < 1e-3


def test_the_worst_case_is_worse_and_better_than_that_of_the_nominal_optimum():
    loose = Problem(5, 3, CUBE, tolerance=ToleranceTable(0.004, 0.0, 8))
    nominal, robust = found(loose), found(loose, "gdop_worst", starts=1)
    from gfimu.array_search.exchange import log_figure
    from gfimu.array_search.problem import Design

    design = Design(nominal.array.chip_positions / 0.05, np.broadcast_to(np.eye(3), (5, 3, 3)), np.full(5, -1))
    of_nominal = np.exp(log_figure(loose, objective("gdop_worst", loose, Conditions()).goal, design))
    assert nominal.value < robust.value <= of_nominal * (1 + 1e-6)


def test_the_search_beats_differential_evolution_at_equal_work(project_root):
    """Paired: the same problem, seed and processor time."""
    import importlib.util

    path = project_root / "benchmarks" / "optimize.py"
    specification = importlib.util.spec_from_file_location("optimize_benchmark", path)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    problems = {name: module.PROBLEMS[name] for name in ("5 triads, cube", "6 single, cube")}
    rows = module.against_evolution(problems, seeds=2, starts=1)
    assert len(rows) == 4
    assert all(row[-1] > 1 - 1e-6 for row in rows)
    assert sum(row[-1] > 1 + 1e-3 for row in rows) >= 2


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: Problem(4, 3, CUBE, (box((0.2, 0.2, 0.2)),)), InputError, "leave nothing of a box"),
        (lambda: Problem(5, 3, Sites(CORNERS[:4])), InputError, "4 candidate sites for 5 chips; give at least 5"),
        (lambda: Problem(4, 3, Sites(CORNERS), (sphere(0.2),)), InputError, "0 candidate sites outside the keep-out"),
        (lambda: Problem(4, 3, Sites(np.full((5, 3), np.nan))), InputError, "three finite numbers"),
        (lambda: Problem(4, 3, Sites(CORNERS), non_recursive=True), InputError, "give a volume"),
        (lambda: Problem(4, 2, CUBE, directions=np.array([[1.0, 1, 0], [1, 0, 0]])), InputError, "perpendicular"),
        (lambda: Problem(6, 1, CUBE, directions=np.zeros((1, 3))), InputError, "not all zero"),
        (lambda: Problem(6, 1, CUBE, directions=np.eye(3)[:1]), GeometryError, "can't see"),
        (lambda: Problem(4, 3, Sites(np.linspace(0, 1, 6)[:, None] * [1.0, 0, 0])), GeometryError, "can't see"),
    ],
)
def test_impossible_problems_are_refused_with_the_reason(make, error, message):
    with pytest.raises(error, match=message):
        found(make(), starts=1)


@pytest.mark.parametrize(
    ("name", "message"),
    [("gdp", "unknown objective 'gdp'; valid: drift, fault, gdop"), ("gdop_worst", "needs \\[tolerance\\]")],
)
def test_unknown_objectives_are_refused(name, message):
    with pytest.raises(InputError, match=message):
        objective(name, Problem(4, 3, CUBE), Conditions())


def test_a_figure_that_ignores_motions_still_gets_an_array_that_sees_them():
    """σ of α is no larger without p, and the leverages add up to the number of motions that are seen."""
    along_body = found(Problem(6, 1, cylinder(0.05, 0.1), directions=np.eye(3)), "sigma_alpha", starts=2)
    assert along_body.score.condition_number < 100
    # The face centres with axes along the body (structure P2 of the paper): σ of α is 0.7071 of the channels'.
    assert along_body.value <= Conditions().noise * np.sqrt(0.5) / 0.05
    seven = found(Problem(7, 1, CUBE), "fault", starts=1)
    assert seven.score.condition_number < 1e4
    assert seven.certificate.gap < 1e-3
