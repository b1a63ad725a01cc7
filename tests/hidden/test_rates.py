"""How often what is hidden is found: rates over fixed lists of seeds.

A bound is the 1 % quantile of the binomial count at the rate that is promised: a diagnosis as good as promised fails
one list in a hundred.
"""

import pytest
from hidden_table import SOURCES
from scipy.stats import binom

from sim.trials import study_cases
from sim.trials.study.cases import EXOTICS, STUDIES
from sim.trials.study.outcome import run_case
from sim.trials.study.tally import score

GENERATORS = ("campaign", "independent")


def at_least(rate, count):
    """The count below which fewer than 1 % of fair draws at this rate fall."""
    return int(binom.ppf(0.01, count, rate))


def at_most(rate, count):
    return int(binom.ppf(0.99, count, rate))


@pytest.fixture
def judged(record_property):
    """Scores of the first cases of a study, and what was said of each for the message of a failing test."""

    def judge(name, first, generator):
        outcomes = [run_case(case, SOURCES[generator]) for case in study_cases(name, first)]
        scores = [score(one) for one in outcomes]
        for key in ("exact", "fair", "within", "wrong", "unknown"):
            record_property(key, f"{sum(entry[key] for entry in scores)} of {len(scores)}")
        said = [(one["key"], one["effects"], one["verdict"], [c["effect"] for c in one["causes"]]) for one in outcomes]
        return scores, said

    return judge


@pytest.mark.study
@pytest.mark.parametrize("generator", GENERATORS)
def test_single_effects(judged, generator):
    scores, said = judged("singles", 80, generator)
    assert sum(entry["fair"] for entry in scores) >= at_least(0.95, len(scores)), said
    assert sum(entry["within"] for entry in scores) >= at_least(0.98, len(scores)), said


@pytest.mark.study
@pytest.mark.parametrize("generator", GENERATORS)
def test_pairs(judged, generator):
    scores, said = judged("pairs", 40, generator)
    assert sum(entry["exact"] for entry in scores) >= at_least(0.88, len(scores)), said
    assert sum(entry["wrong"] for entry in scores) <= at_most(0.05, len(scores)), said


@pytest.mark.study
@pytest.mark.parametrize("generator", GENERATORS)
def test_nothing_hidden(judged, generator):
    scores, said = judged("nulls", 90, generator)
    assert sum(entry["named"] for entry in scores) <= at_most(0.01, len(scores)), said


@pytest.mark.study
def test_outside_the_library(judged):
    assert {name for case in study_cases("exotics") for name in case.effects} == set(EXOTICS)
    scores, said = judged("exotics", None, "independent")
    assert sum(entry["unknown"] for entry in scores) >= at_least(0.9, len(scores)), said


def test_every_study_draws_the_same_cases_and_seeds_of_its_own():
    cases = {name: study_cases(name) for name in STUDIES}
    assert cases == {name: study_cases(name) for name in STUDIES}
    seeds = [case.seed for one in cases.values() for case in one]
    assert len(seeds) == len(set(seeds))
