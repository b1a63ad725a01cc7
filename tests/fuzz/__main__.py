"""``python -m tests.fuzz``: mutated inputs over all readers, and a table of how they ended."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tests.fuzz.campaign import run, work
from tests.fuzz.commands import run_all


def main() -> int:
    """Run a campaign; exit code 1 if an input ended otherwise than in success or in one line of a typed error."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--count", type=int, default=10_000, help="inputs")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--reader", help="one reader; all by default")
    parser.add_argument("--keep", type=Path, default=Path("fuzz-failures"), help="folder for the inputs that failed")
    parser.add_argument("--commands", nargs="?", const="", help="every command, or one, with bad input instead")
    parser.add_argument("--worker", type=int, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.worker is not None:
        work(given.worker, given.count, given.seed, given.reader, given.keep)
        return 0
    if given.commands is not None:
        return int(bool(run_all(given.commands or None)))
    tallies = run(given.count, given.seed, given.reader, given.keep, progress=given.count > 5000)
    print("| reader | inputs | read | refused | uncaught | slowest, s | CPU, s |\n|---|---|---|---|---|---|---|")
    for name, one in sorted(tallies.items()):
        failed = sum(one.failed.values())
        print(
            f"| {name} | {one.inputs} | {one.read} | {one.refused} | {failed} | {one.slowest_s:.2f} | {one.cpu_s:.0f} |"
        )
    uncaught = [(name, what, times) for name, one in tallies.items() for what, times in one.failed.most_common()]
    for name, what, times in uncaught:
        print(f"{name}: {times} × {what}")
    print(f"{sum(one.inputs for one in tallies.values())} inputs, {len(uncaught)} kinds of failures")
    return int(bool(uncaught))


if __name__ == "__main__":
    sys.exit(main())
