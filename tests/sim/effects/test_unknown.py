"""The effect ``unknown``: a function of the motion, the angle or time that is added to channels or reference."""

from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray, InputError
from sim.effects import make_effect
from sim.trials import random_profile
from sim.twin import Twin


@pytest.fixture(scope="module")
def twin():
    return Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


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
