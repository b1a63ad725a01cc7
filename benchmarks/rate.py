"""Methods × scenarios: error over the bound, and speed.

    python benchmarks/rate.py                  the table, 12 runs per scenario
    python benchmarks/rate.py --runs 60        with the runs of the study
    python benchmarks/rate.py --speed          throughput and latency only

Worlds are those of the tests (``tests/gfimu/rate/rate_worlds.py``): data-sheet noise of the ADXL345, 3.9 mg steps,
35 mg of turn-on bias, a cube of 6 cm. Errors are RMS per axis while the body
turns at more than half its top speed. The per-sample methods and the integration take their biases from the 2 s of
rest at the start; per-sample estimates are given the true sign, and are set against the per-sample Cramér–Rao bound.
Speeds are CPU time on one core.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "gfimu" / "rate"))

from rate_worlds import Motion, cube, first_rest, measure, rms, sensor_errors, tumble, turntable

from gfimu.rate.bounds.posterior import posterior_rate_bound
from gfimu.rate.bounds.sample import rate_bound
from gfimu.rate.live import LiveRateFilter
from gfimu.rate.methods import RATE_METHODS, estimate_rate
from gfimu.rate.rest_test import RestTest

SCENARIOS = [
    *[(turntable, speed, rate) for rate in (100.0, 800.0) for speed in (0.0, 0.1, 1.0, 10.0)],
    *[(tumble, speed, rate) for rate in (100.0, 800.0) for speed in (0.1, 1.0, 8.0)],
]


def scenario(motion: Motion, rate: float, speed: float, runs: int) -> list[str]:
    """One row of the table: error and error over the bound of each method."""
    array = cube()
    errors = sensor_errors(array, rate)
    top = np.linalg.norm(motion.omega, axis=1)
    rows = (motion.t > 0.6) & (top >= 0.5 * top.max())
    squares: dict[str, list[float]] = {method: [] for method in RATE_METHODS}
    for run in range(runs):
        values = measure(array, motion, np.random.default_rng([2027, run]))
        for method in RATE_METHODS:
            found = estimate_rate(array, motion.t, values, errors, method=method)
            omega = found.omega
            if method in {"algebraic", "ml"}:
                omega = omega * np.where(np.sum(omega * motion.omega, axis=1) < 0, -1.0, 1.0)[:, None]
            squares[method].append(float(np.mean((omega - motion.omega)[rows] ** 2)))
    per_sample = rate_bound(array, motion.omega[rows], float(np.sqrt(np.mean(errors.noise_std**2)))) if speed else None
    bounds: dict[str, float] = {}
    for method in RATE_METHODS:
        if method in {"filter", "smoother", "batch", "integrate"}:
            covariance = posterior_rate_bound(
                array, motion.t, motion.omega, errors, rest=first_rest(motion), rest_std=RestTest().rate_std,
                smoother=method in {"smoother", "batch"},
            )  # fmt: skip
            bounds[method] = rms(np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))[rows])
        elif per_sample is not None:
            bounds[method] = rms(per_sample)
    cells = []
    for method in RATE_METHODS:
        error = float(np.sqrt(np.mean(squares[method])))
        ratio = f" ({error / bounds[method]:.2f})" if method in bounds else ""
        cells.append(f"{error:.4f}{ratio}")
    return cells


def accuracy(runs: int) -> None:
    """Print methods × scenarios."""
    table = Table(title=f"RMSE of ω, rad/s per axis (over the bound), {runs} runs each")
    table.add_column("scenario")
    for method in RATE_METHODS:
        table.add_column(method, justify="right")
    for world, speed, rate in SCENARIOS:
        name = f"{world.__name__} {speed:g} rev/s, {rate:g} Hz"
        table.add_row(name, *scenario(world(rate, 2 * np.pi * speed), rate, speed, runs))
    Console(width=140).print(table)


def cpu(function, *arguments):  # type: ignore[no-untyped-def]
    """CPU seconds of one call."""
    start = time.process_time()
    function(*arguments)
    return time.process_time() - start


def speed() -> None:
    """Print the throughput of every method, and the latency of one sample."""
    array, rate = cube(), 100.0
    motion = tumble(rate, 2 * np.pi)
    errors = sensor_errors(array, rate)
    one = measure(array, motion, np.random.default_rng(0))
    values = np.tile(one, (100, 1))
    t = np.arange(len(values)) / rate

    def block() -> None:
        process = LiveRateFilter(array, errors, 1 / rate)
        process.push(t, values)
        process.finish()

    block()
    compiled = min(cpu(block) for _ in range(5)) / len(t)
    table = Table(title="Speed, one core, CPU time")
    table.add_column("what")
    table.add_column("samples/s", justify="right")
    for method in RATE_METHODS:
        estimate_rate(array, motion.t, one, errors, method=method)
        best = min(cpu(lambda m=method: estimate_rate(array, motion.t, one, errors, method=m)) for _ in range(3))
        table.add_row(f"{method}, 3000 samples", f"{len(motion.t) / best:,.0f}")
    table.add_row("stream of 300,000 samples, at once", f"{1 / compiled:,.0f}")
    console = Console(width=100)
    console.print(table)

    live = LiveRateFilter(array, errors, 1 / rate)
    for k in range(200):
        live.push(t[k], values[k])
    took = np.empty(5000)
    for k in range(len(took)):
        start = time.perf_counter()
        live.push(t[200 + k], values[200 + k])
        took[k] = time.perf_counter() - start
    console.print(
        f"latency of one sample, live: median {1e6 * np.median(took):.1f} µs, "
        f"95 % {1e6 * np.quantile(took, 0.95):.1f} µs (wall time)"
    )


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=12, help="runs per scenario")
    parser.add_argument("--speed", action="store_true", help="only throughput and latency")
    arguments = parser.parse_args()
    speed()
    if not arguments.speed:
        accuracy(arguments.runs)


if __name__ == "__main__":
    main()
