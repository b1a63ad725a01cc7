"""Files of three rigs as their loggers write them: a pendulum, a table with an encoder's own file, a printer's axis.

numpy alone; nothing of gfimu's own simulation is used. The chip lies on its side on each rig, and the encoder's
computer has a clock of its own.

    python own_rigs.py
"""

import sys
from pathlib import Path

import numpy as np

GRAVITY = 9.80665
MOUNTED = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # sensing axes of the chip in the rig's
NOISE = 0.004  # g per sample


def table(path, head, columns, form="%.5f"):
    """Write columns as CSV."""
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=head, comments="", fmt=form)


def readings(force, seed):
    """Return what the chip reads, (n, 3), g, of a specific force in the rig's axes, m/s²."""
    return force @ MOUNTED.T / GRAVITY + NOISE * np.random.default_rng(seed).standard_normal(force.shape)


def pendulum(folder, arm=0.35):
    """An arm of 0.35 m that swings; the encoder is in the same file."""
    t = np.arange(0.0, 40.0, 0.005)
    angle = 0.8 * np.exp(-t / 60.0) * np.cos(2.0 * np.pi / 1.2 * t)
    rate = np.gradient(angle, t)
    force = np.column_stack(
        [GRAVITY * np.sin(angle) + arm * np.gradient(rate, t), GRAVITY * np.cos(angle) + arm * rate**2, 0.0 * t]
    )
    table(folder / "swing.csv", "time_s,ax_g,ay_g,az_g,encoder_deg", [t, *readings(force, 1).T, np.degrees(angle)])


def turntable(folder, radius=0.12):
    """A chip 0.12 m off the axis, in counts; the encoder's file began 3.7 s later, on a clock that is 0.1 % slow."""

    def angle(t):
        return 3.0 / 0.35 * (1.0 - np.cos(0.35 * t)) + 1.5 / 0.11 * (np.cos(1.0) - np.cos(0.11 * t + 1.0))

    t = np.arange(0.0, 80.0, 0.01)
    rate = 3.0 * np.sin(0.35 * t) + 1.5 * np.sin(0.11 * t + 1.0)
    force = np.column_stack([-radius * rate**2, radius * np.gradient(rate, t), GRAVITY + 0.0 * t])
    table(folder / "chip.csv", "ms,x,y,z", [1000.0 * t, *(256.0 * readings(force, 2)).T], "%.0f")
    own = np.arange(0.0, 70.0, 0.02)
    table(folder / "encoder.csv", "time_s,angle_deg", [own, np.degrees(angle(3.7 + 1.001 * own))])


def axis(folder):
    """A toolhead that moves along x; the commanded place is in the same file."""
    t = np.arange(0.0, 30.0, 0.0025)
    place = 0.08 * np.sin(2.0 * np.pi * 0.8 * t) + 0.03 * np.sin(2.0 * np.pi * 2.1 * t)
    push = np.gradient(np.gradient(place, t), t)
    force = np.column_stack([push, 0.0 * t, GRAVITY + 0.0 * t])
    table(folder / "tool.csv", "time_s,ax_g,ay_g,az_g,carriage_mm", [t, *readings(force, 3).T, 1000.0 * place])


if __name__ == "__main__":
    where = Path(sys.argv[1]) if len(sys.argv) > 1 else Path()
    for write in (pendulum, turntable, axis):
        write(where)
