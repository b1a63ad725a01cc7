"""Located terms against the simulation's exact effects, which the terms must equal to first order."""

from __future__ import annotations

import numpy as np
import pytest
from no_name import Bent, Leaning, Sagging

from gfimu import AccelerometerArray
from gfimu.diagnosis import LocatedBasis, LocatedTerm, dependences, located_columns
from gfimu.model import LocatedEffect, RigState, Wave, channel_place, rig_places
from sim.effects import make_effect
from sim.trials import random_profile
from sim.twin import Twin

ARRAY = AccelerometerArray.load("cube12")
TWIN = Twin(array=ARRAY, array_name="cube12")
T = np.arange(0.0, 20.0, 0.01)
WARM = 25.0 + 3.0 * (1.0 - np.exp(-T / 6.0))
MOTION = random_profile(np.random.default_rng(1), 20.0)
STATE = RigState(T, MOTION.at(T), TWIN.predict(MOTION, T, temperature=WARM)[0], WARM, 0.01, TWIN.placed())
EVERY = dependences([STATE])
PLACES = rig_places(is_angle=False)
FASTEST, STEEPEST = np.abs(STATE.spin.rate).max(), np.abs(STATE.spin.acceleration).max()


def named(name, **parameters):
    return make_effect(name, parameters, ARRAY)


IN_THE_RIG = {
    "leans with rate²": ("omega^2", 0, FASTEST**2 * 1e-6, Leaning([1e-6, 0.0, 0.0], lambda spin: spin.rate**2)),
    "leans with α": ("alpha", 1, STEEPEST * 1e-6, Leaning([0.0, 1e-6, 0.0], lambda spin: spin.acceleration)),
    "moves": ("1", 0, 1e-4, named("eccentricity", x_m=1e-4)),
    "tilts": ("1", 1, 1e-4, named("table_tilt", y_rad=1e-4)),
    "gain": ("|omega|", 0, FASTEST * 1e-5, Sagging(1e-5, lambda spin: np.abs(spin.rate))),
    "reads": ("omega^3", 0, FASTEST**3 * 1e-5, Bent(1e-5, lambda spin: spin.rate**3)),
    "late": ("1", 0, 1e-3, named("tacho_latency", delay_s=1e-3)),
}


def change(effect):
    """What an effect of the simulation changes, (n, c + 1)."""
    before, after = (TWIN.predict(MOTION, T, temperature=WARM, effects=some) for some in ([], [effect]))
    return np.column_stack([after[0] - before[0], after[1] - before[1]])


def effect_of(term, coefficients):
    return LocatedEffect(term.where, term.dependence, term.pattern, coefficients)


def near(first_order, exact):
    """Whether a first order is that of an exact change, but for its ends, where derivatives are one-sided."""
    inner = slice(5, -5)
    error = np.sqrt(np.mean((first_order - exact)[inner] ** 2, axis=0).sum() / np.mean(exact[inner] ** 2, axis=0).sum())
    return float(error)


@pytest.mark.parametrize("case", IN_THE_RIG)
def test_a_place_in_the_rig_changes_what_the_exact_effect_changes(case):
    dependence, component, size, effect = IN_THE_RIG[case]
    term = LocatedTerm(PLACES[case.split(" ")[0]], EVERY[dependence])
    coefficients = np.zeros(term.count)
    coefficients[component] = size
    assert near(effect_of(term, coefficients).added(STATE), change(effect)) < 0.02


@pytest.mark.parametrize(
    ("kind", "dependence", "groups", "name", "parameters"),
    [
        ("offset", "1", ((4,),), "bias", {"a22_m_s2": 0.01}),
        ("gain", "1", ((4,),), "scale_factor", {"a22": 0.001}),
        ("delay", "1", ((3, 4, 5),), "chip_delay", {"a2_s": 1e-4}),
    ],
)
def test_an_error_of_channels_changes_what_the_exact_effect_changes(kind, dependence, groups, name, parameters):
    term = LocatedTerm(channel_place("channel", kind, groups, ["a22"]), EVERY[dependence], "one")
    coefficients = np.array([next(iter(parameters.values()))])
    assert near(effect_of(term, coefficients).added(STATE), change(named(name, **parameters))) < 0.02


def test_an_array_stretches_as_one_with_longer_arms():
    longer = 1e-5
    places = ARRAY.chip_positions * [1.0 + longer, 1.0 + longer, 1.0]
    stretched = TWIN.with_array(ARRAY.with_geometry(places, [chip.axes for chip in ARRAY.chips]))
    exact = stretched.predict(MOTION, T, temperature=WARM)[0] - STATE.readings
    added = effect_of(LocatedTerm(PLACES["stretches"], EVERY["1"]), np.array([longer])).added(STATE)
    assert near(added[:, :-1], exact) < 0.02


