"""A search that is interrupted gives what is known by then."""

import numpy as np
import pytest

from gfimu.diagnosis import diagnose
from gfimu.geometry.array import AccelerometerArray
from sim.campaign import Measurement, measure
from sim.effects import make_effect
from sim.twin import Twin

TWIN = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
RUN = measure(
    np.random.default_rng(4),
    TWIN,
    [make_effect("table_tilt", {"x_rad": 0.01, "y_rad": 0.0})],
    Measurement(duration=20.0),
)


def interrupting(text):
    """A report that interrupts as soon as the search says a text; and what it said."""
    said = []

    def report(share, words):
        said.append(words)
        if text in words:
            raise KeyboardInterrupt

    return report, said


def test_an_interrupt_gives_the_leading_explanation():
    report, said = interrupting("leading")
    found = diagnose([RUN], TWIN, report=report)
    assert said[-1] == "interrupted"
    assert any(words.endswith("leading: table_tilt") for words in said)
    assert [cause.effect for cause in found.causes] == ["table_tilt"]
    assert found.causes[0].parameters["x_rad"] == pytest.approx(0.01, rel=0.1)
    assert found.sentences[0].startswith("The search was interrupted")
    assert not found.gain.held_out


def test_an_interrupt_before_anything_is_known_ends_the_diagnosis():
    report, _ = interrupting("drive")
    with pytest.raises(KeyboardInterrupt):
        diagnose([RUN], TWIN, report=report)
