"""Checks of a recording against its array: wrong files are refused with the cause, right ones never."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gfimu import AccelerometerArray, InputError, Recording, estimate, estimate_from_rest, specific_force
from gfimu.array import PartLimits
from gfimu.base import STANDARD_GRAVITY, list_models
from gfimu.recording import doubts_of, open_run
from gfimu.recording.doubts.judge import refuse_or_warn
from sim.scenarios import Scenario
from sim.simulation import simulate
from sim.trials.benchmark.generators.independent_world import hide

CUBE = AccelerometerArray.load("cube12")
RATE = 100.0
MOTIONS = ("table", "spin", "spin upright", "tumble", "fall", "hand", "still")
NAMES_TO_MOTIONS = {
    "corners8": "tumble",
    "mimu4444": "hand",
    "nap_3_2_2_2": "table",
    "p1_face_diagonals": "tumble",
    "p2_face_centres": "spin",
    "p3_three_plus_one": "tumble",
}


def turning(rng, kind, t):
    """Rate (n, 3), rad/s."""
    rate = np.zeros((len(t), 3))
    if kind == "table":
        speeds = np.repeat(rng.uniform(-8.0, 8.0, 2), 2)
        rate[:, 2] = np.interp(t, [0, 3, 4, 7, 8, 11, 13, 15], [0, 0, *speeds, 0, 0])
    elif kind == "spin":
        rate += rng.normal(size=3) * rng.uniform(2.0, 8.0)
    elif kind == "spin upright":
        rate[:, 2] = rng.uniform(2.0, 20.0)
    elif kind != "still":
        size, fastest = (8.0, 3.0) if kind == "hand" else (3.0, 1.5)
        frequency, phase, swing = rng.uniform(0.1, 1, (3, 5, 3)) * np.array([fastest, 2 * np.pi, size])[:, None, None]
        rate = np.sum(swing * np.sin(2 * np.pi * frequency * t[:, None, None] + phase), axis=1)
    return rate


def world(rng, name="cube12", kind="table", errors="typical"):
    """A recording of 15 s by chips with errors of some size, and its array."""
    array = AccelerometerArray.load(name)
    t = np.arange(1500) / RATE
    rate = turning(rng, kind, t)
    upright = kind in {"table", "spin upright"}
    attitude = Rotation.identity() if upright else Rotation.random(random_state=int(rng.integers(1 << 30)))
    up = np.empty((len(t), 3))
    now = attitude.inv().apply([0.0, 0.0, 1.0])
    for row, back in enumerate(Rotation.from_rotvec(-rate / RATE).as_matrix()):
        up[row] = now
        now = back @ now
    force = (0.0 if kind == "fall" else STANDARD_GRAVITY) * up
    sheet = PartLimits.of(array, RATE)
    real, size = array, array.n_channels
    if errors != "none":
        places = array.chip_positions + rng.normal(0, 5e-4, array.chip_positions.shape)
        turned = [Rotation.from_rotvec(rng.uniform(-0.03, 0.03, 3)).apply(chip.axes) for chip in array.chips]
        real = array.with_geometry(places, turned)
    readings = specific_force(real, force, np.gradient(rate, t, axis=0), rate)
    if errors == "typical":
        readings = readings * (1 + 0.01 * rng.standard_normal(size)) + 0.25 * sheet.bias * rng.standard_normal(size)
    elif errors == "limits":
        readings = readings * rng.uniform(0.905, 1.095, size) + 0.97 * sheet.bias * rng.choice([-1, 1], size)
    elif errors == "alike":
        readings = readings * 1.095 + 0.97 * sheet.bias
    if errors != "none":
        readings = np.round((readings + sheet.noise * rng.standard_normal(readings.shape)) / sheet.lsb) * sheet.lsb
    reference = {"tacho_rad_s": rate[:, 2]} if upright else {}
    metadata = {"mounting_rotvec_rad": [0, 0, 0]} if upright else {}
    return Recording.from_arrays(t, readings, array, reference=reference, metadata=metadata), array


BOARD = """name = "board"
length_unit_m = 0.05
""" + "".join(
    f"""
