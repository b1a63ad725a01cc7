"""The table of the report by channel: numbers and lengths of bars follow the residual."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_runs import PERIOD, made_view

from gfimu import AccelerometerArray, Chip
from gfimu.diagnosis.criticism.views.residuals import residual_views
from gfimu.diagnosis.report.channel_tables import channel_bars

ARRAY = AccelerometerArray(
    "four", (Chip("a1", np.zeros(3), np.eye(3)), Chip("a2", np.array([0.1, 0.0, 0.0]), np.eye(3)[:1]))
)


@pytest.fixture(scope="module")
def size():
    rate = 5.0 + 2.0 * np.sin(0.6 * PERIOD * np.arange(3000))
    view = made_view(rate, np.column_stack([3e-3 * rate**2, np.zeros((len(rate), 3))]))
    return residual_views(view, ARRAY.channels).size


def test_bars_are_in_proportion_and_beside_their_numbers(size):
    values = np.array([0.2, 0.1, 0.05, 0.1])
    found = channel_bars(replace(size, before=values, after=values / 2, floor=np.full(4, 0.05)), ARRAY)
    assert found.scale == "linear, from 0 to 0.200 m/s²"
    assert [row.channel for row in found.rows] == list(ARRAY.channels)
    assert [row.chip for row in found.rows] == [0, 0, 0, 1]
    assert [row.bar_before for row in found.rows] == [100.0, 50.0, 25.0, 50.0]
    assert [row.bar_after for row in found.rows] == [50.0, 25.0, 12.5, 25.0]
    assert {row.bar_noise for row in found.rows} == {25.0}
    assert (found.rows[0].before, found.rows[0].after, found.rows[0].noise) == ("0.200", "0.100", "0.0500")


def test_bars_over_a_wide_range_are_logarithmic(size):
    values = np.array([16.0, 4.0, 1.0, 0.5])
    found = channel_bars(replace(size, before=values, after=values, floor=np.full(4, 0.5)), ARRAY)
    assert found.scale == "logarithmic, from 0.250 to 16.0 m/s²"
    np.testing.assert_allclose(
        [row.bar_before for row in found.rows], [100.0, 100 * 4 / 6, 100 * 2 / 6, 100 / 6], atol=0.1
    )


def test_a_channel_without_a_sample_has_a_dash_and_no_bar(size):
    values = np.array([0.2, np.nan, 0.05, 0.1])
    row = channel_bars(replace(size, before=values, after=values), ARRAY).rows[1]
    assert (row.before, row.bar_before) == ("–", 0.0)
