"""Speed of the simulation against real time, and of the rig against the analytic model.

Run ``python benchmarks/simulation.py [SECONDS]``. All runs are at 100 Hz on the `speed_sweep` or `tumble` motion,
repeated to the length asked for; each round times all of them back to back.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace

import numpy as np

from gfimu.array.array import AccelerometerArray
from sim import forward
from sim.motions.profiles import Tumble, speed_sweep, spin_profile
from sim.rigs.driven import drive
from sim.rigs.turntable import prescribed_readings
from sim.scenarios import Scenario
from sim.simulation import simulate
from sim.world import World

RATE = 100.0
ROUNDS = 5


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 600.0
    t = np.arange(int(seconds * RATE)) / RATE
    world = World(AccelerometerArray.load("cube12"))
    rates = np.tile([2.0, 6.0, 12.0, -3.0, -9.0], int(seconds / 25.0) + 1)
    table, tumble = spin_profile(speed_sweep(rates.tolist())), Tumble()
    run = replace(Scenario.load("speed_sweep"), motion=table, duration=seconds)
    shares = {
        "prescribed table, mj_inverse": (seconds, lambda: prescribed_readings(world, table, t)),
        "prescribed tumble, mj_inverse": (seconds, lambda: prescribed_readings(world, tumble, t)),
        "table, analytic model": (seconds, lambda: forward.channels(world, table, t)),
        "whole scenario with ADXL345": (seconds, lambda: simulate(run, seed=1)),
        "motor-driven table, 1 ms steps": (seconds / 20, lambda: drive(world, table, seconds / 20)),
    }
    times = {name: [] for name in shares}
    for _ in range(ROUNDS):
        for name, (_, work) in shares.items():
            start = time.perf_counter()
            work()
            times[name].append(time.perf_counter() - start)
    print(f"{seconds:g} s at {RATE:g} Hz, 12 channels, {ROUNDS} rounds; median (slowest)")
    for name, (length, _) in shares.items():
        ratio = length / np.array(times[name])
        print(f"{name:32s} {np.median(ratio):10.0f} × real time ({ratio.min():.0f} ×)")


if __name__ == "__main__":
    main()
