"""A table whose servo is given steps turns with corners in its acceleration: the drive follows them before causes do.

A drive that is too smooth for them is late at every corner, which looks like a lag of the channels with a reference as
late.
"""

import numpy as np
import pytest

from gfimu import AccelerometerArray
from gfimu.diagnosis import diagnose
from sim import SpinState, SplineSpin
from sim.effects import make_effect
from sim.trials import Measurement, measure
from sim.twin import Twin

DURATION = 14.0


class ServoSteps:
    """Sum of the responses of a critically damped servo to steps of the commanded rate, in closed form."""

    def __init__(self, rng, *, duration=DURATION, bandwidth=3.0, top_rate=8.0, every=2.5):
        self.natural = 2 * np.pi * bandwidth
        self.times = np.arange(4.0, duration + 1.0, every)
        self.steps = np.diff(rng.uniform(-top_rate, top_rate, len(self.times)), prepend=0.0)

    def at(self, t):
        natural = self.natural
        since = np.maximum(np.subtract.outer(np.asarray(t, dtype=float), self.times), 0.0)  # (n, steps)
        fading = np.exp(-natural * since)
        rate = (1 - (1 + natural * since) * fading) @ self.steps
        angle = (since - 2 / natural + (since + 2 / natural) * fading) @ self.steps
        return SpinState(angle, rate, (natural**2 * since * fading) @ self.steps)


def mounted(x_m):
    """The cube on the table, so far off its axis."""
    return Twin(array=AccelerometerArray.load("cube12"), array_name="cube12", cube_offset=np.array([x_m, -0.05, 0.06]))


@pytest.mark.study
@pytest.mark.parametrize(
    ("sample_rate", "hidden"),
    [
        (100.0, {}),
        (300.0, {}),
        (300.0, {"tacho_latency": {"delay_s": 0.012}}),
        (100.0, {"table_tilt": {"x_rad": -0.005, "y_rad": 0.003}, "tacho_scale": {"ratio": 0.02}}),
    ],
)
def test_corners_of_the_drive_are_no_lag(sample_rate, hidden):
    rng = np.random.default_rng(6)
    twin = mounted(0.12)
    setting = Measurement(duration=DURATION, sample_rate=sample_rate)
    effects = [make_effect(name, parameters) for name, parameters in hidden.items()]
    found = diagnose([measure(rng, twin, effects, setting, motion=ServoSteps(rng))], twin)
    assert {cause.effect for cause in found.causes} == set(hidden)
    assert not found.unexplained.significant
    for cause in found.causes:
        for key, value in hidden[cause.effect].items():
            assert abs(cause.parameters[key] - value) < 4 * cause.std[key]


@pytest.mark.study
def test_a_recording_held_out_may_have_corners_too():
    """Its drive is as free as that of the recording that was fitted."""
    rng = np.random.default_rng(8)
    twin = mounted(0.12)
    hidden = [make_effect("eccentricity", {"x_m": 0.004, "y_m": -0.003})]
    setting = Measurement(duration=20.0)
    smooth = measure(rng, twin, hidden, setting)
    cornered = measure(rng, twin, hidden, setting, motion=ServoSteps(rng, duration=setting.duration))
    found = diagnose([smooth], twin, held_out=[cornered])
    assert [cause.effect for cause in found.causes] == ["eccentricity"]
    assert found.gain.held_out == "another recording"
    assert found.gain.share_of_excess_removed > 0.995


@pytest.mark.study
def test_friction_where_a_table_turns_back_is_no_mode():
    """A sweep through rest against Coulomb friction: the acceleration jumps wherever the table turns back."""
    step, friction, drag = 1e-4, 6.0, 0.8  # s, rad/s², 1/s
    t = np.arange(-1.0, 16.0, step)
    torque = 30.0 * np.sin(2 * np.pi * (0.2 * t + 0.02 * t**2))
    rate = np.zeros(len(t))
    for k in range(1, len(t)):
        before = rate[k - 1]
        if before == 0.0 and abs(torque[k]) < friction:
            continue
        against = friction * np.sign(before or torque[k])
        after = before + step * (torque[k] - against - drag * before)
        rate[k] = 0.0 if before * after < 0.0 else after
    motion = SplineSpin.through(t[::5], rate[::5])
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    recording = measure(np.random.default_rng(1), twin, [], Measurement(duration=15.0), motion=motion)
    assert diagnose([recording], twin).verdict == "nothing_found"
