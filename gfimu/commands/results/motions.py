"""The results of `gfimu estimate`, `impact`, `live` and `view`."""

from __future__ import annotations

from typing import Annotated, Any

from msgspec import UNSET, UnsetType

from gfimu.commands.results.base import Files, Number, Numbers, Result
from gfimu.commands.results.shared import ChannelFault
from gfimu.files.schema import about

__all__ = [
    "AtRest",
    "Centripetal",
    "Consistency",
    "Constant",
    "Disagreement",
    "Estimated",
    "Fault",
    "Health",
    "Impacted",
    "LiveEvent",
    "LiveFault",
    "LiveSample",
    "Mounting",
    "Position",
    "Viewed",
]


class Disagreement(Result, kw_only=True):
    """How much more the channels disagree than their stated noise."""

    enlarged: Annotated[bool, about("Whether standard deviations were multiplied anywhere.")]
    notable: Annotated[bool, about("Whether the factor exceeds 2 in a notable share of the samples.")]
    share: Annotated[Number, about("Share of the samples in which it does.")]
    times: Annotated[Number, about("Median of the factor over those samples; 1 without any.")]
    slow_times: Annotated[Number, about("Median of the factor in the slowest third of the samples that turn.")]
    fast_times: Annotated[Number, about("Median of the factor in the fastest third.")]
    slow_rad_s: Annotated[Number, about("Median rate of the slowest third.", "rad/s")]
    fast_rad_s: Annotated[Number, about("Median rate of the fastest third.", "rad/s")]


class Consistency(Result, kw_only=True):
    """Innovations of a filter against what it states."""

    nis: Annotated[Number, about("Mean normalised innovation squared per degree of freedom.")]
    expected: Annotated[Number, about("What a right model gives: 1.")]
    bound: Annotated[
        Number, about("Largest mean that noise and typical deviations of the parts give, but for false_alarm.")
    ]
    noise_bound: Annotated[Number, about("Largest mean that the noise alone gives.")]
    worst_second: Annotated[Number, about("The mean over the worst second.")]
    worst_second_bound: Annotated[Number, about("Its bound.")]
    worst_second_at_s: Annotated[Number, about("When that second begins.", "s")]
    consistent: Annotated[bool, about("Whether both means are within their bounds.")]
    worst_channel: Annotated[
        str | None, about("Channel without which the innovations shrink most; null where none stands out.")
    ]
    nis_without_worst: Annotated[Number, about("The mean without it.")]
    degrees_of_freedom: Annotated[int, about("Combinations that were compared, over all samples.")]
    false_alarm: Annotated[
        Number, about("Probability of calling a right model inconsistent, by each of the two tests.")
    ]


class Centripetal(Result, kw_only=True):
    """Agreement of the centripetal terms in the null space with a gyro."""

    slope: Annotated[Number, about("Slope of measured against expected terms; 1 is perfect.")]
    correlation: Annotated[Number, about("Correlation of the two.")]
    samples: Annotated[int, about("Samples that were used.")]


class Constant(Result, kw_only=True):
    """A constant of a mounting that was estimated."""

    name: Annotated[str, about("Name, with its unit.")]
    value: Annotated[Number, about("Correction to the array file, in the unit of the name.")]
    std: Annotated[Number, about("Its standard deviation.")]
    prior_std: Annotated[Number, about("Its standard deviation before.")]


class Mounting(Result, kw_only=True):
    """Constants of a mounting that were estimated with the rotation."""

    constants: Annotated[list[Constant], about("The constants.")]
    determined_combinations: Annotated[int, about("Combinations that these data determine.")]
    undetermined_combinations_in_prior_std: Annotated[
        list[str], about("Combinations that they do not, in units of the prior standard deviations.")
    ]


class Position(Result, kw_only=True):
    """Where navigation ends, and the constant errors that would explain it."""

    after_s: Annotated[Number, about("Time since the start of navigation.", "s")]
    position_m: Annotated[Numbers, about("Position at the end, world axes.", "m")]
    equivalent_p_bias_m_s2: Annotated[Numbers, about("Constant bias of p that explains it, world axes.", "m/s²")]
    equivalent_rate_drift_deg_h: Annotated[
        Number, about("Constant drift of the rate that explains the horizontal part.", "°/h")
    ]
    earth_horizontal_rate_deg_h: Annotated[
        Number, about("Horizontal part of the Earth's rate; null without a latitude.", "°/h")
    ]


