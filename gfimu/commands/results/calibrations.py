"""The results of `gfimu calibrate` and `noise`."""

from __future__ import annotations

from typing import Annotated, Any

from msgspec import UNSET, UnsetType

from gfimu.commands.results.base import Files, Matrix, Number, Numbers, Result
from gfimu.commands.results.shared import AxisBounds
from gfimu.files.schema import about

__all__ = ["Calibrated", "CalibrationParameter", "ChannelNoise", "Noise", "NoiseTerm"]


class CalibrationParameter(Result, kw_only=True):
    """A parameter of a calibration."""

    name: Annotated[str, about("Chip or channel, and the parameter.")]
    value: Annotated[Number, about("Its value.")]
    std: Annotated[Number, about("Its standard deviation.")]
    unit: Annotated[str, about("Unit of both.")]


class Calibrated(Result, kw_only=True):
    """A calibration; the file holds the same keys but files."""

    format: Annotated[str, about("gfimu-calibration.")]
    format_version: Annotated[int, about("Version of the format.")]
    method: Annotated[str, about("Method that made it.")]
    unit: Annotated[str, about("Unit of the readings that it applies to; true inputs are in m/s² (rad/s of a gyro).")]
    channels: Annotated[list[str], about("Channels that it applies to, three per chip, in order.")]
    gauge: Annotated[str, about("Frame in which the true inputs are expressed.")]
    gauge_meaning: Annotated[str, about("That frame in words.")]
    gravity_m_s2: Annotated[Number | UnsetType, about("Magnitude of the true input.", "m/s²")] = UNSET
    rate_rad_s: Annotated[Number | UnsetType, about("Of a gyro: magnitude of the true input.", "rad/s")] = UNSET
    parameters: Annotated[list[CalibrationParameter], about("The parameters.")]
    covariance: Annotated[Matrix, about("Covariance of the parameters, in products of their units.")]
    correlation: Annotated[Matrix, about("Correlation of the parameters.")]
    null_space: Annotated[Matrix, about("Orthonormal directions of the parameters that the data did not determine.")]
    statements: Annotated[list[str], about("What was not determined, and further statements.")]
    warnings: Annotated[list[str], about("What looked wrong in the data.")]
    statistics: Annotated[
        dict[str, Any], about("Residuals, number of poses, redundancy, variance factor and so on; units in the keys.")
    ]
    metadata: Annotated[dict[str, Any] | UnsetType, about("Of the recordings that it was made from.")] = UNSET
    files: Files


class NoiseTerm(Result, kw_only=True):
    """One term of the noise of a channel."""

    name: Annotated[str, about("Name of the term.")]
    unit: Annotated[str, about("Unit of the coefficient.")]
    found: Annotated[bool, about("Whether the data show it.")]
    value: Annotated[Number, about("Coefficient; zero if not found.")]
    low_95: Annotated[Number, about("Lower 95 % limit.")]
    high_95: Annotated[Number, about("Upper 95 % limit.")]
    std: Annotated[Number, about("Standard deviation; null if not found.")]


class ChannelNoise(Result, kw_only=True):
    """Noise of a channel."""

    terms: Annotated[
        dict[str, NoiseTerm],
        about(
            "Terms by symbol: Q quantisation, N velocity random walk, B bias instability, K acceleration random "
            "walk, R ramp."
        ),
    ]
    misfit: Annotated[Number, about("Mean squared residual of the fit, in standard deviations.")]
    bias_instability_from_minimum: Annotated[
        Number, about("Bias instability by the minimum of the Allan deviation, unit of the readings.")
    ]
    minimum_tau_s: Annotated[Number, about("Averaging time of that minimum.", "s")]
    tau_s: Annotated[Numbers, about("Averaging times.", "s")]
    deviation: Annotated[Numbers, about("Allan deviation at these, unit of the readings.")]


class Noise(Result, kw_only=True):
    """Noise of a recording at rest."""

    unit: Annotated[str, about("Unit of the readings; m_s2 is m/s².")]
    rate_hz: Annotated[Number, about("Sample rate.", "Hz")]
    start_s: Annotated[Number, about("Start of the samples that were used.", "s")]
    duration_s: Annotated[Number, about("Their length.", "s")]
    channels: Annotated[dict[str, ChannelNoise], about("Noise by channel.")]
    about_axis: Annotated[
        AxisBounds | UnsetType, about("What it means for a rotation about a known axis, where --axis asks for it.")
    ] = UNSET
    files: Files
