"""Localising what no effect of the library explains: the place, what it goes with, and how large it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from few_effects import having

from gfimu import AccelerometerArray
from gfimu.diagnosis import LOCATED, Policy, localise, located, prepare, stretches_of
from sim.effects import make_effect
from sim.trials import Measurement, measure
from sim.twin import Twin

TWIN = having(Twin(array=AccelerometerArray.load("cube12"), array_name="cube12"), "scale_factor")
POLICY = Policy()


def described(effects=(), *, seed=5, change=None):
    """What is located in a recording with effects that the library of the twin lacks."""
    hidden = [make_effect(name, parameters, TWIN.array) for name, parameters in effects]
    recording = measure(np.random.default_rng(seed), TWIN, hidden, Measurement(duration=25.0))
    if change is not None:
        recording = replace(recording, readings=recording.readings + change(recording.t_s))
    stretches = stretches_of(TWIN, prepare([recording], TWIN, ["run"]))
    return located(localise(stretches, POLICY), POLICY)


def test_a_reference_that_saturates_is_located_with_its_form_and_size():
    (found,) = described([("reference_rate_cubed", {"error_rad_s_per_rad3_s3": 1e-4})])
    assert (found.place, found.dependence, found.pattern) == ("reference", "omega^3", "all")
    assert found.place_probability == pytest.approx(LOCATED.most_certain_place, abs=0.02)
    x, f, std = (np.array(column) for column in (found.function.x, found.function.f, found.function.std))
    assert (found.function.x_unit, found.function.unit) == ("rad/s", "rad/s")
    assert np.all(np.abs(f - 1e-4 * x**3) < 4.0 * std + 1e-9)
    at = np.abs(x).argmax()
    assert f[at] == pytest.approx(1e-4 * x[at] ** 3, rel=0.02)
    assert "the reference reads otherwise than the table turns, in proportion to rate³" in found.text


def test_an_array_that_leans_with_the_acceleration_is_located_on_the_table():
    found, *_ = described([("lean_by_acceleration", {"x_rad_per_rad_s2": 2e-4, "y_rad_per_rad_s2": -1e-4})])
    assert (found.place, found.what) == ("array", "leans")
    assert found.dependence in {"alpha", "f(alpha)", "memory of alpha"}


def test_a_tone_on_one_channel_is_located_with_its_frequency():
    change = lambda t: np.outer(0.15 * np.sin(2 * np.pi * 23.7 * t), np.eye(12)[4])  # noqa: E731
    found, *_ = described(change=change)
    assert (found.place, found.pattern, found.series) == ("channel", "one", ("a22",))
    assert found.dependence == "tone at 23.7 Hz"


def test_what_goes_with_nothing_has_a_place_all_the_same():
    """Knocks against the bench: bursts along the vertical, which all chips have in common."""
    rng = np.random.default_rng(8)
    times, sizes = rng.uniform(1.0, 24.0, 25), rng.uniform(0.5, 1.5, 25)

    def change(t):
        since = t[:, None] - times
        knock = np.where(since > 0.0, np.exp(-since / 0.03) * np.sin(2 * np.pi * 21.0 * since), 0.0) @ sizes
        return np.outer(knock, TWIN.array.axes[:, 2])

    (found,) = described(change=change)
    assert (found.dependence, found.function) == ("time", None)
    assert found.place in {"bench", "array"}  # along the vertical the two frames are one
    assert found.text.endswith("in time, with nothing else that is known")


@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_located_where_nothing_is_hidden(seed):
    assert described(seed=seed) == ()
