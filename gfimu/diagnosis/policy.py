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
    starts : int
        Further optima over the shapes of an effect from which the best set is fitted: modes at other frequencies.
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
    largest_flicker : float
        Largest usual bias instability, m/s²: 1.5 mg, above the data sheet's of an ADXL345. More is something else.
    walk_odds : float
        Log odds that a random walk of the biases needs over bias instability alone; the same as for a lack of fit.
    unequal_walk : float
        `Walk.unequal`, nats, from which the channels differ too much for a random walk: a chance of one in a million.
    least_walk : float
        Weakest random walk that differs from bias instability, m/s² per √s.
    walk_to_drive : float
        Share of a walk's strength that is uncertain, as the drive follows what all channels have in common.
    loud_ratio : float
        Bias instability of one channel over the median of the others; right verdicts of 130 cases reached 3.0.
    loud_odds : float
        Nats by which its level must be likelier than that ratio: two standard deviations.
    white_ratio, white_ratio_least : float
        White noise over the expected one, median and least of the channels, beyond what parts of a kind differ by.
    white_accuracy : float
        Share of a white level that is uncertain, as the level is a robust one.
    lack_odds : float
        Log odds from which a lack of fit is significant; one in 320 runs with nothing hidden reached it.
    every_channel, every_function : float
        Nats by which one function on all channels, and all functions on one series, must beat a simpler finding.
    steady_noise : float
        Range of the noise power over six parts of the samples, of its mean: a part's own noise changes by less.
    spikes, spike_share : float
        Isolated bad samples, and their share of all, that happen in any recording.
    spike_odds : float
        Log odds of each where there are more.
    most_terms, terms_per_round : int
        Terms of a surrogate, and those that are chosen before they are fitted.
    term_odds : float
        Log odds that a term of a surrogate needs.
    comparable : float
        Share of a round's best log odds below which a term waits for the next round: a large term is not linear.
    nearly_all : float
        Share of the log odds of a function on all channels below which one channel alone must stay.
    least_described : float
        Share of the excess misfit that a round of terms must take away to describe anything.
    most_searched : int
        Stretches of a long recording on which terms are chosen.
    body_causes : int
        Largest set of a free body: arrays that are carried about differ from their twin in more than a table's do.
    body_rounds : int
        Of screening and learning on a free body, each a Gauss–Newton step.
    body_dominant : float
        As ``dominant``, of a free body: real hands, wheels and belts leave up to a tenth beside what is right.
    body_spike_share : float
        Share of isolated bad samples of a free body beyond which they are no faults: it moves faster than the samples
        follow.
    blur : float
        Standard deviations of all observations of a sample together from which what a drive misses of an angular
        acceleration is worth closer knots.
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
    starts: int = 3
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
    largest_flicker: float = 1.5e-3 * STANDARD_GRAVITY
    walk_odds: float = 10.0
    unequal_walk: float = 14.0
    least_walk: float = 3e-3
    walk_to_drive: float = 0.08
    loud_ratio: float = 4.0
    loud_odds: float = 2.0
    white_ratio: float = 1.3
    white_ratio_least: float = 1.15
    white_accuracy: float = 0.01
    lack_odds: float = 10.0
    every_channel: float = 2.0
    every_function: float = 5.0
    steady_noise: float = 0.25
    spikes: float = 3.0
    spike_share: float = 1e-4
    spike_odds: float = 10.0
    most_terms: int = 16
    terms_per_round: int = 6
    term_odds: float = 8.0
    comparable: float = 0.1
    nearly_all: float = 0.9
    least_described: float = 0.03
    residue_odds: tuple[tuple[float, float], ...] = ((1.0, 3.0), (3.0, 7.0))
    worth_a_search: float = 3.0
    most_searched: int = 6
    most_certain: float = 0.997
    mimic_energy: float = 6.0
    seen: float = 2.0
    unseen_at_most: float = 0.9
    inexactness: float = 2.5e-3
    dominant: float = 0.03
    beyond_chance: float = 4.0
    least_gain: float = 2.0
    fair: float = 1.6
    knot_odds: float = 10.0
    blur: float = 0.5
    hopeless: float = 40.0
    steady: float = 5.0
    body_causes: int = 8
    body_rounds: int = 12
    body_dominant: float = 0.1
    body_spike_share: float = 2e-3
