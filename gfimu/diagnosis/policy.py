"""Every chosen number of search, criticism and verdict, with its unit, what it means and what set it."""

from __future__ import annotations

from dataclasses import dataclass

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
    own_roughness: bool = False
    temperature: float = 1.2
    ambiguous: float = 2.0
    rivals: int = 4
