"""What an estimate about a known axis reaches, against estimates; and rates that a filter took mirrored."""

import numpy as np
import pytest
from turning import NOISE, RATE, array_of

import gfimu
from gfimu import InputError, TurningAxis
from gfimu.array import AxisUncertainty
from gfimu.commands.known_axis import KnownAxis
from gfimu.motion import estimate_about_axis
from gfimu.rate import axis_bounds
from gfimu.rate.axis.accuracy.predicted import predicted_estimate
from gfimu.rate.axis.accuracy.predicted_readings import readings_of, spun_up
from gfimu.rate.axis.accuracy.predicted_run import PredictedRun
from gfimu.rate.axis.channels import AxisChannels
from gfimu.rate.axis.mirror import with_signs
from gfimu.rate.axis.mounting import Mounting
from gfimu.rate.axis.problem import AxisProblem, Settings
from gfimu.rate.axis.roughness import with_roughness
from gfimu.recording import Recording

ONE = array_of((0.1, 0.0, 0.02))
TWO = array_of((0.02, 0.0, 0.0), (0.17, 0.0, 0.0))
SPEED = 6.28
CASES = {
    "two chips on a wheel": (TWO, "free", AxisUncertainty(0.003, 0.01, 0.003, 0.05, 0.2), 1.57, 0.7),
    "one chip on an inclined table": (ONE, "fixed", AxisUncertainty(0.002, 0.01, 0.005, 0.03, 0.1), 0.5, 0.0),
    "one chip on an upright table": (ONE, "fixed", AxisUncertainty(lever_std_m=0.003, bias_std_m_s2=0.05), 0.0, 0.0),
}


def wobble(t, rng, jerk=1.0):
    """Return angle, rate and acceleration about the predicted motion: white jerk of its density, held by a spring."""
    steps, state = 10, np.zeros(3)
    h = (t[1] - t[0]) / steps
    found = np.zeros((len(t), 3))
    for k in range(1, len(t)):
        for kick in rng.standard_normal(steps) * np.sqrt(jerk * h):
            angle, rate, acceleration = state
            state = np.array(
                [angle + h * rate, rate + h * acceleration, acceleration - h * (2.0 * acceleration + rate) + kick]
            )
        found[k] = state
    return found.T


def made(array, axis, hub, rng, duration):
    """Return a recording of the predicted motion with constants drawn from their priors, and its rate."""
    mounting = Mounting.of(array, axis, axis.inclination, free_inclination=False)
    values = rng.normal(size=len(mounting.constants)) * mounting.prior_std
    channels = mounting.channels(values)
    t = np.arange(0.0, duration, 1.0 / RATE)
    angle, rate, acceleration = np.array(spun_up(t, SPEED)) + wobble(t, rng)
    readings = readings_of(channels, axis.inclination, angle, rate, acceleration)
    readings += hub * rng.standard_normal((len(t), 3)) @ channels.force.T + NOISE * rng.standard_normal(readings.shape)
    return Recording.from_arrays(t, readings, array), rate


