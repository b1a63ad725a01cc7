"""A diagnosis that is interrupted, or out of time, gives what is known by then, and its workers end with it."""

import time

import numpy as np
import pytest

import gfimu
from gfimu import AccelerometerArray, InputError
from gfimu.diagnosis import diagnose, headline, limited_to, next_steps
from sim.effects import make_effect
from sim.trials import Measurement, measure
from sim.twin import Twin

TWIN = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
RUN = measure(
    np.random.default_rng(4),
    TWIN,
    [make_effect("table_tilt", {"x_rad": 0.01, "y_rad": 0.0})],
    Measurement(duration=12.0),
)
STAGES = ["samples", "search", "places", "validation"]


def interrupting(text, *words):
    """A report that interrupts once, as soon as the search says a text; and what it said."""
    said = []

    def report(share, line):
        first = not any(text in one for one in said)
        said.append(line)
        if text in line and first:
            raise KeyboardInterrupt(*words)

    return report, said


@pytest.mark.parametrize(
    ("text", "stage", "leads"),
    [
        ("drive", "search", False),
        ("leading", "search", True),
        ("places", "places", True),
        ("places; leading: table_tilt", "places", True),
        ("hold out", "validation", True),
    ],
)
def test_an_interrupt_gives_what_is_known(text, stage, leads):
    report, said = interrupting(text)
    found = diagnose([RUN], TWIN, report=report)
    assert said[-1] == "interrupted"
    assert found.verdict == "unknown"  # nothing was criticised
    assert not found.causes
    assert found.sentences[0].startswith(f"No verdict: the {stage} was interrupted (Ctrl-C)")
    assert headline(found) == found.sentences[0]
    assert ("table_tilt (x_rad = 0.0" in found.unexplained.signature) is leads
    assert not found.gain.held_out
    assert not found.twin.effects
    assert not found.rivals
    assert found.residual.rms_before > found.residual.noise_floor
    place = STAGES.index(stage)
    expected = {"by": "Ctrl-C", "stage": stage, "done": STAGES[:place], "not_done": STAGES[place:]}
    assert found.to_dict()["interrupted"] == expected
    assert "--time-limit" in next_steps(found)[0]


@pytest.mark.parametrize("workers", [1, 2])
def test_the_time_limit_ends_a_search_in_processes_too(monkeypatch, workers):
    monkeypatch.setattr("gfimu.diagnosis.fit.parallel._processors", lambda: workers)
    began = time.monotonic()
    with limited_to(0.3):  # a fast machine takes a second
        found = diagnose([RUN], TWIN)
    assert time.monotonic() - began < 0.3 + 10.0  # a slow machine's
    assert found.interrupted.by == "time limit"
    assert found.verdict == "unknown"
    assert diagnose([RUN], TWIN, report=interrupting("drive")[0]).interrupted.by == "Ctrl-C"  # no limit is left


def test_a_diagnosis_within_its_time_is_whole():
    found = gfimu.diagnose(RUN, TWIN, time_limit=500.0)
    assert (found.verdict, found.interrupted, found.to_dict()["interrupted"]) == ("explained", None, None)


@pytest.mark.parametrize("limit", [0.0, -1.0, float("nan")])
def test_a_limit_without_time_is_refused(limit):
    with pytest.raises(InputError, match=r"time limit is .* above zero"):
        gfimu.diagnose(RUN, TWIN, time_limit=limit)
