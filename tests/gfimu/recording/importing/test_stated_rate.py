"""A sample rate that the lines before the samples state."""

import pytest

from gfimu.recording.importing.guessing.times import RATES, stated_rate
from gfimu.recording.importing.raw_table import RawTable


def rate_of(line):
    found = stated_rate(RawTable("", {}, preamble=("a header", line)))
    return found and found[0]


@pytest.mark.parametrize(
    ("line", "rate"),
    [
        ("sample rate: 250", 250.0),
        ("Sampling frequency = 1,5 kHz", 1500.0),
        ("recorded at 30 Hz by day", 30.0),
        ("rate of the device in use: 250", None),  # too far from the word to belong to it
        (f"sample rate: {RATES[0] * 0.9}", None),
        (f"sample rate: {RATES[0] * 1.1}", RATES[0] * 1.1),
        (f"sample rate: {RATES[1] * 0.9}", RATES[1] * 0.9),
        (f"sample rate: {RATES[1] * 1.1}", None),
    ],
)
def test_a_rate_stands_near_its_word_and_is_one_of_motion(line, rate):
    assert rate_of(line) == (pytest.approx(rate) if rate else None)
