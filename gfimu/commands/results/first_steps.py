"""The results of `gfimu demo`, `show`, `new`."""

from __future__ import annotations

from typing import Annotated, Any

from msgspec import UNSET, UnsetType

from gfimu.commands.results.base import Files, Number, Result
from gfimu.files.schema import about

__all__ = ["Begun", "Demo", "DemoResult", "Listed", "Schema", "Shown"]


class Shown(Result, kw_only=True):
    """The text of a file."""

    name: Annotated[str, about("Name or path that was asked for.")]
    text: Annotated[str, about("The file (TOML), or one line on an effect.")]


class Begun(Result, kw_only=True):
    """A file to edit."""

    kind: Annotated[str, about("Kind of the file.")]
    text: Annotated[str, about("The file (TOML); of a sender, what to do with the folder.")]
    files: Files


class DemoResult(Result, kw_only=True):
    """One line of the demo's table; which figures it has depends on the line."""

    what: Annotated[str, about("What was asked.")]
    condition_number: Annotated[Number | UnsetType, about("Condition number κ(J) of the array.")] = UNSET
    gdop: Annotated[Number | UnsetType, about("GDOP of the array.")] = UNSET
    omega_squared_leakage: Annotated[
        Number | UnsetType, about("Largest coefficient of a product of ω in the linear solution.")
    ] = UNSET
    samples: Annotated[int | UnsetType, about("Samples of the recording.")] = UNSET
    peak_rate_rad_s: Annotated[Number | UnsetType, about("Fastest rate of the run.", "rad/s")] = UNSET
    largest_bias_m_s2: Annotated[Number | UnsetType, about("Largest bias read off at rest.", "m/s²")] = UNSET
    rmse_m_s2: Annotated[Number | UnsetType, about("Error of p, rms.", "m/s²")] = UNSET
    noise_std_m_s2: Annotated[Number | UnsetType, about("Error that the noise alone gives.", "m/s²")] = UNSET
    rmse_rad_s2: Annotated[Number | UnsetType, about("Error of α, rms.", "rad/s²")] = UNSET
    peak_rad_s2: Annotated[Number | UnsetType, about("Largest α of the run.", "rad/s²")] = UNSET
    rmse_rad_s: Annotated[Number | UnsetType, about("Error of ω, rms.", "rad/s")] = UNSET
    rmse_raw_rad_s: Annotated[Number | UnsetType, about("Error of ω without the biases taken off, rms.", "rad/s")] = (
        UNSET
    )
    expected_std_at_end_rad_s: Annotated[
        Number | UnsetType, about("Standard deviation of ω that is expected at the end.", "rad/s")
    ] = UNSET
    error_rad: Annotated[Number | UnsetType, about("Error of the angle at the end.", "rad")] = UNSET
    error_m: Annotated[Number | UnsetType, about("Error of the position at the end.", "m")] = UNSET
    expected_m: Annotated[Number | UnsetType, about("Position error that is expected, 1 σ.", "m")] = UNSET
    valid_until_s: Annotated[Number | UnsetType, about("Time until which the closed form holds.", "s")] = UNSET
    alpha_before_deg_s2: Annotated[Number | UnsetType, about("Apparent α at rest before the calibration.", "°/s²")] = (
        UNSET
    )
    alpha_after_deg_s2: Annotated[Number | UnsetType, about("Apparent α at rest after it.", "°/s²")] = UNSET
    rmse_before_rad_s: Annotated[Number | UnsetType, about("Error of ω before the calibration, rms.", "rad/s")] = UNSET
    rmse_after_rad_s: Annotated[Number | UnsetType, about("Error of ω after it, rms.", "rad/s")] = UNSET
    drift_before_m: Annotated[Number | UnsetType, about("Position drift before the calibration.", "m")] = UNSET
    drift_after_m: Annotated[Number | UnsetType, about("Position drift after it.", "m")] = UNSET
    hidden: Annotated[Number | UnsetType, about("Size of the hidden effect, in its unit.")] = UNSET
    found: Annotated[Number | UnsetType, about("Size that the diagnosis finds, in its unit.")] = UNSET
    std: Annotated[Number | UnsetType, about("Standard deviation of the size found, in its unit.")] = UNSET
    unit: Annotated[str | UnsetType, about("Unit of these three.")] = UNSET
    verdict: Annotated[str | UnsetType, about("Verdict of the diagnosis.")] = UNSET


class Demo(Result, kw_only=True):
    """The paper's experiment in simulation."""

    seed: Annotated[int, about("Seed of all random numbers.")]
    results: Annotated[list[DemoResult], about("The table, line by line.")]
    files: Files


Listed = dict[str, str]
"""What comes with gfimu of one kind: names, and what each is."""

Schema = dict[str, Any]
"""A JSON schema."""
