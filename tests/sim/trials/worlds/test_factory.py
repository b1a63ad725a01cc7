"""The factory of worlds: what it makes has the distribution of `sim.trials.worlds.hidden.measure`."""

import numpy as np
import pytest

from gfimu import InputError
from sim import forward
from sim.effects import make_effect
from sim.trials import Measurement, WorldFactory, measure, random_profile
from sim.twin import Twin

SETTING = Measurement(duration=20.0)


@pytest.fixture(scope="module")
def twin():
    return Twin.load("cube12_turntable")


@pytest.fixture(scope="module")
def factory(twin):
    return WorldFactory(twin, SETTING)


def residual(recording, twin, seed, effects=()):
    """Readings less what the world of that seed would read without noise, (n, c), and the tachometer's error, (n,)."""
    spin = random_profile(np.random.default_rng(seed), SETTING.duration)
    t = np.arange(2000) / 100.0
    ideal = forward.channels(twin.world(effects), spin, t)
    tacho = recording.reference["tacho_rad_s"] - forward.reference(twin.world(effects), spin, t)
    return recording.readings - ideal, tacho


def test_the_table_moves_as_the_campaigns_profile(factory, twin):
    recording = factory.measure(np.random.default_rng(4))
    left, tacho = residual(recording, twin, 4)
    white = twin.expected_noise(100.0).white
    assert left.std(axis=0) == pytest.approx(white, rel=0.1)  # 2000 samples and a little bias instability
    assert tacho.std() == pytest.approx(SETTING.tacho_noise, rel=4 / np.sqrt(2 * 2000))
    assert np.ptp(recording.reference["tacho_rad_s"]) > 3.0  # it did turn


def test_noise_has_the_size_of_the_campaigns(factory, twin):
    seeds = range(60)
    mine = np.array([residual(factory.measure(np.random.default_rng(s)), twin, s)[0] for s in seeds])
    other = np.array([residual(measure(np.random.default_rng(s), twin, setting=SETTING), twin, s)[0] for s in seeds])
    for average in (1, 50, 500):
        sizes = [
            np.diff(x.reshape(60, 2000 // average, average, 12).mean(axis=2), axis=1).std(axis=1) for x in (mine, other)
        ]
        mean, error = sizes[0].mean() / sizes[1].mean(), sizes[1].std() / sizes[1].mean() / np.sqrt(60 * 12)
        assert mean == pytest.approx(1.0, abs=0.02 + 4 * np.sqrt(2) * error)


def test_readings_are_whole_counts(factory, twin):
    quantum = twin.expected_noise(100.0).quantum
    counts = factory.measure(np.random.default_rng(5)).readings / quantum
    assert counts == pytest.approx(np.round(counts), abs=1e-6)


@pytest.mark.parametrize(
    ("name", "parameters"),
    [("table_tilt", {"x_rad": 0.02}), ("sensor_lag", {"time_constant_s": 2e-2}), ("clock_error", {"ratio": 2e-3})],
)
def test_a_hidden_effect_is_in_the_readings(factory, twin, name, parameters):
    effects = [make_effect(name, parameters, twin.array)]
    recording = factory.measure(np.random.default_rng(6), effects)
    with_it, without = residual(recording, twin, 6, effects)[0], residual(recording, twin, 6)[0]
    white = twin.expected_noise(100.0).white
    assert with_it.std(axis=0) == pytest.approx(white, rel=0.1)
    assert np.sum((without / white) ** 2) > 1.1 * np.sum((with_it / white) ** 2)


def test_lost_frames_are_lost_and_a_coarse_step_is_coarse(factory, twin):
    lost = factory.measure(np.random.default_rng(7), [make_effect("dropped_frames", {"share": 0.05}, twin.array)])
    assert 1850 < len(lost.t_s) < 1950
    assert len(lost.reference["tacho_rad_s"]) == len(lost.t_s)
    step = 4 * twin.expected_noise(100.0).quantum
    coarse = factory.measure(np.random.default_rng(7), [make_effect("coarse_resolution", {"step_m_s2": step})])
    assert coarse.readings / step == pytest.approx(np.round(coarse.readings / step), abs=1e-6)


def test_samples_between_the_profiles_grid_are_made_too(twin):
    odd = WorldFactory(twin, Measurement(duration=10.0, sample_rate=130.0)).measure(np.random.default_rng(8))
    assert len(odd.t_s) == 1300
    assert np.isfinite(odd.readings).all()


def test_an_encoder_is_refused(twin):
    with pytest.raises(InputError, match="no encoder"):
        WorldFactory(twin, Measurement(encoder_step=0.01))


def test_a_world_says_what_is_true_of_it(factory, twin):
    effects = [make_effect("dropped_frames", {"share": 0.05}, twin.array), make_effect("table_tilt", {"x_rad": 0.02})]
    made = factory.world(np.random.default_rng(7), effects)
    spin = random_profile(np.random.default_rng(7), SETTING.duration)
    t = made.recording.t_s
    assert made.motion.rate == pytest.approx(spin.at(t).rate, abs=1e-6)
    assert made.ideal == pytest.approx(forward.channels(twin.world(), spin, t), abs=2e-3)  # 0.2 with the tilt
    assert factory.measure(np.random.default_rng(7), effects).readings == pytest.approx(made.recording.readings)


def test_other_noise_is_that_of_a_factory_of_its_own(factory, twin):
    setting = Measurement(duration=20.0, bias_instability=0.02, tacho_noise=0.5)
    one = factory.with_noise(0.02, 0.5).measure(np.random.default_rng(3))
    other = WorldFactory(twin, setting).measure(np.random.default_rng(3))
    assert np.array_equal(one.readings, other.readings)
    assert np.array_equal(one.reference["tacho_rad_s"], other.reference["tacho_rad_s"])
    assert factory.with_noise(SETTING.bias_instability, SETTING.tacho_noise) is factory
