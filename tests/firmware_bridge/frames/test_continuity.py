"""A sample goes on from another: both sides of the longest period and of the most samples that may be missing."""

import numpy as np
import pytest

from firmware_bridge import FORMATS, Continuity, SampleDecoder, encode_samples

PACKET = np.dtype([("sequence", "<u2"), ("ticks", "<u4")])
PERIOD = 1000.0  # ticks, the longest


def passed(step, span, *, sequence="sequence"):
    """Whether a sample passes that is so many numbers and ticks further than the last, and is the last itself."""
    check = Continuity((sequence, 2**16 - 1), ("ticks", 2**32 - 1), PERIOD)
    rows = np.array([(5, 100), (6, 1100), (6 + step, 1100 + span)], dtype=PACKET)
    return len(check.admit(rows, trust_first=True)) == 3


@pytest.mark.parametrize("step", [1, 2, 16])
def test_a_sample_may_be_later_by_a_tenth_of_the_longest_period_of_each_number(step):
    assert passed(step, round(step * 1.09 * PERIOD))
    assert not passed(step, round(step * 1.11 * PERIOD))


def test_fifteen_samples_may_be_missing():
    assert passed(16, 3000)
    assert not passed(17, 3000)


def test_without_a_number_the_clock_alone_decides():
    assert passed(0, round(16 * 1.09 * PERIOD), sequence="")
    assert not passed(0, round(16 * 1.11 * PERIOD), sequence="")


@pytest.mark.parametrize("step", [0, -1])
def test_neither_a_repeated_number_nor_an_earlier_one_goes_on(step):
    assert not passed(step, 1000)


@pytest.mark.parametrize(("share", "samples"), [(1.09, 3), (1.11, 2)])
def test_the_longest_period_of_a_stream_is_that_of_its_slowest_rate(share, samples):
    """The lpc1768 board samples at 10 Hz at the slowest, its clock counts microseconds."""
    form = FORMATS["lpc1768"]
    longest = form.clock_hz / form.slowest_hz
    assert (form.clock_hz, form.slowest_hz) == (1e6, 10.0)
    ticks = np.array([0, 10_000, 10_000 + round(share * longest)])
    decoder = SampleDecoder()
    found = decoder.feed(encode_samples(np.arange(3), ticks, np.ones((3, 12), dtype=int)))
    assert len(found.sequence) == samples
