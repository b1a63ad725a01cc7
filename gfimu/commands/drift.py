"""Under `gfimu drift`: the position-drift budget of an array, or the drift about a known axis."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.commands.former_arguments import former_arguments
from gfimu.errors import InputError
from gfimu.results import Panel, PlottedResult, Series

if TYPE_CHECKING:
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.geometry.turning_axis import TurningAxis
    from gfimu.known_axis.accuracy.drift import AxisDrift
    from gfimu.position_drift import DriftBudget, ErrorSources
    from gfimu.position_drift.monte_carlo import DriftSample

__all__ = ["Drift", "axis_drift", "drift"]


@dataclass(frozen=True)
class Drift(PlottedResult):
    """Position drift: the budget in closed form, and the Monte Carlo where one was run.

    Parameters
    ----------
    budget : DriftBudget
        Position error, cause by cause.
    sample : DriftSample or None
        Nonlinear Monte Carlo of the same errors.
    seed : int
        Its seed.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.drift("cube12", time=10.0, noise_ug=290.0).budget.total_std.round(1)
    array([27.8, 27.8,  3.3])
    """

    budget: DriftBudget
    sample: DriftSample | None
    seed: int

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return the columns of the budget, one row per cause."""
        return self.budget.to_columns()

    def _heading(self) -> str:
        return self.budget._heading()

    def _facts(self) -> list[tuple[str, str]]:
        facts = self.budget._facts()
        if self.sample is not None:
            std = ", ".join(f"{one:.3g}" for one in self.sample.std[-1])
            relative = 100.0 * self.sample.relative_sampling_error
            facts.append((f"Monte Carlo, {self.sample.runs} runs", f"({std}) m, each ± {relative:.2g} %"))
        return facts

    def _notes(self) -> tuple[str, ...]:
        return self.budget._notes()

    def _panels(self) -> list[Panel]:
        panels = self.budget._panels()
        if self.sample is not None:
            found = self.sample
            series = tuple(
                Series(axis, found.std[:, place], found.std[:, place] * found.relative_sampling_error, role=axis)
                for place, axis in enumerate("xyz")
            )
            title = f"position error of {found.runs} simulated runs"
            panels.append(Panel(title, "σ, m", series, found.t_s, "time, s", scale="zero"))
        return panels

    def to_dict(self) -> dict[str, Any]:
        """Return the content of ``gfimu drift --json``."""
        result: dict[str, Any] = self.budget.to_dict()
        if self.sample is not None:
            result["monte_carlo"] = {
                "runs": self.sample.runs,
                "seed": self.seed,
                "std_m": self.sample.std[-1],
                "mean_m": self.sample.mean[-1],
                "relative_sampling_error": self.sample.relative_sampling_error,
            }
        return result


@former_arguments(time="duration", rate="speed_rad_s")
def drift(
    array: AccelerometerArray | str | Path = "cube12",
    *,
    duration: float = 30.0,
    bias_mg: float = 0.0,
    noise_ug: float = 0.0,
    walk_ug: float = 0.0,
    rate_drift_deg_h: float = 0.0,
    speed_rad_s: float = 0.0,
    offset: tuple[float, float] = (0.0, 0.0),
    gravity: float = 9.80665,
    monte_carlo: int = 0,
    seed: int = 0,
    progress: Callable[[int], None] | None = None,
) -> Drift:
    """Budget the position drift of an array; about a known axis see `axis_drift`.

    Parameters
    ----------
    array : AccelerometerArray, str or Path
        The array, its name or file.
    duration : float
        Time since the start of navigation, s.
    bias_mg, noise_ug, walk_ug : float
        Per channel: standard deviation of the constant bias, mg; one-sided density of the white noise, µg/√Hz; random
        walk of the bias, µg/√s.
    rate_drift_deg_h : float
        Constant error of the angular rate per axis, °/h.
    speed_rad_s : float
        Rate of the table about the vertical, rad/s; 0 is at rest.
    offset : tuple of float
        Horizontal place of the unit off the axis, m.
    gravity : float
        Local gravity, m/s².
    monte_carlo : int
        Number of nonlinear Monte Carlo runs; 0 for none.
    seed : int
        Seed of the Monte Carlo.
    progress : callable, optional
        Called with the number of Monte Carlo runs done.

    Raises
    ------
    InputError
        If there is no error to budget, or an argument is out of range.
    GeometryError
        If the array can't see all six motions.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.drift("cube12", time=10.0, noise_ug=290.0)
    >>> print(f"{found.budget.total_std[0]:.1f} m")
    27.8 m
    """
    from gfimu.commands.opened import as_array
    from gfimu.position_drift import drift_budget
    from gfimu.position_drift.monte_carlo import monte_carlo_drift

    if monte_carlo == 1 or monte_carlo < 0:
        raise InputError(f"--monte-carlo {monte_carlo}: give 0 for none, or 2 or more runs")
    sources = _sources(bias_mg, noise_ug, walk_ug, rate_drift_deg_h)
    geometry = as_array(array)
    budget = drift_budget(geometry, duration, sources, rate=speed_rad_s, offset=offset, gravity=gravity)
    sample = None
    if monte_carlo:
        sample = monte_carlo_drift(
            geometry,
            duration,
            sources,
            runs=monte_carlo,
            rng=np.random.default_rng(seed),
            rate=speed_rad_s,
            offset=offset,
            gravity=gravity,
            progress=progress,
        )
    return Drift(budget, sample, seed)


