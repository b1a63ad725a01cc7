"""Stretches in which a filter follows the mirrored rate: Ω² shows no sign, so that it is locked there once it is wrong.

A filter takes the sign of the rate from the angular acceleration while the rate is near zero. A bias or a lever that is
wrong can make it take the other one. Afterwards the angular acceleration, and gravity that turns in an inclined body,
contradict the mirrored rate, but Ω² holds it, and the stated standard deviation does not show it. From each sample at
which the rate comes clear of zero the filter is therefore run again with the sign changed. Where that explains the
readings up to the next zero better, the sign is changed there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gfimu.rate.axis.problem import AxisProblem, Settings
from gfimu.rate.axis.recursion import FilterRun

__all__ = ["MirrorTest", "clear_starts", "first_odds", "with_signs"]


@dataclass(frozen=True)
class MirrorTest:
    """When a sign is changed; all by choice.

    Parameters
    ----------
    clear : float
        Rate in its standard deviations, from which a change of sign is another motion and not noise about zero.
    nats : float
        Log odds of the mirrored rate from which the sign is changed; over the mean normalised innovation squared, where
        that is larger than 1.
    shortest : int
        Samples of a stretch that is tested.
    most : int
        Changes of sign in a run; one that needs more is followed by no model.
    """

    clear: float = 5.0
    nats: float = 20.0
    shortest: int = 10
    most: int = 20


def with_signs(
    problem: AxisProblem,
    settings: Settings,
    start: NDArray[np.float64],
    covariance: NDArray[np.float64],
    test: MirrorTest = MirrorTest(),
    *,
    first_kept: bool = False,
) -> AxisProblem:
    """Return the problem with the sign of the rate changed where the mirrored rate explains the readings better.

    Parameters
    ----------
    problem : AxisProblem
        Readings; changes of sign that it has are kept.
    settings : Settings
        Numbers of the filter.
    start, covariance : ndarray, shapes (3,) and (3, 3)
        State before the first sample and its covariance.
    test : MirrorTest
        When a sign is changed.
    first_kept : bool
        Whether the sign of the first stretch is given.
    """
    seen = -1  # stretches up to there have the better sign
    if first_kept:
        seen = next(iter(clear_starts(problem.run(settings, start, covariance), test)), -1)
    while len(problem.mirrored) < test.most:
        run = problem.run(settings, start, covariance)
        wrong = None
        for rows in _stretches(run, test):
            if rows.start <= seen:
                continue
            seen = rows.start
            if _mirrored_odds(problem, settings, run, rows) > test.nats:
                wrong = rows.start
                break
        if wrong is None:
            break
        problem = replace(problem, mirrored=np.sort(np.append(problem.mirrored, np.int64(wrong))))
    return problem


def clear_starts(run: FilterRun, test: MirrorTest = MirrorTest()) -> list[int]:
    """Return the samples at which the rate comes clear of zero."""
    return [rows.start for rows in _stretches(run, test)]


def first_odds(problem: AxisProblem, settings: Settings, run: FilterRun, test: MirrorTest = MirrorTest()) -> float:
    """Return the log odds of the rate over the mirrored one in the first stretch that is clear of zero, nats."""
    first = _stretches(run, test)[:1]
    return -_mirrored_odds(problem, settings, run, first[0]) if first else 0.0


def _stretches(run: FilterRun, test: MirrorTest) -> list[slice]:
    """Return the stretches in which the rate is clear of zero and of one sign."""
    rate, std = run.states[:, 1], np.sqrt(np.maximum(run.covariances[:, 1, 1], 0.0))
    state = np.where(np.abs(rate) > test.clear * std, np.sign(rate), 0.0)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(state)) + 1, [len(state)]])
    found = [slice(int(first), int(last)) for first, last in pairwise(edges)]
    return [rows for rows in found if state[rows.start] != 0.0 and rows.stop - rows.start >= test.shortest]


def _mirrored_odds(problem: AxisProblem, settings: Settings, run: FilterRun, rows: slice) -> float:
    """Return the log odds of the mirrored rate over the one found in a stretch, nats."""
    part = problem.part(rows)
    state, covariance = run.before[rows.start], run.before_covariances[rows.start]
    mirror = np.diag([1.0, -1.0, 1.0])
    found = part.run(settings, state, covariance)
    other = part.run(settings, mirror @ state, mirror @ covariance @ mirror)
    spread = max(min(one.squares / max(one.readings, 1) for one in (found, other)), 1.0)
    odds = (other.likelihood - found.likelihood) / spread
    return float(odds) if np.isfinite(odds) else -np.inf
