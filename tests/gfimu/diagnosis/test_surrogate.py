"""What has no name is described in the extended twin, which loads back and leaves nothing to find in the same data."""

from dataclasses import replace

import numpy as np
import pytest
from usual_twin import UsualTwin

from gfimu import AccelerometerArray, InputError
from gfimu.diagnosis import diagnose, story, write_diagnosis
from gfimu.recording import Recording
from sim.effects import make_effect
from sim.trials import Measurement, measure, random_profile
from sim.twin import Twin

SETTING = Measurement(duration=24.0)
CHANNEL = "a31"


@pytest.fixture(scope="module")
def twin():
    return UsualTwin(array=AccelerometerArray.load("cube12"), array_name="cube12")


def recorded(twin, seed, change):
    """A run whose readings and tachometer are changed by ``change(t, spin, readings, reference)``."""
    rng = np.random.default_rng(seed)
    motion = random_profile(rng, SETTING.duration)
    run = measure(rng, twin, (), SETTING, motion=motion)
    readings, reference = run.readings.copy(), run.reference["tacho_rad_s"].copy()
    change(run.t_s, motion.at(run.t_s), readings, reference)
    columns = {**run.reference, "tacho_rad_s": reference}
    return Recording.from_arrays(run.t_s, readings, twin.array, reference=columns)


def terms(found):
    """The terms without a name in the extended twin by their function."""
    return {one.parameters["dependence"]: one for one in found.twin.effects if one.name == "unknown"}


def pickup(t, spin, readings, reference):
    """One channel picks up a field that turns twice per revolution, in proportion to the rate."""
    readings[:, 6] += 0.02 * spin.rate * np.cos(2 * spin.angle)


def whistle(t, spin, readings, reference):
    """Half of the channels hear a tone, each in a loudness of its own; that is no interference common to all."""
    readings[:, ::2] += 0.03 * np.sin(2 * np.pi * 17.3 * t)[:, None] * [1, -1, 1, -1, 2, -2]


def stretched(t, spin, readings, reference):
    """The tachometer reads more the faster the table turns, in either direction."""
    reference += 0.002 * spin.rate**2


@pytest.mark.study
@pytest.mark.parametrize(
    ("change", "seed", "function", "key", "size"),
    [
        (pickup, 3, "2 per revolution × rate (cosine)", f"{CHANNEL}_m_s2", 0.02),
        (stretched, 5, "rate²", "reference_rad_s", 0.002),
    ],
)
def test_a_dependence_without_a_name_extends_the_twin(twin, tmp_path, change, seed, function, key, size):
    run = recorded(twin, seed, change)
    found = diagnose([run], twin)
    assert found.verdict == "unknown"
    described = {name: term for name, term in terms(found).items() if key in term.parameters}
    told = [term for name, term in described.items() if name.startswith(function)]
    assert told, described
    unit = told[0].units.rate if "rate" in function else 1.0
    power = 2 if function == "rate²" else 1
    [amplitude] = [term.parameters[key] for term in told]
    assert amplitude / unit**power == pytest.approx(size, rel=0.1)
    assert found.unexplained.extends_twin
    assert not found.unexplained.left_out
    assert found.gain.share_in_any_recording == pytest.approx(found.gain.share_of_excess_removed)
    assert found.gain.held_out
    assert found.gain.share_of_excess_removed > 0.9
    assert found.residual.rms_after < 1.05 * found.residual.noise_floor
    write_diagnosis(tmp_path, found)
    again = diagnose([run], Twin.load(tmp_path / "twin.toml"))
    assert again.verdict == "nothing_found", again.sentences


@pytest.mark.study
def test_a_tone_of_one_recording_is_described_and_left_out_of_the_twin(twin):
    found = diagnose([recorded(twin, 4, whistle)], twin)
    assert found.verdict == "unknown"
    tones = [key for key in found.unexplained.surrogate if key.startswith("a13_m_s2: tone at 17.3")]
    assert np.linalg.norm([found.unexplained.surrogate[key] for key in tones]) == pytest.approx(0.03, rel=0.1)
    assert not terms(found)
    assert not found.unexplained.extends_twin
    assert found.unexplained.left_out >= len(tones) > 0
    assert found.gain.share_of_excess_removed > 0.9
    assert found.gain.share_in_any_recording == pytest.approx(0.0, abs=0.05)
    assert any("of absolute time is left out of the extended twin" in sentence for sentence in found.sentences)
    assert "of absolute time is not in twin.toml" in story(found)
    # The error after is that of the twin that is written, not of what was left out of it.
    assert found.residual.rms_after > 1.1 * found.residual.noise_floor


@pytest.mark.study
@pytest.mark.parametrize("late", [0.0, 0.0145], ids=["in phase", "in another phase"])
def test_only_a_second_recording_confirms_a_tone(twin, late):
    def again(t, spin, readings, reference):
        whistle(t - late, spin, readings, reference)

    found = diagnose([recorded(twin, 4, whistle)], twin, held_out=[recorded(twin, 40, again)])
    assert found.verdict == "unknown"
    assert any(name.startswith("tone at 17.3") for name in terms(found)) == (late == 0.0)


