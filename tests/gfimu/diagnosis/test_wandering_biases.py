"""Random walks of the biases: a model of the nuisance parameters that is searched where its evidence may suffice."""

from pathlib import Path

import pytest

from gfimu.diagnosis import Policy, diagnose, make_stretches, prepare
from gfimu.diagnosis.search.nuisance_models import understand
from sim.trials import draw_world
from sim.trials.study.cases import Case


@pytest.mark.study
@pytest.mark.parametrize(
    ("effects", "walks"),
    [(("bias_random_walk",), True), (("warm_up",), False), (("gain_drift", "bias"), False), ((), False)],
)
def test_the_biases_walk_where_a_walk_is_hidden_and_nowhere_else(effects, walks):
    world = draw_world(Case("walks", 91001, effects, 1000.0, duration=40.0))
    prepared = prepare([world.recording], world.twin, ["run"])
    found = understand(make_stretches(world.twin, prepared.runs, prepared.effects), Policy())
    assert (found.walk is not None) == walks


@pytest.mark.study
def test_a_walk_and_what_is_beside_it_are_found():
    world = draw_world(Case("walks", 91002, ("bias_random_walk", "eccentricity"), 1000.0, duration=20.0))
    found = diagnose([world.recording], world.twin)
    assert {cause.effect for cause in found.causes} == {"bias_random_walk", "eccentricity"}


@pytest.mark.study
def test_a_walk_is_found_beside_a_slow_cause_that_is_right():
    """In 15 s one slow cause of two passes for the walk; without both a walk fits worse than with both it would."""
    settings = {"duration": 15.0, "sample_rate": 200.0, "bias_instability_mg": 0.061, "tacho_noise": 0.0436}
    case = Case("walks", 872_020, ("bias_random_walk", "scale_factor"), 207.8, **settings)
    generators = Path(__file__).parents[3] / "sim" / "trials" / "benchmark" / "generators"
    generator = f"{generators / 'independent_world.py'}:hide"
    world = draw_world(case, generator)
    found = diagnose([world.recording], world.twin)
    assert {cause.effect for cause in found.causes} == {"bias_random_walk", "scale_factor"}


@pytest.mark.study
def test_a_walk_over_coarse_steps_is_told_with_its_strength():
    """The edges at which coarse readings tell much move with the biases."""
    world = draw_world(Case("walks", 91023, ("bias_random_walk", "coarse_resolution"), 1000.0, duration=14.0))
    found = diagnose([world.recording], world.twin)
    assert found.verdict == "explained"
    told = {cause.effect: cause for cause in found.causes}
    assert set(told) == {"bias_random_walk", "coarse_resolution"}
    walk, key = told["bias_random_walk"], "strength_m_s2_rts"
    assert abs(walk.parameters[key] - dict(world.truth)["bias_random_walk"][key]) < 3.0 * walk.std[key]


@pytest.mark.study
def test_an_effect_that_the_library_lacks_is_no_walk():
    """An axis that nods, in a library without it, looks like a random walk of the biases at first sight."""
    world = draw_world(
        Case(
            "left_out", 80045, ("axis_wobble",), 1000.0, duration=20.0, bias_instability_mg=0.05, without="axis_wobble"
        )
    )
    found = diagnose([world.recording], world.twin)
    assert found.verdict == "unknown"
    assert "bias_random_walk" not in {cause.effect for cause in found.causes}


@pytest.mark.study
@pytest.mark.parametrize(
    ("seed", "effects", "size", "group"),
    [(30112, ("gain_drift", "warm_up"), 300.0, "pairs"), (91004, ("eccentricity", "clock_error"), 1000.0, "walks")],
)
def test_causes_that_leave_no_walk_are_found_without_one(seed, effects, size, group):
    world = draw_world(Case(group, seed, effects, size, duration=20.0))
    found = diagnose([world.recording], world.twin)
    assert {cause.effect for cause in found.causes} == set(effects)
