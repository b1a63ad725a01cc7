"""Every chosen number of search, criticism and verdict, with its unit, what it means and what set it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gfimu.base.units import STANDARD_GRAVITY

__all__ = ["Policy"]


@dataclass(frozen=True)
class Policy:
    """Thresholds of the diagnosis.

    Odds are natural logarithms (nats). Of each field stands its meaning, its unit in brackets, and what set it; "by
    choice" where no list of recordings did. What follows from others is a property.

    Parameters
    ----------
    beam : int
        Sets that are fitted after a screening, and terms of a surrogate that are chosen before they are fitted
        [count]. By choice: each more costs a fit.
    most_causes : int
        Most causes in a set [count]. By choice: wide causes enough describe anything.
    cause_odds : float
        Log odds, prior included, that a single cause needs against nothing [nats]. Set on null runs that no reported
        figure uses.
    extra_odds : float
        Log odds that a further cause, or a term of a surrogate, needs against the set without it [nats]. Set as
        ``cause_odds``, beside causes that leave a little by their own inexactness.
    extra_cause : float
        Log prior odds of each cause beyond the first [nats]. By choice: ln 0.3.
    close : float
        Log odds behind the best set within which a set is fitted again under other nuisance parameters [nats]. By
        choice: what learning them anew may change.
    rounds : int
        Most rounds of screening and learning [count]. By choice: a limit, most searches repeat themselves before.
    steps : int
        Most Gauss-Newton steps of a fit [count]. By choice: a limit, most fits settle before.
    knots : float
        Distance of the knots of a drive at first [s]. By choice: knots are halved where a drive shows more.
    knot_odds : float
        Log odds that knots twice as close need [nats]. By choice: those of a cause (``cause_odds``), as causes of
        timing would else take what knots are not yet worth.
    steady : float
        Log odds that more of the same needs: another round of learning, all functions on a series instead of one
        [nats]. By choice: more than noise gains by it.
    worth_a_search : float
        Log odds by which a promise of the linear form may err: what falls short by more is not fitted [nats]. By
        choice.
    residue_odds : tuple of (float, float)
        Sizes of a residue of the calibration [tolerances] and the log odds that each needs [nats]. By choice: that
        everything is a little off is what anybody expects; three times as much needs what a further cause does.
    most_searched : int
        Stretches of a long recording in which causes and terms are searched [count]. By choice: they take the time.
    usual_flicker : float
        Median of the prior of the bias instability, rms [m/s²]. By choice: 0.2 mg, of MEMS chips.
    flicker_spread : float
        Standard deviation of its logarithm [1]. By choice: a factor of 3.3.
    channel_spread : float
        Standard deviation of the logarithm of a channel's over that of its array [1]. By choice: a factor of two.
    largest_flicker : float
        Largest usual bias instability [m/s²]: 1.5 mg. Set above the data sheet's of an ADXL345.
    least_walk : float
        Weakest random walk of the biases that differs from bias instability [m/s² per √s]. By choice.
    walk_to_drive : float
        Share of a walk's strength that is uncertain, as the drive follows what all channels have in common [1]. Set by
        walks of known strength.
    loud_ratio : float
        Bias instability of one channel over the median of the others, from which it stands out [1]. Set on 130 cases,
        whose right verdicts reached 3.0.
    white_ratio : float
        White noise over the expected one, median of the channels, from which it is too much; of each channel the root
        of that, of the squares of a fit the square [1]. Set beyond what parts of a kind differ by.
    noise_accuracy : float
        Share by which the level and the spectrum of learnt noise may err [1]. By choice: a robust level of some
        thousand samples.
    lack_odds : float
        Log odds from which what no effect explains is significant: a lack of fit, a random walk of the biases, each
        isolated bad sample beyond the usual ones [nats]. Set on runs with nothing hidden, of which one in 320 reached
        it.
    chance : float
        Probability that a test of a recording without faults is significant, all its looks together [1]. By choice.
    spikes : float
        Isolated bad samples that happen in any recording [count]. By choice.
    spike_share : float
        Share of all samples that they may be where that is more [1]. By choice.
    stds : float
        Standard errors beyond which a figure counts: held-out gains, sizes over their uncertainty [1]. By choice: one
        in twenty by chance.
    noise_stds : float
        Standard deviations that noise keeps within: fast residuals are clipped there, and the floor of a held-out
        misfit may be raised by so many of its errors [1]. By choice.
    excess_stds : float
        Standard errors of the squares of noise from which a misfit is in excess [1]. By choice.
    least_share : float
        Share that is too little [1]: of the held-out excess, below which causes are withdrawn; of the prior's
        information that the data of a free body add, below which a combination of sizes stays at zero. By choice: more
        is missed than explained, or the prior says more than the data.
    sizeable : float
        Share that is worth a sentence, or a change of the noise [1]: of the range of the noise power over six parts of
        the samples, of a residual that follows a quantity, of the gain that validation data lack. Set beyond what the
        noise of a part changes by.
    small : float
        Share that is a small one [1]: of the log odds of a round's best term, of the excess of causes that explain it
        whole, of an rms beyond the noise, of the probability of a cause that no size of it shows, of the misfit beside
        right causes of a free body, of the scale of an angular acceleration that a gyro hardly follows, of the largest
        weight in a combination of sizes. By choice: a tenth.
    dominant : float
        Share of what causes explain from which a lack of fit refutes them, and below which a round of terms, or a
        correlation, is negligible [1]. Set by the right causes of simulated runs, which leave less.
    inexactness : float
        Log odds of a lack of fit per square that causes explain, which the inexactness of any model leaves [nats]. Set
        by the right causes of simulated runs.
    block_duration : float
        About how long a held-out block is [s]. By choice: several blocks in the shortest run, each much longer than a
        corner of the drive.
    block_angle_std : float
        Standard deviation of the table's angle at the first sample of a block [rad]. Set by its uncertainty after the
        fit of the whole run.
    temperature : float
        Divisor of log posteriors [1]: the linear Gaussian model is never quite true. Set where it makes what was
        hidden in the runs ``faint`` of `sim.trials.study` the most likely.
    most_certain : float
        Largest probability that is reported [1]. Set by `sim.trials.study`: of causes surer than this, 3 of 1000 were
        wrong.
    free_body : bool
        Whether the thresholds are those of a free body, whose drive nothing is known of [1]. Set by `of_body`. What all
        its chips share then passes for specific force; an effect means nothing beside one that can do all it does; sets
        have many causes, so that they grow from the present one; and causes that miss a little are no coincidence.
    """

    beam: int = 6
    most_causes: int = 4
    cause_odds: float = 4.0
    extra_odds: float = 7.0
    extra_cause: float = -1.2
    close: float = 22.0
    rounds: int = 6
    steps: int = 10
    knots: float = 0.05
    knot_odds: float = 4.0
    steady: float = 5.0
    worth_a_search: float = 3.0
    residue_odds: tuple[tuple[float, float], ...] = ((1.0, 3.0), (3.0, 7.0))
    most_searched: int = 6
    usual_flicker: float = 0.2e-3 * STANDARD_GRAVITY
    flicker_spread: float = float(np.log(3.3))
    channel_spread: float = float(np.log(2.0))
    largest_flicker: float = 1.5e-3 * STANDARD_GRAVITY
    least_walk: float = 3e-3
    walk_to_drive: float = 0.08
    loud_ratio: float = 4.0
    white_ratio: float = 1.3
    noise_accuracy: float = 0.01
    lack_odds: float = 10.0
    chance: float = 1e-3
    spikes: float = 3.0
    spike_share: float = 1e-4
    stds: float = 2.0
    noise_stds: float = 3.0
    excess_stds: float = 4.0
    least_share: float = 0.5
    sizeable: float = 0.25
    small: float = 0.1
    dominant: float = 0.03
    inexactness: float = 2.5e-3
    block_duration: float = 8.0
    block_angle_std: float = 5e-3
    temperature: float = 1.2
    most_certain: float = 0.997
    free_body: bool = False

    @property
    def ambiguous(self) -> float:
        """Log odds within which two statements can't be distinguished, nats: those of ``stds`` standard deviations."""
        return 0.5 * self.stds**2

    @property
    def seen(self) -> float:
        """d′ from which an effect is found nearly always: ``cause_odds`` in squares, and ``stds`` of chance beyond."""
        return float(np.sqrt(2.0 * self.cause_odds)) + self.stds

    @property
    def mimic_energy(self) -> float:
        """Squares that an effect may leave of another that it is confounded with: those of ``worth_a_search``."""
        return 2.0 * self.worth_a_search

    @property
    def usual_excess(self) -> float:
        """Squares that a fit may leave over those of noise, less one, where the noise is not yet learnt."""
        return self.white_ratio**2 - 1.0

    @property
    def unequal_walk(self) -> float:
        """Minus the log of the chance at which channels differ too much for a random walk: that of two tests."""
        return -2.0 * float(np.log(self.chance))

    @property
    def body_causes(self) -> int:
        """Largest set of a free body: arrays that are carried about differ from their twin in twice as much."""
        return 2 * self.most_causes

    @property
    def body_rounds(self) -> int:
        """Most rounds of screening and learning on a free body, each a Gauss-Newton step."""
        return 2 * self.rounds

    @property
    def body_dominant(self) -> float:
        """As ``dominant``, of a free body: real hands, wheels and belts leave up to a tenth beside what is right."""
        return self.small

    @property
    def body_spike_share(self) -> float:
        """Share of isolated bad samples of a free body beyond which they are no faults: samples lag behind a hand."""
        return 20.0 * self.spike_share

    @property
    def least_information(self) -> float:
        """Information over the prior's below which a combination of sizes stays at zero; on a table none."""
        return self.least_share if self.free_body else 0.0

    @property
    def motion_odds(self) -> float:
        """Log odds that noise which grows with the motion needs: thrice a lack of fit, as loud samples gather."""
        return 3.0 * self.lack_odds

    def of_body(self) -> Policy:
        """Return the thresholds for a free body."""
        return replace(
            self,
            most_causes=self.body_causes,
            rounds=self.body_rounds,
            dominant=self.body_dominant,
            free_body=True,
        )
