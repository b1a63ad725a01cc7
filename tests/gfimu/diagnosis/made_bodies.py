"""Bodies moved about by hand, made at random: three chips on one body, what is in them known."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from gfimu import AccelerometerArray, Chip
from gfimu.diagnosis.data.body.run import prepare_body_run
from gfimu.diagnosis.data.body.stretch import BodyStretch, make_body_stretches
from gfimu.motion import BodyDrive
from gfimu.recording import Recording
from sim.effects import make_effect
from sim.twin import Twin

PLACES = {"a": [-0.05, 0.0, 0.01], "b": [0.06, 0.0, 0.0], "c": [0.0, 0.04, 0.0]}
CHIPS = tuple(Chip(name, np.array(place), np.eye(3)) for name, place in PLACES.items())
TWIN = Twin(array=AccelerometerArray("three", CHIPS), drive_source="gyro", array_name="three")
PERIOD = 0.01  # s
UP = np.array([0.0, 0.0, TWIN.gravity])


def hand_motion(duration: float = 6.0, *, seed: int = 1, rest: float = 0.0, up=UP) -> BodyDrive:
    """Return a smooth random motion, after a rest of some seconds in which it reads ``up``, m/s²."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, duration, PERIOD)
    omega, force = (size * gaussian_filter1d(rng.normal(size=(len(t), 3)), 25.0, axis=0) for size in (25.0, 30.0))
    begun = 1.0
    if rest:
        passed = np.clip(t - rest, 0.0, 1.0)[:, None]
        begun = passed**2 * (3.0 - 2.0 * passed)
    return BodyDrive(t, begun * omega, up + begun * force)


def hand_recording(motion: BodyDrive, *hidden, seed: int = 1, change=None) -> Recording:
    """Record a motion with hidden effects and the noise of the data sheet; ``change(readings)`` spoils some."""
    rng = np.random.default_rng(100 + seed)
    effects = [make_effect(name, parameters, TWIN.array) for name, parameters in hidden]
    readings = TWIN.predict_body(motion, motion.t, effects=effects)
    readings = readings + rng.normal(size=readings.shape) * TWIN.expected_noise(1.0 / PERIOD).white
    if change is not None:
        change(readings)
    gyro = motion.rate + 0.002 * rng.normal(size=motion.rate.shape)
    reference = {f"gyro_{axis}_rad_s": gyro[:, k] for k, axis in enumerate("xyz")}
    return Recording.from_arrays(motion.t, readings, TWIN.array, reference=reference)


def hand_stretch(motion: BodyDrive, *hidden, seed: int = 1, change=None) -> BodyStretch:
    """Return the stretch of such a recording."""
    run = prepare_body_run(hand_recording(motion, *hidden, seed=seed, change=change), TWIN)
    (stretch,) = make_body_stretches(TWIN, [run], [[]])
    return stretch
