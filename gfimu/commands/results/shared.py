"""Parts that the results of several commands have in common."""

from __future__ import annotations

from typing import Annotated

from msgspec import UNSET, UnsetType

from gfimu.commands.results.base import Number, Numbers, Result
from gfimu.files.schema import about

__all__ = ["Axis", "AxisBounds", "AxisPrediction", "ChannelFault", "Identity", "Stream"]


class Stream(Result, kw_only=True):
    """How a stream of samples came in."""

    samples: Annotated[int, about("Samples that were received.")]
    messages: Annotated[int, about("Messages of the board that are no samples.")]
    lost: Annotated[int, about("Samples that were lost, by the numbers of the frames.")]
    corrupt: Annotated[int, about("Frames with a wrong checksum.")]
    skipped_bytes: Annotated[int, about("Bytes between frames.", "bytes")]
    restarts: Annotated[int, about("Restarts of the board.")]
    unconfirmed: Annotated[int, about("Samples that follow no other and are refused.")]


class Identity(Result, kw_only=True):
    """What a board states about itself."""

    firmware: Annotated[str, about("Version of the firmware.")]
    build_id: Annotated[int, about("First 32 bits of the hash of its sources.")]
    rate_hz: Annotated[int, about("Sample rate.", "Hz")]
    rate_code: Annotated[int, about("BW_RATE code of the chips.")]
    data_format: Annotated[int, about("DATA_FORMAT of the chips.")]
    baud: Annotated[int, about("Speed of the line.", "bit/s")]
    present: Annotated[list[bool], about("Which chips answer and hold their configuration.")]
    reset_cause: Annotated[str, about("Why the board started last; no crystal: it runs on its internal oscillator.")]
    streaming: Annotated[bool, about("Whether it sends samples.")]
    spi_khz: Annotated[int, about("Clock of the bus to the chips.", "kHz")]
    dropped: Annotated[int, about("Frames that the line could not take.")]
    faulty: Annotated[list[bool], about("Which chips have a register that does not read back as written.")]
    range_g: Annotated[int | UnsetType, about("Range of the chips.", "g")] = UNSET


class ChannelFault(Result, kw_only=True):
    """A fault of a channel."""

    channel: Annotated[str, about("The channel.")]
    kind: Annotated[str, about("step, drift, gain, noise, stuck, spikes or unknown.")]
    isolated: Annotated[bool, about("Whether the fault is certain to be on this channel.")]
    onset_s: Annotated[Number, about("When it began.", "s")]
    detected_s: Annotated[Number, about("When it was found.", "s")]
    end_s: Annotated[Number, about("When it ended; null: not before the end.", "s")]
    size: Annotated[Number, about("Its size.", "m/s²")]
    std: Annotated[Number, about("Standard deviation of the size.", "m/s²")]
    unit: Annotated[str, about("Unit of size and std.")]
    excluded: Annotated[bool, about("Whether the channel was left out from the onset to the end.")]
    alternatives: Annotated[
        list[list[str]], about("Where it is not isolated: the sets of channels each of which explains it.")
    ]


class Axis(Result, kw_only=True):
    """An axis about which alone an array turns."""

    direction: Annotated[Numbers, about("Unit vector along the axis, body frame.")]
    point_m: Annotated[Numbers, about("A point of the axis, body frame.", "m")]
    hub: Annotated[str, about("fixed (a table) or free (a wheel on a moving body).")]
    inclination_rad: Annotated[Number | UnsetType, about("Angle between the axis and the vertical.", "rad")] = UNSET


class AxisPrediction(Result, kw_only=True):
    """What an estimate about a known axis reaches in a run that does not exist yet."""

    duration_s: Annotated[Number, about("Length of the run; a tenth is rest, another tenth the gain of speed.", "s")]
    sample_rate_hz: Annotated[Number, about("Sample rate.", "Hz")]
    hub_std_m_s2: Annotated[Number, about("Of a free hub: standard deviation of its own acceleration.", "m/s²")]
    jerk_rad2_s5: Annotated[Number, about("Spectral density of the change of α.", "rad²/s⁵")]
    inclination_rad: Annotated[Number, about("Angle between the axis and the vertical.", "rad")]
    sigma_rate_by_noise_rad_s: Annotated[Number, about("Standard deviation of the rate by the noise alone.", "rad/s")]
    sigma_rate_by_mounting_rad_s: Annotated[
        Number, about("Standard deviation of the rate by the uncertain mounting alone.", "rad/s")
    ]
    sigma_rate_rad_s: Annotated[Number, about("Standard deviation of the rate.", "rad/s")]
    undetermined_combinations_in_prior_std: Annotated[
        list[str],
        about(
            "Combinations of uncertain constants that such a run does not determine, in units of their prior "
            "standard deviations."
        ),
    ]


class AxisBounds(Result, kw_only=True):
    """How well an array measures a rotation about a known axis."""

    array: Annotated[str, about("Name of the array.")]
    direction: Annotated[Numbers, about("Unit vector along the axis, body frame.")]
    point_m: Annotated[Numbers, about("A point of the axis, body frame.", "m")]
    hub: Annotated[str, about("fixed (a table) or free (a wheel on a moving body).")]
    inclination_rad: Annotated[Number | UnsetType, about("Angle between the axis and the vertical.", "rad")] = UNSET
    rate_rad_s: Annotated[Number, about("Rate at which the bounds hold.", "rad/s")]
    sigma_alpha_rad_s2: Annotated[
        Number, about("Standard deviation of the angular acceleration by one sample.", "rad/s²")
    ]
    sigma_rate_squared_rad2_s2: Annotated[
        Number, about("Standard deviation of Ω² by one sample; null: not observable.", "rad²/s²")
    ]
    sigma_rate_sample_rad_s: Annotated[Number, about("Standard deviation of the rate by one sample.", "rad/s")]
    sigma_rate_filter_rad_s: Annotated[
        Number, about("Standard deviation of the rate of a filter that has settled, biases known.", "rad/s")
    ]
    sigma_rate_by_instability_rad_s: Annotated[
        Number | UnsetType, about("Standard deviation of the rate by the bias instability.", "rad/s")
    ] = UNSET
    estimate: Annotated[AxisPrediction | UnsetType, about("What gfimu estimate reaches.")] = UNSET