def test_a_leaning_array_is_one_that_is_tilted_and_moved():
    """The simulation tilts an array about its own centre; it leans about the foot of it."""
    tilt = 1e-4
    height = float(TWIN.cube_offset[2])
    leans = effect_of(LocatedTerm(PLACES["leans"], EVERY["1"]), np.array([0.0, tilt])).added(STATE)
    moves = effect_of(LocatedTerm(PLACES["moves"], EVERY["1"]), np.array([-tilt * height, 0.0, 0.0])).added(STATE)
    assert near(leans + moves, change(named("mount_tilt", y_rad=tilt))) < 0.02


@pytest.mark.parametrize("place", sorted({*PLACES} - {"late"}))
@pytest.mark.parametrize("dependence", ["f(omega)", "f(omega, alpha)", "revolution |omega|", "memory of alpha", "f(T)"])
def test_columns_are_the_derivative_by_the_coefficients(place, dependence):
    term = LocatedTerm(PLACES[place], EVERY[dependence])
    columns = located_columns(term, LocatedBasis(STATE), np.ones((len(T), 13)))
    rng = np.random.default_rng(3)
    sizes = rng.standard_normal(term.count)
    added = effect_of(term, term.where.usual * sizes).added(STATE)
    np.testing.assert_allclose(columns.times(sizes), added, rtol=0, atol=1e-9 * np.abs(added).max())


@pytest.mark.parametrize(
    "where",
    [PLACES["late"], channel_place("clock", "delay", ((0, 1, 2), (3, 4, 5)), ["a1", "a2"])],
    ids=["late", "delay"],
)
def test_columns_of_what_is_late_are_the_derivative_about_the_lateness(where):
    term, rng = LocatedTerm(where, EVERY["f(T)"]), np.random.default_rng(3)
    about, change = 0.05 * rng.standard_normal(term.count), 1e-3 * rng.standard_normal(term.count)
    columns = located_columns(term, LocatedBasis(STATE, about=effect_of(term, about)), np.ones((len(T), 13)))
    ends = [effect_of(term, about + sign * where.usual * change).added(STATE) for sign in (0.5, -0.5)]
    exact = ends[0] - ends[1]
    np.testing.assert_allclose(columns.times(change)[5:-5], exact[5:-5], rtol=0, atol=5e-3 * np.abs(exact).max())


def test_a_bench_shakes_as_the_exact_effect_does():
    amplitude, cycles = 1e-3, 7.3
    exact = change(named("bearing_shake", amplitude_m_s2_per_rad_s=amplitude, order=cycles, phase_rad=0.0))
    term = LocatedTerm(PLACES["shakes"], Wave(cycles, 0.1, fastest=1.0))
    coefficients = np.zeros(term.count)
    coefficients[-1] = amplitude  # the sine along the vertical
    assert near(effect_of(term, coefficients).added(STATE), exact) < 1e-9


def test_an_array_vibrates_as_a_bench_does_whose_direction_turns_with_the_table():
    (vibrates, *_), (along_x, along_y, _) = (PLACES[what].operators(STATE) for what in ("vibrates", "shakes"))
    cos, sin = (wave(STATE.spin.angle)[:, None] for wave in (np.cos, np.sin))
    turning = cos * along_x.of_value + sin * along_y.of_value
    np.testing.assert_allclose(vibrates.of_value, turning, rtol=0, atol=1e-12)


def test_a_smooth_function_can_be_any_of_its_regressor_and_goes_flat_beyond_what_was_seen():
    curve = EVERY["f(omega)"]
    wanted = np.tanh(STATE.spin.rate / 3.0)
    basis = curve.values(STATE)
    coefficients = np.linalg.lstsq(basis, wanted, rcond=None)[0]
    assert np.abs(basis @ coefficients - wanted).max() < 0.01
    ends = curve.at(np.array([curve.high, 2.0 * curve.high])) @ coefficients
    assert ends[0] == pytest.approx(ends[1])


def test_the_table_turns_otherwise_as_the_motion_itself_does():
    """A wave of the angle that is added to the motion changes channels and reference as its operator says."""
    step = 1e-6

    class Turned:
        def at(self, t):
            spin = MOTION.at(t)
            wave, rate = step * np.sin(2.0 * t), 2.0 * step * np.cos(2.0 * t)
            return type(spin)(spin.angle + wave, spin.rate + rate, spin.acceleration - 4.0 * wave)

    before, after = (TWIN.predict(motion, T, temperature=WARM) for motion in (MOTION, Turned()))
    exact = np.column_stack([after[0] - before[0], after[1] - before[1]])
    of_value, of_rate, of_acceleration = PLACES["turns"].operators(STATE)[0].parts
    wave = step * np.sin(2.0 * T)[:, None]
    added = of_value * wave + of_rate * 2.0 * step * np.cos(2.0 * T)[:, None] - of_acceleration * 4.0 * wave
    assert near(added, exact) < 1e-3
