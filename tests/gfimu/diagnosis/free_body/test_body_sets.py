"""Sets of causes of a free body on normal equations made by hand, and what a verdict asks of them."""

from __future__ import annotations

import numpy as np
import pytest

from gfimu.diagnosis.free_body.explain import BodyFit, Sets
from gfimu.diagnosis.free_body.screening import BodyScreening
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.comparison import Comparison
from gfimu.diagnosis.search.screening import Signature, hypotheses_of
from gfimu.diagnosis.verdict.naming import conflicting, probabilities, rival_list
from sim.effects import BODY_EFFECTS
from sim.twin import Twin

ARRAY = Twin.from_dict({"array": "mimu4444", "drive": {"source": "gyro"}, "sensor": {"part": "mpu9150"}}).array
NAMES = ("channel_skew", "chip_delay", "gyro_latency")


def screening(information: float, **sizes: float) -> BodyScreening:
    """Normal equations of three effects whose columns are orthogonal, the first size of some of them not zero."""
    signatures, count = [], 0
    for name in NAMES:
        width = len(BODY_EFFECTS[name].sizes(ARRAY))
        signatures.append(Signature(BODY_EFFECTS[name], {}, np.arange(count, count + width), 1.0))
        count += width
    true = np.zeros(count)
    for signature in signatures:
        true[signature.columns[0]] = sizes.get(signature.family.name, 0.0)
    gram = information * np.eye(count)
    hypotheses = tuple(hypotheses_of(signatures, ARRAY, 1))
    squares = 1000.0 + float(true @ gram @ true)
    return BodyScreening(tuple(signatures), hypotheses, gram, gram @ true, np.zeros(count), (), squares)


def alone(sets: Sets, name: str) -> int:
    """Number of the likeliest hypothesis of an effect."""
    odds = sets.blocks.log_odds_each()
    return max((n for n, h in enumerate(sets.hypotheses) if h.cause.name == name), key=lambda n: odds[n])


def test_an_effect_is_not_searched_beside_one_that_can_do_all_it_does():
    sets = Sets(screening(1e4, channel_skew=0.5, chip_delay=0.5, gyro_latency=0.5), Policy())
    start = (alone(sets, "gyro_latency"),)
    names = [{sets.hypotheses[n].cause.name for n in some} for some, _ in sets.candidates(start)]
    assert {"gyro_latency", "channel_skew"} in names
    assert {"gyro_latency", "chip_delay"} in names
    assert not any({"channel_skew", "chip_delay"} <= some for some in names)


def test_a_fit_has_the_sizes_and_the_misfit_of_the_linear_form():
    sets = Sets(screening(1e4, gyro_latency=0.5), Policy())
    fit = sets.fit((alone(sets, "gyro_latency"),))
    assert fit.causes[0].coordinates == pytest.approx([0.5], rel=1e-5)
    assert fit.objective == pytest.approx(1000.0, abs=1e-3)
    assert np.sqrt(fit.causes[0].covariance[0, 0]) == pytest.approx(0.01, rel=1e-3)


def test_what_the_data_do_not_determine_stays_at_zero_with_the_spread_of_its_prior():
    sets = Sets(screening(0.1, gyro_latency=0.5), Policy())
    (cause,) = sets.fit((alone(sets, "gyro_latency"),)).causes
    assert cause.coordinates == pytest.approx([0.0])
    assert cause.covariance == pytest.approx(np.eye(1))


@pytest.mark.parametrize(("size", "kept"), [(0.5, True), (0.01, False)])
def test_pruning_needs_the_odds_of_the_policy(size, kept):
    sets = Sets(screening(1e4, gyro_latency=size), Policy())
    assert bool(sets.pruned((alone(sets, "gyro_latency"),))) == kept


def test_a_verdict_asks_no_more_of_a_fit_than_a_free_body_has():
    sets = Sets(screening(1e4, gyro_latency=0.5, channel_skew=0.03), Policy())
    whole = (alone(sets, "gyro_latency"),)
    best, nothing = sets.fit(whole), sets.fit(())
    rival = sets.fit((alone(sets, "chip_delay"),))
    compared: Comparison[BodyFit] = Comparison(best, nothing, {"gyro_latency": nothing}, (rival,), sets.screening)
    assert probabilities(compared, Policy())["gyro_latency"] == Policy().most_certain
    assert conflicting(compared, Policy()) == []
    assert [one.effects for one in rival_list(compared, Policy())] == [("chip_delay",), ("nothing",)]
