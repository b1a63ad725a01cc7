"""Named causes against located terms: which of them explains a recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from few_effects import having
from no_name import Bent, Leaning

from gfimu import AccelerometerArray
from gfimu.diagnosis import (
    LOCATED,
    Policy,
    challenged,
    diagnose,
    headline,
    prepare,
    stretches_of,
    understand_any_length,
)
from sim.effects import make_effect
from sim.trials import Measurement, measure
from sim.twin import Twin

TWIN = having(Twin(array=AccelerometerArray.load("cube12"), array_name="cube12"), "scale_factor", "quadratic")
POLICY = Policy()


def found_in(effects=(), *, seed=5, change=None, gain=None, twin=TWIN):
    """The verdict on a recording with effects that the library of the twin may lack."""
    recording = measure(np.random.default_rng(seed), TWIN, effects, Measurement(duration=25.0))
    if change is not None:
        recording = replace(recording, readings=recording.readings + change(recording.t_s))
    if gain is not None:
        recording = replace(recording, readings=recording.readings * (1.0 + gain(recording))[:, None])
    return diagnose([recording], twin)


def named(name, **parameters):
    return make_effect(name, parameters, TWIN.array)


def test_a_bent_reference_is_one_function_of_it_and_no_curve_of_twelve_channels():
    """Beside the centripetal force, a reference ∝ ω³ looks like a square of every channel's reading."""
    found = found_in([Bent(1e-4, lambda spin: spin.rate**3)])
    assert found.verdict == "unknown"
    (cause,) = found.causes
    assert cause.effect == "unlisted"
    located = cause.unlisted
    assert (located.place, located.dependence, located.pattern) == ("reference", "omega^3", "all")
    assert located.place_probability == pytest.approx(LOCATED.most_certain_place, abs=0.02)
    x, f, std = (np.array(column) for column in (located.function.x, located.function.f, located.function.std))
    assert (located.function.x_unit, located.function.unit) == ("rad/s", "rad/s")
    assert np.all(np.abs(f - 1e-4 * x**3) < 4.0 * std + 1e-9)
    at = np.abs(x).argmax()
    assert f[at] == pytest.approx(1e-4 * x[at] ** 3, rel=0.02)
    assert "the reference reads otherwise than the table turns, in proportion to rate³" in headline(found)


def test_curves_of_twelve_channels_are_told_as_they_are():
    sizes = 2e-3 * np.random.default_rng(3).standard_normal(12)
    found = found_in([named("quadratic", **dict(zip((f"{c}_s2_m" for c in TWIN.array.channels), sizes, strict=True)))])
    assert (found.verdict, [cause.effect for cause in found.causes]) == ("explained", ["quadratic"])


def test_an_array_that_leans_is_located_beside_a_cause_that_has_a_name():
    gain = dict(zip(TWIN.array.channels, 5e-3 * np.random.default_rng(4).standard_normal(12), strict=True))
    leaning = Leaning([2e-4, -1e-4, 0.0], lambda spin: spin.acceleration)
    found = found_in([leaning, named("scale_factor", **gain)])
    assert {cause.effect for cause in found.causes} == {"scale_factor", "unlisted"}
    located = next(cause.unlisted for cause in found.causes if cause.unlisted is not None)
    assert (located.place, located.what) == ("array", "leans")
    assert located.dependence in {"alpha", "f(alpha)", "memory of alpha"}
    assert found.in_part or found.verdict == "unknown"
    assert found.gain.share_of_excess_removed > 0.95


def slow(t):
    """Rises and falls, from zero."""
    return np.tanh(t / 6.0) - 1.5 * np.exp(-0.5 * ((t - 15.0) / 4.0) ** 2)


def only(found):
    """The only cause of a verdict, which has no name: place, what is wrong there, and the kind of dependence."""
    (cause,) = found.causes
    return cause.unlisted.place, cause.unlisted.what, cause.unlisted.dependence


def test_a_gain_that_follows_time_is_no_random_walk_of_the_biases():
    """Before it is described, what changes slowly in all channels looks like a walk."""
    twin = having(TWIN, "scale_factor", "bias_random_walk")
    assert only(found_in(gain=lambda run: 0.012 * slow(run.t_s), twin=twin)) == ("supply", "gain", "f(t)")


def test_a_gain_that_follows_the_angle_has_a_mean_and_no_scale_factor_beside_it():
    def at(angle):
        return 2e-3 * np.exp(np.cos(2.0 * angle + 0.4))

    def gain(run):
        return at(np.concatenate([[0.0], np.cumsum(np.diff(run.t_s) * run.reference["tacho_rad_s"][1:])]))

    found = found_in(gain=gain)
    assert only(found) == ("supply", "gain", "revolution")
    table = found.causes[0].unlisted.function
    x, f, std = (np.array(column) for column in (table.x, table.f, table.std))
    assert 0.0 <= x.min() < 0.1
    assert 6.2 < x.max() < 6.3
    assert np.abs(f - at(x)).max() < 4.0 * std.max() + 2e-4  # the sum of the tachometer is no exact angle


def test_a_reference_that_drifts_goes_with_time():
    assert only(found_in([Bent(0.04, lambda spin: slow(np.linspace(0.0, 25.0, len(spin.rate))))])) == (
        *("reference", "reads", "f(t)"),
    )


def test_a_tone_on_one_channel_is_located_with_its_frequency_and_left_out_of_the_twin():
    found = found_in(change=lambda t: np.outer(0.15 * np.sin(2 * np.pi * 23.7 * t), np.eye(12)[4]))
    (cause,) = found.causes
    located = cause.unlisted
    assert (located.place, located.pattern, located.series) == ("channel", "one", ("a22",))
    assert located.dependence == "tone at 23.7 Hz"
    assert not found.twin.effects
    assert any("goes with absolute time" in sentence for sentence in found.sentences)


def test_what_goes_with_nothing_has_a_place_all_the_same():
    """Knocks against the bench: bursts along the vertical, which all chips have in common."""
    rng = np.random.default_rng(8)
    times, sizes = rng.uniform(1.0, 24.0, 25), rng.uniform(0.5, 1.5, 25)

    def change(t):
        since = t[:, None] - times
        knock = np.where(since > 0.0, np.exp(-since / 0.03) * np.sin(2 * np.pi * 21.0 * since), 0.0) @ sizes
        return np.outer(knock, TWIN.array.axes[:, 2])

    found = found_in(change=change)
    assert found.verdict == "unknown"
    located = found.causes[-1].unlisted
    assert (located.place, located.dependence, located.function) == ("bench", "time", None)
    assert located.text.endswith("in time, with nothing else that is known")


@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_located_where_nothing_is_hidden(seed):
    found = found_in(seed=seed)
    assert (found.verdict, found.causes) == ("nothing_found", ())


def test_an_explanation_without_anything_to_add_stays_as_it_is():
    recording = measure(np.random.default_rng(1), TWIN, [], Measurement(duration=15.0))
    stretches = stretches_of(TWIN, prepare([recording], TWIN, ["run"]))
    before = understand_any_length(stretches, POLICY, lambda share, text: None).explanation
    after = challenged(before, POLICY)
    assert after.best is before.best
    assert all(rival.log_posterior < before.best.log_posterior + POLICY.cause_odds for rival in after.rivals)
