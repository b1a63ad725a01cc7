"""The Monte Carlo of `gfimu tolerance`: simulate units, calibrate them, estimate, and compare with a perfect unit."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import GfimuError
from gfimu.budget.tolerances.budget import QUANTITIES
from gfimu.budget.tolerances.calibrated import uses_poses, uses_rest
from gfimu.budget.tolerances.comparison import UnitErrors

if TYPE_CHECKING:
    from gfimu.array.array import AccelerometerArray
    from gfimu.budget.tolerances.known_motion import KnownMotion
    from gfimu.budget.tolerances.tolerances import Tolerances
    from gfimu.motion.estimate import Estimate
    from gfimu.recording import Recording
    from sim.scenarios import Scenario
    from sim.trials.worlds.toleranced import ToleranceUnit

__all__ = ["UnitTask", "simulate_units"]

Floats = NDArray[np.float64]

_BATCH = 10  # numerical: units that a worker takes at a time


@dataclass(frozen=True)
class UnitTask:
    """What is done with each unit.

    Parameters
    ----------
    scenario : Scenario
        The run, with the array as drawn.
    poses : Scenario
        The static poses of a calibration.
    tolerances : Tolerances
        What units are drawn from.
    calibrations : tuple of str
        Keys of `gfimu.budget.tolerances.calibrated.CALIBRATIONS`.
    rates : bool
        Whether the null space determines ω.
    seed : int
        Seed of everything left to chance; unit i has the same errors and noise whatever else is simulated.
    """

    scenario: Scenario
    poses: Scenario
    tolerances: Tolerances
    calibrations: tuple[str, ...]
    rates: bool
    seed: int


_Row = dict[str, dict[str, float] | str]
"""Of one unit: by calibration the errors by quantity, or why there are none."""


def simulate_units(
    task: UnitTask, count: int, workers: int, *, progress: Callable[[float], object] | None = None
) -> dict[str, UnitErrors]:
    """Simulate units and return their errors by calibration.

    Parameters
    ----------
    task : UnitTask
        What is done with each.
    count : int
        Number of units.
    workers : int
        Worker processes; with 1 all is done in this process. The result does not depend on it.
    progress : callable, optional
        Called with the share of the units that is done.
    """
    batches = [range(first, min(first + _BATCH, count)) for first in range(0, count, _BATCH)]
    rows: list[_Row] = []
    for done in _batches(task, batches, min(workers, len(batches))):
        rows += done
        if progress is not None:
            progress(len(rows) / count)
    return {calibration: _gather([row[calibration] for row in rows]) for calibration in task.calibrations}


def _batches(task: UnitTask, batches: Sequence[range], workers: int) -> Iterator[list[_Row]]:
    """Yield the rows of each batch in order."""
    if workers <= 1:
        for batch in batches:
            yield unit_rows(task, batch)
        return
    from sim.trials.sweep.executors import open_workers

    with open_workers(workers) as opened:
        yield from opened.executor.map(unit_rows, [task] * len(batches), batches)


def _gather(found: Sequence[dict[str, float] | str]) -> UnitErrors:
    failures: dict[str, int] = {}
    for one in found:
        if isinstance(one, str):
            failures[one] = failures.get(one, 0) + 1
    names = [name for name in QUANTITIES if any(name in one for one in found if not isinstance(one, str))]
    errors = {
        name: np.array([np.nan if isinstance(one, str) else one[name] for one in found], dtype=float) for name in names
    }
    return UnitErrors(errors, failures)


def unit_rows(task: UnitTask, numbers: Sequence[int]) -> list[_Row]:
    """Simulate some units, given their numbers, and return the errors of each."""
    from sim.chips.adxl345 import SensorErrors
    from sim.trials.worlds.toleranced import ToleranceUnit, known_motion_of

    array = task.scenario.array
    motion = known_motion_of(task.scenario)
    perfect = ToleranceUnit(array, SensorErrors.none(array.n_channels), np.zeros(array.n_channels))
    ideal = perfect.record(task.scenario, np.random.default_rng(0))
    reference = _estimated(ideal, array, motion)
    return [_row(task, number, motion, reference) for number in numbers]


def _row(task: UnitTask, number: int, motion: KnownMotion, reference: Estimate) -> _Row:
    from sim.trials.worlds.toleranced import CALIBRATED_AT, draw_unit

    # Streams of their own: which calibrations are asked for changes no unit.
    drawing, of_run, of_poses = (np.random.default_rng([task.seed, number, stream]) for stream in range(3))
    unit = draw_unit(task.scenario.array, task.tolerances, drawing)
    run = unit.record(task.scenario, of_run, temperature=CALIBRATED_AT + task.tolerances.temperature_K)
    runs: dict[bool, Recording | str] = {False: run}
    if any(uses_poses(calibration) for calibration in task.calibrations):
        runs[True] = _corrected(task, unit, run, of_poses)
    found: _Row = {}
    for calibration in task.calibrations:
        readings = runs[uses_poses(calibration)]
        if isinstance(readings, str):
            found[calibration] = readings
            continue
        try:
            found[calibration] = _errors(task, calibration, readings, motion, reference)
        except GfimuError as error:
            found[calibration] = _reason(error)
    return found


def _reason(error: GfimuError) -> str:
    """Return why a unit failed, without the figures, so that equal reasons count together."""
    return re.sub(r"-?\d+(\.\d+)?(e[-+]?\d+)?", "…", str(error).splitlines()[0])


def _corrected(task: UnitTask, unit: ToleranceUnit, run: Recording, rng: np.random.Generator) -> Recording | str:
    """Calibrate a unit from poses and return its run corrected, or why that is not possible."""
    from gfimu.calibration.array_calibration import calibrate_array

    try:
        posed = unit.record(task.poses, rng)
        return calibrate_array(posed, task.scenario.array, gravity=task.poses.gravity, fit_positions=False).apply(run)
    except GfimuError as error:
        return _reason(error)


def _errors(
    task: UnitTask, calibration: str, run: Recording, motion: KnownMotion, reference: Estimate
) -> dict[str, float]:
    """Estimate a run and return the norms of its errors."""
    array = task.scenario.array
    if uses_rest(calibration):  # as `gfimu.motion.rest_bias`, with the rest known: to find it is no tolerance
        rest = slice(motion.rest)
        bias = run.readings[rest].mean(axis=0) - motion.readings(array)[rest].mean(axis=0)
        run = replace(run, readings=run.readings - bias)
    found = _estimated(run, array, motion)
    errors = {
        "alpha": _rms(found.alpha - reference.alpha),
        "omega": float(np.linalg.norm(found.omega[-1] - reference.omega[-1])),
    }
    if task.rates:
        errors["omega_null_space"] = _rms(_null_space_rate(run, array, motion) - motion.omega[motion.turning])
    assert found.position is not None
    assert reference.position is not None
    errors["position"] = float(np.linalg.norm(found.position[-1] - reference.position[-1]))
    return errors


def _estimated(run: Recording, array: AccelerometerArray, motion: KnownMotion) -> Estimate:
    """Estimate by integration, levelled at the start where the body rests there, else from the true start."""
    from scipy.spatial.transform import Rotation

    from gfimu.motion.attitude import from_rotation
    from gfimu.motion.estimation import estimate

    metadata = {key: value for key, value in run.metadata.items() if key != "mounting_rotvec_rad"}
    return estimate(
        replace(run, metadata=metadata),
        array,
        method="integrate",
        omega0=motion.omega[0],
        quaternion0=None if motion.levelled else from_rotation(Rotation.from_matrix(motion.rotation[0])),
        with_position=True,
        gravity=motion.gravity,
        findings=(),
    )


def _null_space_rate(run: Recording, array: AccelerometerArray, motion: KnownMotion) -> Floats:
    """Rate from the null space at the samples that turn, (k, 3), rad/s; the sign is that of the true one."""
    from gfimu.budget.tolerances.propagation import null_space_of
    from gfimu.rate.maximum_likelihood import rates_of_null_space

    rows, sensitivity = null_space_of(array, motion)
    omega, _ = rates_of_null_space(run.readings[motion.turning] @ rows.T, sensitivity)
    along = np.sum(omega * motion.omega[motion.turning], axis=1, keepdims=True)
    return np.asarray(np.where(along < 0.0, -omega, omega))


def _rms(errors: Floats) -> float:
    """Return the root of the mean square of the norms of errors, (n, 3)."""
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=1))))
