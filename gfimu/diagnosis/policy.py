"""Every chosen number of search, criticism and verdict, with its unit, what it means and what set it."""

from __future__ import annotations

from dataclasses import dataclass

from gfimu.units import STANDARD_GRAVITY

__all__ = ["Policy"]


@dataclass(frozen=True)
class Policy:
    """Thresholds of the diagnosis.

    Parameters
    ----------
    beam : int
        Sets that are fitted after a screening.
    most_causes : int
        Largest set.
    cause_odds : float
        Log odds, prior included, that a single cause needs against nothing.
    extra_odds : float
        Log odds that a further cause needs against the set without it.
    extra_cause : float
        Log prior odds of each cause beyond the first.
    close : float
        Log odds behind the best set within which a set is judged again as a rival.
    rounds : int
        Of screening and learning.
    steps : int
        Gauss–Newton steps of a fit.
    settled : float
        Nats that a step must promise to be taken.
    """

    beam: int = 6
    most_causes: int = 4
    cause_odds: float = 4.0
    extra_odds: float = 7.0
    extra_cause: float = -1.2
    close: float = 22.0
    rounds: int = 6
    steps: int = 10
    settled: float = 0.3
    learnings: int = 3
    knots: float = 0.05
    temperature: float = 1.2
    ambiguous: float = 2.0
    rivals: int = 4
    walk_odds: float = 10.0
    largest_flicker: float = 1.5e-3 * STANDARD_GRAVITY
    unequal_walk: float = 14.0
    least_walk: float = 3e-3
    walk_to_drive: float = 0.08
    loud_ratio: float = 4.0
    loud_odds: float = 2.0
    white_ratio: float = 1.3
    white_ratio_least: float = 1.15
    white_accuracy: float = 0.01
    residue_odds: tuple[tuple[float, float], ...] = ((1.0, 3.0), (3.0, 7.0))
    worth_a_search: float = 3.0
    most_searched: int = 6
    most_certain: float = 0.997
    mimic_energy: float = 6.0
    seen: float = 2.0
    unseen_at_most: float = 0.9
    lack_odds: float = 10.0
    inexactness: float = 2.5e-3
    dominant: float = 0.03
    beyond_chance: float = 4.0
    least_gain: float = 2.0
    fair: float = 1.6
    knot_odds: float = 100.0
