"""The angular rate of an estimate: α integrated as it is read, or a method that knows the errors of the sensors.

`solve_rate` is the way in. The methods themselves are in `gfimu.rate.solvers`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.integration import integrate_rate
from gfimu.rate.consistency import judge_consistency
from gfimu.rate.disagreement import sum_up_disagreement
from gfimu.rate.feedback import integrate_rate_recursively
from gfimu.rate.methods import estimate_rate
from gfimu.rate.problem import RateProblem, RateSolution
from gfimu.rate.registry import RateMethod
from gfimu.rate.rest_test import RestTest
from gfimu.rate.result import RateEstimate
from gfimu.rate.sensing import SensorErrors
from gfimu.rate.settings import FilterSettings

__all__ = ["solve_rate"]

_EXACT = 1e-9  # numerical: uncertainty of a rate at the start that is taken as given, rad/s


def solve_rate(method: RateMethod, problem: RateProblem) -> RateSolution:
    """Find the angular rate: the solution for α integrated, or the sensors' errors taken from their data sheets."""
    return _integrate(problem) if method.open_loop else _with_sensor_errors(method, problem)


def _integrate(problem: RateProblem) -> RateSolution:
    """Integrate α from the first sample (paper, step 10 d), with every error of the sensors left in and in σ."""
    linear, t = problem.linear, problem.t_s
    start = np.zeros(3) if problem.omega0 is None else problem.omega0
    alpha = linear.motion[:, :3]
    leakage = linear.leakage[:, :3]
    if leakage.any():
        omega = integrate_rate_recursively(t, alpha, leakage, linear.pattern, start)
    else:
        omega = integrate_rate(t, alpha, start)
    reduced, _ = _of_living_channels(problem)
    rest = RestTest() if problem.levelled else None  # what the biases taken off are uncertain by
    settings = FilterSettings(start_omega=start, start_std=_EXACT, rest=rest, measure_noise=False)
    known = estimate_rate(
        reduced.array, t, reduced.readings, reduced.errors, method="integrate", settings=settings, path=problem.path
    )
    std = np.where(np.isfinite(omega), known.std, np.nan)
    return RateSolution(omega, std, path=known.path)


def _with_sensor_errors(method: RateMethod, problem: RateProblem) -> RateSolution:
    """Run a method of `gfimu.rate.registry` with the errors of the parts, and of the biases as a calibration states."""
    problem, names = _of_living_channels(problem)
    errors = problem.errors
    settings = FilterSettings(start_omega=problem.omega0)
    found = estimate_rate(
        problem.array, problem.t_s, problem.readings, errors, method=method.name, settings=settings,
        references=problem.references, path=problem.path, progress=problem.progress,
    )  # fmt: skip
    disagreement = None if found.scale is None else sum_up_disagreement(found.scale, found.omega)
    start = found.start
    remarks = {
        "calibration_biases_contradicted": problem.calibrated and start is not None and start.bias_factor > 1.0,
        "start": None if start is None else start.to_dict(),
        "sign": found.sign.state,
        "sign_undecided_samples": int(found.sign_undecided.sum()),
        "disagreement": None if disagreement is None else disagreement.to_dict(),
        "sign_decided_at_s": found.sign.decided_at_s if np.isfinite(found.sign.decided_at_s) else None,
        "mean_normalised_innovation_squared": found.mean_nis if np.isfinite(found.mean_nis) else None,
        "share_at_rest": float(found.rest.mean()),
        "channels": _renamed(found.channels.to_dict(), names),
    }
    if method.recursive:
        consistency = judge_consistency(
            problem.array, problem.readings, errors, found, temperature=problem.temperature,
            filter_again=_filter_again(problem, errors, found),
        )  # fmt: skip
        if consistency is not None and consistency.worst_channel is not None:
            consistency = replace(consistency, worst_channel=names[consistency.worst_channel])
        remarks["consistency"] = None if consistency is None else consistency.to_dict()
    std = np.where(np.isfinite(found.std), found.std, np.nan)
    probability = found.sign_probability
    if probability is None:
        probability = np.full(len(found), 0.5 if found.sign.state == "undecided" else 1.0)
    return RateSolution(found.omega, std, found.rest, found.scale, probability, found.path, remarks)


def _of_living_channels(problem: RateProblem) -> tuple[RateProblem, dict[str, str]]:
    """Return the problem without channels that never have a reading, where the others see all motions.

    An array of the others can recognise rest, which needs all of its channels. Its channels are numbered anew; the
    second value gives their real names.
    """
    array = problem.array
    alive: NDArray[np.bool_] = np.asarray(np.isfinite(problem.readings).any(axis=0))
    living = [name for name, lives in zip(array.channels, alive, strict=True) if lives]
    scale = np.array([array.length_unit] * 3 + [1.0] * 3)
    if alive.all() or np.linalg.matrix_rank(array.regression_matrix[alive] / scale, tol=1e-6) < 6:
        return problem, {name: name for name in array.channels}
    chips = [replace(chip, axes=chip.axes[alive[array.chip_of_channel == k]]) for k, chip in enumerate(array.chips)]
    fewer = replace(array, chips=tuple(chip for chip in chips if len(chip.axes)))
    errors = problem.errors.of_channels(alive)
    reduced = replace(problem, array=fewer, readings=problem.readings[:, alive], errors=errors)
    return reduced, dict(zip(fewer.channels, living, strict=True))


def _renamed(report: dict[str, Any], names: Mapping[str, str]) -> dict[str, Any]:
    """Return a channel report with the channels' real names."""
    return {
        key: {names[name]: count for name, count in value.items()} if isinstance(value, dict) else value
        for key, value in report.items()
    }


def _filter_again(
    problem: RateProblem, errors: SensorErrors, found: RateEstimate
) -> Callable[[slice, NDArray[np.float64]], RateEstimate]:
    """Return a filter of some rows with other readings that starts as the one before did, or from what it found."""

    def run(rows: slice, readings: NDArray[np.float64]) -> RateEstimate:
        begins = rows.start == 0 or not np.isfinite(found.omega[rows.start]).all()
        if begins and problem.omega0 is not None:
            settings = FilterSettings(start_omega=problem.omega0, measure_noise=False)
        else:
            std = float(np.nan_to_num(found.std[rows.start]).max())
            settings = FilterSettings(found.omega[rows.start], max(std, 1e-3), measure_noise=False)
        beside = [one._replace(values=one.values[rows]) for one in problem.references if not one.reference.of_path]
        return estimate_rate(
            problem.array,
            problem.t_s[rows],
            readings,
            errors,
            method="filter",
            settings=settings,
            references=beside,
        )

    return run
