"""Dates and times of day as people and programs write them."""

import numpy as np
import pytest

from gfimu.recording import nanoseconds_of

FORMS = {
    "ISO with zone": ("2024-05-17T10:25:14.123Z", "2024-05-17T10:25:14.123"),
    "offset of the zone": ("2024-05-17 10:25:14.5+02:00", "2024-05-17T08:25:14.5"),
    "named zone": ("2024-05-17_10:25:14.12 Europe/Amsterdam", "2024-05-17T10:25:14.12"),
    "German": ("17.05.2024 10:25:14,5", "2024-05-17T10:25:14.5"),
    "American with halves of the day": ("05/17/2024 01:25:14.5 PM", "2024-05-17T13:25:14.5"),
    "slash, day above twelve": ("17/05/2024 10:25:14", "2024-05-17T10:25:14"),
    "points in the time": ("2018-07-10T10.20.30.123", "2018-07-10T10:20:30.123"),
    "milliseconds after a colon": ("10:20:30:123", "1970-01-01T10:20:30.123"),
    "minutes of a spreadsheet": ("25:14.5", "1970-01-01T00:25:14.5"),
    "duration of pandas": ("0 days 00:00:01.250000", "1970-01-01T00:00:01.25"),
}


@pytest.mark.parametrize(("text", "meant"), FORMS.values(), ids=FORMS)
def test_a_form_is_read(text, meant):
    found, known = nanoseconds_of([text, text])
    assert known.all()
    assert np.datetime64(int(found[0]), "ns") == np.datetime64(meant, "ns")


@pytest.mark.parametrize("text", ["hello", "12", "1.5", "2024-05-17", "99:00:00", "2024-13-40 10:00:00"])
def test_other_texts_are_none(text):
    assert not nanoseconds_of([text, text])[1].any()


def test_a_day_begins_where_times_go_back():
    found, _ = nanoseconds_of(["23:59:59.99", "00:00:00.00", "00:00:00.01"])
    assert np.diff(found).tolist() == [10_000_000, 10_000_000]


def test_one_bad_text_costs_itself_alone():
    found, known = nanoseconds_of(["10:00:00.0", "oops", "10:00:00.2"])
    assert known.tolist() == [True, False, True]
    assert found[2] - found[0] == 200_000_000
