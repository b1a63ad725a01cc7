"""Speed of the overlapping Allan deviation against allantools.

Run ``python benchmarks/allan.py [SAMPLES]``. Both compute the same curve of white noise and random walk on the default
logarithmic grid; they are timed back to back in CPU time and the ratio is taken pair by pair.
"""

from __future__ import annotations

import sys
import time

import allantools
import numpy as np

from gfimu.sensor_noise import allan_deviation, synthesise_noise
from gfimu.sensor_noise.allan import averaging_factors

PAIRS = 3
RATE = 100.0


def main() -> None:
    samples = int(float(sys.argv[1])) if len(sys.argv) > 1 else 10_000_000
    series = synthesise_noise(samples, RATE, N=0.003, K=0.0001, rng=np.random.default_rng(1))
    factors = averaging_factors(samples)
    allan_deviation(series[:1000], RATE)  # compile
    own, theirs, ratios = [], [], []
    for _ in range(PAIRS):
        begin = time.process_time()
        curve = allan_deviation(series, RATE, factors=factors)
        own.append(time.process_time() - begin)
        begin = time.process_time()
        _, deviation, _, _ = allantools.oadev(series, RATE, data_type="freq", taus=factors / RATE)
        theirs.append(time.process_time() - begin)
        ratios.append(theirs[-1] / own[-1])
    difference = np.abs(curve.deviation / deviation - 1).max()
    print(
        f"{samples:,} samples, {len(factors)} averaging times, median of {PAIRS} pairs: "
        f"gfimu {np.median(own):.2f} s, allantools {np.median(theirs):.2f} s, {np.median(ratios):.1f} × "
        f"(least {min(ratios):.1f}); largest relative difference {difference:.0e}"
    )


if __name__ == "__main__":
    main()
