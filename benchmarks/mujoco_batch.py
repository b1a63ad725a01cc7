"""MuJoCo steps per second: a plain loop of `mj_step`, the batch on one and two threads, and whole simulations.

Run ``python benchmarks/mujoco_batch.py [RUNS] [SECONDS]``. RUNS tables turn for SECONDS each, all of the same length;
each round times every way back to back. Steps per second and core: steps over the processor time of all threads.
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import sys  # noqa: E402
import time  # noqa: E402
from collections.abc import Callable  # noqa: E402
from dataclasses import replace  # noqa: E402

import mujoco  # noqa: E402
import numpy as np  # noqa: E402

from sim.rigs.dc_motor import DcMotor  # noqa: E402
from sim.rigs.driven import Drive, drive_all  # noqa: E402
from sim.scenarios import Scenario  # noqa: E402
from sim.simulation import simulate  # noqa: E402

ROUNDS = 5


def main(runs: int, seconds: float) -> None:
    """Print the rates of every way, for both drives."""
    for name, motor in (("speed controller, Runge-Kutta", None), ("dcmotor, Euler", DcMotor())):
        scenario = replace(Scenario.load("driven_run"), duration=seconds, motor=motor)
        drives = [
            Drive(scenario.world.changed(gravity=9.8 + 1e-3 * number), scenario.motion, seconds, motor=motor)
            for number in range(runs)
        ]
        steps = runs * len(drives[0].times)
        # The scenario's own run drives the table once, then asks MuJoCo for the chips and senses with noise.
        alone = [replace(scenario, gravity=9.8 + 1e-3 * number) for number in range(runs)]
        bare = drives[0].model()
        for sensor in ("bare", "sensors"):
            print(f"{name}: mj_step alone, {sensor}: {_stepped(bare, sensor == 'sensors'):.0f} steps/s")
        ways: dict[str, Callable[[], object]] = {
            "plain mj_step loop, state logged": lambda drives=drives: [_loop(one) for one in drives],
            "drive_all, 1 thread": lambda drives=drives: drive_all(drives, threads=1),
            "drive_all, 2 threads": lambda drives=drives: drive_all(drives, threads=2),
            "simulate (drive, chips, noise)": lambda alone=alone: [simulate(one, seed=1) for one in alone],
        }
        _print(name, steps, ways)


def _stepped(model: mujoco.MjModel, sensors: bool, count: int = 50_000) -> float:
    """Return steps per second of C code alone: one call of `mj_step` for many steps."""
    flag = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    model.opt.disableflags = model.opt.disableflags & ~flag if sensors else model.opt.disableflags | flag
    data = mujoco.MjData(model)
    begin = time.process_time()
    mujoco.mj_step(model, data, count)
    model.opt.disableflags &= ~flag
    return count / (time.process_time() - begin)


def _loop(drive: Drive) -> np.ndarray:
    """Drive a table as one would without the batch: a loop in Python that logs the sensor data."""
    model = drive.model()
    data, controls = mujoco.MjData(model), drive.controls(drive.command.at(drive.times))
    rows = np.empty((len(controls), model.nsensordata))
    control, sensors, step = data.ctrl, data.sensordata, mujoco.mj_step
    for row, wanted in enumerate(controls):
        control[:] = wanted
        step(model, data)
        rows[row] = sensors
    return rows


def _print(name: str, steps: int, ways: dict[str, Callable[[], object]]) -> None:
    times: dict[str, list[tuple[float, float]]] = {way: [] for way in ways}
    for _ in range(ROUNDS):
        for way, work in ways.items():
            wall, busy = time.perf_counter(), time.process_time()
            work()
            times[way].append((time.perf_counter() - wall, time.process_time() - busy))
    print(f"{name}: {steps} steps per round, median of {ROUNDS} rounds")
    first = 0.0
    for way, taken in times.items():
        wall, busy = np.median(np.array(taken), axis=0)
        first = first or steps / busy
        rates = f"{steps / wall:9.0f} steps/s {steps / busy:9.0f} steps/s per core"
        print(f"  {way:34s} {rates}, {steps / busy / first:.2f} of the loop")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 16, float(sys.argv[2]) if len(sys.argv) > 2 else 10.0)
