"""The Monte Carlo of `gfimu tolerance`: simulate units, calibrate them, estimate, and compare with a perfect unit."""

from __future__ import annotations

import functools
import math
import re
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.base.errors import GfimuError
from gfimu.budget.tolerances.budget import QUANTITIES
from gfimu.budget.tolerances.calibrated import uses_poses, uses_rest
from gfimu.budget.tolerances.comparison import UnitErrors
from gfimu.budget.tolerances.known_motion import KnownMotion
from gfimu.budget.tolerances.propagation import null_space_of
from gfimu.budget.tolerances.tolerances import Tolerances
from gfimu.calibration.array_calibration import calibrate_array
from gfimu.motion.attitude import from_rotation
from gfimu.motion.estimate import Estimate
from gfimu.motion.estimation import estimate
from gfimu.rate.maximum_likelihood import rates_of_null_space
from gfimu.recording import Recording
from sim.chips.adxl345 import SensorErrors
from sim.scenarios import Scenario
from sim.trials.sweep.executors import open_workers
from sim.trials.worlds.toleranced import CALIBRATED_AT, ToleranceUnit, draw_unit, known_motion_of

__all__ = ["UnitTask", "simulate_units"]

Floats = NDArray[np.float64]

_BATCH = 10  # numerical: units that a worker takes at a time

UnitRow = dict[str, dict[str, float] | str]
"""Of one unit: by calibration the errors by quantity, or why there are none."""


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

    @functools.cached_property
    def motion(self) -> KnownMotion:
        """The true motion."""
        return known_motion_of(self.scenario)

    @functools.cached_property
    def reference(self) -> Estimate:
        """What a perfect unit estimates."""
        array = self.scenario.array
        perfect = ToleranceUnit(array, SensorErrors.none(array.n_channels), np.zeros(array.n_channels))
        return self.estimated(perfect.record(self.scenario, np.random.default_rng(0)))

    def row(self, number: int) -> UnitRow:
        """Simulate the unit of a number and return its errors."""
        # Streams of their own: which calibrations are asked for changes no unit.
        drawing, of_run, of_poses = (np.random.default_rng([self.seed, number, stream]) for stream in range(3))
        unit = draw_unit(self.scenario.array, self.tolerances, drawing)
        run = unit.record(self.scenario, of_run, temperature=CALIBRATED_AT + self.tolerances.temperature_K)
        posed = unit.record(self.poses, of_poses) if any(map(uses_poses, self.calibrations)) else None

        @functools.cache
        def corrected() -> Recording:
            """Return the run corrected by a calibration from poses."""
            assert posed is not None
            fitted = calibrate_array(posed, self.scenario.array, gravity=self.poses.gravity, fit_positions=False)
            return fitted.apply(run)

        reference, errors = self.reference, UnitRow()
        for calibration in self.calibrations:
            try:
                readings = corrected() if uses_poses(calibration) else run
                errors[calibration] = self.errors(readings, reference, at_rest=uses_rest(calibration))
            except GfimuError as error:  # without its figures, so that equal reasons count together
                errors[calibration] = re.sub(r"-?\d+(\.\d+)?(e[-+]?\d+)?", "…", str(error).splitlines()[0])
        return errors

    def errors(self, run: Recording, reference: Estimate, *, at_rest: bool) -> dict[str, float]:
        """Estimate a run, its biases read off the rest where asked for, and return the norms of its errors."""
        motion = self.motion
        if at_rest:  # as `gfimu.motion.rest_bias`, with the rest known: to find it is no tolerance
            rest = slice(motion.rest)
            bias = run.readings[rest].mean(axis=0) - motion.readings(self.scenario.array)[rest].mean(axis=0)
            run = replace(run, readings=run.readings - bias)
        estimated = self.estimated(run)
        errors = {
            "alpha": _rms(estimated.alpha - reference.alpha),
            "omega": float(np.linalg.norm(estimated.omega[-1] - reference.omega[-1])),
        }
        if self.rates:
            errors["omega_null_space"] = _rms(self.null_space_rate(run) - motion.omega[motion.turning])
        assert estimated.position is not None
        assert reference.position is not None
        errors["position"] = float(np.linalg.norm(estimated.position[-1] - reference.position[-1]))
        return errors

    def estimated(self, run: Recording) -> Estimate:
        """Estimate by integration, levelled at the start where the body rests there, else from the true start."""
        motion = self.motion
        metadata = {key: value for key, value in run.metadata.items() if key != "mounting_rotvec_rad"}
        return estimate(
            replace(run, metadata=metadata),
            self.scenario.array,
            method="integrate",
            omega0=motion.omega[0],
            quaternion0=None if motion.levelled else from_rotation(Rotation.from_matrix(motion.rotation[0])),
            with_position=True,
            gravity=motion.gravity,
            findings=(),
        )

    def null_space_rate(self, run: Recording) -> Floats:
        """Rate from the null space at the samples that turn, (k, 3), rad/s; the sign is that of the true one."""
        rows, sensitivity = null_space_of(self.scenario.array, self.motion)
        omega, _ = rates_of_null_space(run.readings[self.motion.turning] @ rows.T, sensitivity)
        along = np.sum(omega * self.motion.omega[self.motion.turning], axis=1, keepdims=True)
        return np.asarray(np.where(along < 0.0, -omega, omega))


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
    rows: list[UnitRow] = []
    processes, units = min(workers, math.ceil(count / _BATCH)), range(count)
    with open_workers(processes) if processes > 1 else nullcontext() as opened:
        done = map(task.row, units) if opened is None else opened.executor.map(task.row, units, chunksize=_BATCH)
        for row in done:
            rows.append(row)
            if progress is not None:
                progress(len(rows) / count)
    return {calibration: _gathered([row[calibration] for row in rows]) for calibration in task.calibrations}


def _gathered(results: Sequence[dict[str, float] | str]) -> UnitErrors:
    failures = Counter(result for result in results if isinstance(result, str))
    rows = [{} if isinstance(result, str) else result for result in results]
    names = [name for name in QUANTITIES if any(name in row for row in rows)]
    return UnitErrors({name: np.array([row.get(name, np.nan) for row in rows]) for name in names}, dict(failures))


def _rms(errors: Floats) -> float:
    """Return the root of the mean square of the norms of errors, (n, 3)."""
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=1))))
