"""Combinations of sizes that data say nothing of, in words and in numbers."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from made_bodies import TWIN

from gfimu.diagnosis.search.screening import Screening, Signature
from gfimu.diagnosis.search.undetermined import Undetermined, undetermined, undetermined_sentence
from sim.effects import BODY_EFFECTS, Size

ARRAY = TWIN.array
BIAS = BODY_EFFECTS["bias"]
SIZES = BIAS.sizes(ARRAY)
COUNT = len(SIZES)
LEAST = 0.5


def screening_of(gram, shape=None):
    """A screening of biases alone, whose information is given in units of the prior."""
    signature = Signature(BIAS, shape or {}, np.arange(COUNT), 1.0)
    return Screening((signature,), (), gram, np.zeros(COUNT), np.zeros(COUNT), ())


def blind_to(*directions, strength=100.0):
    """Information about everything but some directions (COUNT,) of the sizes, in their units."""
    unseen = np.linalg.qr(np.array([one / [size.prior_std for size in SIZES] for one in directions]).T)[0]
    return strength * (np.eye(COUNT) - unseen @ unseen.T)


def axis(place):
    return np.array([1.0 if number % 3 == place else 0.0 for number in range(COUNT)])


def keys(place):
    return [size.key for size in SIZES][place::3]


def test_what_all_channels_of_an_axis_share_is_open():
    found = undetermined(screening_of(blind_to(axis(0), axis(1), axis(2))), ARRAY, LEAST)
    assert [one.effect for one in found] == ["bias"] * 3
    assert {tuple(one.combination) for one in found} == {tuple(keys(place)) for place in range(3)}
    for one in found:
        assert [*one.combination.values()] == pytest.approx([1.0] * 3, abs=2e-3)


def test_weights_are_relative_to_the_largest_and_small_ones_are_left_out():
    direction = np.zeros(COUNT)
    direction[[1, 4, 7]] = 2.0, -1.0, 0.1
    (found,) = undetermined(screening_of(blind_to(direction)), ARRAY, LEAST)
    assert found.combination == pytest.approx({SIZES[1].key: 1.0, SIZES[4].key: -0.5}, abs=2e-3)
    assert found.text == f"bias {SIZES[1].key} × 1, {SIZES[4].key} × -0.5"


def test_weights_are_in_the_units_of_the_sizes():
    family = SimpleNamespace(name="made", sizes=lambda array: (Size("p", "m", 1.0), Size("q", "rad", 2.0)))
    signature = Signature(family, {}, np.array([0, 1]), 1.0)
    blind = 100.0 * np.array([[1.0, -1.0], [-1.0, 1.0]])  # both move by as many of their priors
    screening = Screening((signature,), (), blind, np.zeros(2), np.zeros(2), ())
    (found,) = undetermined(screening, ARRAY, LEAST)
    assert found == Undetermined("made", {"p": 0.5, "q": 1.0})


def test_data_that_say_as_much_as_the_prior_leave_nothing_open():
    assert undetermined(screening_of(2.0 * LEAST * np.eye(COUNT)), ARRAY, LEAST) == ()
    assert len(undetermined(screening_of(0.5 * LEAST * np.eye(COUNT)), ARRAY, LEAST)) == COUNT


def test_nothing_is_open_of_an_effect_that_is_not_asked_for_or_has_a_shape():
    blind = np.zeros((COUNT, COUNT))
    assert undetermined(screening_of(blind), ARRAY, LEAST, {"scale_factor"}) == ()
    assert len(undetermined(screening_of(blind), ARRAY, LEAST, {"bias"})) == COUNT
    assert undetermined(screening_of(blind, {"frequency_hz": 3.0}), ARRAY, LEAST) == ()


@pytest.mark.parametrize(
    ("combination", "text"),
    [
        ({"a1": 1.0}, "bias a1"),
        ({"a1": 1.0, "b1": 0.95}, "bias a1, b1 by the same amount"),
        ({"a1": 1.0, "b1": -1.0}, "bias a1 × 1, b1 × -1"),
    ],
)
def test_a_combination_in_words(combination, text):
    one = Undetermined("bias", combination)
    assert one.to_dict() == {"effect": "bias", "combination": combination, "text": text}
    assert undetermined_sentence((one,)).endswith(f"one combination, which stays at zero: {text}.")


def test_of_many_combinations_one_of_each_effect_is_named_first():
    every = tuple(Undetermined(name, {f"{name}{k}": 1.0}) for name in "pqrs" for k in range(2))
    told = undetermined_sentence(every)
    assert told.startswith("These data can't determine 8 combinations, which stay at zero")
    assert told.endswith("such as p p0; q q0; r r0.")
