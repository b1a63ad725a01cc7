"""What a verdict adds on the place of what it does not know."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from few_effects import having

from gfimu import AccelerometerArray
from gfimu.diagnosis import Policy, diagnose, headline, make_stretches, prepare, report_html, with_place
from sim.trials import Measurement, measure
from sim.twin import Twin

TWIN = having(
    Twin(array=AccelerometerArray.load("cube12"), array_name="cube12"), "eccentricity", "scale_factor", "table_tilt"
)


@pytest.fixture(scope="module")
def swaying():
    """A cube that sways along the table's axis at a frequency that changes."""
    recording = measure(np.random.default_rng(9), TWIN, [], Measurement(duration=20.0))
    sway = 0.2 * np.sin(2 * np.pi * 1.37 * recording.t_s + 0.8 * np.sin(2 * np.pi * 0.23 * recording.t_s))
    return replace(recording, readings=recording.readings + np.outer(sway, TWIN.array.axes[:, 2]))


@pytest.fixture(scope="module")
def found(swaying):
    return diagnose([swaying], TWIN)


def test_an_unknown_verdict_says_where_its_cause_is(found):
    assert found.verdict == "unknown"
    assert found.rigid.place == "array"
    assert found.to_dict()["rigid_motion"]["place"] == "array"
    assert found.unexplained.mistake == ""
    located = found.unexplained.located[0]
    assert located.place in {"array", "bench"}  # along the vertical both are the same
    assert found.sentences[1].lower().startswith(located.text.lower())
    assert located.text in headline(found)
    stated = found.to_dict()["unexplained"]["located"][0]
    assert (stated["effect"], stated["place"]) == ("unlisted", located.place)


@pytest.mark.study
def test_a_report_has_its_picture_and_its_sentence(found):
    page = report_html(found)
    assert "whose motion is it?" in page
    assert page.count(found.rigid.sentence) == 1  # beside its picture
    assert "Where it is, and what it goes with" in page


def test_other_verdicts_have_the_numbers_and_no_sentence(found, swaying):
    prepared = prepare([swaying], TWIN, ["run"])
    stretches = make_stretches(TWIN, prepared.runs, prepared.effects)
    other = with_place(replace(found, verdict="explained", rigid=None), stretches, prepared.runs, Policy())
    assert other.rigid.place == "array"
    assert other.sentences == found.sentences