def reached(case, seeds, duration=20.0):
    """Return predicted σ, and errors and stated σ in the steady halves of runs, shape (seeds, n)."""
    array, hub, doubt, tilt, shake = CASES[case]
    axis = TurningAxis.of("z", hub=hub, inclination=tilt, uncertainty=doubt)
    predicted = predicted_estimate(array, axis, PredictedRun(duration), rate_rad_s=SPEED, noise_std=NOISE)
    missed, stated = [], []
    for seed in seeds:
        recording, rate = made(array, axis, shake, np.random.default_rng(seed), duration)
        found = estimate_about_axis(recording, array, axis)
        steady = slice(len(rate) // 2, None)
        missed.append((found.omega[:, 2] - rate)[steady])
        stated.append(found.omega_std[steady, 2])
    return predicted, np.array(missed), np.array(stated)


@pytest.mark.parametrize("case", [*CASES][:2])
def test_prediction_and_error_agree(case):
    """Noise prevails here, so that one run says much."""
    predicted, missed, stated = reached(case, [1])
    assert np.sqrt(np.mean(missed**2)) == pytest.approx(predicted.std, rel=0.25)
    assert np.sqrt(np.mean(stated**2)) == pytest.approx(predicted.std, rel=0.25)
    assert np.mean(np.abs(missed) < 3.0 * stated) > 0.98


@pytest.mark.study
def test_prediction_and_error_agree_where_the_mounting_prevails():
    """Each run is one draw of lever and bias: 12 runs have a ratio of 1 within 0.6 at 3 σ."""
    predicted, missed, stated = reached("one chip on an upright table", range(12))
    assert predicted.mounting_std > 5.0 * predicted.noise_std
    assert np.sqrt(np.mean(missed**2)) < 1.6 * predicted.std
    assert np.sqrt(np.mean(stated**2)) == pytest.approx(predicted.std, rel=0.25)
    assert np.mean(np.abs(missed) < 3.0 * stated) > 0.95


def test_an_exact_mounting_is_at_the_closed_form():
    for array, hub in ((TWO, "free"), (ONE, "fixed")):
        axis = TurningAxis.of("z", hub=hub, inclination=0.0)
        bound = axis_bounds(array, axis, rate_rad_s=SPEED, noise_std=NOISE).filter_std
        found = predicted_estimate(array, axis, PredictedRun(20.0), rate_rad_s=SPEED, noise_std=NOISE)
        assert found.mounting_std == 0.0
        assert found.std == pytest.approx(bound, rel=0.15)


def test_gravity_alone_bounds_one_chip_on_a_wheel():
    wheel = TurningAxis.of("z", hub="free")
    quiet, loud = (
        predicted_estimate(ONE, wheel, PredictedRun(20.0, hub_std_m_s2=hub), noise_std=NOISE).std for hub in (0.1, 0.7)
    )
    assert np.isinf(axis_bounds(ONE, wheel).filter_std)
    assert quiet < loud < 0.2


def test_score_uses_the_axis_of_the_file_beside_other_arrays(tmp_path):
    text = ONE.to_toml() + "[turning_axis]\ndirection = [0, 0, 1]\nlever_std_m = 0.002\n"
    (tmp_path / "arm.toml").write_text(text)
    full, arm = gfimu.score(["cube12", tmp_path / "arm.toml"])
    assert full.gdop == pytest.approx(1.0607, abs=1e-4)
    assert arm.predicted.mounting_std > 0.0
    with pytest.raises(InputError, match="give the axis too"):
        gfimu.score("cube12", axis=KnownAxis(uncertainty=AxisUncertainty(lever_std_m=0.002)))
    with pytest.raises(InputError, match="samples"):
        PredictedRun(1e6)


def test_a_rate_that_a_bias_mirrored_is_turned_back():
    """At rest a bias of the tangential reading, taken as motion, sends the filter off the other way."""
    axis = TurningAxis.of("z", inclination=0.0, uncertainty=AxisUncertainty(lever_std_m=0.003, bias_std_m_s2=0.1))
    channels = AxisChannels.of(ONE, axis)
    t = np.arange(0.0, 20.0, 1.0 / RATE)
    angle, rate, acceleration = spun_up(t, SPEED)
    readings = readings_of(channels, 0.0, angle, rate, acceleration) + np.array([0.0, -0.15, 0.0])
    readings += NOISE * np.random.default_rng(2).standard_normal(readings.shape)
    problem = AxisProblem(t, readings, channels, np.full(3, NOISE))
    settings, start, covariance = Settings(10.0, 1.0, 0.0, 0.0), np.zeros(3), np.diag([0.25, 1e-4, 1e-2])
    steady = slice(len(t) // 2, None)
    assert np.median(problem.run(settings, start, covariance).states[steady, 1]) < -0.5 * SPEED
    signed = with_signs(problem, settings, start, covariance)
    assert len(signed.mirrored)
    assert np.median(signed.run(settings, start, covariance).states[steady, 1]) > 0.5 * SPEED
    found = estimate_about_axis(Recording.from_arrays(t, readings, ONE), ONE, axis)
    missed = (found.omega[:, 2] - rate)[steady]
    assert np.all(np.abs(missed) < 4.0 * found.omega_std[steady, 2])


def test_a_change_of_speed_is_rougher_than_a_steady_rotation():
    channels = AxisChannels.of(ONE, TurningAxis.of("z"))
    t = np.arange(0.0, 20.0, 1.0 / RATE)
    readings = readings_of(channels, 0.0, *spun_up(t, SPEED))
    readings += NOISE * np.random.default_rng(2).standard_normal(readings.shape)
    problem = AxisProblem(t, readings, channels, np.full(3, NOISE))
    found = with_roughness(problem, Settings(1.0, 1.0, 0.0, 0.0), np.zeros(3), np.diag([0.25, 1e-4, 1e-2]))
    assert np.median(found.roughness[(t > 2.0) & (t < 4.0)]) >= 10.0 * np.median(found.roughness[t > 8.0])
