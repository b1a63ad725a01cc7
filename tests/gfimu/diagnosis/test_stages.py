"""Which of two verdicts is given: by the usual library of effects, or by the wider one."""

from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

from gfimu import AccelerometerArray, NamedCause
from gfimu.diagnosis import diagnose
from sim.trials import Measurement, measure
from sim.twin import Twin

TWIN = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


@pytest.fixture(scope="module")
def clean():
    """A run without a hidden effect and the verdict on it."""
    run = measure(np.random.default_rng(1), TWIN, (), Measurement(duration=10.0))
    return run, diagnose([run], TWIN)


def verdict(clean, kind, *, probability=np.nan, removed=np.nan):
    gain = replace(clean[1].gain, share_of_excess_removed=removed)
    return replace(clean[1], verdict=kind, library_probability=probability, gain=gain, sentences=(kind,))


def given(monkeypatch, clean, usual, wider, *, promise=10.0, gain=10.0):
    """Return the verdict that is given if the libraries say so, and the nuisance models that the wider one searched.

    The wider library promises so many nats before its search, and gains so many.
    """
    asked = []

    class Library:
        def __init__(self, prepared, kept, model, *rest):
            self._is_wide = model.families().keys() > TWIN.families().keys()

        def understood(self, models=None):
            asked.append(models)
            search = SimpleNamespace(interrupted="")
            return SimpleNamespace(explanation=search, model="random walk", log_posterior=gain * self._is_wide)

        def promise(self, understanding, others):
            assert "cubic" in others
            assert "bias" not in others
            return promise

        def verdict(self, understanding):
            return wider if self._is_wide else usual

    monkeypatch.setattr(import_module("gfimu.diagnosis.diagnose"), "LibraryDiagnosis", Library)
    return diagnose([clean[0]], TWIN).sentences[0], asked


@pytest.mark.parametrize(
    ("usual", "wider", "gain", "rare", "chosen"),
    [
        (("unknown", {}), ("explained", {"probability": 0.5}), -50.0, "cubic", "explained"),
        (("unknown", {"removed": 0.4}), ("unknown", {"removed": 0.7}), 0.0, "cubic", "wider unknown"),
        (("unknown", {"removed": 0.7}), ("unknown", {"removed": 0.4}), 50.0, "cubic", "usual unknown"),
        (("unknown", {}), ("nothing_found", {}), 50.0, "cubic", "usual unknown"),
        (("explained", {"probability": 0.9}), ("explained", {"probability": 0.6}), 2.5, "cubic", "wider explained"),
        (("explained", {"probability": 0.6}), ("explained", {"probability": 0.9}), 1.5, "cubic", "usual explained"),
        (("explained", {"probability": 0.6}), ("unknown", {"removed": 1.0}), 50.0, "cubic", "usual explained"),
        (("nothing_found", {}), ("explained", {"probability": 0.9}), 5.0, "cubic", "wider explained"),
        (("explained", {}), ("explained", {}), 5.0, "bias", "usual explained"),  # what is rare was withdrawn
    ],
)
def test_the_verdict_of_the_greater_evidence_is_given(monkeypatch, clean, usual, wider, gain, rare, chosen):
    one = replace(verdict(clean, usual[0], **usual[1]), sentences=(f"usual {usual[0]}",))
    other = replace(verdict(clean, wider[0], **wider[1]), sentences=(f"wider {wider[0]}",))
    other = replace(other, causes=(NamedCause(rare, {}, {}, 0.9),))
    said, asked = given(monkeypatch, clean, one, other, gain=gain)
    assert said.endswith(chosen)
    assert asked == [None, {"random walk"}]


@pytest.mark.parametrize("usual", ["nothing_found", "explained"])
@pytest.mark.parametrize(("promise", "searched"), [(-1.1, False), (-0.9, True)])
def test_what_is_rare_is_searched_where_it_may_be_more_probable(monkeypatch, clean, usual, promise, searched):
    _, asked = given(monkeypatch, clean, verdict(clean, usual), verdict(clean, "explained"), promise=promise)
    assert asked == [None, {"random walk"}][: 1 + searched]