@pytest.mark.study
def test_runs_share_their_terms_with_a_run_that_was_not_there(twin):
    found = diagnose([recorded(twin, 3, pickup), recorded(twin, 30, pickup)], twin)
    assert found.verdict == "unknown"
    (size,) = (term.parameters[f"{CHANNEL}_m_s2"] / term.units.rate for term in terms(found).values())
    assert size == pytest.approx(0.02, rel=0.05)
    assert diagnose([recorded(twin, 31, pickup)], found.twin).verdict == "nothing_found"


@pytest.mark.study
def test_a_table_with_an_encoder_gets_terms_of_its_channels(twin):
    encoder = replace(twin, drive_source="angle")
    rng = np.random.default_rng(3)
    motion = random_profile(rng, SETTING.duration)
    run = measure(rng, encoder, (), replace(SETTING, encoder_step=2 * np.pi / 4096), motion=motion)
    readings = run.readings.copy()
    pickup(run.t_s, motion.at(run.t_s), readings, None)
    found = diagnose([Recording.from_arrays(run.t_s, readings, twin.array, reference=run.reference)], encoder)
    assert found.verdict == "unknown"
    assert set(terms(found)) == {"2 per revolution × rate (cosine)"}


@pytest.mark.study
def test_what_no_function_predicts_is_not_in_the_twin(twin):
    rng = np.random.default_rng(9)

    def rattle(t, spin, readings, reference):
        readings += 0.03 * (np.abs(spin.rate) > np.median(np.abs(spin.rate)))[:, None] * rng.normal(size=readings.shape)

    found = diagnose([recorded(twin, 6, rattle)], twin)
    assert found.verdict == "unknown"
    assert "noise" in found.unexplained.signature
    assert not terms(found)
    assert not found.unexplained.extends_twin
    assert any("No function of the motion" in sentence for sentence in found.sentences)


@pytest.mark.study
def test_named_causes_need_no_terms_without_a_name(twin):
    tilt = make_effect("table_tilt", {"x_rad": 0.01}, twin.array)
    found = diagnose([measure(np.random.default_rng(7), twin, [tilt], SETTING)], twin)
    assert found.verdict == "explained"
    assert not terms(found)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"a11_m_s2": 0.1}, "unknown dependence ''; valid: .*N per revolution"),
        ({"dependence": "rate!"}, "unknown dependence 'rate!'; valid: .*rate²"),
        ({"dependence": "rate", "rate_unit_rad_s": 0.0}, "rate_unit_rad_s must be a positive number, not 0.0"),
        ({"dependence": "rate", "duration_s": float("nan")}, "duration_s must be a positive number"),
        ({"dependence": "rate", "a99_m_s2": 1.0}, "unknown parameter 'a99_m_s2'"),
        ({"dependence": "tone at 5 Hz (sine)", "reference_rad_s": 1.0}, "reference_rad_s needs a function of the mot"),
        ({"dependence": "reading³", "reference_rad_s": 1.0}, "reference_rad_s needs a function of the motion"),
    ],
)
def test_a_term_that_makes_no_sense_is_refused(twin, parameters, message):
    with pytest.raises(InputError, match=message):
        make_effect("unknown", parameters, twin.array).check(twin.array)


def test_a_term_adds_its_function_to_its_channels(twin):
    t = np.arange(0.0, 5.0, 0.01)
    motion = random_profile(np.random.default_rng(1), 5.0)
    state = motion.at(t)
    units = {"rate_unit_rad_s": 4.0, "acceleration_unit_rad_s2": 8.0, "duration_s": 5.0}

    def change(dependence, key):
        term = make_effect("unknown", {"dependence": dependence, **units, key: 0.5}, twin.array)
        (readings, reference), (plain, rate) = twin.predict(motion, t, effects=[term]), twin.predict(motion, t)
        others = [place for place, name in enumerate(twin.array.channels) if f"{name}_m_s2" != key]
        assert not (readings - plain)[:, others].any()
        return (readings - plain)[:, twin.array.channels.index("a22")], reference - rate

    both = change("rate² × acceleration", "a22_m_s2")
    np.testing.assert_allclose(both[0], 0.5 * (state.rate / 4) ** 2 * state.acceleration / 8, atol=1e-12)
    assert not both[1].any()
    np.testing.assert_allclose(change("tone at 3.5 Hz (sine)", "a22_m_s2")[0], 0.5 * np.sin(7 * np.pi * t), atol=1e-12)
    np.testing.assert_allclose(change("step at 2 s", "a22_m_s2")[0], np.where(t > 2, 0.25, -0.25), atol=1e-12)
    np.testing.assert_allclose(change("constant", "a22_m_s2")[0], 0.5, atol=1e-12)
    silent, turned = change("3 per revolution (sine)", "reference_rad_s")
    assert not silent.any()
    np.testing.assert_allclose(turned, 0.5 * np.sin(3 * state.angle) * (np.abs(state.rate) > 0.05), atol=1e-12)


def test_terms_of_time_count_from_the_start_of_the_recording(twin):
    term = make_effect("unknown", {"dependence": "step at 2 s", "a22_m_s2": 1.0}, twin.array)
    world = replace(twin, effects=(term,))
    motion = random_profile(np.random.default_rng(1), 5.0)
    t = 100.0 + np.arange(0.0, 4.0, 0.01)
    change = world.predict(motion, t, start=99.0)[0] - twin.predict(motion, t)[0]
    assert (change[:, 4] > 0).argmax() == pytest.approx(100, abs=1)
