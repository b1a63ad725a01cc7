"""What has no name is described by the functions that it is made of, on the series where it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_fits import POLICY, channel, fitted, quiet, recorded, twin

from gfimu.base import STANDARD_GRAVITY
from gfimu.diagnosis.criticism.lack_of_fit import lack_of_fit
from gfimu.diagnosis.criticism.surrogate import surrogates
from gfimu.model import OF_READING


def pickup(t, spin, readings, reference):
    """One channel picks up a field that turns twice per revolution, in proportion to the rate."""
    readings[:, channel("a31")] += 0.02 * spin.rate * np.cos(2 * spin.angle)


def whistle(t, spin, readings, reference):
    """Half of the channels hear a tone, each in a loudness of its own; that is no interference common to all."""
    readings[:, ::2] += 0.03 * np.sin(2 * np.pi * 17.3 * t)[:, None] * [1, -1, 1, -1, 2, -2]


def stretched(t, spin, readings, reference):
    """The tachometer reads more the faster the table turns, in either direction."""
    reference += 0.002 * spin.rate**2


def bent(t, spin, readings, reference):
    readings[:, channel("a12")] += 3e-4 * readings[:, channel("a12")] ** 3


def described(seed, change, hints=()):
    stretches, nothing = fitted(recorded(seed, change))
    found = surrogates(stretches, nothing, POLICY, hints)
    assert found
    return stretches, nothing, found[-1]


def test_noise_is_not_described():
    assert not surrogates(*quiet(), POLICY)


def test_what_looked_like_a_random_walk_is_described_without_one():
    stretches, nothing = fitted(recorded(3, pickup))
    levels = tuple(replace(one, walk=0.1) for one in nothing.point.levels)
    walking = replace(nothing, point=replace(nothing.point, levels=levels))
    for found in surrogates(stretches, walking, POLICY):
        assert {one.walk for one in found.fit.point.levels} == {0.0}
        assert [term.place for term in found.terms] == ["2 per revolution × rate (cosine)"]


def test_a_function_of_one_channel_is_all_there_is():
    stretches, nothing, found = described(3, pickup)
    [term] = found.terms
    assert term.place == "2 per revolution × rate (cosine)"
    assert not term.family.of_one_recording
    sizes = term.sizes(twin().array, 0)
    assert np.flatnonzero(sizes).tolist() == [channel("a31")]
    assert sizes.sum() / term.family.units.rate == pytest.approx(0.02, rel=0.05)
    # Under the noise that it leaves, nothing is left to describe.
    place = channel("a31")
    assert found.fit.point.levels[0].flicker[place] < 0.3 * nothing.point.levels[0].flicker[place]
    assert found.fit.objective / stretches[0].observations == pytest.approx(1.0, abs=0.03)
    assert lack_of_fit(stretches, found.fit).log_odds < POLICY.lack_odds


def test_a_function_of_the_reference_is_one_of_no_channel():
    _, _, found = described(5, stretched)
    [term] = found.terms
    assert term.family.of_reference
    assert term.place == "rate²"
    assert term.sizes(twin().array, 0) / term.family.units.rate**2 == pytest.approx([0.002], rel=0.1)


def test_a_tone_belongs_to_one_recording():
    _, _, found = described(4, whistle)
    assert all(term.place.startswith("tone at 17.3") for term in found.terms)
    assert all(term.family.of_one_recording for term in found.terms)
    sizes = np.linalg.norm([term.sizes(twin().array, 0) for term in found.terms], axis=0)
    np.testing.assert_allclose(sizes[::2], 0.03 * np.array([1, 1, 1, 1, 2, 2]), atol=0.003)
    assert (sizes[1::2] < 0.004).all()


def test_a_hint_is_taken_where_it_predicts_best():
    _, _, found = described(4, bent, (OF_READING,))
    assert OF_READING in [term.place for term in found.terms]
    size = sum(term.sizes(twin().array, 0)[channel("a12")] for term in found.terms if term.place == OF_READING)
    assert size / STANDARD_GRAVITY**3 == pytest.approx(3e-4, rel=0.1)


def test_terms_that_were_chosen_on_some_runs_are_fitted_to_all():
    stretches, nothing = fitted(recorded(3, pickup), recorded(30, pickup))
    # Every run gives one at least: two stretches of the first leave it one.
    twice = (stretches[0], *stretches)
    point = replace(
        nothing.point,
        drives=(nothing.point.drives[0], *nothing.point.drives),
        levels=(nothing.point.levels[0], *nothing.point.levels),
    )
    found = surrogates(twice, replace(nothing, point=point), replace(POLICY, most_searched=2))
    [term] = found[-1].terms
    assert len(found[-1].fit.point.drives) == 3
    assert term.sizes(twin().array, 0).sum() / term.family.units.rate == pytest.approx(0.02, rel=0.03)
