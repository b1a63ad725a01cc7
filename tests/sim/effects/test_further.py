"""The further effects of a rig, against MuJoCo, closed forms and their own definition."""

import numpy as np
import pytest
from scipy.signal import lsim, lti

from gfimu import AccelerometerArray, InputError
from gfimu.base import find_model
from sim import SpinState, forward, prescribed_readings
from sim.effects import EFFECTS, FURTHER_EFFECTS, SIMULATED_EFFECTS, make_effect
from sim.scenarios import Scenario
from sim.trials import random_profile
from sim.twin import Twin

ARRAY = AccelerometerArray.load("cube12")
TWIN = Twin(array=ARRAY, array_name="cube12")
T = np.arange(0.0, 20.0, 0.01)
WARM = 25.0 + 3.0 * (1.0 - np.exp(-T / 6.0))
MOTION = random_profile(np.random.default_rng(1), 20.0)
FURTHER = FURTHER_EFFECTS | {name: one for name, one in SIMULATED_EFFECTS.items() if name != "proof_mass"}
OF_REFERENCE = {name for name, family in FURTHER.items() if family.place == "reference"}
WHOLE_CUBE = {name for name, family in FURTHER.items() if family.place == "geometry"}


def usual(name, rng=None):
    """An effect of usual size, in its first shape."""
    family = FURTHER[name]
    sizes = np.array([size.prior_std for size in family.sizes(ARRAY)])
    if rng is not None:
        sizes = sizes * np.where([one.positive for one in family.sizes(ARRAY)], 1.0, rng.standard_normal(len(sizes)))
    return family.from_sizes(ARRAY, sizes, family.shapes(20.0, 100.0)[0])


def changes(*effects):
    before = TWIN.predict(MOTION, T, temperature=WARM)
    after = TWIN.predict(MOTION, T, effects=effects, temperature=WARM)
    return after[0] - before[0], after[1] - before[1]


@pytest.mark.parametrize("name", FURTHER)
def test_an_effect_comes_back_from_its_sizes_and_from_a_twin_file(name, tmp_path):
    effect = usual(name, np.random.default_rng(2))
    family = FURTHER[name]
    again = family.from_sizes(ARRAY, effect.size_values(ARRAY), effect.shape_values())
    assert again.parameters == pytest.approx(effect.parameters)
    effect.check(ARRAY)
    assert set(family.parameter_units(ARRAY)) >= set(effect.parameters)
    extended = TWIN.extended([effect])
    path = tmp_path / "twin.toml"
    path.write_text(extended.to_toml())
    for one, other in zip(
        Twin.load(path).predict(MOTION, T, temperature=WARM), extended.predict(MOTION, T, temperature=WARM), strict=True
    ):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", FURTHER)
def test_an_effect_acts_at_its_place_alone(name):
    channels, reference = changes(usual(name))
    if name in OF_REFERENCE:
        assert not channels.any()
        assert reference.any()
    else:
        assert channels.any()
        assert not reference.any()


@pytest.mark.parametrize("name", sorted(WHOLE_CUBE))
def test_mujoco_agrees_on_what_leans_and_shakes(name):
    """To the square of the lean: the forward model is linear in it."""
    effect = usual(name)
    t = T[::20]
    world = TWIN.world([effect])
    expected = prescribed_readings(world, MOTION, t)
    seen = forward.channels(world, MOTION, t)
    change = np.abs(expected - prescribed_readings(TWIN.world(), MOTION, t)).max()
    assert np.abs(seen - expected).max() < 0.02 * change


def test_a_slow_tachometer_is_a_first_order_filter():
    fine = np.arange(0.0, 20.0, 1e-3)
    rate = MOTION.at(fine).rate
    _, filtered, _ = lsim(lti([1.0], [0.05, 1.0]), rate - rate[0], fine)
    _, reference = TWIN.predict(MOTION, T, effects=[make_effect("tacho_lag", {"time_constant_s": 0.05})])
    np.testing.assert_allclose(reference, filtered[::10] + rate[0], atol=2e-3)


def test_one_slow_chip_leaves_the_others_alone():
    channels, _ = changes(make_effect("chip_lag", {"a2_s": 0.02}))
    slow, _ = changes(make_effect("sensor_lag", {"time_constant_s": 0.02}))
    mine = ARRAY.chip_of_channel == 1
    np.testing.assert_allclose(channels[:, mine], slow[:, mine], atol=1e-12)
    assert not channels[:, ~mine].any()


def test_a_bench_far_above_its_mode_sways_as_its_unbalance_turns():
    """Force m r ω² on a free mass M: it stays where the centre of both is, so that it moves by −m r / M."""
    t = np.arange(0.0, 10.0, 1e-3)
    spin = SpinState(20.0 * t, np.full_like(t, 20.0), np.zeros_like(t))
    size = 1e-3
    effect = make_effect("bench_sway", {"x_cosine_m": size, "frequency_hz": 0.3, "damping_ratio": 0.05})
    shaken = TWIN.world([effect]).shakes[0](spin, t)
    late = t > 8.0
    np.testing.assert_allclose(shaken[late, 0], (size * 400.0 * np.cos(spin.angle))[late], atol=0.05 * size * 400.0)
    assert not shaken[:, 1:].any()


def test_names_are_new():
    assert not set(FURTHER) & set(EFFECTS)


@pytest.mark.parametrize(
    ("place", "what", "dependence", "there"),
    [
        ("supply", "gain", "1", True),
        ("array", "arms", "omega^2", True),
        ("array", "stretches", "omega^2", False),
        ("supply", "gain", "theta", False),
    ],
)
def test_a_tumbling_body_has_no_table_whose_error_it_could_be(tmp_path, place, what, dependence, there):
    path = tmp_path / "tumble.toml"
    scenario = find_model("scenarios", "tumble").read_text(encoding="utf-8")
    numbers = "numbers = { scale = 1.0, first = 0.0 }, coefficients = [[0.1]]"
    table = f'place = "{place}", what = "{what}", dependence = "{dependence}", {numbers}'
    path.write_text(f'{scenario}\n[[effect]]\nname = "unlisted"\nparameters = {{ {table} }}\n')
    if there:
        assert [effect.name for effect in Scenario.load(path).effects] == ["unlisted"]
        return
    with pytest.raises(InputError, match=r".unlisted.: it is an error of a table or of its angle"):
        Scenario.load(path)
