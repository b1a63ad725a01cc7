"""Models of the nuisance parameters: a random walk and a residue are found where they are, neither in noise."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from core_cases import small_twin, stretches_of

from gfimu.diagnosis import Policy, starting_point
from gfimu.diagnosis.search import nuisance_models
from gfimu.diagnosis.search.nuisance_models import understand
from sim.effects import EFFECTS, make_effect


def test_neither_in_noise():
    found = understand(stretches_of(small_twin(), seed=1, duration=10.0), Policy())
    assert found.walk is None
    assert found.residue == 0.0
    assert found.explanation.best.causes == ()


@pytest.mark.study
def test_a_random_walk_is_found_with_its_strength():
    walk = [make_effect("bias_random_walk", {"strength_m_s2_rts": 0.04})]
    found = understand(stretches_of(small_twin(), walk, seed=3, duration=10.0), Policy())
    assert found.explanation.best.causes == ()
    assert found.walk is not None
    assert found.walk.is_likely(Policy())
    assert abs(found.walk.strength - 0.04) < 3.0 * found.walk.std
    assert found.log_odds > 0.0


@pytest.mark.study
def test_a_residue_of_the_calibration_is_found():
    twin, rng = small_twin(), np.random.default_rng(5)
    effects = [
        family.from_sizes(twin.array, 3.0 * family.tolerance * rng.standard_normal(len(family.sizes(twin.array))), {})
        for family in EFFECTS.values()
        if family.tolerance > 0.0
    ]
    found = understand(stretches_of(twin, effects, seed=4, duration=10.0), Policy())
    assert found.residue in dict(Policy().residue_odds)
    assert found.walk is None
    assert found.explanation.best.causes == ()


@pytest.mark.parametrize(("inexactness", "left"), [(0.0, 0.0), (0.02, 20.0)])
def test_other_nuisance_parameters_must_bring_more_than_a_rough_cause_leaves(inexactness, left):
    cause = SimpleNamespace(name="rough", family=SimpleNamespace(inexactness=inexactness))
    best = SimpleNamespace(causes=(cause,), log_posterior=5000.0)
    explanation = SimpleNamespace(best=best, without={"rough": SimpleNamespace(log_posterior=4000.0)})
    assert nuisance_models._left_by_inexactness(explanation) == pytest.approx(left)


def test_derivatives_are_taken_once_for_a_point(monkeypatch):
    stretches = stretches_of(small_twin(), seed=1, duration=6.0)
    first, other = (starting_point(stretches, spacing) for spacing in (0.05, 0.1))
    taken, kept = [], nuisance_models.linearise
    monkeypatch.setattr(nuisance_models, "linearise", lambda *a, **k: taken.append(a[1]) or kept(*a, **k))
    derivatives = nuisance_models._Derivatives(stretches)
    for point in (first, other, first, other):
        [told] = derivatives.at(point)
        assert told.size == point.drives[0].spline.size
    assert len(taken) == 2
