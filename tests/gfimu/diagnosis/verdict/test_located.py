"""A cause without a name in a verdict: its place, how sure it is, and what it can't be told from."""

import pytest

from gfimu.diagnosis import LOCATED, FreeTime, LocatedTerm, Policy, experiment_between, of_free_time
from gfimu.model import dependence_of, rig_places

PLACES = rig_places(is_angle=False)
POLICY = Policy()


def at(what, log_odds):
    return FreeTime(log_odds, PLACES[what], "all")


def test_an_error_that_is_free_in_time_has_the_place_of_the_greatest_evidence():
    cause = of_free_time([at("heaves", 300.0), at("reads", 100.0)], POLICY)
    found = cause.unlisted
    assert (cause.effect, cause.log_odds) == ("unlisted", 300.0)
    assert (found.place, found.what, found.dependence, found.function) == ("bench", "heaves", "time", None)
    assert found.place_probability == LOCATED.most_certain_place == cause.probability
    assert found.dependence_probability is None
    assert found.instead == ()
    assert cause.why == "the bench shakes up and down, in time, with nothing else that is known"


def test_places_of_the_same_evidence_share_the_probability():
    found = of_free_time([at("shakes", 300.0), at("vibrates", 300.0)], POLICY).unlisted
    assert found.place_probability == pytest.approx(0.5)
    assert found.instead == ("the array vibrates with the table",)


def term(what, dependence):
    return LocatedTerm(PLACES[what], dependence_of(dependence, {"scale": 1.0, "first": 0.0}))


@pytest.mark.parametrize(
    ("one", "others", "record"),
    [
        (("reads", "omega"), [], ""),
        (("reads", "omega"), [("reads", "omega^2")], ""),
        (("reads", "omega"), [("reads", "t")], "held speeds, slow and fast, both ways and the same motion once more"),
        (("late", "t"), [("late", "T")], "at another time and the same motion with a cold board and with a warm one"),
        (("leans", "omega^2"), [("tilts", "omega^2")], "the array at another place on the table, and turned there"),
        (("leans", "1"), [("tilts", "1"), ("tilts", "omega")], "held speeds, slow and fast, both ways"),
    ],
)
def test_what_fits_as_well_names_the_recording_that_decides(one, others, record):
    words = experiment_between(term(*one), [term(*other) for other in others])
    assert record in words
    assert bool(words) == bool(record)
