"""How many faulty channels are found, and how many sound ones are excluded: the table of docs/theory/integrity.md.

Run ``PYTHONPATH=tests/gfimu/rate/health python benchmarks/channel_faults.py`` (10 min of processor time). The readings
are those of the tests (`watched_world`): ``cube12``, noise of the data sheet, gains 0.05 %, axes 0.5 mrad, places
0.1 mm, onset at random within 2 s. Options: runs per cell, hours of each motion without a fault, and the first seed.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from watched_world import CALIBRATED, CUBE, GRAVITY, readings

from gfimu.rate.health import watch_channels

MG = 1e-3 * GRAVITY
MOTIONS = ("turn", "tumble", "rest")
BEHIND_S = 6.0
Change = Callable[[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], int, np.random.Generator], set[int]]


def step(size_mg: float, channels: int = 1, second: float = 0.0, later_s: float = 0.0) -> Change:
    """Return a step on a channel; with ``second`` one of that size on another channel too, and so much later."""

    def change(t, time, y, channel, rng):  # type: ignore[no-untyped-def]
        faulty = {channel} if channels == 1 else {3 * (channel // 3) + axis for axis in range(3)}
        for number in faulty:
            y[time >= 0.0, number] += size_mg * MG * (rng.choice([-1.0, 1.0]) if channels > 1 else 1.0)
        if second:
            other = int((channel + 1 + rng.integers(11)) % 12)
            y[time >= later_s, other] += second * MG
            faulty = faulty | {other}
        return faulty

    return change


def other(kind: str, size: float) -> Change:
    """Return a gain error in %, noise in multiples of the stated one, or a drift in mg/s."""

    def change(t, time, y, channel, rng):  # type: ignore[no-untyped-def]
        bad = time >= 0.0
        if kind == "gain":
            y[bad, channel] *= 1.0 + 0.01 * size
        elif kind == "noise":
            y[bad, channel] += rng.normal(0.0, np.sqrt(size**2 - 1.0) * CALIBRATED.noise_std[channel], int(bad.sum()))
        else:
            y[bad, channel] += size * MG * time[bad]
        return {channel}

    return change


FAULTS: dict[str, Change] = {
    **{f"step {size} mg": step(size) for size in (3, 5, 10, 20, 50)},
    **{f"gain {size} %": other("gain", size) for size in (2, 5, 20)},
    "noise × 3": other("noise", 3.0),
    "drift 5 mg/s": other("drift", 5.0),
    "two, 20 and 13 mg at once": step(20, second=13),
    "two, 20 and 13 mg, 1 s apart": step(20, second=13, later_s=1.0),
    "two, 20 mg each at once": step(20, second=20),
    "chip, 20 mg on each axis": step(20, channels=3),
}


def faults(runs: int, seed: int) -> None:
    """Print a row per fault: found, within 1 s and wrong ones of the runs, for each motion."""
    print("| fault | " + " | ".join(MOTIONS) + " |")
    print("|---|" + "---|" * len(MOTIONS))
    for number, (name, change) in enumerate(FAULTS.items()):
        cells = [cell(motion, change, runs, seed + 1000 * number) for motion in MOTIONS]
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


def cell(motion: str, change: Change, runs: int, seed: int) -> str:
    """Return how often the faulty channels alone were excluded (within 1 s), how often others, and the median delay."""
    right, soon, named, wrong, delays = 0, 0, 0, 0, []
    for run in range(runs):
        rng = np.random.default_rng([seed, run])
        onset = 7.0 + 2.0 * rng.random()
        t, y, _ = readings(motion, seed + run, duration=onset + BEHIND_S)
        faulty = {CUBE.channels[i] for i in change(t, t - onset, y, run % 12, rng)}
        health = watch_channels(CUBE, t, y, CALIBRATED)
        excluded = {name for fault in health.faults if fault.excluded for name in fault.channels}
        if excluded == faulty:
            right += 1
            delays.append(max(fault.found_s for fault in health.faults if fault.excluded) - onset)
            soon += delays[-1] < 1.0
        elif any(set(names) == faulty for fault in health.faults for names in fault.alternatives):
            named += 1
        elif excluded - faulty:
            wrong += 1
    delay = f"; {np.median(delays):.2f} s" if delays else ""
    several = f", {named} as one of several" if named else ""
    return f"{right} ({soon}){several}, {wrong} wrong{delay}"


def sound(hours: float, seed: int) -> None:
    """Print what is excluded without a fault."""
    for motion in MOTIONS:
        found, largest = 0, 0.0
        for run in range(round(12 * hours)):
            t, y, _ = readings(motion, seed + run, duration=300.0)
            health = watch_channels(CUBE, t, y, CALIBRATED)
            found += len(health.faults)
            largest = max(largest, health.largest_statistic)
        print(f"{motion}: {found} exclusions in {hours:g} h; largest statistic {largest:.1f} of {health.threshold:.1f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--runs", type=int, default=48)
    parser.add_argument("--hours", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=300_000)
    options = parser.parse_args()
    sound(options.hours, options.seed)
    faults(options.runs, options.seed)
