"""A run on a turntable as a data logger writes it: four ADXL345 on the corners of a cube of 0.1 m, and a tachometer.

numpy alone; nothing of gfimu's own simulation is used. What the rig has and a drawing has not is written below: the
table leans, and the cube stands off its axis. Biases were taken off at the factory, so the chips add noise only.

    python table_run.py logger.csv
"""

import sys
from pathlib import Path

import numpy as np

GRAVITY = 9.80665
RATE = 100.0  # Hz
LEAN = np.array([0.006, -0.003])  # rad, of the table about x and y
OFF_AXIS = np.array([0.002, -0.001, 0.0])  # m, of the cube on the table
CORNERS = 0.05 * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])  # m
NOISE = 0.03  # m/s² per sample
PROFILE = [(3.0, 0.0), (6.0, 4.0), (6.0, 2.0), (3.0, 0.0), (6.0, -4.0), (6.0, -2.0), (3.0, 0.0)]  # s, rad/s
RAMP = 1.0  # s, from one speed to the next


def spin():
    """Return time, rate and angular acceleration of the table, (n,) each."""
    t = np.arange(int(RATE * sum(duration for duration, _ in PROFILE))) / RATE
    rate, change, start, before = np.zeros_like(t), np.zeros_like(t), 0.0, 0.0
    for duration, speed in PROFILE:
        part = (t >= start) & (t < start + duration)
        x = np.clip((t[part] - start) / RAMP, 0.0, 1.0)
        rate[part] = before + (speed - before) * (3.0 * x**2 - 2.0 * x**3)
        change[part] = (speed - before) / RAMP * (6.0 * x - 6.0 * x**2)
        start, before = start + duration, speed
    return t, rate, change


def readings(seed=1):
    """Return time, specific force of the twelve axes in m/s², (n, 12), and the tachometer in rad/s."""
    rng = np.random.default_rng(seed)
    t, rate, change = spin()
    angle = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2.0 / RATE)])
    up = GRAVITY * np.array([-LEAN[1], LEAN[0], 1.0])  # of gravity's reaction in table axes at angle zero
    cosine, sine = np.cos(angle), np.sin(angle)
    gravity = np.column_stack([cosine * up[0] + sine * up[1], cosine * up[1] - sine * up[0], np.full_like(t, up[2])])
    columns = []
    for corner in CORNERS + OFF_AXIS:
        tangential = change[:, None] * np.array([-corner[1], corner[0], 0.0])
        centripetal = -(rate**2)[:, None] * np.array([corner[0], corner[1], 0.0])
        columns.append(gravity + tangential + centripetal)
    noise = NOISE * rng.standard_normal((len(t), 12))
    return t, np.hstack(columns) + noise, rate + 0.002 * rng.standard_normal(len(t))


if __name__ == "__main__":
    t, force, rate = readings()
    table = np.column_stack([1e3 * t, force / GRAVITY * 1e3, rate * 60.0 / (2.0 * np.pi)])
    names = [f"acc{chip}_{axis}_mg" for chip in "1234" for axis in "xyz"]
    form = ["%.0f", *["%.1f"] * 12, "%.3f"]
    np.savetxt(Path(sys.argv[1]), table, form, ",", header=",".join(["ms", *names, "table_rpm"]), comments="")
