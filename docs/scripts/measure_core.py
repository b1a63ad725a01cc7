"""What numba and pyarrow are in the core for: time per sample with and without the compiler, time to read a CSV file.

python docs/scripts/measure_core.py            prints the rows of the table in reference/installation.md
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from gfimu import AccelerometerArray, Recording, estimate

METHODS = ("integrate", "ml", "filter", "smoother")


def rest(samples: int) -> Recording:
    """Return the cube at rest, 100 Hz, with the noise of its chips."""
    cube = AccelerometerArray.load("cube12")
    noise = 0.03 * np.random.default_rng(1).standard_normal((samples, cube.n_channels))
    return Recording.from_arrays(np.arange(samples) / 100.0, cube.regression_matrix[:, 5] * 9.81 + noise, cube)


def microseconds_per_sample(method: str, samples: int) -> float:
    """Return the processor time per sample of a rate method, after a first call that compiles it."""
    estimate(rest(300), method=method, rest_bias=True)
    recording = rest(samples)
    began = time.process_time()
    estimate(recording, method=method, rest_bias=True)
    return (time.process_time() - began) / samples * 1e6


def without_compiler(method: str, samples: int) -> float:
    """Return the same of a process in which numba compiles nothing."""
    code = f"import measure_core; print(measure_core.microseconds_per_sample({method!r}, {samples}))"
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=True,
    )
    return float(done.stdout)


def seconds_to_read(samples: int) -> tuple[float, float]:
    """Return the processor time to read a recording from CSV, by pyarrow with all checks and by ``numpy.loadtxt``."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rest.csv"
        rest(samples).write(path)
        Recording.read(path)
        began = time.process_time()
        Recording.read(path)
        between = time.process_time()
        skipped = sum(line.startswith("#") for line in path.read_text(encoding="utf-8").splitlines()) + 1
        begun = time.process_time()
        np.loadtxt(path, delimiter=",", skiprows=skipped)
        return between - began, time.process_time() - begun


def main(samples: int = 2000, rows: int = 200_000) -> None:
    """Print the rows."""
    for method in METHODS:
        fast, slow = microseconds_per_sample(method, 10 * samples), without_compiler(method, samples)
        print(f"| `{method}`, per sample | {fast:.3g} µs | {slow:.3g} µs | {slow / fast:.0f} |")
    arrow, plain = seconds_to_read(rows)
    print(f"| CSV file of {rows} samples | {arrow:.2g} s | {plain:.2g} s | {plain / arrow:.0f} |")


if __name__ == "__main__":
    main()
