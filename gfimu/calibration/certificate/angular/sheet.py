"""The sheet of an array as an angular sensor, in the words of IEEE Std 671-1985 (R2008).

The standard is for angular jerk, acceleration, velocity and displacement sensors without a gyro; a gyro-free IMU is a
multi-axis angular accelerometer of that kind. The printed standard was not at hand: its scope is public, and the choice
of figures (range, scale factor, bias, noise, bandwidth, alignment, cross-axis and acceleration sensitivity) follows the
terms of IEEE Std 528 and what makers of angular accelerometers state, both from secondary sources.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.limits import PartLimits
from gfimu.array.parts.part_file import PartFile
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.calibration.certificate.angular.input_range import acceleration_range, rate_range, specific_force_limits
from gfimu.calibration.certificate.angular.noise import AlphaNoise, noise_at_rest, noise_by_data_sheet
from gfimu.calibration.certificate.angular.response import Response, response
from gfimu.calibration.certificate.certificate import Sheet, Term
from gfimu.calibration.certificate.coverage import coverage_factor
from gfimu.calibration.result import Calibration
from gfimu.calibration.spin.policy import SpinPolicy
from gfimu.recording import Recording

__all__ = ["angular_sensor_sheet"]

_SAMPLE_RATE = 100.0  # Hz, where nothing was recorded
_DEGREES = 180.0 / np.pi


def angular_sensor_sheet(
    calibration: Calibration,
    array: AccelerometerArray,
    *,
    rest: Recording | None = None,
    position_std_m: float = SpinPolicy.radius_std_m,
) -> Sheet:
    """State the figures of a calibrated array as a sensor of angular acceleration and rate.

    Parameters
    ----------
    calibration : Calibration
        Of the whole array (gauge ``array``).
    array : AccelerometerArray
        The drawing, with parts.
    rest : Recording, optional
        Recording at rest, corrected, m/s²: noise, bias and bias instability; else the data sheets of the parts.
    position_std_m : float
        Standard deviation of each coordinate of a chip where the calibration did not fit positions, m.

    Returns
    -------
    Sheet
        Terms per body axis: ``range_alpha_x`` … Each says in its note where it is from. A quantity that the calibration
        corrects has the value it was corrected to, with the standard uncertainty that remains.

    Raises
    ------
    InputError
        If the calibration is of single chips or other channels, a part's file lacks a figure, or nothing rests.
    GeometryError
        If the array can't see every angular acceleration.
    """
    found = response(calibration, array, position_std_m)
    noise = noise_by_data_sheet(found) if rest is None else noise_at_rest(found, rest)
    rate = noise.rate_hz or _SAMPLE_RATE
    limits = PartLimits.of(array, rate)
    fitted = bool(calibration.positions)
    places = (
        "positions as fitted" if fitted else f"positions as drawn, to {1e3 * position_std_m:.3g} mm (taken for granted)"
    )
    terms = (
        *_ranges(calibration, found, limits, places),
        *_noise(noise, found),
        _bandwidth(array, rate, recorded=noise.rate_hz is not None),
        *_response(found, places),
    )
    conditions = {
        "array": array.name,
        "channels": str(array.n_channels),
        "sample rate, Hz": f"{rate:.6g}" if noise.rate_hz else f"{rate:g} (not recorded; taken for granted)",
        "noise": noise.source,
        "positions": places,
        "frame": "body frame of the array",
        "correction": "readings corrected by this calibration, α by J⁺",
    }
    statements = [
        "the angular acceleration is measured; the rate is its integral, in which white noise is a random walk"
    ]
    if noise.instability is None:
        statements.append("bias instability is not stated: data sheets have none, and no recording at rest was given")
    return Sheet("The array as an angular sensor (IEEE Std 671)", terms, conditions, tuple(statements))


def _term(
    name: str,
    symbol: str,
    meaning: str,
    unit: str,
    value: float | None,
    std: float | None,
    note: str,
    familiar: tuple[str, float] = ("", 1.0),
) -> Term:
    known = std is not None and np.isfinite(std)
    k = coverage_factor(None) if known else None
    return Term(
        name,
        symbol,
        meaning,
        unit,
        value=None if value is None else float(value),
        std=float(std) if known and std is not None else None,
        expanded=None if k is None or std is None else k * float(std),
        coverage_factor=k,
        familiar_unit=familiar[0],
        familiar_factor=familiar[1],
        note=note,
    )


def _ranges(calibration: Calibration, found: Response, limits: PartLimits, places: str) -> Iterator[Term]:
    limit = specific_force_limits(calibration, limits)
    source = f"full range of the parts at their widest range, calibration, {places}"
    for which, symbol, meaning, unit, familiar, end in (
        ("alpha", "α_max", "input range, angular acceleration from rest", "rad/s²", "°/s²", acceleration_range),
        ("omega", "ω_max", "input range, constant rate about the origin", "rad/s", "°/s", rate_range),
    ):
        for axis, letter in enumerate("xyz"):
            value, std = end(found, limit, calibration.gravity, axis)
            finite = bool(np.isfinite(value))
            note = f"first channel to saturate, in any attitude; {source}" if finite else "no channel sees it"
            yield _term(
                f"range_{which}_{letter}",
                symbol,
                meaning,
                unit,
                value if finite else None,
                std,
                note,
                (familiar, _DEGREES),
            )


def _noise(noise: AlphaNoise, found: Response) -> Iterator[Term]:
    rows = [
        ("noise_density", "N_α", "noise density of the angular acceleration", "rad/s²/√Hz", ("°/s²/√Hz", _DEGREES)),
        ("rate_walk", "N_ω", "random walk of the rate, by integration", "rad/s/√s", ("°/s/√s", _DEGREES)),
    ]
    for name, symbol, meaning, unit, familiar in rows:
        for axis, letter in enumerate("xyz"):
            value, std = noise.density[axis]
            note = f"{noise.source}; N of the Allan deviation, the one-sided spectral density is √2 times that"
            yield _term(f"{name}_{letter}", symbol, meaning, unit, value, std, note, familiar)
    for axis, letter in enumerate("xyz"):
        if noise.bias is None:
            value, std, note = 0.0, float(found.bias_std[axis]), "corrected; covariance of the calibration"
        else:
            value, std = noise.bias[axis]
            note = f"mean after correction, {noise.source}"
        yield _term(
            f"bias_{letter}", "B_α", "bias of the angular acceleration", "rad/s²", value, std, note, ("°/s²", _DEGREES)
        )
    for axis, letter in enumerate("xyz"):
        meaning = "bias instability of the angular acceleration"
        if noise.instability is None:
            yield _term(f"instability_{letter}", "I_α", meaning, "rad/s²", None, None, "not determined")
            continue
        value, std = noise.instability[axis]
        note = f"minimum over 0.664, {noise.source}"
        note += "; an upper limit: the curve still falls" if noise.falling[axis] else ""
        yield _term(f"instability_{letter}", "I_α", meaning, "rad/s²", value, std, note, ("°/s²", _DEGREES))


def _bandwidth(array: AccelerometerArray, rate: float, *, recorded: bool) -> Term:
    rates = array.output_data_rates(rate)
    ratio = [
        PartFile.load(array.chips[chip].part, array.part_files).bandwidth_over_output_data_rate
        for chip in array.chip_of_channel
    ]
    note = "data sheets of the parts, at " + (
        "the recorded rate" if recorded else f"{rate:g} Hz, or the array file's rate"
    )
    return _term("bandwidth", "f_3", "bandwidth, −3 dB", "Hz", float(np.min(rates * ratio)), None, note)


def _response(found: Response, places: str) -> Iterator[Term]:
    source = f"covariance of the calibration, {places}"
    std = found.response_std
    for axis, letter in enumerate("xyz"):
        yield _term(f"scale_factor_{letter}", "S_α", "scale factor", "1", 1.0, std[axis, axis], f"corrected; {source}")
    for axis, letter in enumerate("xyz"):
        others = [other for other in range(3) if other != axis]
        across = float(np.linalg.norm(std[axis, others]))
        meaning = "input-axis misalignment (cross-axis sensitivity), over both directions"
        yield _term(f"misalignment_{letter}", "δ_α", meaning, "rad", 0.0, across, f"corrected; {source}", ("mrad", 1e3))
    for axis, letter in enumerate("xyz"):
        pull = float(np.linalg.norm(std[axis, 3:]))
        meaning = "acceleration sensitivity (g-sensitivity), over all directions"
        unit = "rad/s² per m/s²"
        yield _term(
            f"g_sensitivity_{letter}",
            "G_α",
            meaning,
            unit,
            0.0,
            pull,
            "corrected; gains and alignment, covariance of the calibration",
            ("rad/s² per g", STANDARD_GRAVITY),
        )
    for axis, letter in enumerate("xyz"):
        meaning = "rate-squared sensitivity, worst direction, before correction by ω"
        value, spread = found.rate_squared[axis], found.rate_squared_std[axis]
        yield _term(f"rate_squared_{letter}", "Q_α", meaning, "rad/s² per rad²/s²", value, spread, f"J⁺ Q, {places}")
