"""Sets of hypotheses on the normal equations of a screening."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from core_cases import cause_of, lively, small_twin, stretches_of
from numpy.testing import assert_allclose

from gfimu import AccelerometerArray
from gfimu.diagnosis import Policy, starting_point
from gfimu.diagnosis.fit.evidence import SCALES, log_evidence
from gfimu.diagnosis.search.beam import Blocks, leading_sets, promise
from gfimu.diagnosis.search.screening import Signature, hypotheses_of, screen
from sim.effects import make_effect

TWIN, CUBE = small_twin(), small_twin("cube12")
TRUTH = cause_of("table_tilt", TWIN.array, [1.0, -0.5])


@pytest.fixture(scope="module")
def blocks():
    stretches = stretches_of(TWIN, [TRUTH.effect(TWIN.array, 0)], duration=6.0, motion=lively())
    return Blocks(screen(stretches, starting_point(stretches, 0.1)), Policy())


def test_other_effects_promise_what_they_bring(blocks):
    tilt = blocks.causes([blocks.nearest(TRUTH)])
    assert promise(blocks, (), {"table_tilt"}, Policy()) > 20.0
    assert promise(blocks, (), {"clock_error"}, Policy()) < promise(blocks, (), {"table_tilt"}, Policy())
    # Beside the truth others bring no more than chance, less their prior.
    assert promise(blocks, tilt, {"cogging", "quadratic", "clock_error"}, Policy()) < 0.0
    assert promise(blocks, tilt, {"not in the library"}, Policy()) == -np.inf


def block_of(blocks, members):
    """G, b and signs of a set, cause by cause."""
    screening = blocks.screening
    mixing, positive = np.zeros((len(screening.score), 0)), []
    for number in members:
        hypothesis = screening.hypotheses[number]
        mine = np.zeros((len(screening.score), hypothesis.cause.mixing.shape[1]))
        mine[hypothesis.signature.columns] = hypothesis.cause.mixing
        mixing, positive = np.hstack([mixing, mine]), [*positive, *hypothesis.positive]
    return mixing.T @ screening.gram @ mixing, mixing.T @ screening.score, np.array(positive)


@pytest.mark.parametrize("members", [(0,), (3,), (0, 40), (5, 60, 110)])
def test_log_odds_are_the_evidence_of_the_block(blocks, members):
    prior = sum(blocks.hypotheses[k].cause.log_prior for k in members)
    prior += Policy().extra_cause * (len(members) - 1)
    expected = log_evidence(*block_of(blocks, members)) + prior
    assert blocks.log_odds(members) == pytest.approx(expected, rel=1e-9, abs=1e-6)


def test_log_odds_of_every_hypothesis_alone(blocks):
    each = blocks.log_odds_each()
    for number in range(0, len(each), 7):
        assert each[number] == pytest.approx(blocks.log_odds((number,)), rel=1e-6, abs=1e-5)


def test_log_odds_beside_a_set_have_its_sizes_integrated_out(blocks):
    members = (int(np.argmax(blocks.log_odds_each())),)
    each = blocks.log_odds_each(members)
    count = len(block_of(blocks, members)[1])
    for number in range(0, len(each), 11):
        gram, score, positive = block_of(blocks, (*members, number))
        inner = np.linalg.inv(gram[:count, :count] + np.eye(count) / SCALES[-1] ** 2)
        rest = gram[count:, count:] - gram[count:, :count] @ inner @ gram[:count, count:]
        right = score[count:] - gram[count:, :count] @ inner @ score[:count]
        expected = log_evidence(rest, right, positive[count:]) + blocks.hypotheses[number].cause.log_prior
        assert each[number] == pytest.approx(expected, rel=1e-4, abs=0.05)


def best_of_each_set_of_names(blocks):
    """Log odds and members of the best set of each one or two names, best first, by looking at all of them."""
    names = [h.cause.name for h in blocks.hypotheses]
    every = [(k,) for k in range(len(names))]
    every += [(i, j) for i, j in combinations(range(len(names)), 2) if names[i] != names[j]]
    found = {}
    for odds, members in sorted(((blocks.log_odds(one), one) for one in every), reverse=True):
        found.setdefault(frozenset(names[k] for k in members), (odds, members))
    return list(found.values())


@pytest.mark.study
def test_leading_sets_are_the_best_of_each_set_of_names_whose_members_all_add_something(blocks):
    policy = Policy()
    sets = leading_sets(blocks, 2, policy)

    def adds(members):
        rests = [tuple(k for k in members if k != member) for member in members] if len(members) > 1 else []
        return min((blocks.log_odds(members) - blocks.log_odds(rest) for rest in rests), default=np.inf)

    every = best_of_each_set_of_names(blocks)
    worth = [(odds, members) for odds, members in every if adds(members) >= policy.worth_a_search][: policy.beam]
    assert [one.members for one in sets] == [members for _, members in worth]
    assert_allclose([one.log_odds for one in sets], [odds for odds, _ in worth])
    # With one cause in the data nothing adds to it, and many more sets than are fitted hold it and something idle.
    (tilt,) = sets[0].members
    assert blocks.hypotheses[tilt].cause.name == "table_tilt"
    assert len(sets) == policy.beam
    idle = [members for _, members in every if tilt in members and adds(members) < policy.worth_a_search]
    assert len(idle) > 3 * policy.beam


def test_causes_are_at_their_linear_estimates(blocks):
    (number,) = next(one.members for one in leading_sets(blocks, 1, Policy()) if len(one.members) == 1)
    (cause,) = blocks.causes((number,))
    gram, score, _ = block_of(blocks, (number,))
    assert_allclose(cause.coordinates, np.linalg.solve(gram + np.eye(len(score)) / SCALES[-1] ** 2, score), rtol=1e-6)
    assert cause.name == "table_tilt"
    assert_allclose(cause.coordinates, TRUTH.coordinates, atol=0.1)


def test_no_exchange_of_a_member_betters_the_leader():
    """Greedy growth takes a set of offsets for gravity, as long as nothing stands beside it."""
    effects = [cause_of("gravity", CUBE.array, [4.0]), cause_of("table_tilt", CUBE.array, [1.0, -0.5])]
    worlds = [one.effect(CUBE.array, 0) for one in effects]
    crossed = make_effect("cross_axis", {"a33_from_a31": -0.1, "a33_from_a32": -0.08}, CUBE.array)
    stretches = stretches_of(CUBE, [*worlds, crossed], duration=6.0, motion=lively())
    policy = replace(Policy(), beam=2)
    blocks = Blocks(screen(stretches, starting_point(stretches, 0.1)), policy)
    leader = leading_sets(blocks, 3, policy)[0]
    for member in leader.members:
        rest = [other for other in leader.members if other != member]
        taken = {blocks.hypotheses[other].cause.name for other in rest}
        for number, hypothesis in enumerate(blocks.hypotheses):
            if hypothesis.cause.name not in taken:
                assert blocks.log_odds(sorted((*rest, number))) <= leader.log_odds + 1e-6


def test_one_chip_has_no_hypothesis_without_a_size():
    """Delays between chips are none for one chip: such a pattern is no hypothesis, and the search goes on."""
    array = AccelerometerArray.load("one_adxl345")
    twin = replace(TWIN, array=array)
    signatures = [
        Signature(family, {}, np.arange(count), 1.0)
        for family in twin.families().values()
        if (count := len(family.sizes(array)))
    ]
    assert any(not pattern.mixing.shape[1] for one in signatures for pattern in one.family.patterns(array))
    assert all(len(one.positive) for one in hypotheses_of(signatures, array, 1))
