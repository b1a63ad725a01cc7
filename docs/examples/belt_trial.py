"""A belt box as in the SisFall trials: ADXL345 and MMA8451Q beside a gyro on a person who walks, as its raw text.

numpy alone; nothing of gfimu's own simulation is used. What is wrong with the second chip is written below.

    python belt_trial.py D06.txt
"""

import sys
from pathlib import Path

import numpy as np

GRAVITY = 9.80665
RATE = 200.0  # Hz
SECONDS = 15.0
LEVER = np.array([0.0, 0.0, 0.006])  # m, from the ADXL345 to the MMA8451Q
GAIN = np.array([1.03, 1.03, 1.00])  # of the MMA8451Q
OFFSET = np.array([0.0, 0.0, -1.25])  # m/s², of the MMA8451Q
COUNTS = np.array([256.0 / GRAVITY] * 3 + [np.degrees(1.0) * 16.384] * 3 + [1024.0 / GRAVITY] * 3)


def motion(rng):
    """Return the specific force at the first chip, the rate and its derivative in the body, (n, 3) each."""
    t = np.arange(int(RATE * SECONDS)) / RATE
    step = 1.8  # Hz
    rate = np.zeros((len(t), 3))
    change = np.zeros((len(t), 3))
    force = np.zeros((len(t), 3))
    for axis in range(3):
        for order in range(1, 9):
            size, phase = rng.normal(0.0, 1.6 / order), rng.uniform(0.0, 2.0 * np.pi)
            turn = 2.0 * np.pi * step * order * (1.0 + 0.01 * rng.standard_normal())
            rate[:, axis] += size * np.sin(turn * t + phase)
            change[:, axis] += size * turn * np.cos(turn * t + phase)
            force[:, axis] += rng.normal(0.0, 3.0 / order) * np.sin(turn * t + rng.uniform(0.0, 2.0 * np.pi))
    return t, force + np.array([0.0, -GRAVITY, 0.0]), rate, change


def trial(seed=1):
    """Return the counts of a trial, (n, 9): ADXL345, gyro, MMA8451Q."""
    rng = np.random.default_rng(seed)
    t, force, rate, change = motion(rng)
    moving = np.clip((t - 2.0) / 0.5, 0.0, 1.0)[:, None]  # two seconds of rest first
    still = np.array([0.0, -GRAVITY, 0.0])
    force, rate = still + moving * (force - still), moving * rate
    change = moving * change + np.gradient(moving[:, 0], t)[:, None] * rate
    second = force + np.cross(change, LEVER) + np.cross(rate, np.cross(rate, LEVER))
    second = GAIN * second + OFFSET
    noise = rng.standard_normal((len(t), 9)) * np.repeat([0.04, 0.003, 0.012], 3)
    return np.rint((np.hstack([force, rate, second]) + noise) * COUNTS).astype(int)


if __name__ == "__main__":
    lines = [",".join(f"{value:4d}" for value in row) + ";" for row in trial()]
    Path(sys.argv[1]).write_text("\n".join(lines) + "\n")
