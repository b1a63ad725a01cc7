"""Drift about a known axis against closed forms, and the noise of a recording as a rate."""

from dataclasses import replace

import numpy as np
import pytest
from turning import NOISE, RATE, array_of, turned

import gfimu
from gfimu import GeometryError, InputError, TurningAxis
from gfimu.rate.axis.accuracy.drift import axis_drift
from gfimu.rate.axis.channels import AxisChannels
from gfimu.rate.axis.problem import AxisProblem, Settings
from gfimu.recording import Recording

ONE = array_of((0.1, 0.0, 0.0))
UPRIGHT = TurningAxis.of("z")
BIAS, NOISE_DENSITY, WALK = 0.1, 0.003, 0.001


def drift(**options):
    found = axis_drift(
        ONE, options.pop("axis", UPRIGHT), options.pop("time", 10.0), bias=BIAS, noise_density=NOISE_DENSITY,
        bias_random_walk=WALK, **options,
    )  # fmt: skip
    return {one.name: (one.rate_std, one.angle_std) for one in found.terms}


@pytest.mark.study
def test_at_rest_rate_and_angle_are_integrals_of_the_tangential_reading():
    """α = a / ρ: t and t²/2 of a bias, and the usual integrals of white noise and of a random walk."""
    found, rho, t = drift(), 0.1, 10.0
    two_sided = NOISE_DENSITY / np.sqrt(2.0)
    assert found["bias"] == pytest.approx((BIAS / rho * t, BIAS / rho * t**2 / 2.0), rel=0.01)
    assert found["white noise"] == pytest.approx(
        (two_sided / rho * t**0.5, two_sided / rho * np.sqrt(t**3 / 3.0)), rel=0.02
    )
    assert found["random walk of the bias"] == pytest.approx(
        (WALK / rho * np.sqrt(t**3 / 3.0), WALK / rho * np.sqrt(t**5 / 20.0)), rel=0.02
    )


def test_turning_bounds_the_rate_and_not_the_angle():
    short, long = drift(rate_rad_s=5.0, time=50.0), drift(rate_rad_s=5.0, time=100.0)
    assert long["bias"][0] == pytest.approx(short["bias"][0], rel=0.01)
    assert long["bias"][0] > 0.99 * BIAS / (2.0 * 5.0 * 0.1)  # the radial reading's share: δs = δa / ρ, δΩ = δs / 2Ω
    assert long["bias"][1] == pytest.approx(BIAS / (2.0 * 5.0 * 0.1) * 100.0, rel=0.02)


def test_an_inclined_axis_bounds_the_angle():
    turn = 2.0 * np.pi / 5.0
    short, long = (
        drift(axis=replace(UPRIGHT, inclination=0.5), rate_rad_s=5.0, time=turns * turn) for turns in (40, 80)
    )
    assert long["bias"][1] < 0.05
    assert long["white noise"][1] == pytest.approx(short["white noise"][1], rel=0.05)


def test_white_noise_does_what_the_drift_says():
    """Of independent runs the angle's error at the end is as large as stated, within 3 σ of its χ² (60 runs)."""
    rng, errors = np.random.default_rng(4), []
    settings, start = Settings(1.0, 1.0, 0.0, 0.0), np.zeros(3)
    for _ in range(60):
        recording, _, angle = turned(ONE, (0, 0, 1), rng, duration=10.0, speed=0.0)
        problem = AxisProblem(recording.t_s, recording.readings, AxisChannels.of(ONE, UPRIGHT), np.full(3, NOISE))
        run = problem.run(settings, start, 1e-12 * np.eye(3))
        errors.append(run.states[-1, 0] - (angle[-1] - angle[0]))
    stated = axis_drift(ONE, UPRIGHT, 10.0, noise_density=NOISE * np.sqrt(2.0 / RATE)).angle_std_rad
    assert np.mean(np.square(errors)) / stated**2 == pytest.approx(1.0, abs=3.0 * np.sqrt(2.0 / 60.0))


def test_the_command_s_function_takes_an_axis_for_few_chips():
    how = {"duration": 60.0, "speed_rad_s": 6.0, "bias_mg": 5.0}
    found = gfimu.axis_drift("one_chip", axis=gfimu.TurningAxis.of("z", point=(-0.1, 0.0, 0.0)), **how)
    assert found.to_dict()["angle_std_rad"] == pytest.approx(0.0490 / (2.0 * 6.0 * 0.1) * 60.0, rel=0.03)
    with pytest.raises(GeometryError):
        gfimu.drift("one_chip", bias_mg=5.0)
    with pytest.raises(GeometryError, match="no chip is off it"):
        gfimu.axis_drift("one_chip", axis="z", bias_mg=5.0)
    with pytest.raises(InputError, match="has no axis of its own"):
        gfimu.axis_drift("one_chip", bias_mg=5.0)


def test_noise_at_rest_is_stated_as_a_rate():
    t = np.arange(0.0, 120.0, 0.01)
    readings = [0.0, 0.0, 9.80665] + NOISE * np.random.default_rng(3).standard_normal((len(t), 3))
    array = replace(ONE, turning_axis=UPRIGHT)
    found = gfimu.noise(Recording.from_arrays(t, readings, array), array=array, speed_rad_s=4.0)
    assert found.about_axis.sample_std == pytest.approx(NOISE / (2.0 * 4.0 * 0.1), rel=0.03)
    assert found.to_dict()["about_axis"]["sigma_alpha_rad_s2"] == pytest.approx(NOISE / 0.1, rel=0.03)
