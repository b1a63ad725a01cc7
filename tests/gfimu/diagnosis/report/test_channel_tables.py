"""Tables of the report by channel: numbers, lengths of bars and colours follow the residual."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_runs import PERIOD, made_view

from gfimu import AccelerometerArray, Chip
from gfimu.diagnosis.criticism.views.dependence import Fingerprint
from gfimu.diagnosis.criticism.views.residuals import residual_views
from gfimu.diagnosis.report.channel_tables import channel_bars, fingerprint_rows

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


def test_the_fingerprint_is_empty_within_chance_and_red_and_blue_beyond():
    before = np.array([[2.9, -2.9, np.nan], [4.0, -4.0, 300.0]])
    quiet, loud = fingerprint_rows(Fingerprint(("a11", "a12"), ("ω", "α", "T"), before, np.zeros((2, 3))))
    assert {cell.text for cell in (*quiet.before, *quiet.after, *loud.after)} == {""}
    assert [cell.text for cell in loud.before] == ["4", "−4", "300"]
    red, blue, deep = (parts(cell.ground) for cell in loud.before)
    assert red[0] > red[2]
    assert blue[0] < blue[2]
    assert sum(deep) < sum(red)
    assert loud.before[2].ink == "#ffffff"
    for cell in loud.before:
        assert contrast(cell.ground, cell.ink) > 4.5  # WCAG 2.2, level AA


def parts(colour):
    return [int(colour[k : k + 2], 16) for k in (1, 3, 5)]


def contrast(first, second):
    def luminance(colour):
        linear = [
            one / 12.92 if one <= 0.04045 else ((one + 0.055) / 1.055) ** 2.4 for one in np.divide(parts(colour), 255)
        ]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    low, high = sorted(map(luminance, (first, second)))
    return (high + 0.05) / (low + 0.05)
