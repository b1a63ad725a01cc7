"""Times of foreign tables: how many rows may be left out, and when the clock counts as started anew."""

import numpy as np
import pytest

from gfimu import InputError
from gfimu.recording import increasing_times
from gfimu.recording.importing.clock import parts_of, times_of
from gfimu.recording.importing.column_map import TimeSpec
from gfimu.recording.importing.raw_table import RawTable

ROWS = 400


def late_rows(count):
    """Times in which some rows repeat the time of an early row."""
    t = 0.01 * np.arange(ROWS)
    t[100 : 100 + 20 * count : 20] = t[7]
    return t


@pytest.mark.parametrize(("rows", "allowed"), [(400, 8), (100, 2), (20, 1)])
def test_two_per_cent_of_the_rows_may_be_out_of_order_and_no_more(rows, allowed):
    """Of few rows one may be: a single bad stamp must not refuse a short recording."""

    def times(wrong):
        t = 0.01 * np.arange(rows)
        t[rows // 2 : rows // 2 + 2 * wrong : 2] = t[3]
        return increasing_times(t, 0.0, "file: column t")

    assert (~times(allowed).rows).sum() == allowed
    with pytest.raises(InputError, match=f"{allowed + 1} of {rows} times do not increase"):
        times(allowed + 1)


def test_rows_that_are_to_be_dropped_may_be_many():
    found = increasing_times(late_rows(15), 0.0, "file: column t", drop=("duplicates",))
    assert dict(found.dropped) == {"duplicates": 15}


def restarted(first, second, back):
    """Times of a logger, s: some rows, then some more that begin earlier by a share of what the first lasted."""
    before = 0.01 * np.arange(first)
    return np.concatenate([before, before[-1] * (1.0 - back) + 0.01 * np.arange(second)])


@pytest.mark.parametrize(
    ("first", "second", "back", "parts"),
    [
        (100, 60, 0.8, 2),
        (100, 40, 0.55, 2),  # by more than half of what the first part lasted
        (100, 40, 0.45, 1),
        (20, 20, 1.05, 2),  # both parts have at least 20 rows
        (19, 20, 1.05, 1),
        (20, 19, 1.05, 1),
    ],
)
def test_a_clock_that_starts_anew(first, second, back, parts):
    assert len(parts_of(restarted(first, second, back))) == parts


def test_a_clock_that_goes_back_all_the_time_has_not_started_anew():
    """At most one restart in 20 rows: more is a counter that wraps, or no time at all."""
    longer = np.concatenate([0.01 * np.arange(25)] * 4)
    assert len(parts_of(longer)) == 4
    assert len(parts_of(np.concatenate([0.01 * np.arange(19)] * 4))) == 1


@pytest.mark.parametrize(("first", "origin"), [(99.0, 0.0), (101.0, 101.0)])
def test_times_far_from_zero_count_from_the_first_sample(first, origin):
    table = RawTable("", {"t": first + 0.01 * np.arange(50)})
    found = times_of(table, TimeSpec(column="t", unit="s"), "file")
    assert found.origin_s == origin
    np.testing.assert_allclose(found.t_s + found.origin_s, first + 0.01 * np.arange(50), atol=1e-9)


def test_a_time_beyond_all_times_is_none():
    t = 0.01 * np.arange(ROWS)
    t[5], t[9] = 0.9e12, 1.1e12
    found = increasing_times(t, 0.0, "file: column t")
    assert dict(found.dropped) == {"unordered": 1, "untimed": 1}
