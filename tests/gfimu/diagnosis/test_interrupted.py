"""A search that is interrupted gives what is known by then."""

import numpy as np
import pytest

from gfimu.diagnosis import diagnose
from gfimu.diagnosis.report.plain_words import headline
from gfimu.geometry.array import AccelerometerArray
from sim.effects import make_effect
from sim.twin import Twin
from sim.worlds.hidden import Measurement, measure

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
    assert found.verdict == "unknown"  # nothing was criticised
    assert not found.causes
    assert found.sentences[0].startswith("No verdict: the search was interrupted")
    assert headline(found) == found.sentences[0]
    assert "table_tilt (x_rad = 0.00" in found.unexplained.signature
    assert not found.gain.held_out
    assert not found.twin.effects


@pytest.mark.parametrize("when", ["drive", "search"])
def test_an_interrupt_before_anything_is_known_ends_the_diagnosis(when):
    report, _ = interrupting(when)
    with pytest.raises(KeyboardInterrupt):
        diagnose([RUN], TWIN, report=report)
