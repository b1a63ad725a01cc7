"""Described errors: every kind of function comes back from a file, and wrong tables are refused in one line."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest
import tomli_w

from gfimu import AccelerometerArray, InputError
from gfimu.diagnosis import LocatedTerm, dependences
from gfimu.model import (
    ACCELERATION,
    FORCES,
    LocatedEffect,
    Mode,
    RigState,
    Wave,
    channel_place,
    dependence_of,
    rig_places,
)
from sim.effects import make_effect
from sim.scenarios import Scenario
from sim.simulation import simulate
from sim.trials import random_profile
from sim.twin import Twin

ARRAY = AccelerometerArray.load("cube12")
TWIN = Twin(array=ARRAY, array_name="cube12")
T = np.arange(0.0, 20.0, 0.01)
WARM = 25.0 + 3.0 * (1.0 - np.exp(-T / 6.0))
MOTION = random_profile(np.random.default_rng(1), 20.0)
STATE = RigState(T, MOTION.at(T), TWIN.predict(MOTION, T, temperature=WARM)[0], WARM, 0.01, TWIN.placed())
EVERY = {
    **dependences([STATE]),
    "order": Wave(7.3, 0.1, fastest=8.0),
    "mode": Mode(ACCELERATION, 3.0, 6.2, (0, 2), 0.05),
    "forced mode": Mode(FORCES[0], 30.0, 9.0, (2,)),
}
OFFSETS = channel_place("channel", "offset", ((4,), (0,)), ["a22", "a11"])


def effect_at(where, dependence, pattern="all"):
    count = LocatedTerm(where, dependence).count
    return LocatedEffect(where, dependence, pattern, 1e-3 * np.random.default_rng(3).standard_normal(count))


def again(effect, array=ARRAY):
    """The effect after a twin file has held it."""
    return LocatedEffect.of_parameters(tomllib.loads(tomli_w.dumps(effect.parameters)), array)


@pytest.mark.parametrize("dependence", [name for name in EVERY if name not in ("t", "f(t)")])
def test_a_function_of_any_kind_comes_back_from_a_file(dependence):
    effect = effect_at(OFFSETS, EVERY[dependence], "own")
    np.testing.assert_allclose(again(effect).added(STATE), effect.added(STATE), rtol=0, atol=1e-12)


@pytest.mark.parametrize("kind", ["offset", "gain", "delay"])
def test_an_error_of_channels_of_any_kind_comes_back_from_a_file(kind):
    """The gain of channels is another place than that of the supply, which all channels share."""
    where = channel_place("channel", kind, ((4,), (0,)), ["a22", "a11"])
    effect = effect_at(where, EVERY["t"], "own")
    np.testing.assert_allclose(again(effect).added(STATE), effect.added(STATE), rtol=0, atol=1e-12)


@pytest.mark.parametrize("what", rig_places(is_angle=False))
def test_an_error_at_any_place_of_the_rig_comes_back_from_a_file(what):
    effect = effect_at(rig_places(is_angle=False)[what], EVERY["omega^2"])
    np.testing.assert_allclose(again(effect).added(STATE), effect.added(STATE), rtol=0, atol=1e-12)


def test_the_error_of_an_angle_stays_one_of_an_angle():
    effect = effect_at(rig_places(is_angle=True)["late"], EVERY["1"])
    lateness = effect.coefficients[0]
    expected = MOTION.at(T - lateness).angle - STATE.spin.angle
    np.testing.assert_allclose(again(effect).added(STATE)[1:-1, -1], expected[1:-1], rtol=0, atol=1e-6)


@pytest.mark.parametrize("size", [3e-4, 0.2])
def test_what_is_late_is_read_at_another_time_however_late(size):
    """The first order of 0.2 s would be wrong by as much as the reading itself."""
    late = LocatedEffect(rig_places(is_angle=False)["late"], EVERY["1"], "all", np.array([size]))
    delay = LocatedEffect(channel_place("clock", "delay", ((3, 4, 5),), ["a2"]), EVERY["1"], "chip", np.array([size]))
    inside = np.abs(T - T.mean()) < 0.5 * np.ptp(T) - size
    expected = (MOTION.at(T - size).rate - STATE.spin.rate)[inside]
    np.testing.assert_allclose(late.added(STATE)[inside, -1], expected, rtol=0, atol=2e-6)
    ahead = TWIN.predict(MOTION, T + size, temperature=WARM)[0] - TWIN.predict(MOTION, T, temperature=WARM)[0]
    np.testing.assert_allclose(delay.added(STATE)[inside, 3:6], ahead[inside, 3:6], rtol=0, atol=2e-4)


@pytest.mark.parametrize("what", ["leans", "reads", "turns"])
def test_a_twin_has_the_error_beside_what_it_predicts(what, tmp_path):
    effect = effect_at(rig_places(is_angle=False)[what], EVERY["f(omega)"])
    twin = TWIN.extended([TWIN.described(effect.parameters)])
    path = tmp_path / "twin.toml"
    path.write_text(twin.to_toml())
    before, after = (one.predict(MOTION, T, temperature=WARM) for one in (TWIN, Twin.load(path)))
    change = np.column_stack([after[0] - before[0], after[1] - before[1]])
    np.testing.assert_allclose(change, effect.added(STATE), rtol=0, atol=1e-9)


def test_a_simulated_recording_has_it_on_its_channel_alone():
    effect = effect_at(channel_place("channel", "offset", ((4,),), ["a22"]), EVERY["1"], "one")
    scenario = Scenario.load("rest")
    hidden = make_effect("unlisted", {**effect.parameters, "coefficients": [[0.5]]}, scenario.array)
    plain, changed = (
        simulate(replace(scenario, effects=some), seed=1).readings.mean(axis=0) for some in ((), (hidden,))
    )
    np.testing.assert_allclose(changed - plain, 0.5 * np.eye(12)[4], rtol=0, atol=0.02)  # the chips' own axes


GOOD = effect_at(OFFSETS, EVERY["omega^2"], "own").parameters


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"what": "sings"}, "effect 'unlisted': .*sings"),
        ({"dependence": "omega^9"}, "effect 'unlisted': .*omega.9"),
        ({"dependence": "memory of luck"}, "effect 'unlisted': .*luck"),
        ({"series": ["a99", "a11"]}, "effect 'unlisted': .*a99"),
        ({"numbers": {"scale": 1.0}}, "effect 'unlisted': 'first' is missing"),
        ({"numbers": {"scale": "large", "first": 0.0}}, "effect 'unlisted': .*large"),
        (
            {"dependence": "f(omega)", "numbers": {"low": 0, "high": 1, "warp": 0, "functions": 10**9}},
            "1000000000 functions",
        ),
        ({"dependence": "revolution", "numbers": {"scale": 1.0, "harmonics": -3}}, "-3 functions, not 4 to 320"),
        ({"numbers": {"scale": 0.0, "first": 0.0}}, "scale = 0.0"),
        ({"numbers": {"scale": 1.0, "first": float("inf")}}, "first = inf"),
        (
            {
                "dependence": "mode at 5 Hz of alpha",
                "numbers": {"scale": 1.0, "frequency_hz": 5.0, "damping": 0.1, "outputs": [7]},
            },
            r"outputs = \(7,\)",
        ),
        ({"coefficients": [[1.0]]}, r"coefficients have shape \(1, 1\); give 2 × 1 numbers"),
        ({"coefficients": [[1.0], [float("nan")]]}, "coefficients have shape"),
        ({"coefficients": "none"}, "effect 'unlisted'"),
        ({"loudness": 1.0}, "unknown parameter 'loudness'"),
    ],
)
def test_a_wrong_table_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        make_effect("unlisted", {**GOOD, **changes}, ARRAY)


@pytest.mark.parametrize("key", ["place", "what", "dependence", "numbers", "coefficients"])
def test_a_missing_key_is_named(key):
    with pytest.raises(InputError, match=f"'{key}' is missing"):
        make_effect("unlisted", {name: value for name, value in GOOD.items() if name != key}, ARRAY)


def test_a_name_that_is_no_dependence_is_an_error():
    with pytest.raises(KeyError):
        dependence_of("f(luck)", {"low": 0.0, "high": 1.0, "warp": 0.0, "functions": 8})


def test_a_function_of_a_revolution_without_word_of_its_mean_has_none():
    """Twins of before the mean was a coefficient."""
    numbers = {"scale": 1.0, "harmonics": 8}
    old, new = (dependence_of("revolution", {**numbers, **more}) for more in ({}, {"mean": True}))
    assert (old.count, new.count) == (16, 17)
    np.testing.assert_array_equal(new.values(STATE)[:, :-1], old.values(STATE))
    np.testing.assert_array_equal(new.values(STATE)[:, -1], 1.0)


@pytest.mark.parametrize("where", [OFFSETS, rig_places(is_angle=False)["reads"]])
def test_a_twin_predicts_what_goes_with_the_temperature(where):
    effect = effect_at(where, EVERY["T"])
    extended = TWIN.extended([TWIN.described(effect.parameters)])
    warm, cold = (extended.predict(MOTION, T, temperature=some) for some in (WARM, None))
    plain = TWIN.predict(MOTION, T, temperature=WARM)
    np.testing.assert_allclose(np.column_stack(warm) - np.column_stack(plain), effect.added(STATE), rtol=0, atol=1e-9)
    at_rest = effect.added(replace(STATE, temperature=np.full(len(T), 25.0)))
    np.testing.assert_allclose(np.column_stack(cold) - np.column_stack(plain), at_rest, rtol=0, atol=1e-9)
