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
    least_share : float
        Share of the held-out excess below which causes are withdrawn: they miss more than they explain.
    gate_stds : float
        Standard errors beyond which a held-out figure counts.
    worse : float
        Ratio of the rms after to the rms before up to which a rise is the noise of the drive.
    near_noise : float
        Ratio of an rms to the noise floor up to which it is no evidence against a cause.
    block_duration : float
        About how long a held-out block is, s: several blocks in the shortest run, each much longer than a corner of
        the drive.
    block_angle_std : float
        Standard deviation of the table's angle at the first sample of a block, rad: its uncertainty after the
        fit of the whole run.
    significant_excess : float
        Standard errors of the noise floor from which held-out misfit counts as an excess.
    least_excess : float
        Share of the noise floor from which it counts: what the spectrum of slow noise may be wrong by.
    floor_slack : float
        Standard errors by which the noise floor may be raised to the misfit of the fitted part.
    clipped : float
        Squares of fast residuals, in variances, at which they are clipped for the noise floor, so that a line does not
        count as noise: 3 σ.
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
    least_share: float = 0.5
    gate_stds: float = 2.0
    worse: float = 1.01
    near_noise: float = 1.1
    block_duration: float = 8.0
    block_angle_std: float = 5e-3
    significant_excess: float = 4.0
    least_excess: float = 0.01
    floor_slack: float = 3.0
    clipped: float = 9.0
