"""The foreign worlds: every effect changes what it should and nothing else, by two generators that agree."""

import ast
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from every_item import every
from foreign_world import (
    CASES,
    SIZES,
    _campaign_motion,
    _held_by_bristles,
    _sensed,
    hide,
    hide_in_campaign,
    in_turning_frame,
    new_recording,
)

from gfimu import AccelerometerArray
from sim import SplineSpin, forward
from sim.effects import EFFECTS
from sim.trials import draw_world
from sim.trials.benchmark import generators
from sim.trials.benchmark.generators.foreign_effects import (
    FOREIGN,
    PLACES,
    STAGES,
    Motion,
    Places,
    acting,
    by_positions,
    noise_free,
)
from sim.trials.benchmark.generators.foreign_world import distance, sized, table_motion
from sim.trials.benchmark.generators.independent_effects import CHANNELS, DRAWS, EXOTICS
from sim.trials.benchmark.generators.independent_world import Setting
from sim.trials.study.cases import Case
from sim.twin import Twin

FOLDER = Path(generators.__file__).parent
PLAN = Setting(duration=4.0)
T = np.arange(400) / 100
MOVING = [name for name, effect in FOREIGN.items() if effect.stage == "places"]
SHAKEN_APART = {"loose_chip", "stretch_in_plane"}
BY_CHANCE = {"loose_chip"}  # impacts: its d′ jumps with the gap
GENERATORS = (hide, hide_in_campaign)


@cache
def table() -> Motion:
    return table_motion(1, 0, PLAN)[0]


@cache
def typical(name):
    return {name: FOREIGN[name].draw(np.random.default_rng(5), PLAN)}


def test_an_effect_has_a_place_and_says_what_it_depends_on():
    assert len(FOREIGN) >= 26
    assert {effect.place for effect in FOREIGN.values()} == set(PLACES)
    assert {effect.stage for effect in FOREIGN.values()} == set(STAGES)
    assert all(effect.dependence for effect in FOREIGN.values())


def test_no_name_is_one_of_a_library_and_kin_are():
    assert not set(FOREIGN) & (set(EFFECTS) | set(DRAWS))
    assert set(FOREIGN) & set(EXOTICS) == {"stick_slip"}  # the same physics, drawn anew
    assert {name for effect in FOREIGN.values() for name in effect.kin} <= set(EFFECTS)


@every("file", sorted(FOLDER.glob("*.py")))
def test_generators_share_no_code_with_the_project(file):
    tree = ast.parse(file.read_text(encoding="utf-8"))
    modules = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    modules |= {name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names}
    own = {name for name in modules if name.split(".")[0] in {"sim", "gfimu", "firmware_bridge"}}
    assert all(name.startswith("sim.trials.benchmark.generators.") for name in own)


@pytest.mark.parametrize("name", FOREIGN)
def test_an_effect_changes_what_it_should_and_nothing_else(name):
    effect, run = FOREIGN[name], table()
    hidden = typical(name)
    stamps, times, channels, tacho = noise_free(run, T, hidden)
    _, still, ideal, rate = noise_free(run, T, {})
    for act, one in acting(hidden, "noise"):
        channels = act(one, run, times, channels)
    changed = np.abs(channels - ideal).max(axis=0) > 1e-6
    assert (tacho != rate).any() == (effect.place in {"reference", "host"} and name != "late_from_then")
    assert changed.any() == (effect.stage not in {"reference", "drive"} and name not in {"stamp_jitter", "burst_reads"})
    assert (times != still).any() == (effect.stage == "times" and np.array_equal(stamps, T))
    assert np.all(np.diff(stamps) > 0)
    touched = [key for key in hidden[name] if key[:3] in CHANNELS]
    if touched:
        assert set(np.array(CHANNELS)[changed]) == {key[:3] for key in touched}
    if "channel" in hidden[name] or "chip" in hidden[name]:
        chip = hidden[name].get("channel", hidden[name].get("chip"))[:2]
        assert {channel[:2] for channel in np.array(CHANNELS)[changed]} == {chip}


