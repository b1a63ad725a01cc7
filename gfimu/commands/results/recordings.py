"""The results of `gfimu inspect`, `convert`, `join`, `record`, `simulate`."""

from __future__ import annotations

from typing import Annotated, Any

from msgspec import UNSET, UnsetType

from gfimu.commands.results.base import Files, Matrix, Number, Result
from gfimu.commands.results.shared import ChannelFault, Identity, Stream
from gfimu.files.schema import about

__all__ = [
    "AxisSelfTest",
    "Board",
    "BoardsFound",
    "Clock",
    "Converted",
    "ConvertedArray",
    "ConvertedCalibration",
    "Inspected",
    "InspectedColumn",
    "Joined",
    "Lever",
    "Recorded",
    "Simulated",
]


class InspectedColumn(Result, kw_only=True):
    """A column as it looks."""

    name: Annotated[str, about("Its name in the file.")]
    least: Annotated[Number, about("Least of its numbers.")]
    most: Annotated[Number, about("Largest of its numbers.")]
    median: Annotated[Number, about("Median of its numbers.")]
    missing: Annotated[int, about("Cells without a number.")]
    role: Annotated[str, about("What it seems to be.")]


class Inspected(Result, kw_only=True):
    """What a file seems to hold."""

    source: Annotated[str, about("The file.")]
    format: Annotated[str, about("Its format.")]
    table: Annotated[str, about("The table that was looked at; empty for the file itself.")]
    tables: Annotated[list[str], about("All tables of the file, with their rows.")]
    rows: Annotated[int, about("Rows of that table.")]
    sample_rate_hz: Annotated[Number, about("Sample rate by the times; null if unknown.", "Hz")]
    chips: Annotated[int, about("Triads of accelerations.")]
    columns: Annotated[list[InspectedColumn], about("The columns as they look.")]
    fitting_maps: Annotated[list[str], about("Column maps that come with gfimu and fit.")]
    findings: Annotated[list[str], about("What is odd: gaps, rails, corrupt values, noisy channels.")]
    reasons: Annotated[list[str], about("What the proposed map rests on, one line each.")]
    map_toml: Annotated[str, about("A column map to start from (TOML); empty where none was found.")]
    files: Files


class Converted(Result, kw_only=True):
    """A recording in another format."""

    samples: Annotated[int, about("Samples.")]
    channels: Annotated[int, about("Channels.")]
    duration_s: Annotated[Number, about("Length.", "s")]
    sample_rate_hz: Annotated[Number, about("Sample rate; null of a single sample.", "Hz")]
    gaps: Annotated[int, about("Places where samples are lost.")]
    packets: Annotated[int | UnsetType, about("Of a MIMU4444 stream: packets.")] = UNSET
    packets_lost: Annotated[int | UnsetType, about("Of a MIMU4444 stream: packets that are lost.")] = UNSET
    packets_corrupt: Annotated[int | UnsetType, about("Of a MIMU4444 stream: packets with a wrong checksum.")] = UNSET
    bytes_skipped: Annotated[int | UnsetType, about("Of a MIMU4444 stream: bytes between packets.", "bytes")] = UNSET
    dropped_rows_corrupt: Annotated[int | UnsetType, about("Rows left out as corrupt.")] = UNSET
    dropped_rows_out_of_range: Annotated[int | UnsetType, about("Rows left out as out of range.")] = UNSET
    dropped_rows_missing: Annotated[int | UnsetType, about("Rows left out for a missing value.")] = UNSET
    dropped_rows_duplicates: Annotated[int | UnsetType, about("Rows left out as duplicates.")] = UNSET
    dropped_rows_unordered: Annotated[int | UnsetType, about("Rows left out as not in order of time.")] = UNSET
    files: Files


class ConvertedArray(Result, kw_only=True):
    """An array as a MuJoCo model."""

    array: Annotated[str, about("Name of the array.")]
    chips: Annotated[int, about("Chips.")]
    channels: Annotated[int, about("Channels.")]
    files: Files


class ConvertedCalibration(Result, kw_only=True):
    """A calibration in another format."""

    format: Annotated[str, about("kalibr or ros.")]
    method: Annotated[str, about("Method that made the calibration.")]
    unit: Annotated[str, about("Unit of the readings that it applies to.")]
    chips: Annotated[int, about("Chips.")]
    files: Files


class Lever(Result, kw_only=True):
    """Distance of a chip from the axis."""

    by_rate: Annotated[Number, about("Distance by ω².", "m")]
    by_acceleration: Annotated[Number, about("Distance by α.", "m")]


