"""Calibrations of a known unit under given stage errors, by the estimator that the calibration itself came from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.calibration.certificate.stage.stage_errors import StageErrors, specific_force
from gfimu.calibration.combine import combine
from gfimu.calibration.coverage import FACES
from gfimu.calibration.observations import Observations
from gfimu.calibration.parameter_names import quadratic_names
from gfimu.calibration.registry import METHODS, CalibrationMethod
from gfimu.calibration.result import Calibration

__all__ = ["SimulatedCalibration", "calibrate_under", "chip_statistic", "poses_of", "simulated_method"]

Floats = NDArray[np.float64]

_EDGES = np.array([(1, 1, 0), (-1, 1, 0), (1, 0, 1), (-1, 0, 1), (0, 1, 1), (0, -1, 1)]) / np.sqrt(2.0)
_EIGHTEEN = np.concatenate([FACES, _EDGES, -_EDGES])
"""Faces, then the edges at 45° and 135° in each plane, then the opposite edges."""

_MOST_POSES = 36
"""Numerical: a calibration of more poses is simulated by so many."""

_NOISE_SHARE = 1e-4
"""Numerical: noise of the means over gravity, where the file does not state it; it only sets weights."""


@dataclass(frozen=True)
class SimulatedCalibration:
    """One simulated calibration.

    Parameters
    ----------
    calibration : Calibration
        What the estimator returned, all chips.
    misfit : float
        Mean variance factor of the chips: vᵀPv over the redundancy that the stage errors alone leave in the fit; zero
        where the calibration does not state the noise of its means.
    """

    calibration: Calibration
    misfit: float


def simulated_method(calibration: Calibration) -> CalibrationMethod | None:
    """Return the method by which a calibration can be simulated; None for whole arrays, gyros and other methods."""
    method = METHODS.get(calibration.method)
    if method is None or not method.gauges or calibration.unit == "rad_s" or calibration.gauge == "array":
        return None
    return method


def chip_statistic(calibration: Calibration, chip: str, key: str) -> float | None:
    """Return a statistic of one chip, whose name is before it where there are several; None if it is not there."""
    found = calibration.statistics.get(f"{chip}_{key}", calibration.statistics.get(key))
    return None if found is None else float(found)


def poses_of(calibration: Calibration) -> Floats:
    """Return the poses of a method, as many as the calibration had, shape (p, 3).

    The file does not hold the poses. Known-pose methods have the six faces, repeated in turn; ``twelve-position`` the
    faces and edges; methods that use magnitudes only have faces and edges as well, at least the eighteen recommended.
    """
    count = int(chip_statistic(calibration, calibration.chips[0], "poses") or 0)
    known, least = {"six-position": (FACES, 6), "recursive": (FACES, 6), "twelve-position": (_EIGHTEEN, 12)}.get(
        calibration.method, (_EIGHTEEN, 18)
    )
    return np.resize(known, (min(max(count, least), _MOST_POSES), 3))


def calibrate_under(calibration: Calibration, directions: Floats, errors: StageErrors) -> list[SimulatedCalibration]:
    """Calibrate every chip again, n times, from the readings that it has under the errors of the stage.

    Parameters
    ----------
    calibration : Calibration
        The unit (M, b and q of every chip), method, gauge and gravity.
    directions : ndarray, shape (p, 3)
        Wanted directions of the specific force in the axes of the unit.
    errors : StageErrors
        Errors of n calibrations.
    """
    force = specific_force(directions, errors, calibration.gravity)  # (n, p, 3)
    each = [
        [_fit(calibration, chip, one, rounding) for chip in calibration.chips]
        for one, rounding in zip(force, errors.reading, strict=True)
    ]
    return [SimulatedCalibration(combine(fits), _misfit(calibration, fits)) for fits in each]


def _fit(calibration: Calibration, chip: str, force: Floats, error: Floats) -> Calibration:
    """Calibrate one chip from the specific forces (p, 3) of its poses and errors of the readings (p, 3), both m/s²."""
    model = calibration.models[chip]
    scale = float(np.mean(np.linalg.norm(model.sensitivity, axis=1)))  # reading unit per m/s²
    noise = _mean_noise(calibration, chip) or _NOISE_SHARE * calibration.gravity * scale
    bends = quadratic_names((chip,))
    prior = chip_statistic(calibration, chip, f"quadratic_prior_std_per_{calibration.unit}")
    observations = Observations.from_means(
        model.read(force) + scale * error,
        noise**2 * np.eye(3),
        unit=calibration.unit,
        channels=tuple(f"{chip}{axis}" for axis in (1, 2, 3)),
    )
    if bends[0] in calibration.names:
        std = [calibration.std_of(name) for name in bends] if prior is None else [prior] * 3
        observations = replace(observations, quadratic_std=np.array(std))
    method = METHODS[calibration.method]
    options: dict[str, Any] = {}
    levelling = chip_statistic(calibration, chip, "levelling_std_rad")
    if "levelling_std_rad" in method.options and levelling is not None:
        options["levelling_std_rad"] = levelling
    return method.fit(observations, gravity=calibration.gravity, gauge=calibration.gauge, **options)


def _misfit(calibration: Calibration, fits: list[Calibration]) -> float:
    """Return the mean variance factor, in units of the noise that the calibration states."""
    if any(_mean_noise(calibration, chip) is None for chip in calibration.chips):
        return 0.0
    factors = np.array([fit.statistics["variance_factor"] for fit in fits], dtype=float)
    return float(np.mean(np.where(np.isfinite(factors), factors, 0.0)))


def _mean_noise(calibration: Calibration, chip: str) -> float | None:
    return chip_statistic(calibration, chip, f"mean_noise_{calibration.unit}")