@pytest.mark.parametrize("name", sorted(set(MOVING) - SHAKEN_APART))
def test_a_cube_that_moves_as_a_whole_is_rigid(name):
    still, run = Places.at_rest(), table()
    places = FOREIGN[name].act(typical(name)[name], run, still)
    assert np.abs(places.lab).max() > 0 or np.abs(places.arms - still.arms).max() > 0
    bodies = [np.concatenate([one.arms, one.axes.reshape(-1, 12, 3)], axis=1) for one in (places, still)]
    products = [body @ body.swapaxes(1, 2) for body in bodies]
    np.testing.assert_allclose(*np.broadcast_arrays(*products), atol=1e-12)


def test_heights_stay_where_arms_grow_in_the_plane():
    places = FOREIGN["stretch_in_plane"].act({"stretch_s2_rad2": 1e-3}, table(), Places.at_rest())
    grown = places.arms / Places.at_rest().arms
    np.testing.assert_allclose(grown[..., 0], np.broadcast_to(1 + 1e-3 * table().rate[:, None] ** 2, grown.shape[:2]))
    np.testing.assert_allclose(grown[..., 2], 1.0)


@pytest.mark.parametrize("name", [name for name, effect in FOREIGN.items() if not effect.sizeless])
def test_the_size_is_reached(name):
    effect, unit = FOREIGN[name], typical(name)[name]
    parameters = sized(name, unit, 100.0, PLAN, table())
    assert {key: parameters[key] for key in effect.shape} == {key: unit[key] for key in effect.shape}
    reached = distance({name: parameters}, PLAN, table())
    at_most = effect.most and abs(parameters[effect.most[0]]) >= 0.999 * effect.most[1]
    assert (at_most and reached < 100) or reached == pytest.approx(100, rel=0.4 if name in BY_CHANCE else 0.03)


@pytest.mark.parametrize("name", MOVING)
def test_both_generators_agree_on_what_a_movement_reads(name):
    for run in (table(), _campaign_motion(1, 0, PLAN)[0]):
        places, still = FOREIGN[name].act(typical(name)[name], run, Places.at_rest()), Places.at_rest()
        one, other = (read(run, places) - read(run, still) for read in (by_positions, in_turning_frame))
        inner = slice(20, -20)
        assert np.std((one - other)[inner]) < 0.03 * np.std(one[inner])


def test_both_generators_agree_on_a_table_without_effects():
    run, _ = _campaign_motion(1, 0, PLAN)
    readings = by_positions(run, Places.at_rest())
    np.testing.assert_allclose(readings[20:-20], run.readings[20:-20], atol=1e-5)
    through = SplineSpin.through(table().t, table().rate)
    np.testing.assert_allclose(
        _sensed(through, table().t, (0,))[0].readings[50:-50], table().readings[50:-50], atol=0.02
    )


def test_a_late_chip_is_late_as_in_a_world_of_the_simulation():
    run, spin = _campaign_motion(1, 0, PLAN)
    hidden = {"late_chip": {"chip": "a3", "delay_s": 0.004}}
    world = Twin(AccelerometerArray.load("cube12")).world().changed(chip_delay=np.array([0, 0, -0.004, 0]))
    np.testing.assert_allclose(noise_free(run, T, hidden)[2], forward.channels(world, spin, T), atol=1e-6)


@cache
def steady(rate) -> Motion:
    t = np.arange(0.0, 30.0, 1e-3)
    return Motion(t, rate * t, rate + 0 * t, 0 * t, np.zeros((len(t), 12)), 25 + 0 * t)


def added(name, parameters, run):
    """What an effect adds to the readings after 20 s, at the chips' axes x, y, z of the cube."""
    places = FOREIGN[name].act(parameters, run, Places.at_rest())
    return (by_positions(run, places) - by_positions(run, Places.at_rest()))[20_000:-20]


def test_a_bench_sways_as_far_as_a_mode_does_at_a_steady_rate():
    rate, natural, damping = 10.0, 2 * np.pi * 2.0, 0.05
    one = {"unbalance_m": 1e-3, "azimuth_rad": 0.4, "phase_rad": 1.0, "frequency_hz": 2.0, "damping_ratio": damping}
    swayed = 1e-3 * rate**2 / abs(natural**2 - rate**2 + 2j * damping * natural * rate)
    x, y, z = added("bench_sway", one, steady(rate))[:, :3].T
    assert np.hypot(x, y).max() == pytest.approx(swayed * rate**2, rel=0.01)
    assert np.abs(z).max() < 1e-9


