"""What one thing upstream of all chips does is not told as a fault of every chip."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from usual_twin import UsualTwin

from gfimu import AccelerometerArray
from gfimu.diagnosis import Unlisted, diagnose, headline
from gfimu.recording import Recording
from sim.effects import make_effect
from sim.trials import Measurement, measure
from sim.twin import Twin

TWIN = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


def recorded(seed, effects=(), cubic=0.0, square=0.0):
    """A run whose tachometer reads ω + square · ω² + cubic · ω³."""
    run = measure(np.random.default_rng(seed), TWIN, effects, Measurement(duration=24.0))
    reference = {name: values + square * values**2 + cubic * values**3 for name, values in run.reference.items()}
    return Recording.from_arrays(run.t_s, run.readings, TWIN.array, reference=reference)


@pytest.mark.study
def test_a_tachometer_that_is_bent_is_named_by_place_and_dependence():
    said = []
    found = diagnose([recorded(4, cubic=1e-4)], TWIN, report=lambda share, text: said.append((share, text)))
    assert found.verdict == "explained"
    assert any(text.startswith("wider library") for _, text in said)  # as the usual one has no answer
    assert "further ones were searched" in " ".join(found.sentences)
    assert np.all(np.diff([share for share, _ in said]) >= 0.0)
    assert headline(found).endswith("the gain of the reference changes with the rate squared.")
    assert "grammar" not in found.twin.to_dict()  # the next diagnosis begins with the usual effects again
    (cause,) = found.causes
    assert cause.unlisted == Unlisted(cause.effect, "reference", "omega^3", "one")
    (size,) = cause.parameters.values()
    assert size == pytest.approx(1e-4, abs=4 * next(iter(cause.std.values())))
    told = found.to_dict()["causes"][0]
    assert told["effect"] == "unlisted"
    assert told["name"] == "reference_rate_cubed"
    assert "it goes with rate³" in cause.why
    assert Twin.from_dict(tomllib.loads(found.twin.to_toml())).effects[0].parameters == pytest.approx(cause.parameters)


@pytest.mark.study
def test_a_tachometer_that_reads_too_much_in_both_directions_is_no_change_of_its_gain():
    # A run in both directions: one that turns one way can not tell the two apart.
    found = diagnose([recorded(5, square=1e-3)], TWIN)
    (cause,) = found.causes
    assert found.verdict == "explained"
    assert cause.unlisted == Unlisted(cause.effect, "reference", "omega^2", "one")
    (size,) = cause.parameters.values()
    assert size == pytest.approx(1e-3, abs=4 * next(iter(cause.std.values())))


@pytest.mark.study
def test_by_the_usual_effects_it_is_no_curve_of_twelve_channels():
    found = diagnose([recorded(4, cubic=1e-4)], UsualTwin(array=TWIN.array, array_name=TWIN.array_name))
    assert found.verdict == "unknown"
    assert "go as the centripetal arm" in found.unexplained.signature
    assert not found.causes
    # What describes it then is the reference's, and predicts validation data.
    assert found.gain.share_of_excess_removed == pytest.approx(1.0, abs=0.1)


@pytest.mark.study
def test_curves_of_twelve_channels_are_told_as_they_are():
    sizes = 2e-3 * np.random.default_rng(3).standard_normal(12)
    keys = [f"{channel}_s2_m" for channel in TWIN.array.channels]
    hidden = make_effect("quadratic", dict(zip(keys, sizes, strict=True)), TWIN.array)
    said = []
    found = diagnose([recorded(4, [hidden])], TWIN, report=lambda share, text: said.append(text))
    assert found.verdict == "explained"
    (cause,) = found.causes
    assert cause.effect == "quadratic"
    assert not any(text.startswith("wider library") for text in said)


@pytest.mark.study
def test_an_interrupt_of_the_wider_search_leaves_the_verdict_by_the_usual_effects():
    def report(share, text):
        if text.startswith("wider library") and "leading" in text:
            raise KeyboardInterrupt

    found = diagnose([recorded(4, cubic=1e-4)], TWIN, report=report)
    assert found.verdict == "unknown"
    assert "go as the centripetal arm" in found.unexplained.signature


@pytest.mark.study
def test_what_an_upright_run_can_not_see_of_a_cause_is_listed():
    """No reading depends on the height of a chip while the axis stands upright."""
    keys = [f"a{chip}_{axis}_m" for chip in range(1, 5) for axis in "xy"]
    sizes = 2e-3 * np.random.default_rng(7).standard_normal(8)
    hidden = make_effect("sensor_position", dict(zip(keys, sizes, strict=True)), TWIN.array)
    found = diagnose([recorded(4, [hidden])], TWIN)
    assert [cause.effect for cause in found.causes] == ["sensor_position"]
    assert {one.text for one in found.undetermined} == {f"sensor_position a{chip}_z_m" for chip in range(1, 5)}
    assert all(abs(found.causes[0].parameters.get(f"a{chip}_z_m", 0.0)) < 1e-6 for chip in range(1, 5))