class AtRest(Result, kw_only=True):
    """Specific force of the body origin at rest, less gravity."""

    start_s: Annotated[Number, about("Start of the rest.", "s")]
    stop_s: Annotated[Number, about("Its end.", "s")]
    bias_mg: Annotated[Numbers, about("Mean of p less gravity, body axes.", "mg")]
    std_mg: Annotated[Numbers, about("Standard uncertainty of that mean.", "mg")]
    lean_rad: Annotated[Number, about("Lean that would read the same across the vertical.", "rad")]
    magnitude_mg: Annotated[Number, about("|p| less gravity, which no lean makes.", "mg")]
    magnitude_std_mg: Annotated[Number, about("Its standard uncertainty.", "mg")]


class Fault(Result, kw_only=True):
    """A fault, with all channels that it is on."""

    channels: Annotated[list[str], about("The channels; where it is not isolated, one set that explains it.")]
    kind: Annotated[str, about("step, drift, gain, noise, stuck, spikes or unknown.")]
    isolated: Annotated[bool, about("Whether the fault is certain to be on these channels.")]
    onset_s: Annotated[Number, about("When it began.", "s")]
    found_s: Annotated[Number, about("When it was found.", "s")]
    end_s: Annotated[Number, about("When it ended; null: not before the end.", "s")]
    sizes_m_s2: Annotated[Numbers, about("Its size on each channel.", "m/s²")]
    sizes_std_m_s2: Annotated[Numbers, about("Standard deviations of the sizes.", "m/s²")]
    statistic: Annotated[Number, about("Test statistic at which it was found.")]
    alternatives: Annotated[
        list[list[str]], about("Where it is not isolated: the sets of channels each of which explains it.")
    ]
    excluded: Annotated[bool, about("Whether the channels were left out.")]


class Health(Result, kw_only=True):
    """Health of the channels."""

    faults: Annotated[list[Fault], about("Faults, in the order in which they were found.")]
    share_unexplained: Annotated[Number, about("Share of the samples that no fault explains.")]
    largest_statistic: Annotated[Number, about("Largest statistic of a channel in the run.")]
    threshold: Annotated[Number, about("Threshold above which it counts as a fault.")]
    model_factor: Annotated[
        Number, about("Factor on the stated errors of gains, axes and positions at which the channels agree.")
    ]


class Estimated(Result, kw_only=True):
    """Key figures of an estimate."""

    array: Annotated[str, about("Name of the array.")]
    method: Annotated[str, about("Method for the angular rate.")]
    form: Annotated[str, about("How readings turn into p and α.")]
    samples: Annotated[int, about("Samples.")]
    gaps: Annotated[int, about("Places where samples are lost.")]
    samples_without_estimate: Annotated[int, about("Samples whose channels don't suffice.")]
    duration_s: Annotated[Number, about("Length.", "s")]
    sample_rate_hz: Annotated[Number, about("Sample rate.", "Hz")]
    p_rms_m_s2: Annotated[Numbers, about("Specific force of the body origin, rms of x, y, z.", "m/s²")]
    alpha_rms_rad_s2: Annotated[Numbers, about("Angular acceleration, rms of x, y, z.", "rad/s²")]
    omega_rms_rad_s: Annotated[Numbers, about("Angular rate, rms of x, y, z.", "rad/s")]
    omega_std_rad_s: Annotated[Numbers, about("Standard deviation of ω at the end, x, y, z.", "rad/s")]
    angle_rad: Annotated[Number, about("Angle at the end.", "rad")]
    tacho_rmse_rad_s: Annotated[Number, about("Rate against the tachometer, rms; null without one.", "rad/s")]
    gyro_rmse_rad_s: Annotated[Number, about("Rate against the gyro, rms; null without one.", "rad/s")]
    centripetal: Annotated[Centripetal | None, about("Centripetal terms against the gyro; null without one.")]
    disagreement: Annotated[
        Disagreement | None, about("Disagreement of the channels; null of methods that do not measure it.")
    ]
    sign_undecided_samples: Annotated[
        int | None, about("Samples whose sign of the rate is not decided; null of methods without one.")
    ]
    consistency: Annotated[
        Consistency | None, about("Innovations against what the filter states; null of methods without a filter.")
    ]
    mounting: Annotated[
        Mounting | None, about("Constants of the mounting that were estimated; null where it is exact.")
    ]
    position: Annotated[Position | None, about("Where navigation ends; null without --position.")]
    at_rest: Annotated[AtRest | None, about("Specific force at rest; null without a rest.")]
    health: Annotated[Health | None, about("Health of the channels; null of methods that do not watch it.")]
    faults: Annotated[list[ChannelFault], about("Faults, an entry for each channel.")]
    channels_left_out: Annotated[list[str], about("Channels that were not used.")]
    warnings: Annotated[list[str], about("What speaks against these figures.")]
    files: Files


