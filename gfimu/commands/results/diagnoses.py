"""The results of `gfimu check`, `diagnose` and `design`."""

from __future__ import annotations

from typing import Annotated, Any

from msgspec import UNSET, UnsetType

from gfimu.commands.results.base import Files, Number, Numbers, Result
from gfimu.files.schema import about

__all__ = [
    "Cause",
    "Checked",
    "CheckedEffect",
    "CheckedRun",
    "Designed",
    "Diagnosed",
    "Gain",
    "NoiseLevels",
    "Pair",
    "Parameter",
    "ReferenceClock",
    "Residual",
    "RigidMotion",
    "Rival",
    "Segment",
    "Undetermined",
    "Unexplained",
]


class CheckedRun(Result, kw_only=True):
    """A recording."""

    name: Annotated[str, about("Its name.")]
    duration_s: Annotated[Number, about("Length.", "s")]
    sample_rate_hz: Annotated[Number | UnsetType, about("Sample rate.", "Hz")] = UNSET
    fastest_rad_s: Annotated[Number | UnsetType, about("Largest rate.", "rad/s")] = UNSET
    largest_acceleration_rad_s2: Annotated[
        Number | UnsetType, about("Largest angular acceleration (99 % quantile).", "rad/s²")
    ] = UNSET
    fastest_m_s: Annotated[Number | UnsetType, about("Of a stage: largest speed.", "m/s")] = UNSET
    largest_acceleration_m_s2: Annotated[
        Number | UnsetType, about("Of a stage: largest acceleration (99 % quantile).", "m/s²")
    ] = UNSET
    turns: Annotated[Number | UnsetType, about("Turns, all directions summed.")] = UNSET
    share_forwards: Annotated[Number | UnsetType, about("Share of the time that it turns forwards.")] = UNSET
    share_backwards: Annotated[Number | UnsetType, about("Share of the time that it turns backwards.")] = UNSET
    share_at_rest: Annotated[Number | UnsetType, about("Share of the time at rest.")] = UNSET
    lowest_degC: Annotated[Number | UnsetType, about("Lowest temperature.", "°C")] = UNSET
    highest_degC: Annotated[Number | UnsetType, about("Highest temperature.", "°C")] = UNSET


class CheckedEffect(Result, kw_only=True):
    """How well the motion shows an effect of its usual size."""

    name: Annotated[str, about("The effect.")]
    detectability: Annotated[
        Number, about("d′: its size in standard deviations, the motion unknown; below 5 it may be missed.")
    ]
    confused_with: Annotated[list[str], about("Effects that explain it as well.")]
    remedy: Annotated[str, about("What would separate it.")]


class Checked(Result, kw_only=True):
    """What recordings can show."""

    runs: Annotated[list[CheckedRun], about("The recordings.")]
    findings: Annotated[list[str], about("What is odd about the data.")]
    effects: Annotated[list[CheckedEffect], about("The twin's effects, the best seen first.")]
    advice: Annotated[list[str], about("What one more minute of recording should be.")]


class Parameter(Result, kw_only=True):
    """A parameter of a cause; its unit is in its key."""

    value: Annotated[Any, about("Its value: a number, or a name or list of names.")]
    std: Annotated[Number | UnsetType, about("Its standard deviation.")] = UNSET


class Cause(Result, kw_only=True):
    """A cause that the diagnosis names."""

    effect: Annotated[str, about("The effect; unlisted for one without a name.")]
    parameters: Annotated[dict[str, Parameter], about("Parameters; units in the keys.")]
    probability: Annotated[Number, about("Probability that this effect is among the causes.")]
    place: Annotated[str, about("Where it acts.")]
    not_distinguishable_from: Annotated[list[str], about("Effects that explain these data as well.")]
    would_be_separated_by: Annotated[str, about("Excitation that would separate them.")]
    why: Annotated[str, about("Where and how it shows, one sentence.")]
    log_odds: Annotated[Number, about("Log odds against the best explanation without it.", "nats")]
    name: Annotated[str | UnsetType, about("Of an unlisted one: its terms.")] = UNSET
    dependence: Annotated[str | UnsetType, about("Of an unlisted one: function of the motion.")] = UNSET
    pattern: Annotated[str | UnsetType, about("Of an unlisted one: how it is spread over the channels.")] = UNSET
    time: Annotated[str | UnsetType, about("Of an unlisted one: how it depends on time.")] = UNSET
    frame: Annotated[str | UnsetType, about("Of an unlisted one: the frame in which it is constant.")] = UNSET


