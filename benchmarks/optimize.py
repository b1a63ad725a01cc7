"""Search of arrays against differential evolution with the same processor time, and against published structures.

Run ``python benchmarks/optimize.py`` (about 10 minutes of one core). Each pair is one problem and one seed: the search
of `gfimu optimize` makes a few starts, then SciPy's differential evolution gets the same processor time and its own
final polish besides. Lower is better.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import scipy.optimize

from gfimu.array.array import AccelerometerArray
from gfimu.array_search.objectives import Conditions, objective
from gfimu.array_search.problem import Problem, rows_of
from gfimu.array_search.scoring import score
from gfimu.array_search.search import search
from gfimu.array_search.shapes import box, cylinder, frames_across, sphere

PROBLEMS = {
    "4 triads, cube": Problem(4, 3, box((0.1, 0.1, 0.1))),
    "5 triads, cube": Problem(5, 3, box((0.1, 0.1, 0.1))),
    "7 triads, sphere": Problem(7, 3, sphere(0.05)),
    "5 of 2 axes, cylinder": Problem(5, 2, cylinder(0.04, 0.1)),
    "6 single, cube": Problem(6, 1, box((0.1, 0.1, 0.1))),
    "8 single, flat box": Problem(8, 1, box((0.1, 0.06, 0.02))),
    "9 single, keep-out": Problem(9, 1, box((0.1, 0.1, 0.1)), (sphere(0.03, (0.05, 0.05, 0.05)),)),
    "12 single, cube": Problem(12, 1, box((0.1, 0.1, 0.1))),
}
"""Problems by name; least spacing 5 mm."""

STARTS = 3
PENALTY = 1e3  # per unit of length by which a constraint fails


def evolved(problem: Problem, name: str, seconds: float, seed: int) -> tuple[float, int]:
    """Return what differential evolution finds within a processor time, and its number of evaluations."""
    criterion = objective(name, problem, Conditions()).criterion
    shape, n, k = problem.shape, problem.n_chips, problem.axes_per_chip
    first, second = np.triu_indices(n, 1)
    evaluations = 0

    def value(numbers):
        nonlocal evaluations
        evaluations += 1
        places = numbers[: 3 * n].reshape(n, 3)
        if k == 3:
            axes = np.broadcast_to(np.eye(3), (n, 3, 3))
        else:
            turn, height = numbers[3 * n : 4 * n], numbers[4 * n :]
            across = np.sqrt(1.0 - height**2)
            units = np.column_stack([across * np.cos(turn), across * np.sin(turn), height])
            axes = units[:, None] if k == 1 else frames_across(units)
        failed = np.maximum(-shape.walls(places), 0.0).sum()
        failed += sum(np.maximum(zone.walls(places).min(axis=-1), 0.0).sum() for zone in problem.zones)
        apart = np.linalg.norm(places[first] - places[second], axis=1)
        failed += np.maximum(problem.spacing - apart, 0.0).sum()
        return float(criterion.exact(rows_of(places[:, None], axes).reshape(-1, 12))) + PENALTY * failed

    bounds = [*zip(np.tile(shape.centre - shape.half, n), np.tile(shape.centre + shape.half, n), strict=True)]
    bounds = [(low, high + 1e-12) for low, high in bounds]
    if k < 3:
        bounds += [(0.0, 2.0 * np.pi)] * n + [(-1.0, 1.0)] * n
    stop = time.process_time() + seconds
    found = scipy.optimize.differential_evolution(
        value, bounds, rng=seed, maxiter=10**6, tol=0.0, callback=lambda *_: time.process_time() > stop, polish=True
    )
    return float(np.exp(found.fun)), evaluations


def against_evolution(
    problems: dict[str, Problem], seeds: int, starts: int = STARTS, times: float = 1.0
) -> list[tuple]:
    """Return rows of problem, seed, seconds, evaluations, figure of evolution, of the search, and ratio.

    Evolution gets ``times`` the processor time of the search.
    """
    name = "gdop"
    rows = []
    for title, problem in problems.items():
        goal = objective(name, problem, Conditions())
        for seed in range(seeds):
            begin = time.process_time()
            ours = search(problem, goal, np.random.default_rng(seed), starts=starts).value
            seconds = time.process_time() - begin
            theirs, evaluations = evolved(problem, name, times * seconds, seed)
            rows.append((title, seed, seconds, evaluations, theirs, ours, theirs / ours))
    return rows


PUBLISHED = {
    "cube12": 3,
    "p1_face_diagonals": 1,
    "p2_face_centres": 1,
    "p3_three_plus_one": 3,
    "nap_3_2_2_2": 1,
    "mimu4444": 3,
}
"""Published structures, and the axes per chip with which their channels are placed anew."""


def against_published(starts: int = 10) -> list[tuple]:
    """Return rows of structure, channels, its GDOP, that of the search in its own box with its channels, and ratio."""
    rows = []
    for name, k in PUBLISHED.items():
        array = AccelerometerArray.load(name)
        places = array.chip_positions
        low, high = places.min(axis=0), places.max(axis=0)
        apart = np.linalg.norm(places[:, None] - places[None], axis=-1)[np.triu_indices(len(places), 1)].min()
        several = len(places) * k < array.n_channels  # several axes at one point become chips of their own there
        problem = Problem(
            array.n_channels // k,
            k,
            box(high - low, (low + high) / 2.0),
            min_spacing_m=0.0 if several else min(0.005, float(apart)),
            length_unit_m=array.length_unit,
        )
        ours = search(problem, objective("gdop", problem, Conditions()), np.random.default_rng(0), starts=starts).value
        theirs = score(array)[0].gdop
        rows.append((name, array.n_channels, theirs, ours, theirs / ours))
    return rows


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--times", type=float, default=1.0, help="processor time of evolution over that of the search")
    chosen = parser.parse_args()
    search(PROBLEMS["6 single, cube"], objective("gdop", PROBLEMS["6 single, cube"], Conditions()),
           np.random.default_rng(0), starts=1)  # fmt: skip  # imports
    print(f"{'published structure':24} {'channels':>8} {'its GDOP':>9} {'found':>9} {'ratio':>8}")
    for row in against_published():
        print("{:24} {:8} {:9.4f} {:9.4f} {:8.4f}".format(*row), flush=True)
    print(f"\n{'problem':24} {'seed':>4} {'s':>6} {'evaluations':>11} {'evolution':>10} {'search':>9} {'ratio':>8}")
    rows = against_evolution(PROBLEMS, chosen.seeds, times=chosen.times)
    for row in rows:
        print("{:24} {:4} {:6.2f} {:11} {:10.4f} {:9.4f} {:8.4f}".format(*row), flush=True)
    better, worse = sum(row[-1] > 1 + 1e-6 for row in rows), sum(row[-1] < 1 - 1e-6 for row in rows)
    print(f"\nsearch better in {better} of {len(rows)} pairs, worse in {worse}")


if __name__ == "__main__":
    main()
