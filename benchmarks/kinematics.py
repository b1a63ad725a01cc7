"""Speed of the closed form against the machine's copy and a plain matrix product, and of the GDOP of many geometries.

Run ``python benchmarks/kinematics.py [SAMPLES]``. Linear algebra runs on one thread. Everything is measured in CPU time
and in rounds, each of which runs every contender once. The least time of the rounds counts: what comes on top is other
load, and for the contenders that allocate their result the kernel's zeroing of new pages. The range of the ratios taken
round by round stands beside. The copy moves as many bytes as the closed form reads and writes (144 per sample).
"""

# ruff: noqa: E402  (NumPy reads the number of threads when it is first imported)
from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"

import sys
import time
from collections.abc import Callable

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.array.dilution import gdop
from gfimu.array.kinematics import closed_form, motion_from_readings, pseudo_inverse

ROUNDS = 7
GEOMETRIES = 100_000


def main() -> None:
    samples = int(float(sys.argv[1])) if len(sys.argv) > 1 else 10_000_000
    print(f"closed form: {samples:,} samples of 12 channels, float64, {ROUNDS} rounds")
    closed_form_against_copy_and_product(samples)
    print(f"\nGDOP of {GEOMETRIES:,} geometries of four tri-axial chips")
    gdop_against_inverse()


def closed_form_against_copy_and_product(samples: int) -> None:
    cube = AccelerometerArray.load("cube12_as_built")
    readings = np.random.default_rng(0).normal(size=(samples, 12))
    motion = np.ones((samples, 6))
    source, target = np.ones((samples, 9)), np.ones((samples, 9))
    transposed = pseudo_inverse(cube).T
    contenders: dict[str, Callable[[], object]] = {
        "copy": lambda: np.copyto(target, source),
        "closed_form, into out": lambda: closed_form(cube, readings, out=motion),
        "matmul(y, M.T), into out": lambda: np.matmul(readings, transposed, out=motion),
        "closed_form": lambda: closed_form(cube, readings),
        "motion_from_readings": lambda: motion_from_readings(cube, readings),
        "y @ M.T": lambda: readings @ transposed,
    }
    seconds = rounds_of(contenders)
    for name, times in seconds.items():
        least = times.min()
        print(f"  {name:26s} {samples / least / 1e6:7.1f} M samples/s  {144 * samples / least / 1e9:5.1f} GB/s")
    copy, into_out, allocating = seconds["copy"], seconds["closed_form, into out"], seconds["closed_form"]
    compare("closed_form, into out: share of copy bandwidth", copy, into_out, 0.8)
    compare("closed_form over matmul, both into out", seconds["matmul(y, M.T), into out"], into_out, 1.5)
    compare("closed_form over y @ M.T, both allocating", seconds["y @ M.T"], allocating, 1.5)


def gdop_against_inverse() -> None:
    places = np.random.default_rng(1).uniform(-1.0, 1.0, (GEOMETRIES, 4, 3))
    channel_places = np.repeat(places, 3, axis=1)
    channel_axes = np.ascontiguousarray(np.broadcast_to(np.tile(np.eye(3), (4, 1)), channel_places.shape))

    def by_inverse() -> np.ndarray:
        j = np.concatenate([np.cross(channel_places, channel_axes), channel_axes], axis=-1)
        return np.sqrt(np.trace(np.linalg.inv(np.swapaxes(j, 1, 2) @ j), axis1=1, axis2=2))

    normal = normal_matrices(places)
    contenders: dict[str, Callable[[], object]] = {
        "gdop(positions)": lambda: gdop(places),
        "gdop(positions, axes)": lambda: gdop(channel_places, channel_axes),
        "J, JᵀJ, numpy inv": by_inverse,
        "numpy inv alone, JᵀJ given": lambda: np.sqrt(np.trace(np.linalg.inv(normal), axis1=1, axis2=2)),
    }
    difference = np.abs(gdop(places) / by_inverse() - 1).max()
    seconds = rounds_of(contenders)
    for name, times in seconds.items():
        print(f"  {name:26s} {1e3 * times.min():7.1f} ms")
    print(f"  largest relative difference {difference:.1e}")
    by_triads, by_axes, inverse = (
        seconds["gdop(positions)"],
        seconds["gdop(positions, axes)"],
        seconds["J, JᵀJ, numpy inv"],
    )
    compare("gdop over J, JᵀJ, numpy inv", inverse, by_triads, 10)
    compare("gdop over numpy inv alone", seconds["numpy inv alone, JᵀJ given"], by_triads, 10)
    compare("gdop with axes over J, JᵀJ, numpy inv", inverse, by_axes, 10)


def normal_matrices(places: np.ndarray) -> np.ndarray:
    """JᵀJ of tri-axial chips, shape (m, 6, 6)."""
    cross = np.zeros((*places.shape, 3))
    x, y, z = np.moveaxis(places, -1, 0)
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = -z, y, -x
    cross -= np.swapaxes(cross, -1, -2)
    k = np.concatenate([cross, np.broadcast_to(np.eye(3), cross.shape)], axis=-2)
    return np.einsum("mnij,mnkj->mik", k, k)


def rounds_of(contenders: dict[str, Callable[[], object]]) -> dict[str, np.ndarray]:
    for run in contenders.values():
        run()  # compiles and touches the memory
    seconds = {name: np.empty(ROUNDS) for name in contenders}
    for number in range(ROUNDS):
        for name, run in contenders.items():
            start = time.process_time()
            run()
            seconds[name][number] = time.process_time() - start
    return seconds


def compare(meaning: str, slow: np.ndarray, fast: np.ndarray, wanted: float) -> None:
    ratio, by_rounds = slow.min() / fast.min(), slow / fast
    print(f"  {meaning}: {ratio:.2f} (asked: {wanted:g}; by rounds {by_rounds.min():.2f} to {by_rounds.max():.2f})")


if __name__ == "__main__":
    main()