@former_arguments(time="duration", rate="speed_rad_s")
def axis_drift(
    array: AccelerometerArray | str | Path,
    *,
    axis: TurningAxis | str | Sequence[float] | None = None,
    axis_point: Sequence[float] = (0.0, 0.0, 0.0),
    hub: str = "fixed",
    inclination_rad: float | None = None,
    duration: float = 30.0,
    bias_mg: float = 0.0,
    noise_ug: float = 0.0,
    walk_ug: float = 0.0,
    speed_rad_s: float = 0.0,
    hub_noise_m_s2_rthz: float = 0.1,
) -> AxisDrift:
    """Budget the drift of rate and angle about a known axis, for as few as one chip.

    Parameters
    ----------
    array : AccelerometerArray, str or Path
        The array, its name or file.
    axis : TurningAxis, str or sequence of float, optional
        An axis about which alone the array turns: x, y, z, or three numbers, body frame. Few chips then suffice. By
        default the array's own.
    axis_point : sequence of float
        A point of that axis, body frame, m.
    hub : {"fixed", "free"}
        Whether that axis stands still (a table) or moves with a body (a wheel).
    inclination_rad : float, optional
        Angle between that axis and the vertical, rad; upright by default.
    hub_noise_m_s2_rthz : float
        Of a free hub, one-sided density of its own specific force, m/s²/√Hz.
    duration, bias_mg, noise_ug, walk_ug, speed_rad_s
        As of `drift`; ``speed_rad_s`` about the axis.

    Raises
    ------
    InputError
        If there is no error to budget, no axis, or an argument is out of range.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.axis_drift("wheel_pair", time=10.0, noise_ug=290.0, rate=5.0)
    >>> [one.name for one in found.terms]
    ['white noise']
    """
    from gfimu.commands.known_axis import turning_axis
    from gfimu.commands.opened import as_array
    from gfimu.known_axis.accuracy.drift import axis_drift as drift_about

    sources = _sources(bias_mg, noise_ug, walk_ug)
    geometry = as_array(array)
    turning = turning_axis(axis, axis_point, hub, inclination_rad) or geometry.turning_axis
    if turning is None:
        raise InputError(f"array {geometry.name!r} has no axis of its own; give one, such as axis='z' (--axis z)")
    return drift_about(
        geometry,
        turning,
        duration,
        bias=sources.bias,
        noise_density=sources.noise_density,
        bias_random_walk=sources.bias_random_walk,
        rate_rad_s=speed_rad_s,
        hub_density=hub_noise_m_s2_rthz,
    )


def _sources(bias_mg: float, noise_ug: float, walk_ug: float, rate_drift_deg_h: float = 0.0) -> ErrorSources:
    """Return the errors in SI units; raises `InputError` if there is none."""
    from gfimu.position_drift import ErrorSources
    from gfimu.units import STANDARD_GRAVITY

    found = ErrorSources(
        bias=bias_mg * 1e-3 * STANDARD_GRAVITY,
        noise_density=noise_ug * 1e-6 * STANDARD_GRAVITY,
        bias_random_walk=walk_ug * 1e-6 * STANDARD_GRAVITY,
        rate_drift=math.radians(rate_drift_deg_h / 3600.0),
    )
    if not any(vars(found).values()):
        raise InputError(
            "no error to budget: give at least one of --bias-mg, --noise-ug, --walk-ug, --rate-drift-deg-h"
        )
    return found
