"""Budget the errors of α, ω and position from machining and chip tolerances: shares, simulated units.

Examples
--------
gfimu tolerance cube12 --position-mm 0.2 --angle-deg 0.5 --picture tolerance.png
# Another part, without simulated units
gfimu tolerance cube12 --closed-form --part adxl355 --calibrated poses+rest
"""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from gfimu.base.errors import InputError
from gfimu.commands import given
from gfimu.commands.shell import options
from gfimu.commands.shell.declare import Group, Option, command

if TYPE_CHECKING:
    from gfimu.array.array import AccelerometerArray
    from gfimu.budget.tolerances.comparison import UnitErrors
    from gfimu.budget.tolerances.result import ToleranceResult
    from gfimu.budget.tolerances.tolerances import ChipErrors
    from sim.scenarios import Scenario

__all__ = ["tolerance"]

_LEAST_UNITS, _MOST_UNITS = 10, 100_000  # fewer have no spread to speak of; more take hours
_SHEET = "; else the data sheet's"

_SCENARIO = options.SCENARIO.also("; by default rest, then a spin about the vertical", when="Motion. ")
_NORMAL = Option("Limits are 3 σ of a normal distribution; else errors are uniform between them.")
_CALIBRATED = Option(
    "none, rest, poses or poses+rest; may be repeated; all that are possible by default.",
    "NAME",
    kind=list[str],
    offers=("none", "rest", "poses", "poses+rest"),
)
_PICK_UP = Option(f"Pick-up of each other axis of the chip, 1 σ, %{_SHEET}.")


def _chip_errors(
    bias_mg: Annotated[float | None, options.BIAS_MG.also(_SHEET)] = None,
    gain_percent: Annotated[float | None, Option(f"Gain error, 1 σ, %{_SHEET}.")] = None,
    cross_axis_percent: Annotated[float | None, _PICK_UP] = None,
    nonlinearity_percent: Annotated[float | None, Option(f"Non-linearity at full scale, 1 σ, %{_SHEET}.")] = None,
    noise_ug: Annotated[float | None, options.NOISE_UG.also(_SHEET)] = None,
) -> "ChipErrors":
    """Return the errors of the chips that the options of the shell state."""
    from gfimu.base.units import MILLI_G
    from gfimu.budget.tolerances.tolerances import ChipErrors

    return ChipErrors(
        bias_m_s2=_scaled("--bias-mg", bias_mg, MILLI_G),
        gain=_scaled("--gain-percent", gain_percent, 0.01),
        cross_axis=_scaled("--cross-axis-percent", cross_axis_percent, 0.01),
        nonlinearity=_scaled("--nonlinearity-percent", nonlinearity_percent, 0.01),
        noise_m_s2_rthz=_scaled("--noise-ug", noise_ug, 1e-3 * MILLI_G),
    )


_CHIP = Group(
    _chip_errors,
    "Standard deviations of the errors of each channel, such as ``ChipErrors(bias_m_s2=0.1, gain=0.01)``; what it does "
    "not state is the data sheet's.",
)


@command(doing=lambda values: "" if values["closed_form"] else "simulating units")
def tolerance(
    array: Annotated["AccelerometerArray | str | Path", options.ARRAY.also(", as drawn", argument=True)],
    *,
    scenario: Annotated["Scenario | str | Path | None", _SCENARIO] = None,
    duration: Annotated[float | None, options.DURATION.also("; 3, or that of the scenario")] = None,
    speed_rad_s: Annotated[float, options.SPEED_RAD_S.also(", of the default motion")] = 5.0,
    position_mm: Annotated[float, Option("Limit ± of each chip's place along each axis, mm.", "MM")] = 0.2,
    angle_deg: Annotated[float, Option("Limit ± of each chip's rotation about each axis, °.")] = 0.5,
    normal: Annotated[bool, _NORMAL] = False,
    part: Annotated[str | None, options.PART.also(", in place of those of the array")] = None,
    chip: Annotated["ChipErrors | None", _CHIP] = None,
    temperature_k: Annotated[float, Option("Temperature of the run less that of the calibration, K.")] = 5.0,
    calibrated: Annotated[Sequence[str], _CALIBRATED] = (),
    closed_form: Annotated[bool, Option("First order alone, without simulated units.")] = False,
    units: Annotated[int, Option("Number of simulated units.")] = 200,
    seed: Annotated[int, options.SEED] = 0,
    workers: Annotated[int | None, options.WORKERS] = None,
    picture: given.Picture = None,
    progress: Annotated[Callable[[float], object] | None, options.PROGRESS] = None,
) -> "ToleranceResult":
    """Budget the errors of α, ω and position from machining and chip tolerances, and simulate units to compare.

    Of a scenario, array, sensors and effects are not used. The result does not depend on the number of workers.

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
    from gfimu.array.observability import require_all_motions
    from gfimu.budget.tolerances.budget import tolerance_budget
    from gfimu.budget.tolerances.calibrated import calibrations_of, check_calibration
    from gfimu.budget.tolerances.propagation import error_maps
    from gfimu.budget.tolerances.result import ToleranceResult
    from gfimu.budget.tolerances.tolerances import Tolerances
    from gfimu.commands.opened import as_array
    from sim.trials.sweep.executors import processors
    from sim.trials.worlds.tolerance_units import UnitTask, simulate_units
    from sim.trials.worlds.toleranced import calibration_poses, known_motion_of, tolerated_run

    _check("--position-mm", position_mm)
    _check("--angle-deg", angle_deg)
    _check("--temperature-k", temperature_k)
    if not closed_form and not _LEAST_UNITS <= units <= _MOST_UNITS:
        raise InputError(f"--units {units}: give {_LEAST_UNITS} to {_MOST_UNITS}, or --closed-form for none")
    if workers is not None and workers < 1:
        raise InputError(f"--workers {workers}: workers are 1 or more")
    drawn = as_array(array)
    if part is not None:
        drawn, name = drawn.with_part_file(part)
        drawn = drawn.with_part(name)
    require_all_motions(drawn, or_axis=False)
    run, words = tolerated_run(drawn, scenario, duration=duration, rate=speed_rad_s)
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
    posed, poses = calibration_poses(run)
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
        from gfimu.budget.tolerances.picture import tolerance_picture

        errors = {name: found.errors for name, found in simulated.items()}
        tolerance_picture(picture, budgets, errors, tolerances.shape, title=f"{drawn.name}: {words}")
    return result


def _check(option: str, value: float | None) -> None:
    if value is not None and not 0.0 <= value < math.inf:
        raise InputError(f"{option} {value:g}: give a finite number, zero or above")


def _scaled(option: str, value: float | None, unit: float) -> float | None:
    """Return a value of an option in SI units."""
    _check(option, value)
    return None if value is None else value * unit
