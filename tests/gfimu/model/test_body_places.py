"""Errors at the places of a free body, against the prediction of a body that has them."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest
import tomli_w

from gfimu import AccelerometerArray, InputError
from gfimu.model import LocatedEffect, RigState, VectorForm, body_places, channel_place, dependence_of, rig_places
from gfimu.motion import BodyDrive
from sim.twin import Twin

ARRAY = AccelerometerArray.load("cube12")
TWIN = Twin(array=ARRAY, array_name="cube12", drive_source="gyro")
T = np.arange(0.0, 8.0, 0.005)
PHASES = np.array([0.3, 1.1, 2.0])
RATE = 4.0 * np.sin(np.outer(T, [1.3, 0.9, 1.7]) + PHASES)
FORCE = 8.0 * np.cos(np.outer(T, [0.7, 1.1, 0.4]) + PHASES)
INSIDE = slice(20, -20)  # derivatives at the ends are one-sided


def read(rate, force=FORCE, array=ARRAY):
    """What the chips of a body read, m/s²."""
    return replace(TWIN, array=array).predict_body(BodyDrive(T, rate, force), T)


READINGS = read(RATE)
STATE = RigState.of_body(ARRAY, BodyDrive(T, RATE, FORCE), T, READINGS, None)


def added(what, dependence, coefficients, state=STATE):
    effect = LocatedEffect(body_places()[what], dependence, "all", np.array(coefficients))
    again = LocatedEffect.of_parameters(tomllib.loads(tomli_w.dumps(effect.parameters)), ARRAY)
    np.testing.assert_allclose(again.added(state), effect.added(state), rtol=0, atol=1e-12)
    return effect.added(state)[:, :-1]


def test_a_gyro_that_reads_by_the_force_has_the_body_turn_less():
    mixing = 1e-5 * np.array([[2.0, 0.0, 1.0], [0.0, -1.0, 0.0], [3.0, 0.0, 0.0]])  # rad/s per m/s²
    change = read(RATE - FORCE @ mixing.T) - READINGS
    found = added("gyro", VectorForm("force vector", 2.0), (2.0 * mixing).ravel())
    np.testing.assert_allclose(found[INSIDE], change[INSIDE], rtol=0, atol=0.01 * np.abs(change).max())


def test_a_gyro_that_is_late_has_the_body_turn_ahead_of_it():
    change = read(4.0 * np.sin(np.outer(T + 1e-4, [1.3, 0.9, 1.7]) + PHASES)) - READINGS
    found = added("gyro late", dependence_of("1", {"scale": 1.0, "first": 0.0}), [1e-4])
    np.testing.assert_allclose(found[INSIDE], change[INSIDE], rtol=0, atol=0.01 * np.abs(change).max())


def test_arms_that_stretch_read_more_of_the_turning_and_nothing_of_the_force():
    longer = AccelerometerArray(
        "longer", tuple(replace(chip, position=chip.position * (1.0 + 1e-3)) for chip in ARRAY.chips)
    )
    change = read(RATE, array=longer) - READINGS
    found = added("arms", dependence_of("1", {"scale": 1.0, "first": 0.0}), [1e-3])
    np.testing.assert_allclose(found[INSIDE], change[INSIDE], rtol=0, atol=0.01 * np.abs(change).max())


def test_a_gain_of_all_channels_goes_with_their_readings():
    found = added("gain", dependence_of("1", {"scale": 1.0, "first": 0.0}), [1e-3])
    np.testing.assert_allclose(found, 1e-3 * READINGS, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    "name", ["omega vector", "omega products", "omega cubes", "alpha vector", "force vector", "force change"]
)
def test_a_channel_may_go_with_each_component_of_the_motion(name):
    form = VectorForm(name, 3.0)
    expected = {
        "omega vector": RATE,
        "omega products": np.column_stack([RATE[:, [0]] * RATE, RATE[:, [1]] * RATE[:, 1:], RATE[:, 2:] ** 2]),
        "alpha vector": np.gradient(RATE, T, axis=0),
        "force vector": FORCE,
        "force change": FORCE - FORCE[0],
        "omega cubes": RATE**3,
    }[name]
    values = 3.0 * form.values(STATE)
    assert values.shape == expected.shape
    largest = np.abs(expected).max(axis=0)
    for column in expected.T / largest.reshape(-1, 1):  # in any order
        assert (
            min(
                np.abs(values[INSIDE, k] / np.abs(values).max(axis=0)[k] - column[INSIDE]).max()
                for k in range(values.shape[1])
            )
            < 0.01
        )


def test_a_table_has_no_gyro_and_a_body_no_axis():
    spin = RigState(T, STATE.spin, READINGS, None, 0.005, STATE.placed)
    with pytest.raises(InputError, match="an error of a free body"):
        added("gyro", VectorForm("force vector", 1.0), np.zeros(9), spin)
    leaning = LocatedEffect(
        rig_places(is_angle=False)["leans"], dependence_of("omega^2", {"scale": 1.0, "first": 0.0}), "all", np.ones(2)
    )
    with pytest.raises(InputError, match="an error of a table"):
        leaning.added(STATE)
    of_angle = LocatedEffect(
        channel_place("channel", "offset", ((0,),), ["a11"]),
        dependence_of("theta", {"scale": 1.0, "first": 0.0}),
        "one",
        np.ones(1),
    )
    with pytest.raises(InputError, match="its angle"):
        of_angle.added(STATE)