[[chip]]
part = "adxl345"
position_m = [{x}, {y}, 0.0]
axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
"""
    for x, y in ((0.04, 0.03), (0.04, -0.03), (-0.04, 0.03), (-0.04, -0.03))
)


def with_columns(run, change):
    readings = run.readings.copy()
    change(readings)
    return replace(run, readings=readings)


def exchanged(one, two):
    def change(readings):
        readings[:, [one, two]] = readings[:, [two, one]]

    return change


def scaled(columns, factor):
    def change(readings):
        readings[:, columns] *= factor

    return change


def held(column, value):
    def change(readings):
        readings[:, column] = value

    return change


def copied(readings):
    readings[:, 1] = readings[:, 0]


G = STANDARD_GRAVITY
WRONG = {
    "milliseconds": (lambda run: replace(run, t_s=1e3 * run.t_s), "time", "milliseconds"),
    "microseconds": (lambda run: replace(run, t_s=1e6 * run.t_s), "time", "microseconds"),
    "all in g": (lambda run: replace(run, readings=run.readings / G), "unit", "all readings are in g"),
    "all in mg": (lambda run: replace(run, readings=1e3 * run.readings / G), "unit", "all readings are in mg"),
    "counts": (lambda run: replace(run, readings=run.readings / 0.038245935), "unit", "all readings are in counts"),
    "one chip in g": (lambda run: with_columns(run, scaled([3, 4, 5], 1 / G)), "chip_unit", "chip a2 reads in g"),
    "a22 alone in g": (lambda run: with_columns(run, scaled([4], 1 / G)), "chip_unit", "channel a22 reads in g"),
    "a11 and a12": (lambda run: with_columns(run, exchanged(0, 1)), "exchange", "a11 and a12 are exchanged"),
    "a11 and a13": (lambda run: with_columns(run, exchanged(0, 2)), "exchange", "a11 and a13 are exchanged"),
    "a12 and a32": (lambda run: with_columns(run, exchanged(1, 7)), "exchange", "a12 and a32 are exchanged"),
    "copied": (lambda run: with_columns(run, copied), "duplicate", "a11 and a12 hold the same values"),
    "a11 inverted": (lambda run: with_columns(run, scaled([0], -1)), "sign", "a11 is inverted"),
    "a23 inverted": (lambda run: with_columns(run, scaled([5], -1)), "sign", "a23 is inverted"),
}


@pytest.fixture(scope="module")
def table_run():
    t = np.arange(2400) / RATE
    rate = np.interp(t, [0, 3, 4, 8, 9, 13, 14.5, 16, 17, 21, 22.5, 24], [0, 0, 2, 2, 4, 4, 0, 0, -3, -3, 0, 0])
    rng = np.random.default_rng(5)
    axis = np.array([0.0, 0.0, 1.0])
    readings = specific_force(
        CUBE, G * np.tile(axis, (len(t), 1)), np.outer(np.gradient(rate, t), axis), np.outer(rate, axis)
    )
    sheet = PartLimits.of(CUBE, RATE)
    readings = readings * (1 + 0.01 * rng.standard_normal(12)) + 0.3 * rng.standard_normal(12)
    readings = readings + sheet.noise * rng.standard_normal(readings.shape)
    return Recording.from_arrays(t, readings, CUBE, metadata={"mounting_rotvec_rad": [0, 0, 0]})


@pytest.mark.parametrize("seed", [3005, 3008, 3009])
def test_a_short_run_of_uncalibrated_chips_is_accepted(seed):
    """One rest, then a spin: the α that biases read there adds up to many times the rate, unless it is taken off."""
    run = simulate(Scenario.load("paper_run", changes=["duration_s=10"]), seed=seed)
    assert not doubts_of(run, CUBE)


@pytest.mark.study(only=["a11 and a12", "a11 and a13", "a11 inverted"])
@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_file_is_refused_with_its_cause(table_run, name):
    spoil, kind, words = WRONG[name]
    wrong = spoil(table_run)
    found = doubts_of(wrong, CUBE)
    assert [(one.kind, one.refused) for one in found] == [(kind, True)]
    assert words in found[0].text
    assert "\n" not in found[0].text
    with pytest.raises(InputError, match=r"--force"):
        refuse_or_warn(found)
    assert refuse_or_warn(found, force=True) == found


TWICE = {
    "one chip in g, two channels exchanged": (
        [scaled([3, 4, 5], 1 / G), exchanged(0, 1)],
        "chip_unit",
        ["chip a2 reads in g", "a11 and a12 are exchanged"],
    ),
    "all in g, one inverted": (
        [scaled(list(range(12)), 1 / G), scaled([0], -1)],
        "unit",
        ["all readings are in g", "a11 is inverted"],
    ),
    "two inverted": ([scaled([0], -1), scaled([8], -1)], "sign", ["a11 is inverted", "a33 is inverted"]),
}


@pytest.mark.study(only=["two inverted"])
@pytest.mark.parametrize("name", TWICE)
def test_two_things_wrong_at_once_are_both_named(table_run, name):
    changes, kind, words = TWICE[name]
    wrong = table_run
    for change in changes:
        wrong = with_columns(wrong, change)
    found = doubts_of(wrong, CUBE)
    assert [(one.kind, one.refused) for one in found] == [(kind, True)]
    assert all(word in found[0].text for word in words), found[0].text


def test_another_array_is_named(table_run):
    built = AccelerometerArray.load("cube12_as_built")
    found = doubts_of(table_run, built)
    assert [(one.kind, one.refused) for one in found] == [("array", True)]
    assert "--array cube12" in found[0].text


@pytest.mark.parametrize(
    ("change", "cause"),
    [(scaled([0], -1), "channel a11 is inverted"), (exchanged(0, 4), "channels a11 and a22 are exchanged")],
)
def test_an_array_that_nothing_can_contradict_is_no_explanation(tmp_path, change, cause):
    """The cube has no combination that is free of all motion: it has no residual there, whatever the readings are."""
    (tmp_path / "board.toml").write_text(BOARD)
    board = AccelerometerArray.load(tmp_path / "board.toml")
    t = np.arange(2400) / RATE
    rate = np.where(t > 4.0, 6.0 * np.sin(0.7 * (t - 4.0)), 0.0)
    axis = np.array([0.0, 0.0, 1.0])
    angle = np.cumsum(rate) / RATE
    up = np.column_stack([0.005 * np.cos(angle), -0.005 * np.sin(angle), np.ones(len(t))])  # the table leans
    readings = specific_force(board, G * up, np.outer(np.gradient(rate, t), axis), np.outer(rate, axis))
    run = Recording.from_arrays(t, readings + 0.03 * np.random.default_rng(5).standard_normal(readings.shape), board)
    assert doubts_of(run, board) == ()
    (found,) = doubts_of(with_columns(run, change), board)
    assert found.refused
    assert cause in found.text


def test_a_rate_other_than_the_stated_one_is_refused(table_run):
    stated = replace(table_run, metadata={"sample_rate_hz": 100.0})
    assert doubts_of(stated, CUBE) == ()
    (found,) = doubts_of(replace(stated, t_s=1e3 * stated.t_s), CUBE)
    assert found.refused
    assert "milliseconds" in found.text
    (other,) = doubts_of(replace(stated, metadata={"sample_rate_hz": 50.0}), CUBE)
    assert not other.refused
    assert "50 Hz" in other.text


def test_force_keeps_the_warning(table_run):
    wrong = replace(table_run, readings=table_run.readings / G)
    with pytest.raises(InputError, match="all readings are in g"):
        estimate(wrong, CUBE)
    found = estimate(wrong, CUBE, force=True)
    assert len(found.metadata["warnings"]) == 1
    assert "all readings are in g" in found.metadata["warnings"][0]


@pytest.mark.parametrize("fault", ["missing", "stuck"])
@pytest.mark.parametrize("solve", [estimate, estimate_from_rest])
def test_a_dead_channel_is_named_and_left_out(table_run, fault, solve):
    hurt = with_columns(
        table_run, lambda readings: readings.__setitem__((slice(None), 4), np.nan if fault == "missing" else 1.5)
    )
    found = solve(hurt, CUBE, method="filter")
    assert found.metadata["channels_left_out"] == ["a22"]
    assert "a22" in found.metadata["warnings"][0]
    whole = solve(table_run, CUBE, method="filter")
    assert np.sqrt(np.mean((found.omega - whole.omega) ** 2)) < 0.1


def test_perfect_sensors_are_not_taken_for_dead_ones():
    t = np.arange(500) / RATE
    run = Recording.from_arrays(
        t, specific_force(CUBE, [[0, 0, G]] * 500, np.zeros((500, 3)), np.zeros((500, 3))), CUBE
    )
    assert doubts_of(run, CUBE) == ()


@pytest.mark.parametrize(
    ("name", "kind"),
    [("cube12", kind) for kind in MOTIONS] + [(name, NAMES_TO_MOTIONS[name]) for name in NAMES_TO_MOTIONS],
)
@pytest.mark.parametrize("errors", ["none", "limits", "alike"])
def test_errors_within_the_data_sheet_are_not_refused(name, kind, errors):
    run, array = world(np.random.default_rng([MOTIONS.index(kind), len(errors)]), name, kind, errors)
    assert not [one.text for one in doubts_of(run, array) if one.refused]


@pytest.mark.study(only=["centrifuge", "eccentric_mount", "speed_sweep"])
@pytest.mark.parametrize("name", list_models("scenarios"))
def test_shipped_scenarios_are_clean(name):
    scenario = Scenario.load(name)
    assert doubts_of(simulate(scenario, seed=3), scenario.array) == ()


@pytest.mark.study(only=["2"])
@pytest.mark.parametrize("seed", range(4))
def test_hidden_effects_are_not_refused(seed):
    effects = [(), ("table_tilt", "bias"), ("scale_factor", "misalignment"), ("eccentricity", "sensor_lag")][seed]
    columns = dict(hide(seed, effects, duration=20.0).columns)
    readings = np.column_stack([columns[f"{name}_m_s2"] for name in CUBE.channels])
    reference = {"tacho_rad_s": columns["tacho_rad_s"]}
    run = Recording.from_arrays(columns["t_s"], readings, CUBE, reference=reference)
    assert not [one.text for one in doubts_of(run, CUBE) if one.refused]


@pytest.mark.parametrize("name", ["exp_1", "exp_2"])
def test_real_hand_motion_is_not_refused(shared_data, name):
    recording, array = open_run(shared_data / "mimu4444" / f"{name}.bin.gz")
    assert not [one.text for one in doubts_of(recording, array) if one.refused]
    one_chip = with_columns(recording, scaled([6, 7, 8], 1 / G))
    assert [one.kind for one in doubts_of(one_chip, array) if one.refused] == ["chip_unit"]


def test_a_rest_bias_beyond_the_data_sheet_is_refused(table_run):
    assert "rest_bias_m_s2" in estimate_from_rest(table_run, CUBE).metadata
    wrong = with_columns(table_run, lambda readings: readings.__setitem__((slice(None), 4), readings[:, 4] + 0.3 * G))
    with pytest.raises(
        InputError, match=r"channel a22 of array 'cube12' reads \+[23]\d\d mg beyond gravity .* allows 175 mg"
    ):
        estimate_from_rest(wrong, CUBE)
    assert "a22" in estimate_from_rest(wrong, CUBE, force=True).metadata["warnings"][0]


@pytest.mark.parametrize(("one", "two"), [(0, 1), (0, 2)])
def test_two_axes_exchanged_on_every_chip_are_named_by_the_tachometer(table_run, one, two):
    """The cube's mirror image is itself with two chips exchanged: only the sign of the turning decides."""
    order = np.arange(12).reshape(4, 3)
    order[:, [one, two]] = order[:, [two, one]]
    rate = np.interp(
        table_run.t_s, [0, 3, 4, 8, 9, 13, 14.5, 16, 17, 21, 22.5, 24], [0, 0, 2, 2, 4, 4, 0, 0, -3, -3, 0, 0]
    )
    run = replace(table_run, reference={"tacho_rad_s": rate})
    assert doubts_of(run, CUBE) == ()
    (found,) = doubts_of(replace(run, readings=run.readings[:, order.ravel()]), CUBE)
    assert (found.kind, found.refused) == ("exchange", True)
    assert f"axes {one + 1} and {two + 1} of every chip are exchanged" in found.text
    pair = [3 * chip + axis for chip in ({1: (1, 2), 2: (1, 3)}[two]) for axis in range(3)]
    (found,) = doubts_of(with_columns(run, exchanged(pair, pair[3:] + pair[:3])), CUBE)
    assert found.text.startswith(f"chips a2 and a{two + 2} are exchanged")
