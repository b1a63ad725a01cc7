"""Columns of unknowns against full arrays."""

from __future__ import annotations

import numpy as np
import pytest
from core_cases import dense
from numpy.testing import assert_allclose, assert_array_equal

from gfimu.diagnosis import Columns


@pytest.fixture
def values():
    """Columns (n, c, P), two of which act on one observation each and one on none."""
    found = np.random.default_rng(1).standard_normal((20, 3, 4))
    found[:, 1:, 0] = 0.0
    found[:, :2, 1] = 0.0
    found[:, :, 2] = 0.0
    return found


@pytest.fixture
def weight():
    return np.random.default_rng(2).uniform(0.0, 1.0, (20, 3))


def test_blocks_that_are_zero_are_not_kept(values, weight):
    columns = Columns.of(values, weight)
    assert [at.tolist() for at in columns.places] == [[0, 3], [3], [1, 3]]
    assert_allclose(dense(columns), values * weight[:, :, None])


def test_times(values, weight):
    sizes = np.array([0.5, -2.0, 7.0, 1.0])
    assert_allclose(Columns.of(values, weight).times(sizes), (values * weight[:, :, None]) @ sizes)


def test_together_puts_them_beside_each_other(values, weight):
    one, other = Columns.of(values, weight), Columns.of(values[:, :, ::-1], weight)
    both = Columns.together([one, Columns.none(3, 20), other])
    assert both.count == 8
    assert_allclose(dense(both), np.concatenate([dense(one), dense(other)], axis=2))


def test_scaled(values, weight):
    by = np.array([1.0, 2.0, -3.0, 0.1])
    assert_allclose(dense(Columns.of(values, weight).scaled(by)), values * weight[:, :, None] * by)


def test_among_a_larger_set(values, weight):
    columns = Columns.of(values, weight)
    larger = columns.among(np.array([6, 0, 3, 2]), 8)
    expected = np.zeros((20, 3, 8))
    expected[:, :, [6, 0, 3, 2]] = dense(columns)
    assert_allclose(dense(larger), expected)
    assert_allclose(larger.times(np.arange(8.0)), expected @ np.arange(8.0))


def test_none():
    nothing = Columns.none(3, 20)
    assert nothing.count == 0
    assert_array_equal(nothing.times(np.zeros(0)), np.zeros((20, 3)))
