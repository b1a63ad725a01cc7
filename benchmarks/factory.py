"""How long a measured world of 40 s takes, by the factory and by `sim.trials.worlds.hidden.measure`, in one run.

python benchmarks/factory.py [COUNT]
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")  # threads that wait would count as processor time

import sys  # noqa: E402
import time  # noqa: E402
from collections.abc import Callable  # noqa: E402

import numpy as np  # noqa: E402

from sim.trials.worlds.factory import WorldFactory  # noqa: E402
from sim.trials.worlds.hidden import measure  # noqa: E402
from sim.twin import Twin  # noqa: E402


def main(count: int) -> None:
    """Print milliseconds of processor time per world, median of blocks, and the ratio."""
    twin = Twin.load("cube12_turntable")
    factory = WorldFactory(twin)
    factory.measure(np.random.default_rng(0))  # compiles
    by_factory = _median(lambda seed: factory.measure(np.random.default_rng(seed)), count)
    by_campaign = _median(lambda seed: measure(np.random.default_rng(seed), twin), max(count // 10, 20))
    print(f"factory {by_factory:.2f} ms, hidden.measure {by_campaign:.2f} ms, ratio {by_campaign / by_factory:.1f}")


def _median(make: Callable[[int], object], count: int) -> float:
    """Return the median processor time of a call, ms."""
    times = []
    for seed in range(count):
        begin = time.process_time()
        make(seed)
        times.append(time.process_time() - begin)
    return 1e3 * float(np.median(times))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 500)
