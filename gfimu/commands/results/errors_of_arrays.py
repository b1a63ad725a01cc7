"""The results of `gfimu drift` and `tolerance`."""

from __future__ import annotations

from typing import Annotated

from msgspec import UNSET, UnsetType

from gfimu.commands.results.base import Files, Number, Numbers, Result
from gfimu.commands.results.shared import Axis
from gfimu.files.schema import about

__all__ = [
    "AxisDrift",
    "AxisDriftTerm",
    "Drift",
    "DriftTerm",
    "EquivalentErrors",
    "ErrorSources",
    "MonteCarlo",
    "RestDrift",
    "RestWindow",
    "SimulatedUnits",
    "ToleranceCalibration",
    "ToleranceQuantity",
    "Tolerances",
    "Tolerated",
]


class ErrorSources(Result, kw_only=True):
    """Errors that the drift comes from, of each channel."""

    bias_m_s2: Annotated[Number, about("Constant bias, 1 σ.", "m/s²")]
    noise_density_m_s2_sqrt_hz: Annotated[Number, about("White noise, one-sided density.", "m/s²/√Hz")]
    bias_random_walk_m_s2_sqrt_s: Annotated[Number, about("Random walk of the bias.", "m/s²/√s")]
    rate_drift_rad_s: Annotated[Number, about("Constant error of the angular rate, 1 σ.", "rad/s")]


class DriftTerm(Result, kw_only=True):
    """Share of one cause in the position error."""

    name: Annotated[str, about("The cause.")]
    form_at_rest: Annotated[str, about("Its law at rest.")]
    size: Annotated[Number, about("Standard deviation of the error that drives it.")]
    size_unit: Annotated[str, about("Unit of that.")]
    std_m: Annotated[Numbers, about("Standard deviation of the position error, world axes.", "m")]
    share: Annotated[Number, about("Share of the total variance.")]


class MonteCarlo(Result, kw_only=True):
    """Position errors of simulated runs."""

    runs: Annotated[int, about("Runs.")]
    seed: Annotated[int, about("Seed.")]
    std_m: Annotated[Numbers, about("Standard deviation of the position error, world axes.", "m")]
    mean_m: Annotated[Numbers, about("Mean of the position error, world axes.", "m")]
    relative_sampling_error: Annotated[Number, about("Relative standard deviation of that standard deviation.")]


class Drift(Result, kw_only=True):
    """Position error after a time, cause by cause."""

    format_version: Annotated[int, about("Version of the format.")]
    array: Annotated[str, about("Name of the array.")]
    time_s: Annotated[Number, about("Time since the start of navigation.", "s")]
    rate_rad_s: Annotated[Number, about("Rate about the vertical.", "rad/s")]
    offset_m: Annotated[Numbers, about("Horizontal place of the unit off the axis.", "m")]
    sources: Annotated[ErrorSources, about("What was assumed of the sensors.")]
    terms: Annotated[list[DriftTerm], about("The causes.")]
    total_std_m: Annotated[Numbers, about("Standard deviation of the position error, world axes.", "m")]
    fall_m: Annotated[Number, about("Mean vertical error, of second order.", "m")]
    tilt_std_rad: Annotated[Number, about("Attitude error about a horizontal axis, 1 σ.", "rad")]
    heading_std_rad: Annotated[Number, about("Attitude error about the vertical, 1 σ.", "rad")]
    attitude_error_rad: Annotated[Number, about("The attitude error that decides on validity, 1 σ.", "rad")]
    tilt_limit_rad: Annotated[Number, about("Limit of that error.", "rad")]
    valid: Annotated[bool, about("Whether the closed forms hold.")]
    valid_until_s: Annotated[Number, about("Time until which they hold; null: far later.", "s")]
    alpha_overtakes_p_s: Annotated[Number, about("Time after which a bias acts more through α than through p.", "s")]
    note: Annotated[str, about("What the budget leaves out; empty if nothing.")]
    monte_carlo: Annotated[MonteCarlo | UnsetType, about("Position errors of simulated runs, with --monte-carlo.")] = (
        UNSET
    )


class RestWindow(Result, kw_only=True):
    """One window of a recording at rest."""

    start_s: Annotated[Number, about("Its start.", "s")]
    position_m: Annotated[Numbers, about("Position error at its end, world axes.", "m")]
    predicted_std_m: Annotated[Numbers, about("Standard deviation that the noise predicts.", "m")]


class RestDrift(Result, kw_only=True):
    """The drift that a recording at rest has, beside what its noise predicts."""

    array: Annotated[str, about("Name of the array.")]
    time_s: Annotated[Number, about("Length of a window.", "s")]
    lead_s: Annotated[Number, about("Rest before each window.", "s")]
    windows: Annotated[list[RestWindow], about("The windows.")]
    rms_m: Annotated[Numbers, about("Position error, rms over the windows.", "m")]
    predicted_rms_m: Annotated[Numbers, about("What the noise predicts.", "m")]
    valid: Annotated[bool, about("Whether the prediction, of first order in the tilt, holds.")]
    ratio: Annotated[Number, about("Error over prediction, horizontal.")]
    ratio_interval_95: Annotated[Numbers, about("Interval of that ratio of 95 % of right predictions.")]
    tilt_std_rad: Annotated[Number, about("Tilt at the end, 1 σ.", "rad")]
    noise_terms: Annotated[list[str], about("Terms of the noise that were found.")]
    equivalent_p_bias_m_s2: Annotated[Numbers, about("Constant bias of p that explains the first window.", "m/s²")]
    equivalent_rate_drift_deg_h: Annotated[Number, about("Constant drift of the rate that explains it.", "°/h")]
    files: Files


