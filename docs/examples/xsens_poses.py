"""A calibration run as of an Xsens MTi: one triad held in about forty poses by hand, raw counts in a text file.

numpy and scipy alone; nothing of gfimu's own simulation is used. The truth is written below.

    python xsens_poses.py poses.txt
"""

import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

GRAVITY = 9.81744  # m/s², of the place
RATE = 100.0  # Hz
SCALE = np.array([414.4, 412.0, 414.6])  # counts per m/s²
BIAS = np.array([33124.0, 33275.0, 32364.0])  # counts
LEAN = np.array([[1.0, -0.0034, 0.0093], [0.0, 1.0, 0.0214], [0.0, 0.0, 1.0]])  # of the sensing axes
POSES, HELD, TURN = 40, 3.0, 1.2  # number, s, s


def run(seed=1):
    """Return times, s, and counts, (n, 3)."""
    rng = np.random.default_rng(seed)
    turns = Rotation.random(POSES, random_state=seed)
    knots = np.concatenate([[20.0 + k * (HELD + TURN) - HELD, 20.0 + k * (HELD + TURN)] for k in range(POSES)])
    knots[0] = 0.0  # the first pose lasts longer, for the noise at rest
    t = np.arange(int(RATE * knots[-1])) / RATE
    attitude = Slerp(knots, Rotation.concatenate([turns[k // 2] for k in range(2 * POSES)]))(t)
    force = attitude.inv().apply([0.0, 0.0, GRAVITY])
    rest = np.any([(t >= first) & (t <= last) for first, last in zip(knots[::2], knots[1::2], strict=True)], axis=0)
    force[~rest] += 0.8 * np.sin(31.0 * t[~rest])[:, None] * rng.standard_normal(3)
    counts = (force + 0.008 * rng.standard_normal(force.shape)) @ LEAN.T * SCALE + BIAS
    return t + 0.03, np.rint(counts).astype(int)


if __name__ == "__main__":
    lines = [f"{a:.5f} {x} {y} {z}" for a, (x, y, z) in zip(*run(), strict=True)]
    Path(sys.argv[1]).write_text("\n".join(lines) + "\n")
