"""Every chosen number of the reading of files and of the judgement of recordings, with unit, meaning and source."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["GuessPolicy", "SamplePolicy", "StampPolicy"]


@dataclass(frozen=True)
class GuessPolicy:
    """Evidence for what columns of an unknown file are: natural logarithms of odds [nats] where no other unit stands.

    Parameters
    ----------
    unit : float
        A unit in the name, which programs write more carefully than words.
    word : float
        A word of the quantity in the name. By choice: words of processed quantities contain it too.
    letter : float
        A lone letter, as ``ax`` or ``wx``.
    table : float
        A word in the name of the table, which may hold several quantities.
    gravity : float
        The length at rest is gravity in a usual unit: a range of ±8 % about one of seven values in six decades.
    poses : float
        That length is the same in poses that differ, which rates never are.
    zero : float
        At rest the readings are near zero beside the largest, as rates are.
    constant : float
        The length at rest is the same throughout.
    near_in_motion : float
        Relative distance from gravity of the quietest pieces of a motion without rest, in a unit of the name [ratio].
    rare : float
        Distance from gravity by which a unit that hardly any logger writes has to be nearer [ratio]. A bias of 14 mg.
    pose_lengths : float
        Scatter of the lengths of poses, with the gains and biases of raw readings [ratio].
    exact_counts : float
        Distance of gravity from a usual number of counts, beyond which an offset or another scale is as likely [ratio].
        The gain and bias of most chips.
    unit_vector : float
        Distance of the length at rest from one, and its scatter, below which it is that of a direction [ratio]. Errors
        of gain are a hundred times that, and a chip has noise.
    ratio_error : float
        Error of the ratio of a gyro's numbers to the turn of gravity [nats]. Seen up to 0.067.
    """

    unit: float = 8.0
    word: float = 5.0
    letter: float = 2.0
    table: float = 3.0
    gravity: float = 4.0
    poses: float = 3.0
    zero: float = 2.0
    constant: float = 1.0
    near_in_motion: float = 0.3
    rare: float = 0.014
    pose_lengths: float = 0.2
    exact_counts: float = 0.03
    unit_vector: float = 1e-4
    ratio_error: float = 0.07


@dataclass(frozen=True)
class SamplePolicy:
    """Numbers by which readings are judged that can be no readings, or are wrong.

    Parameters
    ----------
    fewest : int
        Readings from which a channel is judged [count]. By choice.
    corrupt : float
        Size beyond which a value can be no measurement [medians]. By choice: 1e19 and the like.
    apart : float
        Distance of a single reading from those around it beside its noise, from which it is odd [std]. White noise
        exceeds 8 std once in 1e15 readings.
    rough : float
        The same beside what the readings around it differ [ranges]: a fast signal differs as well.
    clear : float
        Size of the readings around it beside their noise, from which zero, twice or minus their value shows [std].
    multiples : tuple of float
        What a misread register makes of a reading [ratio]: zero (no answer), twice or half (a shifted word), minus.
    most_wrong : float
        Largest share of such readings; what happens more often is the signal [ratio]. By choice.
    rail_width : int
        Distance beyond a rail at which single readings may lie [counts]. Ten were seen on a real one.
    beyond_pile : float
        Readings beyond a rail, of those on it [ratio]. One in forty on a real one.
    pile : float
        Readings at an extreme from which it is a rail [ratio of all]. By choice.
    least_pile : int
        The same at least [count]. By choice.
    steep : float
        Readings at a rail beside those one count below [ratio]. By choice: noise spreads what just gets there.
    least_levels : int
        Different values of a channel that moves [count]. By choice.
    garbage : int
        Readings that may be anything [count]. By choice.
    longest_equal : int
        Equal readings in a row that show nothing yet [count]. By choice.
    chance : float
        Probability of a run of equal readings by chance from which the channel was frozen. By choice.
    least_repeats : float
        Share of readings that repeat the one before, at least assumed [ratio]. By choice: of fine steps few are seen.
    around : int
        Readings before and after a value that is held, which show whether the signal joins it [count]. By choice.
    jump : float
        Step to a held value that no signal makes which joins it [std, and what neighbours differ]. By choice.
    noisy : float
        White noise beside the median of the channels [ratio]. By choice.
    sentinel_apart : float
        Distance of a number that stands for a missing one from all others [their range]. By choice.
    quietest : float
        White noise of one reading of the quietest accelerometer whose part is not known [m/s²]. 1 µg/√Hz at 100 Hz.
    least_noise : float
        White noise beside the data sheet's, from which a channel surely has noise of its own [ratio]. By choice.
    """

    fewest: int = 8
    corrupt: float = 1e6
    apart: float = 8.0
    rough: float = 3.0
    clear: float = 20.0
    multiples: tuple[float, ...] = (0.0, 2.0, 0.5, -1.0)
    most_wrong: float = 0.05
    rail_width: int = 12
    beyond_pile: float = 0.1
    pile: float = 0.002
    least_pile: int = 8
    steep: float = 3.0
    least_levels: int = 50
    garbage: int = 5
    longest_equal: int = 40
    chance: float = 1e-6
    least_repeats: float = 0.05
    around: int = 6
    jump: float = 6.0
    noisy: float = 3.0
    sentinel_apart: float = 3.0
    quietest: float = 1e-4
    least_noise: float = 0.3


@dataclass(frozen=True)
class StampPolicy:
    """Numbers by which the times of samples are judged.

    Parameters
    ----------
    fewest : int
        Times from which their steps are judged [count]. By choice.
    gap : float
        Step from which samples are missing [usual steps]. Half a sample more than the next one.
    scatter : float
        Standard deviation of the steps that is worth a word [usual steps]. By choice.
    irregular : float
        Mean deviation of the steps from the mean one, from which they are not those of the samples [steps]. A clock
        that reads each sample as it comes scatters by hundredths.
    bounded : float
        Deviation of the times from a steady clock beside that of a random walk of the same steps, below which the
        clock was steady and the stamps were late [ratio]. One random walk of 60 to 3000 exponential steps in 2000 is
        below 0.42 (simulated).
    whole : float
        Relative distance at which a rate is taken for a whole number. By choice: crystals are ten times better.
    """

    fewest: int = 30
    gap: float = 1.5
    scatter: float = 0.02
    irregular: float = 0.3
    bounded: float = 0.4
    whole: float = 2e-3
