"""Under `gfimu tolerance`: what machining and chip tolerances of an array do to α, ω and position."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.commands.former_arguments import former_arguments
from gfimu.errors import InputError
from gfimu.files.outputs import PICTURE, writes
from gfimu.results import Panel, PlottedResult, Series, text_column

if TYPE_CHECKING:
    from gfimu.commands.tolerance_units import UnitErrors
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.tolerances.budget import ToleranceBudget
    from gfimu.tolerances.calibrated import Poses
    from gfimu.tolerances.comparison import Comparison
    from gfimu.tolerances.tolerances import Tolerances
    from sim.scenarios import Scenario

__all__ = ["ToleranceResult", "tolerance"]

_FORMAT_VERSION = 1
_LEAST_UNITS, _MOST_UNITS = 10, 100_000  # fewer have no spread to speak of; more take hours
_USUAL_TIME_S = 3.0  # of the reference motion: a second at the rate, after rest and ramp
_MOST_SAMPLES = 6000  # numerical: memory of the first-order maps, 1 GB with 24 channels


@dataclass(frozen=True)
class ToleranceResult(PlottedResult):
    """Errors of an array from its tolerances, before and after a calibration.

    Parameters
    ----------
    array : str
        Name of the array.
    motion : str
        What was simulated, in words.
    levelled : bool
        Whether estimates level themselves at the start; else attitude and rate are known there.
    tolerances : Tolerances
        What was assumed.
    budgets : mapping of str to ToleranceBudget
        First order, by calibration.
    units : mapping of str to UnitErrors
        Simulated units, by calibration; empty where none were asked for.
    seed : int
        Seed of the simulated units.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.tolerance("cube12", closed_form=True)
    >>> sorted(found.budgets)
    ['none', 'poses', 'poses+rest', 'rest']
    """

    array: str
    motion: str
    levelled: bool
    tolerances: Tolerances
    budgets: Mapping[str, ToleranceBudget]
    units: Mapping[str, UnitErrors]
    seed: int

    @cached_property
    def comparisons(self) -> dict[str, dict[str, Comparison]]:
        """Simulated units beside first order, by calibration and quantity."""
        from gfimu.tolerances.comparison import compare

        return {
            calibration: {
                name: compare(self.budgets[calibration].quantities[name], errors, self.tolerances.shape)
                for name, errors in found.errors.items()
            }
            for calibration, found in self.units.items()
        }

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per calibration, quantity and cause: the rms error it makes, its share of the variance."""
        rows = [
            (calibration, one, cause, size)
            for calibration, budget in self.budgets.items()
            for one in budget.quantities.values()
            for cause, size in one.by_cause.items()
        ]
        return {
            "calibration": text_column(calibration for calibration, _, _, _ in rows),
            "quantity": text_column(one.name for _, one, _, _ in rows),
            "cause": text_column(cause for _, _, cause, _ in rows),
            "rms": np.array([size for _, _, _, size in rows], dtype=float),
            "unit": text_column(one.unit for _, one, _, _ in rows),
            "share": np.array([one.shares[cause] for _, one, cause, _ in rows], dtype=float),
        }

    def _heading(self) -> str:
        return f"Tolerances of {self.array}"

    def _facts(self) -> list[tuple[str, str]]:
        facts = [("motion", self.motion)]
        for calibration, budget in self.budgets.items():
            sizes = "; ".join(f"{one.name} {one.rms:.3g} {one.unit}" for one in budget.quantities.values())
            facts.append((f"errors, {calibration.replace('_', ' ')}", sizes))
        return facts

    def _panels(self) -> list[Panel]:
        first = next(iter(self.budgets.values()))
        panels = []
        for name, quantity in first.quantities.items():
            causes = tuple(dict.fromkeys(c for one in self.budgets.values() for c in one.quantities[name].by_cause))
            series = tuple(
                Series(key.replace("_", " "), np.array([one.quantities[name].by_cause.get(c, np.nan) for c in causes]))
                for key, one in self.budgets.items()
            )
            title = f"error of {name.replace('_', ' ')}, by cause"
            panels.append(Panel(title, f"rms, {quantity.unit}", series, causes, scale="log"))
        return panels

    def to_dict(self) -> dict[str, Any]:
        """Return the content of ``gfimu tolerance --json``."""
        from gfimu.tolerances.words import tolerance_figures

        return {
            "format_version": _FORMAT_VERSION,
            "array": self.array,
            "motion": self.motion,
            "levelled_at_start": self.levelled,
            "tolerances": tolerance_figures(self.tolerances),
            "seed": self.seed,
            "calibrations": {name: self._calibration(name) for name in self.budgets},
        }

    def _calibration(self, name: str) -> dict[str, Any]:
        budget, units = self.budgets[name], self.units.get(name)
        simulated = {} if units is None else self.comparisons[name]
        return {
            "attitude_error_rad": budget.attitude_rad,
            "failed_units": {} if units is None else units.failures,
            "quantities": {
                key: one.to_dict() | ({"simulated": simulated[key].to_dict()} if key in simulated else {})
                for key, one in budget.quantities.items()
            },
        }