def test_a_bearing_shakes_by_the_square_of_its_order():
    for rate in (4.0, 8.0):
        shaken = added("bearing_shake", {"amplitude_m": 1e-5, "order": 3.3, "phase_rad": 0.0}, steady(rate))
        assert np.abs(shaken[:, 2]).max() == pytest.approx(1e-5 * (3.3 * rate) ** 2, rel=1e-3)
        assert np.abs(shaken[:, :2]).max() < 1e-6


def test_a_leaning_cube_reads_gravity_and_a_sunken_bench_reads_it_in_turn():
    leant = added("lean_with_rate", {"lean_s2_rad": 1e-4, "azimuth_rad": 0.0}, steady(5.0))
    lean, height = 25e-4, 0.11  # of the first chip, m: what is moved outwards reads centripetal force
    assert leant[0, 1] == pytest.approx(9.80665 * lean + 25.0 * lean * height, rel=0.02)
    one = {"lean_rad": 1e-3, "azimuth_rad": 0.0, "time_constant_s": 1.0}
    sunk = added("sinking_bench", one, steady(2.0))
    assert np.hypot(sunk[:, 0], sunk[:, 1]) == pytest.approx(9.80665e-3, rel=0.02)


def test_friction_holds_the_table_and_hides_nothing():
    run, spin = _campaign_motion(1, 0, PLAN)
    held, _ = _sensed(_held_by_bristles({"coulomb_N_m": 0.15}, spin, run.t), run.t, run.seed)
    gripped = table_motion(1, 0, PLAN, 0.15)[0]
    assert np.abs(held.rate - run.rate).max() > 0.01
    assert np.abs(gripped.rate - table().rate).max() > 0.01
    inner = slice(50, -50)
    left = by_positions(gripped, Places.at_rest()) - gripped.readings
    assert np.median(np.abs(left[inner])) < 1e-3  # what a table reads whose motion the tachometer tells


@pytest.mark.parametrize("generator", GENERATORS)
def test_a_seed_draws_the_same_world_and_a_new_recording_of_it_another_run(generator):
    hidden = ("floor_vibration",)
    first, same = (generator(4, hidden, 200.0, duration=4.0) for _ in range(2))
    more = new_recording(4, hidden, 200.0, generator=generator, duration=4.0)
    other = generator(5, hidden, 200.0, duration=4.0)
    assert all(np.array_equal(first.columns[name], same.columns[name]) for name in first.columns)
    assert first.truth == same.truth == more.truth
    assert first.truth != other.truth
    assert first.detectability == pytest.approx(200, rel=0.03)
    for column in ("tacho_rad_s", "a11_m_s2", "temperature_degC"):
        assert not np.array_equal(first.columns[column], more.columns[column])


@pytest.mark.parametrize("generator", GENERATORS)
@pytest.mark.parametrize("name", ["tacho_offset", "stamp_jitter", "rate_noise", "rocking_foot", "bearing_friction"])
def test_a_study_draws_them(generator, name):
    source = f"{Path(__file__).parent / 'foreign_world.py'}:{generator.__name__}"
    world = draw_world(Case("foreign", 1, (name,), 150.0, duration=4.0), source)
    assert [effect for effect, _ in world.truth] == [name]
    assert len(world.recording) == 400
    assert np.isfinite(world.recording.readings).all()


@pytest.mark.parametrize("generator", GENERATORS)
def test_cases_have_every_effect_on_every_kind_of_profile(generator):
    cases = CASES[generator.__name__]
    assert {(*case.effects, case.seed % 3) for case in cases} == {(name, kind) for name in FOREIGN for kind in range(3)}
    assert len({case.seed for one in CASES.values() for case in one}) == len(CASES) * len(cases)
    for name, effect in FOREIGN.items():
        assert {case.size for case in cases if case.effects == (name,)} == ({0.0} if effect.sizeless else set(SIZES))
