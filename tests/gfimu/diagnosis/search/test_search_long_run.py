"""Recordings of any length: causes are searched in some stretches and fitted to all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_cases import cause_of, lively, small_twin, stretches_of

from gfimu.diagnosis import Policy, spread_over_runs, understand_any_length


@pytest.mark.parametrize(
    ("runs", "most", "chosen"),
    [
        ([0] * 5, 8, [0, 1, 2, 3, 4]),
        ([0] * 28, 8, [0, 4, 8, 12, 15, 19, 23, 27]),
        ([0] * 6 + [1], 4, [0, 2, 5, 6]),
        ([0, 1, 2], 1, [0, 1, 2]),
    ],
)
def test_searched_stretches_are_spread_over_the_runs(runs, most, chosen):
    assert spread_over_runs(runs, most) == chosen


def test_what_some_stretches_show_is_fitted_to_all():
    twin = small_twin()
    hidden = cause_of("gravity", twin.array, [2.0])
    effect = [hidden.effect(twin.array, 0)]
    stretches = [
        replace(stretches_of(twin, effect, seed=seed, duration=6.0, motion=lively())[0], stretches=2) for seed in (1, 2)
    ]
    told = []
    found = understand_any_length(stretches, replace(Policy(), most_searched=1), lambda share, text: told.append(share))
    explanation = found.explanation
    assert len(explanation.stretches) == len(explanation.best.point.drives) == 2
    assert explanation.best.names == {"gravity"}
    assert told == sorted(told)
    (cause,) = explanation.best.causes
    assert abs(cause.coordinates[0] - 2.0) < 4.0 * np.sqrt(cause.covariance[0, 0])
