"""Wandering biases: looked for where they are likely, at once where they explain far more than anything else."""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from gfimu.diagnosis import diagnose, engine, wandering_biases
from gfimu.diagnosis.data.prepared_runs import PreparedRuns
from gfimu.diagnosis.engine import explain
from gfimu.diagnosis.long_run import explain_any_length
from gfimu.diagnosis.stochastic import Walk
from sim.study.cases import Case
from sim.study.outcome import draw_world


def left_for_a_walk(effects, size, seed):
    """Whether the search of a recording is left for wandering biases, and how many rounds it takes."""
    world = draw_world(Case("walks", seed, effects, size, duration=40.0))
    segments, fixed = PreparedRuns.build([world.recording], world.twin, ["run"]).segments(world.twin)
    told = []
    found = explain(segments, fixed, 1, instead=wandering_biases.wanders, report=lambda _, text: told.append(text))
    return found.left_for, sum(text.startswith("search") for text in told)


@pytest.mark.parametrize(
    ("effects", "left"),
    [(("bias_random_walk",), "walk"), (("warm_up",), ""), (("gain_drift", "bias"), ""), ((), "")],
)
def test_a_search_is_left_for_a_walk_and_for_nothing_else(effects, left):
    left_for, rounds = left_for_a_walk(effects, 1000.0, 91001)
    assert left_for == left
    if left:
        assert rounds == 1


def test_a_search_that_is_left_for_a_walk_finds_it_and_what_is_beside_it():
    world = draw_world(Case("walks", 91002, ("bias_random_walk", "eccentricity"), 1000.0, duration=20.0))
    found = diagnose([world.recording], world.twin)
    assert {cause.effect for cause in found.causes} == {"bias_random_walk", "eccentricity"}


def test_a_walk_is_found_beside_a_slow_cause_that_is_right():
    """In 15 s one slow cause of two passes for the walk; without both a walk fits worse than with both it would."""
    settings = {"duration": 15.0, "sample_rate": 200.0, "bias_instability_mg": 0.061, "tacho_noise": 0.0436}
    case = Case("walks", 872_020, ("bias_random_walk", "scale_factor"), 207.8, **settings)
    generator = str(Path(__file__).parents[2] / "independent_world.py:hide")
    world = draw_world(case, generator)
    found = diagnose([world.recording], world.twin)
    assert {cause.effect for cause in found.causes} == {"bias_random_walk", "scale_factor"}


def test_a_walk_over_coarse_steps_is_told_with_its_strength():
    """The edges at which coarse readings tell much move with the biases."""
    world = draw_world(Case("walks", 91023, ("bias_random_walk", "coarse_resolution"), 1000.0, duration=14.0))
    found = diagnose([world.recording], world.twin)
    assert found.verdict == "explained"
    told = {cause.effect: cause for cause in found.causes}
    assert set(told) == {"bias_random_walk", "coarse_resolution"}
    walk, key = told["bias_random_walk"], "strength_m_s2_rts"
    assert abs(walk.parameters[key] - dict(world.truth)["bias_random_walk"][key]) < 3.0 * walk.std[key]


def test_a_search_left_for_a_walk_that_is_none_is_taken_up_again(monkeypatch):
    searches = []

    def noted(*args, **kwargs):
        searches.append(explain_any_length(*args, **kwargs))
        return searches[-1]

    module = sys.modules[diagnose.__module__]
    monkeypatch.setattr(module, "wanders", lambda *_: True)
    monkeypatch.setattr(module, "explain_any_length", noted)
    monkeypatch.setattr(engine, "_SURELY_WRONG", 0.0)  # so that a walk is thought of whatever the first round leaves
    world = draw_world(Case("walks", 91004, ("eccentricity", "clock_error"), 1000.0, duration=20.0))
    found = diagnose([world.recording], world.twin)
    assert [search.left_for for search in searches] == ["walk", ""]
    assert {cause.effect for cause in found.causes} == {"eccentricity", "clock_error"}


def test_what_no_walk_explains_starts_no_search_for_one(monkeypatch):
    """An axis that nods, in a library without it, looks like wandering biases at first sight."""
    world = draw_world(
        Case(
            "left_out", 80045, ("axis_wobble",), 1000.0, duration=20.0, bias_instability_mg=0.05, without="axis_wobble"
        )
    )
    searches = []
    search = explain_any_length

    def counted(*args, **kwargs):
        searches.append(kwargs.get("start", ()))
        return search(*args, **kwargs)

    monkeypatch.setattr(wandering_biases, "explain_any_length", counted)
    found = diagnose([world.recording], world.twin)
    assert found.verdict == "unknown"
    assert not searches


def test_slow_causes_that_leave_no_walk_start_no_search_for_one(monkeypatch):
    world = draw_world(Case("pairs", 30112, ("gain_drift", "warm_up"), 300.0, duration=20.0))
    searches = []

    def counted(*args, **kwargs):
        searches.append(args)
        return explain_any_length(*args, **kwargs)

    monkeypatch.setattr(wandering_biases, "explain_any_length", counted)
    found = diagnose([world.recording], world.twin)
    assert {cause.effect for cause in found.causes} == {"gain_drift", "warm_up"}
    assert not searches
    # Without them there would be a walk to look for.
    monkeypatch.setattr(wandering_biases, "_WORSE", np.inf)
    again = diagnose([world.recording], world.twin)
    assert searches
    assert {cause.effect for cause in again.causes} == {"gain_drift", "warm_up"}


@pytest.mark.parametrize(("odds", "unequal", "kept"), [(50.0, 1.0, True), (5.0, 1.0, False), (50.0, 100.0, False)])
def test_a_walk_is_named_beside_an_unknown_only_where_one_is_left(monkeypatch, odds, unequal, kept):
    module = sys.modules[diagnose.__module__]
    left = Walk(0.02, 0.001, odds, unequal)
    monkeypatch.setattr(module, "walk_strength", lambda *_: left)
    walk = Walk(0.1, 0.01, 3000.0, 1.0)
    described = SimpleNamespace(segments=(), fit=None, fixed=())
    assert module._left_wandering(described, walk) is (walk if kept else None)