class Impacted(Result, kw_only=True):
    """One impact."""

    time_zero_s: Annotated[Number, about("Time zero in the recording's time.", "s")]
    duration_s: Annotated[Number, about("From time zero until the resultant of p stays below the threshold.", "s")]
    offset_m_s2: Annotated[dict[str, Number], about("Reading of each channel before time zero, taken off.", "m/s²")]
    peak_p_m_s2: Annotated[Number, about("Largest resultant of p.", "m/s²")]
    peak_p_time_s: Annotated[Number, about("When, after time zero.", "s")]
    velocity_change_m_s: Annotated[Numbers, about("Integral of p over the duration, body axes.", "m/s")]
    peak_alpha_rad_s2: Annotated[Number, about("Largest resultant of α.", "rad/s²")]
    peak_alpha_std_rad_s2: Annotated[Number, about("Its standard deviation.", "rad/s²")]
    peak_alpha_time_s: Annotated[Number, about("When, after time zero.", "s")]
    peak_omega_rad_s: Annotated[Number, about("Largest resultant of ω.", "rad/s")]
    hic15: Annotated[Number, about("Head injury criterion over at most 15 ms.")]
    warnings: Annotated[list[str], about("What speaks against these figures.")]
    files: Files


class LiveSample(Result, kw_only=True):
    """The estimate at one sample."""

    t_s: Annotated[Number, about("Its time.", "s")]
    omega_rad_s: Annotated[Numbers, about("Angular rate, body axes.", "rad/s")]
    omega_std_rad_s: Annotated[Numbers | None, about("Its standard deviation; null where it is not known.", "rad/s")]
    nis: Annotated[Number, about("Normalised innovation squared.")]
    nis_dof: Annotated[int, about("Its degrees of freedom.")]
    sign: Annotated[str, about("Whether the sign of the rate is known, decided or undecided.")]
    noise_scale: Annotated[Number | UnsetType, about("How much larger the noise is than stated.")] = UNSET
    omega_sign_probability: Annotated[Number | UnsetType, about("Probability that the sign of the rate is right.")] = (
        UNSET
    )
    rest: Annotated[bool | UnsetType, about("True where a block of rest ended.")] = UNSET
    health: Annotated[
        list[int] | UnsetType, about("Of each channel: 0 used, 1 excluded, 2 missing, 3 saturated, 4 stuck.")
    ] = UNSET
    fault: Annotated[str | dict[str, Any] | UnsetType, about("What was wrong with the line or its channels.")] = UNSET
    rate_rad_s: Annotated[Number | UnsetType, about("About a known axis: the rate.", "rad/s")] = UNSET
    rate_std_rad_s: Annotated[Number | UnsetType, about("About a known axis: its standard deviation.", "rad/s")] = UNSET
    alpha_rad_s2: Annotated[Number | UnsetType, about("About a known axis: the angular acceleration.", "rad/s²")] = (
        UNSET
    )
    angle_rad: Annotated[Number | UnsetType, about("About a known axis: the angle.", "rad")] = UNSET


class LiveFault(Result, kw_only=True):
    """A line that could not be read, and was skipped."""

    fault: Annotated[str, about("What was wrong with it.")]


class LiveEvent(Result, kw_only=True):
    """A channel that is left out from now on, or used again."""

    event: Annotated[str, about("excluded, cleared or another event.")]
    t_s: Annotated[Number | UnsetType, about("When.", "s")] = UNSET
    faults: Annotated[list[dict[str, Any]], about("Faults, an entry for each channel.")]
    text: Annotated[str, about("The event in words.")]


class Viewed(Result, kw_only=True):
    """What is shown in the viewer."""

    files: Files
