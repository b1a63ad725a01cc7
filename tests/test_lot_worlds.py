"""Worlds by lot: each is as large as it was drawn, every place is among them, and an answer is judged by its place."""

import lot_worlds
import numpy as np
import pytest
from lot_study import JOBS, judged

from sim.trials import draw_world


def test_every_place_is_among_the_worlds_and_no_case_twice():
    for half in (lot_worlds.LOTS[: lot_worlds.HALF], lot_worlds.LOTS[lot_worlds.HALF :]):
        assert {lot.place for lot in half} == set(lot_worlds.GOES_WITH)
        assert len(set(half)) == lot_worlds.HALF
    assert len(JOBS) == 2 * lot_worlds.HALF


@pytest.mark.parametrize("key", ["lot/700007", "lot/700027", "lot/700032"])
def test_a_world_has_the_size_that_it_was_drawn_with(key):
    generator, case = JOBS[key]
    world = draw_world(case, f"{lot_worlds.__file__}:{generator}")
    assert world.reached == pytest.approx(case.size, rel=0.02)
    assert np.isfinite(world.recording.readings).all()


@pytest.mark.parametrize(
    ("causes", "located", "place", "goes", "wrong"),
    [
        ([], [("reference", "f(alpha)")], True, True, False),
        ([], [("reference", "f(t)")], True, False, False),
        ([], [("array", "f(alpha)")], False, False, False),
        ([("bias", 0.95)], [("reference", "f(alpha)")], False, False, True),
        ([("bias", 0.8)], [("reference", "f(alpha)")], False, False, False),
        ([("tacho_ripple", 0.97)], [], True, True, False),
        ([], [], False, False, False),
    ],
)
def test_an_answer_is_right_where_its_place_and_quantity_are(causes, located, place, goes, wrong):
    """World 27 hides a reference that goes with the angular acceleration."""
    answer = judged(
        {
            "effects": ["lot_027"],
            "verdict": "unknown",
            "causes": [{"effect": effect, "probability": probability} for effect, probability in causes],
            "located": [{"place": where, "dependence": dependence} for where, dependence in located],
        }
    )
    assert (answer["place"], answer["goes"], answer["wrong"]) == (place, goes, wrong)