class EquivalentErrors(Result, kw_only=True):
    """The constant errors that would explain a position error of a unit at rest."""

    position_m: Annotated[Numbers, about("The position error, z up.", "m")]
    time_s: Annotated[Number, about("Time since the start of navigation.", "s")]
    known_bias_mg: Annotated[Numbers, about("Known bias of p.", "mg")]
    left_m: Annotated[Numbers, about("Position error without its share.", "m")]
    bias_mg: Annotated[Numbers, about("Bias of p that explains the whole error.", "mg")]
    rate_drift_deg_h: Annotated[
        Numbers, about("Drift about x, y, z that explains the rest of it; about z none can.", "°/h")
    ]
    earth_rate_deg_h: Annotated[Number, about("Horizontal part of the Earth's rate; null without a latitude.", "°/h")]
    earth_share_m: Annotated[Number, about("Its share of the position error; null without a latitude.", "m")]


class AxisDriftTerm(Result, kw_only=True):
    """One cause of the drift about a known axis."""

    name: Annotated[str, about("The cause.")]
    size: Annotated[str, about("Its size, with the unit.")]
    rate_std: Annotated[Number, about("Its share of the rate, 1 σ.", "rad/s")]
    angle_std: Annotated[Number, about("Its share of the angle, 1 σ.", "rad")]


class AxisDrift(Result, kw_only=True):
    """Drift of a rotation about a known axis."""

    array: Annotated[str, about("Name of the array.")]
    turning_axis: Annotated[Axis, about("The axis.")]
    time_s: Annotated[Number, about("Time since a known start.", "s")]
    rate_rad_s: Annotated[Number, about("Rate about the axis.", "rad/s")]
    terms: Annotated[list[AxisDriftTerm], about("The causes.")]
    rate_std_rad_s: Annotated[Number, about("Standard deviation of the rate.", "rad/s")]
    angle_std_rad: Annotated[Number, about("Standard deviation of the angle.", "rad")]
    remark: Annotated[str, about("How far the figures hold.")]


class SimulatedUnits(Result, kw_only=True):
    """Errors of simulated units beside first order."""

    units: Annotated[int, about("Units.")]
    rms: Annotated[Number, about("Error, rms over the units, in the unit of the quantity.")]
    quantiles: Annotated[dict[str, Number], about("Quantiles of the error.")]
    first_order_quantiles: Annotated[dict[str, Number], about("What first order gives for these.")]
    ratio_to_first_order: Annotated[Number, about("Rms over that of first order.")]
    ratio_std: Annotated[Number, about("Its standard deviation.")]
    first_order_holds: Annotated[bool, about("Whether the two agree.")]


class ToleranceQuantity(Result, kw_only=True):
    """Error of one quantity."""

    meaning: Annotated[str, about("What it is.")]
    unit: Annotated[str, about("Its unit.")]
    rms: Annotated[Number, about("Error by first order, rms.")]
    rms_by_cause: Annotated[dict[str, Number], about("Its parts by cause.")]
    share: Annotated[dict[str, Number], about("Share of each cause in the variance.")]
    reduction_by_halving: Annotated[dict[str, Number], about("Relative reduction of the error when a cause is halved.")]
    factor_for_a_tenth_more: Annotated[
        dict[str, Number], about("Factor on a cause that makes the error a tenth larger.")
    ]
    simulated: Annotated[SimulatedUnits | UnsetType, about("Simulated units, where they were asked for.")] = UNSET


class ToleranceCalibration(Result, kw_only=True):
    """Errors after one calibration."""

    attitude_error_rad: Annotated[Number, about("Attitude error at the end, 1 σ per axis.", "rad")]
    failed_units: Annotated[dict[str, int], about("Units that could not be estimated, by reason.")]
    quantities: Annotated[dict[str, ToleranceQuantity], about("The quantities.")]


class Tolerances(Result, kw_only=True):
    """Tolerances that were assumed; lists are by channel."""

    placement_m: Annotated[Number, about("Limit of each chip's position error along each axis.", "m")]
    angle_rad: Annotated[Number, about("Limit of each chip's rotation about each axis.", "rad")]
    shape: Annotated[str, about("uniform (between the limits) or normal (limits are 3 σ).")]
    bias_std_m_s2: Annotated[Numbers, about("Bias, 1 σ.", "m/s²")]
    gain_std: Annotated[Numbers, about("Gain error, 1 σ.")]
    cross_axis_std: Annotated[Numbers, about("Pick-up of each other axis, 1 σ.")]
    nonlinearity_full_scale_std: Annotated[Numbers, about("Non-linearity at full scale, 1 σ.")]
    noise_std_m_s2: Annotated[Numbers, about("White noise per sample.", "m/s²")]
    bias_tempco_std_m_s2_K: Annotated[Numbers, about("Temperature coefficient of the bias, 1 σ.", "m/s²/K")]
    gain_tempco_std_K: Annotated[Numbers, about("Temperature coefficient of the gain, 1 σ.", "1/K")]
    temperature_K: Annotated[Number, about("Temperature of the run less that of the calibration.", "K")]
    from_data_sheet: Annotated[list[str], about("Which of these are the data sheets'.")]


class Tolerated(Result, kw_only=True):
    """Errors of an array by its tolerances, before and after calibration."""

    format_version: Annotated[int, about("Version of the format.")]
    array: Annotated[str, about("Name of the array.")]
    motion: Annotated[str, about("The motion in words.")]
    levelled_at_start: Annotated[bool, about("Whether estimates level themselves at the start.")]
    tolerances: Annotated[Tolerances, about("What was assumed.")]
    seed: Annotated[int, about("Seed of the simulated units.")]
    calibrations: Annotated[dict[str, ToleranceCalibration], about("Errors by calibration.")]
    files: Files