class Joined(Result, kw_only=True):
    """Channels and a reference of two clocks: t = offset + (1 + rate error) · t_reference."""

    offset_s: Annotated[Number, about("Time of the channels' clock at which the reference's reads zero.", "s")]
    offset_std_s: Annotated[Number, about("Its standard deviation, in the middle of the common time.", "s")]
    rate_error: Annotated[Number, about("Seconds of the channels' clock per second of the reference's, less one.")]
    rate_error_std: Annotated[Number, about("Its standard deviation.")]
    overlap_s: Annotated[Number, about("Common time.", "s")]
    explained: Annotated[dict[str, Number], about("Share of each channel's variance that the reference explains.")]
    second_offset_s: Annotated[Number, about("Next-best offset apart from this one; null without any.", "s")]
    log_odds_over_second: Annotated[Number, about("Log odds over the next-best offset.", "nats")]
    log_odds_over_foreign: Annotated[Number, about("Log odds over shuffled references.", "nats")]
    levers_m: Annotated[
        dict[str, Lever], about("Distance of each chip from the axis, by two terms that have to agree.", "m")
    ]
    doubts: Annotated[list[str], about("Why the two files may not belong together.")]
    files: Files


class Clock(Result, kw_only=True):
    """Host time against board time."""

    offset_s: Annotated[Number, about("Host time at the board time mean_board_s, less that board time.", "s")]
    offset_std_s: Annotated[Number, about("Its standard deviation.", "s")]
    rate_error: Annotated[Number, about("How much faster the host's clock runs than the board's, relative.")]
    rate_error_std: Annotated[Number, about("Its standard deviation.")]
    mean_board_s: Annotated[Number, about("Board time in the middle of the fit.", "s")]
    residual_s: Annotated[Number, about("Robust spread of the arrivals.", "s")]
    windows: Annotated[int, about("Points of the fit.")]
    latency_std_s: Annotated[Number, about("Part of every standard deviation that all times share.", "s")]
    rate_walk: Annotated[Number, about("Strength of the random walk of the rate.", "1/√s")]
    knots: Annotated[Matrix, about("Board time, offset and its standard deviation: the fit is linear in between.", "s")]


class Board(Result, kw_only=True):
    """A board that was found."""

    port: Annotated[str, about("Where it is.")]
    baud: Annotated[int, about("Speed at which it was understood.", "bit/s")]
    form: Annotated[str, about("Frame format.")]
    identity: Annotated[Identity | None, about("What it states about itself; null if it only sends.")]
    array: Annotated[str, about("The array that it states; empty if it states none.")]


class AxisSelfTest(Result, kw_only=True):
    """Self-test of one sensing axis."""

    channel: Annotated[str, about("The channel.")]
    shift_g: Annotated[Number, about("Reading under self-test less reading without.", "g")]
    least_g: Annotated[Number, about("Lower limit at the supply of the board.", "g")]
    greatest_g: Annotated[Number, about("Upper limit at the supply of the board.", "g")]
    noise_g: Annotated[Number, about("Standard deviation of the readings without self-test.", "g")]
    verdict: Annotated[str, about("passed, failed, missing (no readings) or moved (the unit did not rest).")]


class BoardsFound(Result, kw_only=True):
    """Boards that were looked for, and their self-test, without a recording."""

    boards: Annotated[list[Board], about("Boards that were found.")]
    self_test: Annotated[list[AxisSelfTest], about("Self-test of each axis; empty where none was asked for.")]


class Recorded(Result, kw_only=True):
    """A recording from a board."""

    path: Annotated[str, about("The recording.")]
    duration_s: Annotated[Number, about("From the first to the last sample, board time.", "s")]
    stream: Annotated[Stream, about("How the stream came in.")]
    breaks: Annotated[int, about("Times that the connection was lost.")]
    clock: Annotated[Clock | None, about("Board clock against host clock; null where it was not found.")]
    identity: Annotated[Identity | None, about("What the board stated about itself.")]
    status_counts: Annotated[dict[str, int], about("Samples by status bit.")]
    faults: Annotated[list[ChannelFault], about("Faults of channels that a live view saw.")]
    baud: Annotated[int | None, about("Speed of the line at the end; null of a port without one.", "bit/s")]
    source: Annotated[dict[str, Any], about("What a source without a serial port states about itself.")]
    array: Annotated[str, about("Array that the recording carries; empty if none was stated.")]
    array_stated_by: Annotated[str, about("host, format, board or answer; empty if none was stated.")]
    board_array: Annotated[str, about("Array that the board states; empty if it states none.")]
    temperature_degC: Annotated[list[Number] | None, about("Lowest and highest temperature of the board.", "°C")]
    boards: Annotated[list[Board], about("Boards that were found with --find.")]
    self_test: Annotated[list[AxisSelfTest], about("Self-test of each axis; empty where none was asked for.")]
    files: Files


class Simulated(Result, kw_only=True):
    """A simulated recording."""

    scenario: Annotated[str, about("Name of the scenario.")]
    seed: Annotated[int, about("Seed of all random numbers.")]
    samples: Annotated[int, about("Samples.")]
    duration_s: Annotated[Number, about("Length.", "s")]
    sample_rate_hz: Annotated[Number, about("Sample rate.", "Hz")]
    array: Annotated[str, about("Name of the array.")]
    channels: Annotated[list[str], about("Channels.")]
    drive: Annotated[str, about("What moves the body, in words.")]
    effects: Annotated[list[str], about("Effects that were simulated.")]
    peak_rate_rad_s: Annotated[Number, about("Fastest turn.", "rad/s")]
    peak_reading_m_s2: Annotated[Number, about("Largest reading.", "m/s²")]
    files: Files
