"""The prior of an effect's size is the number that its page states: a diagnosis weighs each effect by it."""

import math

import numpy as np
from every_item import every

from gfimu import AccelerometerArray
from sim.effects import (
    BODY_EFFECTS,
    CARRIAGE_EFFECTS,
    EFFECTS,
    INCLINED_EFFECTS,
    SIMULATED_EFFECTS,
    TABLE_EFFECTS,
    describe,
)

MG = 9.80665e-3  # m/s²
DEG = math.pi / 180.0
STATED = {
    "bias": ("20 mg", 20 * MG),
    "scale_factor": ("2 %", 0.02),
    "misalignment": ("0.5°", 0.5 * DEG),
    "sensor_position": ("1 mm", 1e-3),
    "eccentricity": ("1 mm", 1e-3),
    "mount_tilt": ("0.5°", 0.5 * DEG),
    "mount_turn": ("1°", DEG),
    "table_tilt": ("0.3°", 0.3 * DEG),
    "axis_wobble": ("0.1°", 0.1 * DEG),
    "gravity": ("0.015 m/s²", 0.015),
    "angle_zero": ("0.02 rad", 0.02),
    "cogging": ("1 rad/s²", 1.0),
    "resonance": ("0.3 of the inertia", 0.3),
    "centrifugal_flex": ("2.5e-5 s²/rad²", 2.5e-5),
    "sensor_lag": ("5 ms", 5e-3),
    "chip_lag": ("5 ms", 5e-3),
    "chip_delay": ("1 ms", 1e-3),
    "channel_skew": ("1 ms", 1e-3),
    "clock_error": ("1e-3", 1e-3),
    "tacho_latency": ("10 ms", 1e-2),
    "tacho_lag": ("10 ms", 1e-2),
    "tacho_scale": ("1 %", 0.01),
    "tacho_ripple": ("1 %", 0.01),
    "gyro_latency": ("2 ms", 2e-3),
    "gyro_scale": ("2 %", 0.02),
    "gyro_misalignment": ("0.5°", 0.5 * DEG),
    "bias_temperature": ("0.8 mg/K", 0.8 * MG),
    "warm_up": ("10 mg", 10 * MG),
    "cold_start": ("10 mg", 10 * MG),
    "quadratic": ("3 mg at 1 g", 3 * MG / (1000 * MG) ** 2),
    "cross_axis": ("1 %", 0.01),
    "hysteresis": ("5 mg", 5 * MG),
    "interference_tone": ("2 mg", 2 * MG),
    "gain_drift": ("2e-4 per second", 2e-4),
    "vibration_rectification": ("30 mg at 15 rad/s", 30 * MG / 15**4),
    "bearing_shake": ("5 mm/s² per rad/s", 5e-3),
    "bench_sway": ("1 mm", 1e-3),
}
"""What the page of an effect states of its usual size, and that size in the unit of the effect's parameter."""

EVERY = {**EFFECTS, **BODY_EFFECTS, **TABLE_EFFECTS, **CARRIAGE_EFFECTS, **INCLINED_EFFECTS, **SIMULATED_EFFECTS}
EVERY = {name: one for name, one in EVERY.items() if name != "proof_mass"}  # which states a part of a filter
CUBE = AccelerometerArray.load("cube12")


def test_every_effect_with_a_size_states_it():
    assert {name for name, effect in EVERY.items() if effect.sizes(CUBE)} == set(STATED)


@every("name", STATED)
def test_the_prior_is_what_the_page_states(name):
    text, size = STATED[name]
    assert text in " ".join(describe(EVERY[name]).size.split())
    np.testing.assert_allclose([one.prior_std for one in EVERY[name].sizes(CUBE)], size, rtol=1e-9)