@former_arguments(time="duration", rate="speed_rad_s", placement_mm="position_mm", out="picture")
@writes(reads=("array", "scenario"), picture=PICTURE)
def tolerance(
    array: AccelerometerArray | str | Path,
    *,
    scenario: Scenario | str | Path | None = None,
    duration: float | None = None,
    speed_rad_s: float = 5.0,
    position_mm: float = 0.2,
    angle_deg: float = 0.5,
    normal: bool = False,
    part: str | None = None,
    bias_mg: float | None = None,
    gain_percent: float | None = None,
    cross_axis_percent: float | None = None,
    nonlinearity_percent: float | None = None,
    noise_ug: float | None = None,
    temperature_k: float = 5.0,
    calibrated: Sequence[str] = (),
    closed_form: bool = False,
    units: int = 200,
    seed: int = 0,
    workers: int | None = None,
    picture: str | Path | None = None,
    progress: Callable[[int], object] | None = None,
) -> ToleranceResult:
    """Budget the errors of α, ω and position from machining and chip tolerances, and simulate units to compare.

    Parameters
    ----------
    array : AccelerometerArray, str or Path
        The array as drawn, its name or file.
    scenario : Scenario, str or Path, optional
        Motion: a scenario, its name or file; its array, sensors and effects are not used. By default the array rests
        level for 1.5 s, is spun up about the vertical within 0.5 s, and turns on.
    duration : float, optional
        Length of the run, s; 3 s by default, or that of the scenario.
    speed_rad_s : float
        Angular rate of the default motion, rad/s.
    position_mm : float
        Limit of the position error of each chip along each axis, mm.
    angle_deg : float
        Limit of the rotation of each chip about each axis, °.
    normal : bool
        Take both limits for three standard deviations of a normal distribution; else errors are uniform between them.
    part : str, optional
        Part of every chip, in place of those of the array.
    bias_mg, gain_percent, cross_axis_percent, nonlinearity_percent : float, optional
        Standard deviations of each channel, mg and %; by default those of the parts' data sheets.
    noise_ug : float, optional
        White noise of each channel, one-sided density, µg/√Hz; by default the data sheets'.
    temperature_k : float
        Temperature of the run less that of the calibration, K.
    calibrated : sequence of str
        Calibrations, of none, rest, poses and poses+rest; all that the array and the motion allow by default.
    closed_form : bool
        First order alone, without simulated units.
    units : int
        Number of simulated units.
    seed : int
        Their seed.
    workers : int, optional
        Worker processes; by default as many as this process has processors. The result does not depend on it.
    picture : str or Path, optional
        Picture to write, ``.png``, ``.svg`` or ``.pdf``.
    progress : callable, optional
        Called with the number of simulated units done.

    Raises
    ------
    InputError
        If an argument is out of range, or the array or the motion do not allow a calibration.
    GeometryError
        If the array can't see all six motions.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.tolerance("cube12", closed_form=True)
    >>> found.budgets["poses+rest"].quantities["omega"].unit
    'rad/s'
    """
    from gfimu.commands.opened import as_array
    from gfimu.commands.tolerance_units import UnitTask, simulate_units
    from gfimu.geometry.observability import require_all_motions
    from gfimu.tolerances.budget import tolerance_budget
    from gfimu.tolerances.calibrated import calibrations_of, check_calibration
    from gfimu.tolerances.propagation import error_maps
    from gfimu.tolerances.tolerances import ChipErrors, Tolerances
    from gfimu.units import MILLI_G
    from sim.sweep.executors import processors
    from sim.worlds.toleranced import known_motion_of

    _check("--position-mm", position_mm)
    _check("--angle-deg", angle_deg)
    _check("--temperature-k", temperature_k)
    if not closed_form and not _LEAST_UNITS <= units <= _MOST_UNITS:
        raise InputError(f"--units {units}: give {_LEAST_UNITS} to {_MOST_UNITS}, or --closed-form for none")
    if seed < 0 or (workers is not None and workers < 1):
        raise InputError(f"--seed {seed}, --workers {workers}: a seed is zero or positive, workers are 1 or more")
    chip = ChipErrors(
        bias_m_s2=_scaled("--bias-mg", bias_mg, MILLI_G),
        gain=_scaled("--gain-percent", gain_percent, 0.01),
        cross_axis=_scaled("--cross-axis-percent", cross_axis_percent, 0.01),
        nonlinearity=_scaled("--nonlinearity-percent", nonlinearity_percent, 0.01),
        noise_m_s2_rthz=_scaled("--noise-ug", noise_ug, 1e-3 * MILLI_G),
    )
    drawn = as_array(array)
    if part is not None:
        drawn, name = drawn.with_part_file(part)
        drawn = drawn.with_part(name)
    require_all_motions(drawn, or_axis=False)
    run, words = _run(drawn, scenario, duration, speed_rad_s)
    motion = known_motion_of(run)
    for name in calibrated:
        check_calibration(name, drawn, motion)
    names = tuple(dict.fromkeys(calibrated)) or calibrations_of(drawn, motion)
    tolerances = Tolerances.of(
        drawn,
        run.sample_rate,
        placement_m=1e-3 * position_mm,
        angle_rad=math.radians(angle_deg),
        shape="normal" if normal else "uniform",
        chip=chip,
        temperature_K=temperature_k,
    )
    posed, poses = _poses(run)
    maps = error_maps(drawn, motion)
    budgets = {
        name: tolerance_budget(drawn, motion, tolerances, calibration=name, poses=poses, maps=maps) for name in names
    }
    simulated: Mapping[str, UnitErrors] = {}
    if not closed_form:
        task = UnitTask(run, posed, tolerances, names, maps.rate is not None, seed)
        simulated = simulate_units(task, units, workers or processors(), progress=progress)
    result = ToleranceResult(drawn.name, words, motion.levelled > 0, tolerances, budgets, simulated, seed)
    if picture is not None:
        errors = {name: found.errors for name, found in simulated.items()}
        from gfimu.tolerances.picture import tolerance_picture

        tolerance_picture(picture, budgets, errors, tolerances.shape, title=f"{drawn.name}: {words}")
    return result


