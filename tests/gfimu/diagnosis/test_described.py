"""What has no name is described in the extended twin, which loads back and leaves nothing to find in the same data."""

from dataclasses import replace

import numpy as np
import pytest
from few_effects import having

from gfimu import AccelerometerArray
from gfimu.diagnosis import diagnose, write_diagnosis
from gfimu.recording import Recording
from sim.effects import make_effect
from sim.trials import Measurement, measure, random_profile
from sim.twin import Twin

SETTING = Measurement(duration=24.0)
WHOLE = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
FEW = having(WHOLE, "table_tilt", "scale_factor")
CHANNEL = "a31"


def recorded(seed, change, twin=WHOLE, setting=SETTING):
    """A run whose readings and tachometer are changed by ``change(t, spin, readings, reference)``."""
    rng = np.random.default_rng(seed)
    motion = random_profile(rng, setting.duration)
    run = measure(rng, twin, (), setting, motion=motion)
    readings, columns = run.readings.copy(), {name: values.copy() for name, values in run.reference.items()}
    change(run.t_s, motion.at(run.t_s), readings, columns.get("tacho_rad_s"))
    return Recording.from_arrays(run.t_s, readings, twin.array, reference=columns)


def pickup(t, spin, readings, reference):
    """One channel picks up a field that turns twice per revolution, in proportion to the rate."""
    readings[:, 6] += 0.02 * spin.rate * np.cos(2 * spin.angle)


def stretched(t, spin, readings, reference):
    """The tachometer reads more the faster the table turns, in either direction."""
    reference += 0.002 * spin.rate**2


@pytest.mark.parametrize(
    ("change", "seed", "place", "dependence"),
    [
        pytest.param(pickup, 3, "channel", "revolution omega", marks=pytest.mark.study),
        (stretched, 5, "reference", "omega^2"),
    ],
)
def test_a_function_without_a_name_extends_the_twin(tmp_path, change, seed, place, dependence):
    run = recorded(seed, change)
    found = diagnose([run], FEW)
    assert found.verdict == "unknown"
    assert [cause.unlisted.place for cause in found.causes] == [place]
    (effect,) = found.twin.effects
    assert (effect.name, effect.parameters["place"]) == ("unlisted", place)
    assert effect.parameters["dependence"].startswith(dependence.split(" ")[0])
    assert found.gain.share_in_any_recording == pytest.approx(found.gain.share_of_excess_removed)
    assert found.gain.share_of_excess_removed > 0.9
    assert found.residual.rms_after < 1.05 * found.residual.noise_floor
    write_diagnosis(tmp_path, found)
    again = diagnose([run], Twin.load(tmp_path / "twin.toml"))
    assert again.verdict == "nothing_found", again.sentences


def test_a_described_function_predicts_another_recording():
    found = diagnose([recorded(5, stretched)], FEW)
    (effect,) = found.twin.effects
    assert effect.parameters["dependence"] == "omega^2"
    other = recorded(51, stretched)
    assert diagnose([other], found.twin.extended([]), held_out=[]).verdict == "nothing_found"


@pytest.mark.study
def test_a_table_with_an_encoder_has_functions_of_its_channels():
    encoder = replace(WHOLE, drive_source="angle")
    found = diagnose([recorded(3, pickup, encoder, replace(SETTING, encoder_step=2 * np.pi / 4096))], encoder)
    assert found.verdict == "unknown"
    assert {cause.unlisted.series for cause in found.causes} == {(CHANNEL,)}


@pytest.mark.study
def test_what_no_function_predicts_is_not_in_the_twin():
    rng = np.random.default_rng(9)

    def rattle(t, spin, readings, reference):
        readings += 0.03 * (np.abs(spin.rate) > np.median(np.abs(spin.rate)))[:, None] * rng.normal(size=readings.shape)

    found = diagnose([recorded(6, rattle)], WHOLE)
    assert found.verdict == "unknown"
    assert not found.twin.effects


@pytest.mark.study
def test_named_causes_need_no_functions_without_a_name():
    tilt = make_effect("table_tilt", {"x_rad": 0.01}, WHOLE.array)
    found = diagnose([measure(np.random.default_rng(7), WHOLE, [tilt], SETTING)], WHOLE)
    assert found.verdict == "explained"
    assert [effect.name for effect in found.twin.effects] == ["table_tilt"]


def test_a_clock_that_warms_up_is_late_in_time_and_no_clock_of_another_rate():
    """A constant rate error explains most of it, and predicts no other part of the recording."""

    def late(t, spin, readings, reference):
        reference -= spin.acceleration * 6e-4 * (t - 6.0 * -np.expm1(-t / 6.0))

    found = diagnose([recorded(3, late)], WHOLE)
    assert found.verdict == "unknown"
    assert [(cause.unlisted.place, cause.unlisted.what) for cause in found.causes] == [("clock", "late")]
    assert found.unexplained.log_odds < 8


def test_a_bias_that_only_completes_a_warm_up_is_not_in_the_twin():
    """Chips that start warm: a bias less a warm-up, of which no other recording has the warm-up."""

    def warm(t, spin, readings, reference):
        readings[:, [1, 7]] += np.outer(np.exp(-t / 5.0), [0.1, -0.15])

    found = diagnose([recorded(4, warm)], WHOLE)
    assert {cause.effect for cause in found.causes} == {"bias", "warm_up"}
    assert not found.twin.effects
    assert any("bias is not all in the extended twin" in sentence for sentence in found.sentences)