class Residual(Result, kw_only=True):
    """Prediction error over all valid samples."""

    rms_before: Annotated[Number, about("Of the twin as given.", "m/s²")]
    rms_after: Annotated[Number, about("Of the extended twin.", "m/s²")]
    noise_floor: Annotated[Number, about("Noise as estimated from the data.", "m/s²")]
    unit: Annotated[str, about("Unit of all of these.")]
    before_by_channel: Annotated[dict[str, Number], about("Of the twin as given, by channel.", "m/s²")]
    after_by_channel: Annotated[dict[str, Number], about("Of the extended twin, by channel.", "m/s²")]


class Gain(Result, kw_only=True):
    """What the extension is worth on validation data."""

    held_out: Annotated[str, about("Which data these are; empty where none could be held out.")]
    held_out_rms_before: Annotated[Number, about("Prediction error before, rms.", "m/s²")]
    held_out_rms_after: Annotated[Number, about("Prediction error after, rms.", "m/s²")]
    share_of_excess_removed: Annotated[
        Number, about("Share of the error beyond noise that is gone: 1 − (after² − floor²)/(before² − floor²).")
    ]
    share_of_excess_removed_std: Annotated[Number, about("Its standard deviation.")]
    share_in_any_recording: Annotated[Number, about("The share without terms of absolute time.")]
    log_likelihood_per_sample: Annotated[Number, about("Gain of the log likelihood per sample.", "nats")]
    log_likelihood_std: Annotated[Number, about("Its standard error.", "nats")]
    rate_rmse_before_rad_s: Annotated[Number, about("Rate of the array against the reference, before.", "rad/s")]
    rate_rmse_after_rad_s: Annotated[Number, about("Rate of the array against the reference, after.", "rad/s")]
    position_drift_before_m: Annotated[Number, about("Position drift before.", "m")]
    position_drift_after_m: Annotated[Number, about("Position drift after.", "m")]


class Unexplained(Result, kw_only=True):
    """What nothing in the library explains."""

    significant: Annotated[bool, about("Whether it is more than chance.")]
    signature: Annotated[str, about("Which channels and which dependence, in words.")]
    log_odds: Annotated[Number, about("Log odds of the strongest term against chance.", "nats")]
    surrogate: Annotated[dict[str, Number], about("Coefficients of data-driven terms; units in the keys.")]
    extends_twin: Annotated[bool, about("Whether these terms are in the extended twin.")]
    left_out: Annotated[int, about("Terms that are not in it, as they are of absolute time.")]
    mistake: Annotated[str, about("A mistake in the files that makes the simulation fit; empty where none does.")]


class RigidMotion(Result, kw_only=True):
    """How the residual divides into single chips, the whole array and a spin."""

    place: Annotated[str, about("chips, array or spin; empty where that can't be tested.")]
    frame: Annotated[
        str, about("Frame in which a motion of the whole array is simpler; empty where that can't be said.")
    ]
    combinations: Annotated[int, about("Combinations of channels that no motion reaches.")]
    chips_std: Annotated[Number, about("Size of the part of single chips, in standard deviations.")]
    chips_slow_std: Annotated[Number, about("Size of its slow part, in standard deviations.")]
    array_std: Annotated[Number, about("Size of the part of the whole array, in standard deviations.")]
    array_slow_std: Annotated[Number, about("Size of its slow part, in standard deviations.")]


class Rival(Result, kw_only=True):
    """Another explanation."""

    effects: Annotated[list[str], about("Its effects.")]
    log_odds: Annotated[Number, about("Log odds against the verdict; negative: less probable.", "nats")]
    why: Annotated[str, about("Why it lost, one sentence.")]


class NoiseLevels(Result, kw_only=True):
    """Noise levels that were estimated."""

    white_over_data_sheet: Annotated[Number | UnsetType, about("White noise over that of the data sheet.")] = UNSET
    bias_instability_m_s2: Annotated[Number | UnsetType, about("Bias instability, median of the channels.", "m/s²")] = (
        UNSET
    )
    bias_instability_largest_m_s2: Annotated[
        Number | UnsetType, about("Bias instability, largest of the channels.", "m/s²")
    ] = UNSET
    bias_instability_largest_channel: Annotated[str | UnsetType, about("That channel.")] = UNSET
    reference_white: Annotated[Number | UnsetType, about("White noise of the reference, rad/s (of a stage m/s).")] = (
        UNSET
    )
    calibration_residue: Annotated[
        Number | UnsetType,
        about("Small errors of all the twin's numbers at once, in units of what a good calibration leaves."),
    ] = UNSET


