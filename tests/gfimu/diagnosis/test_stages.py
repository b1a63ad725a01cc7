"""Which of two verdicts is given: by the usual library of effects, or by the wider one."""

from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

from gfimu.diagnosis import diagnose
from gfimu.geometry.array import AccelerometerArray
from sim.twin import Twin
from sim.worlds.hidden import Measurement, measure

TWIN = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


@pytest.fixture(scope="module")
def clean():
    """A run without a hidden effect and the verdict on it."""
    run = measure(np.random.default_rng(1), TWIN, (), Measurement(duration=10.0))
    return run, diagnose([run], TWIN)


def verdict(clean, kind, *, probability=np.nan, removed=np.nan):
    gain = replace(clean[1].gain, share_of_excess_removed=removed)
    return replace(clean[1], verdict=kind, library_probability=probability, gain=gain, sentences=(kind,))


def given(monkeypatch, clean, usual, wider):
    """Return the verdict that is given if the libraries say so, and the nuisance models that the wider one searched."""
    asked = []

    class Library:
        def __init__(self, prepared, kept, model, *rest):
            self._is_wide = model.families().keys() > TWIN.families().keys()

        def understood(self, models=None):
            asked.append(models)
            return SimpleNamespace(explanation=SimpleNamespace(interrupted=False), model="random walk")

        def verdict(self, understanding):
            return wider if self._is_wide else usual

    monkeypatch.setattr(import_module("gfimu.diagnosis.diagnose"), "LibraryDiagnosis", Library)
    return diagnose([clean[0]], TWIN).sentences[0], asked


@pytest.mark.parametrize(
    ("usual", "wider", "chosen"),
    [
        (("unknown", {}), ("explained", {"probability": 0.5}), "explained"),
        (("unknown", {"removed": 0.4}), ("unknown", {"removed": 0.7}), "wider unknown"),
        (("unknown", {"removed": 0.7}), ("unknown", {"removed": 0.4}), "usual unknown"),
        (("unknown", {}), ("nothing_found", {}), "usual unknown"),
        (("explained", {"probability": 0.6}), ("explained", {"probability": 0.9}), "wider explained"),
        (("explained", {"probability": 0.6}), ("unknown", {"removed": 1.0}), "usual explained"),
    ],
)
def test_the_verdict_that_answers_better_is_given(monkeypatch, clean, usual, wider, chosen):
    one = replace(verdict(clean, usual[0], **usual[1]), sentences=(f"usual {usual[0]}",))
    other = replace(verdict(clean, wider[0], **wider[1]), sentences=(f"wider {wider[0]}",))
    said, asked = given(monkeypatch, clean, one, other)
    assert said.endswith(chosen)
    assert asked == [None, {"random walk"}]


@pytest.mark.parametrize("usual", [("nothing_found", {}), ("explained", {"probability": 0.85})])
def test_what_is_rare_is_not_searched_where_the_usual_effects_answer(monkeypatch, clean, usual):
    _, asked = given(monkeypatch, clean, verdict(clean, usual[0], **usual[1]), verdict(clean, "explained"))
    assert asked == [None]
