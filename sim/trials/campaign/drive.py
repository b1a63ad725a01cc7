"""The kind ``drive`` of a campaign: how well a motor-driven table follows its command, and what the chips see of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from gfimu.base.errors import InputError

if TYPE_CHECKING:
    from sim.rigs.driven import Drive, DrivenRun
    from sim.trials.sweep.design import Case
    from sim.trials.sweep.plan import Value

__all__ = ["DriveWork", "as_toml"]

_SCENARIO = "motor_run"
_LOG_STEP = 1e-3  # s between logged states: above the frequencies of cogging, below what memory minds
_MOVING, _STUCK = 1e-3, 0.1  # rad/s of a command that moves; share of it below which the table is at rest
_DRAWN = ("mount_std_m", "mount_std_rad", "tilt_std_rad")


@dataclass(frozen=True)
class DriveWork:
    """Drive the table of a scenario by its motor; the cases of a batch advance together (`sim.rigs.driven.drive_all`).

    Factors: ``scenario`` (one with a driven table), any key of its file, and tolerances whose errors are drawn by the
    seed: ``mount_std_m`` of the cube's place along each axis, ``mount_std_rad`` of its attitude about each,
    ``tilt_std_rad`` of the table's axis about x and y.
    """

    def check(self, case: Case) -> None:
        """Raise `InputError` where a case can't be set up."""
        _drive(case)

    def __call__(self, case: Case) -> Mapping[str, float]:
        """Return the results of one case: see `_results`."""
        return self.prepared([case])(case)

    def prepared(self, cases: Sequence[Case]) -> _Done:
        """Run cases together and return what gives the results of each."""
        from sim.rigs.driven import drive_all

        results: dict[int, Mapping[str, float] | InputError] = {}
        drives: dict[int, Drive] = {}
        for case in cases:
            try:
                drives[case.number] = _drive(case)
            except InputError as error:
                results[case.number] = error
        by_step: dict[int, list[int]] = {}
        for number, one in drives.items():
            by_step.setdefault(max(1, round(_LOG_STEP / one.step)), []).append(number)
        for every, numbers in by_step.items():
            runs = drive_all([drives[number] for number in numbers], every=every)
            for number, run in zip(numbers, runs, strict=True):
                results[number] = run if isinstance(run, InputError) else _results(drives[number], run)
        return _Done(results)


class _Done:
    """Results of cases that were run."""

    def __init__(self, results: Mapping[int, Mapping[str, float] | InputError]) -> None:
        self._results = results

    def __call__(self, case: Case) -> Mapping[str, float]:
        """Return the results of a case, or raise what made it fail."""
        result = self._results[case.number]
        if isinstance(result, InputError):
            raise result
        return result


def _drive(case: Case) -> Drive:
    """Return the run of a case."""
    from sim.rigs.driven import Drive
    from sim.scenarios import Scenario

    keys: dict[str, Value] = dict(case.values)
    scenario = Scenario.load(
        str(keys.pop("scenario", _SCENARIO)),
        changes=[f"{key}={as_toml(value)}" for key, value in keys.items() if key not in _DRAWN],
    )
    if not scenario.driven:
        raise InputError(f"scenario {scenario.name!r}: its table is not driven; set drive.mode to driven or dcmotor")
    place, attitude, tilt = (_std(keys, name) for name in _DRAWN)
    rng = np.random.default_rng(case.seed)
    errors = rng.standard_normal(8)
    scenario = replace(
        scenario,
        cube_offset=tuple(np.add(scenario.cube_offset, place * errors[:3]).tolist()),
        mounting_rotvec=tuple(np.add(scenario.mounting_rotvec, attitude * errors[3:6]).tolist()),
    )
    world = scenario.world
    world = world.changed(axis_rotvec=world.axis_rotvec + tilt * np.append(errors[6:], 0.0))
    return Drive(world, scenario.motion, scenario.duration, scenario.physics_step, scenario.motor)  # type: ignore[arg-type]


def _std(values: Mapping[str, Value], name: str) -> float:
    value = values.get(name, 0.0)
    if isinstance(value, str | bool) or not 0.0 <= value < math.inf:
        raise InputError(f"{name} = {value!r}: give a standard deviation of zero or above")
    return float(value)


def _results(drive: Drive, run: DrivenRun) -> dict[str, float]:
    """Return the results of a run.

    Error of the rate against the command, peak of the angular acceleration, largest change of a reading since the
    start, torque, and the share of the time in which the command moves but the table rests.
    """
    wanted = drive.command.at(run.t)
    error = run.state.rate - wanted.rate
    moving = np.abs(wanted.rate) > _MOVING
    stuck = np.abs(run.state.rate[moving]) < _STUCK * np.abs(wanted.rate[moving])
    return {
        "rate_error_rms_rad_s": float(np.sqrt(np.mean(error**2))),
        "rate_error_peak_rad_s": float(np.abs(error).max()),
        "acceleration_peak_rad_s2": float(np.abs(run.state.acceleration).max()),
        "reading_change_peak_m_s2": float(np.abs(run.readings - run.readings[0]).max()),
        "torque_rms_Nm": float(np.sqrt(np.mean(run.torque**2))),
        "torque_peak_Nm": float(np.abs(run.torque).max()),
        "stuck_share": float(np.mean(stuck)) if moving.any() else 0.0,
    }


def as_toml(value: Value) -> str:
    """Return the value of a factor as a change of a scenario file takes it."""
    return str(value).lower() if isinstance(value, bool) else str(value)
