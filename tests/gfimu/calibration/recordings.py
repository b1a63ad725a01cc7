"""Recordings of static poses with motion between them, for the tests of rest, faults and commands."""

import numpy as np
from calibration_cases import GRAVITY

from gfimu.recording import Recording


def pose_recording(
    models, directions, rng, *, rate=100.0, still_s=6.0, move_s=2.0, sigma=0.02, unit="m_s2", gravity=GRAVITY
):
    """Poses of ``still_s`` with swings of ``move_s`` between them; one triad model per chip a1, a2 …"""
    still, move = int(still_s * rate), int(move_s * rate)
    parts = []
    for number, direction in enumerate(directions):
        parts.append(np.tile(direction, (still, 1)))
        if number + 1 < len(directions):
            share = np.linspace(0, 1, move)[:, None]
            path = (1 - share) * direction + share * directions[number + 1]
            path += 0.3 * np.sin(np.linspace(0, 9 * np.pi, move))[:, None] * rng.normal(size=3)
            parts.append(path)
    true = gravity * np.concatenate(parts)
    readings = np.hstack([model.read(true) for model in models])
    readings = readings + rng.normal(0, sigma, readings.shape)
    if unit == "lsb":
        readings = np.round(readings)
    channels = tuple(f"a{chip + 1}{axis}" for chip in range(len(models)) for axis in (1, 2, 3))
    return Recording(np.arange(len(true)) / rate, readings, channels, unit=unit)