def _check(option: str, value: float | None) -> None:
    if value is not None and not 0.0 <= value < math.inf:
        raise InputError(f"{option} {value:g}: give a finite number, zero or above")


def _scaled(option: str, value: float | None, unit: float) -> float | None:
    """Return a value of an option in SI units."""
    _check(option, value)
    return None if value is None else value * unit


def _run(
    array: AccelerometerArray, scenario: Scenario | str | Path | None, duration: float | None, speed_rad_s: float
) -> tuple[Scenario, str]:
    """Return the run with the array as drawn and nothing wrong in it, and what it is in words."""
    from sim.scenarios import Scenario
    from sim.worlds.toleranced import LEAST_TIME_S, REST_S, reference_motion

    if scenario is None:
        length = _USUAL_TIME_S if duration is None else duration
        if not LEAST_TIME_S < length < math.inf:
            raise InputError(f"--duration {length:g}: the default motion is longer than {LEAST_TIME_S:g} s; give more")
        if not 0.0 < abs(speed_rad_s) <= 1e3:
            raise InputError(f"--speed-rad-s {speed_rad_s:g}: give a rate of at most 1000 rad/s that is not zero")
        run = reference_motion(array, time=length, rate=speed_rad_s)
        words = (
            f"at rest for {REST_S:g} s, then spun up to {speed_rad_s:g} rad/s about the vertical, {length:g} s in all"
        )
    else:
        given = scenario if isinstance(scenario, Scenario) else Scenario.load(scenario)
        length = given.duration if duration is None else duration
        if not 0.0 < length <= given.duration:
            raise InputError(
                f"--duration {length:g}: scenario {given.name!r} lasts {given.duration:g} s; give at most that"
            )
        run = replace(given, array=array, part=None, duration=length, driven=False, effects=(), earth=None)
        words = f"scenario {given.name}, {length:g} s"
    if not 10 <= round(run.duration * run.sample_rate) <= _MOST_SAMPLES:
        raise InputError(
            f"the run has {run.duration * run.sample_rate:.0f} samples; give a --duration with 10 to {_MOST_SAMPLES}"
        )
    return run, words


def _poses(run: Scenario) -> tuple[Scenario, Poses]:
    """Return the recording of a calibration from poses, and these poses for its prediction."""
    import numpy as np

    from gfimu.tolerances.calibrated import Poses
    from sim.motions.pose_sequence import POSE_SETS, PoseSequence

    sequence = PoseSequence()
    period = sequence.rest + sequence.turn
    middles = np.arange(POSE_SETS[sequence.poses]) * period + 0.5 * sequence.rest
    up = sequence.at(middles).rotation[:, 2]  # (p, 3): the world's z in body axes
    posed = replace(run, motion=sequence, duration=sequence.duration, mounting_rotvec=(0.0, 0.0, 0.0))
    return posed, Poses(up, round(sequence.rest * run.sample_rate))
