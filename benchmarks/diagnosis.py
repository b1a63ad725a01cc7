"""How long a diagnosis takes, and how much memory, against the limits of 15 s a minute and 120 s and 2 GB half an hour.

python benchmarks/diagnosis.py           60 s: nothing hidden, one effect, wandering biases, and what is in no library
python benchmarks/diagnosis.py --long    30 min: nothing hidden, one effect, and what is in no library
"""

from __future__ import annotations

import argparse
import resource
import time

from gfimu.diagnosis import diagnose
from sim.study.cases import Case
from sim.study.outcome import draw_world


def timed(duration: float, effect: str, limit: float, *, known: bool = True) -> None:
    """Draw a world, diagnose it, and print wall time over the limit, CPU time and the peak of memory."""
    hidden = (effect,) if effect else ()
    world = draw_world(Case("benchmark", 3, hidden, 300.0, duration=duration, without="" if known else effect))
    wall, processor = time.perf_counter(), time.process_time()
    found = diagnose([world.recording], world.twin)
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    what = f"{effect or 'nothing'} hidden{'' if known else ' and not in the library'}"
    print(
        f"{duration:.0f} s, {what}: {found.verdict}, {wall:.1f} s wall ({wall / limit:.2f} of the limit), "
        f"{processor:.1f} s CPU, {peak:.2f} GB"
    )


def main() -> None:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--long", action="store_true", help="30 min instead of 60 s")
    if parser.parse_args().long:
        timed(1800.0, "", 120.0)
        timed(1800.0, "eccentricity", 120.0)
        timed(1800.0, "table_tilt", 120.0, known=False)
    else:
        timed(60.0, "", 15.0)
        timed(60.0, "eccentricity", 15.0)
        timed(60.0, "bias_random_walk", 15.0)
        timed(60.0, "table_tilt", 15.0, known=False)


if __name__ == "__main__":
    main()
