"""How long a diagnosis takes, and how much memory, against the limits of 15 s a minute and 120 s and 2 GB half an hour.

python benchmarks/diagnosis.py           60 s: nothing hidden, one effect, walking biases, and what no library has
python benchmarks/diagnosis.py --long    30 min: nothing hidden, one effect, walking biases, and what no library has
"""

from __future__ import annotations

import argparse
import os
import re
import threading
import time
from pathlib import Path
from typing import Self

from gfimu.diagnosis import diagnose
from sim.trials.study.cases import Case
from sim.trials.study.outcome import draw_world, processor_time

_PERIOD = 0.2  # s


class PeakMemory:
    """The most memory that this process and those split off from it hold together while the context lasts, GB.

    Pages that several share are counted once (the proportional set size of Linux).
    """

    def __enter__(self) -> Self:
        self.largest = 0.0
        self._over = threading.Event()
        self._watch = threading.Thread(target=self._look)
        self._watch.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._watch.join()

    def _look(self) -> None:
        while not self._over.wait(_PERIOD):
            children = Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read_text().split()
            self.largest = max(self.largest, sum(_held(process) for process in (str(os.getpid()), *children)))


def _held(process: str) -> float:
    try:
        rollup = Path(f"/proc/{process}/smaps_rollup").read_text()
    except OSError:  # ended meanwhile
        return 0.0
    found = re.search(r"^Pss:\s+(\d+) kB", rollup, re.MULTILINE)
    return int(found.group(1)) / 1e6 if found else 0.0


def timed(duration: float, effect: str, limit: float, *, known: bool = True) -> None:
    """Draw a world, diagnose it, and print wall time over the limit, CPU time and the peak of memory."""
    hidden = (effect,) if effect else ()
    world = draw_world(Case("benchmark", 3, hidden, 300.0, duration=duration, without="" if known else effect))
    wall, processor = time.perf_counter(), processor_time()
    with PeakMemory() as memory:
        found = diagnose([world.recording], world.twin)
    wall, processor = time.perf_counter() - wall, processor_time() - processor
    what = f"{effect or 'nothing'} hidden{'' if known else ' and not in the library'}"
    print(
        f"{duration:.0f} s, {what}: {found.verdict}, {wall:.1f} s wall ({wall / limit:.2f} of the limit), "
        f"{processor:.1f} s CPU, {memory.largest:.2f} GB"
    )


def main() -> None:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--long", action="store_true", help="30 min instead of 60 s")
    if parser.parse_args().long:
        timed(1800.0, "", 120.0)
        timed(1800.0, "eccentricity", 120.0)
        timed(1800.0, "bias_random_walk", 120.0)
        timed(1800.0, "table_tilt", 120.0, known=False)
    else:
        timed(60.0, "", 15.0)
        timed(60.0, "eccentricity", 15.0)
        timed(60.0, "bias_random_walk", 15.0)
        timed(60.0, "table_tilt", 15.0, known=False)


if __name__ == "__main__":
    main()
