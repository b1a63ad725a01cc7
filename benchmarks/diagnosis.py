"""How long a diagnosis takes, and how much memory, against the limits of 15 s a minute and 120 s and 2 GB half an hour.

python benchmarks/diagnosis.py           60 s, nothing hidden and one effect
python benchmarks/diagnosis.py --long    30 min, the same
"""

from __future__ import annotations

import argparse
import resource
import time

import numpy as np

from gfimu.array import AccelerometerArray
from gfimu.diagnosis import diagnose
from sim.campaign import Measurement, hidden_effect, measure, random_profile
from sim.twin import Twin


def timed(duration: float, effect: str, limit: float) -> None:
    """Draw a world, diagnose it, and print wall time over the limit, CPU time and the peak of memory."""
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    rng = np.random.default_rng(3)
    setting = Measurement(duration=duration)
    motion = random_profile(rng, duration)
    hidden = [hidden_effect(rng, twin, effect, motion, 300.0, setting)] if effect else []
    recording = measure(rng, twin, hidden, setting, motion=motion)
    wall, processor = time.perf_counter(), time.process_time()
    found = diagnose([recording], twin)
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(
        f"{duration:.0f} s, {effect or 'nothing'} hidden: {found.verdict}, {wall:.1f} s wall ({wall / limit:.2f} of "
        f"the limit), {processor:.1f} s CPU, {peak:.2f} GB"
    )


def main() -> None:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--long", action="store_true", help="30 min instead of 60 s")
    if parser.parse_args().long:
        timed(1800.0, "", 120.0)
        timed(1800.0, "eccentricity", 120.0)
    else:
        timed(60.0, "", 15.0)
        timed(60.0, "eccentricity", 15.0)


if __name__ == "__main__":
    main()