class ReferenceClock(Result, kw_only=True):
    """Clock of a reference that was aligned before the diagnosis."""

    offset_s: Annotated[Number, about("Channels' clock less the reference's at the first sample.", "s")]
    offset_std_s: Annotated[Number, about("Its standard deviation.", "s")]
    rate_error: Annotated[Number, about("Seconds of the channels' clock per second of the reference's, less one.")]
    rate_error_std: Annotated[Number, about("Its standard deviation.")]


class Undetermined(Result, kw_only=True):
    """A combination of sizes that these data can't see."""

    effect: Annotated[str, about("The effect.")]
    combination: Annotated[dict[str, Number], about("Weights by parameter.")]
    text: Annotated[str, about("The combination in words.")]


class Diagnosed(Result, kw_only=True):
    """What a simulation gets wrong, and why."""

    format_version: Annotated[int, about("Version of the format.")]
    verdict: Annotated[str, about("nothing_found, explained, ambiguous or unknown.")]
    in_part: Annotated[bool, about("Whether the causes leave more than a tenth of the excess on held-out data.")]
    library_probability: Annotated[Number, about("Probability that the library, or the grammar, holds the truth.")]
    coincidence_nats: Annotated[
        Number, about("Log odds that terms outside the library coincide with the causes.", "nats")
    ]
    sentences: Annotated[list[str], about("The verdict in words, most important first.")]
    reference_clock: Annotated[ReferenceClock | None, about("Clock of the reference; null where it was not aligned.")]
    causes: Annotated[list[Cause], about("Causes by contribution.")]
    residual: Annotated[Residual, about("Prediction error before and after.")]
    gain: Annotated[Gain, about("What the extension is worth.")]
    unexplained: Annotated[Unexplained, about("What nothing in the library explains.")]
    rigid_motion: Annotated[RigidMotion | None, about("How the residual divides; null where that can't be tested.")]
    rivals: Annotated[list[Rival], about("Other explanations, best first.")]
    noise: Annotated[NoiseLevels, about("Noise levels that were estimated.")]
    undetermined: Annotated[list[Undetermined], about("Combinations of sizes that these data can't see.")]
    files: Files


class Segment(Result, kw_only=True):
    """A piece of a profile."""

    kind: Annotated[str, about("ramp or hold.")]
    duration_s: Annotated[Number, about("Its length.", "s")]
    to_rad_s: Annotated[Number | UnsetType, about("Of a ramp: rate at its end.", "rad/s")] = UNSET


class Pair(Result, kw_only=True):
    """Margin of an effect over a rival."""

    effect: Annotated[str, about("The effect.")]
    rival: Annotated[str, about("The rival.")]
    nats_before: Annotated[Number, about("Margin with what was recorded so far, or a plain run.", "nats")]
    nats_after: Annotated[Number, about("Margin with this experiment.", "nats")]
    unexplained_before: Annotated[Number, about("Share of the effect that the rival does not explain, before.")]
    unexplained_after: Annotated[
        Number, about("Share of the effect that the rival does not explain, with this experiment.")
    ]


class Designed(Result, kw_only=True):
    """The experiment to do next."""

    effects: Annotated[list[str], about("The effects to distinguish.")]
    separates: Annotated[bool, about("Whether every effect is expected to be separated from every other.")]
    nats_needed: Annotated[Number, about("Margin that separates two effects.", "nats")]
    mounting_rotvec_rad: Annotated[Numbers, about("How the array is to be turned from upright.", "rad")]
    upright_too: Annotated[bool, about("Whether the same profile has to be recorded upright as well.")]
    duration_s: Annotated[Number, about("Length of the profile.", "s")]
    peak_rate_rad_s: Annotated[Number, about("Largest rate.", "rad/s")]
    peak_acceleration_rad_s2: Annotated[Number, about("Largest angular acceleration.", "rad/s²")]
    segments: Annotated[list[Segment], about("The profile, piece by piece.")]
    detectability_before: Annotated[Numbers, about("d′ of each effect with what was recorded so far, or a plain run.")]
    detectability_after: Annotated[Numbers, about("d′ of each effect with this experiment.")]
    pairs: Annotated[list[Pair], about("Margins of each effect over each rival.")]
    text: Annotated[str, about("The proposal in words.")]
    files: Files
