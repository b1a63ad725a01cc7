"""The probability that the library holds the truth: what lowers it, what it does to a verdict, and its limits."""

from dataclasses import replace

import numpy as np
import pytest
from made_diagnoses import made_diagnosis

from gfimu import NamedCause
from gfimu.diagnosis import Policy
from gfimu.diagnosis.verdict.library import (
    LibraryEvidence,
    LibraryRule,
    library_probability,
    standing_out,
    with_library,
)

POLICY, RULE = Policy(), LibraryRule()


def probability(stds=100.0, explained=100.0, **evidence):
    return library_probability(LibraryEvidence(**evidence), stds, explained, RULE, POLICY)


def test_a_large_cause_beside_which_nothing_stays_is_believed():
    assert probability() > 0.9


@pytest.mark.parametrize("doubt", [{"unexplained": 30.0}, {"stds": 1.5}])
def test_each_kind_of_doubt_lowers_it(doubt):
    assert probability(**doubt) < 0.9 * probability()


def test_what_stays_counts_beside_what_the_cause_explains():
    """A tone that a board hums does not make its turn-on bias doubtful, nor what leaves as much as it explains sure."""
    assert probability(explained=1e5, unexplained=300.0) > 0.9
    assert probability(explained=300.0, unexplained=300.0) < 0.7
    assert probability(explained=100.0, unexplained=300.0) < probability(explained=300.0, unexplained=300.0)


def test_only_another_recording_makes_it_surer_than_the_rule():
    assert probability() <= RULE.most
    certain = replace(RULE, constant=20.0)
    assert library_probability(LibraryEvidence(), 100.0, 300.0, certain, POLICY) == RULE.most
    assert library_probability(LibraryEvidence(confirmed=True), 100.0, 300.0, certain, POLICY) == POLICY.most_certain


def test_shapes_and_angles_do_not_stand_out():
    cause = NamedCause(
        "resonance",
        {"gain": 0.3, "frequency_hz": 12.0, "phase_rad": 3.0},
        {"gain": 0.1, "frequency_hz": 0.01, "phase_rad": 0.01},
        0.9,
    )
    assert standing_out(cause, {"frequency_hz"}) == pytest.approx(3.0)
    assert standing_out(replace(cause, std={}), ()) == np.inf


def test_a_verdict_has_the_product_and_says_so():
    found = made_diagnosis("explained")
    doubted = with_library(found, LibraryEvidence(unexplained=3.0), {"table_tilt": ()}, POLICY)
    (before,), (after,) = found.causes, doubted.causes
    assert after.probability == pytest.approx(before.probability * doubted.library_probability)
    assert doubted.library_probability == pytest.approx(
        library_probability(LibraryEvidence(unexplained=3.0), standing_out(before, ()), before.log_odds, RULE, POLICY)
    )
    assert "confounded with nothing outside the library" in doubted.sentences[-1]
    assert "--held-out" in doubted.sentences[-1]
    assert doubted.to_dict()["library_probability"] == doubted.library_probability


def test_a_fault_of_the_samples_is_seen_and_not_inferred():
    found = made_diagnosis("explained")
    assert with_library(found, LibraryEvidence(unexplained=3.0), {}, POLICY) is found


@pytest.mark.parametrize("verdict", ["unknown", "nothing_found"])
def test_a_verdict_without_causes_stays_as_it_is(verdict):
    found = made_diagnosis(verdict)
    assert with_library(found, LibraryEvidence(), {"table_tilt": ()}, POLICY) is found
    assert np.isnan(found.library_probability)
