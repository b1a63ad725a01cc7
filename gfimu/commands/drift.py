"""Under `gfimu drift`: the position-drift budget of an array, or the drift of rate and angle about a known axis."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gfimu.errors import InputError

if TYPE_CHECKING:
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.geometry.turning_axis import TurningAxis
    from gfimu.known_axis.drift import AxisDrift
    from gfimu.position_drift import DriftBudget
    from gfimu.position_drift.monte_carlo import DriftSample

__all__ = ["Drift", "drift"]


@dataclass(frozen=True)
class Drift:
    """Position drift: the closed forms, and the Monte Carlo where one was asked for.

    Parameters
    ----------
    budget : DriftBudget
        Position error, cause by cause.
    sample : DriftSample or None
        Nonlinear Monte Carlo of the same errors.
    seed : int
        Its seed.
    """

    budget: DriftBudget
    sample: DriftSample | None
    seed: int

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


def drift(
    array: AccelerometerArray | str | Path = "cube12",
    *,
    time: float = 30.0,
    bias_mg: float = 0.0,
    noise_ug: float = 0.0,
    walk_ug: float = 0.0,
    rate_drift_deg_h: float = 0.0,
    rate: float = 0.0,
    offset: tuple[float, float] = (0.0, 0.0),
    gravity: float = 9.80665,
    monte_carlo: int = 0,
    seed: int = 0,
    axis: TurningAxis | str | Sequence[float] | None = None,
    axis_point: Sequence[float] = (0.0, 0.0, 0.0),
    hub: str = "fixed",
    inclination_rad: float | None = None,
    hub_noise_m_s2_rthz: float = 0.1,
    progress: Callable[[int], None] | None = None,
) -> Drift | AxisDrift:
    """Budget the position drift of an array, or about a known axis the drift of its rate and angle.

    Parameters
    ----------
    array : AccelerometerArray, str or Path
        The array, its name or file.
    time : float
        Time since the start of navigation, s.
    bias_mg, noise_ug, walk_ug : float
        Per channel: standard deviation of the constant bias, mg; one-sided density of the white noise, µg/√Hz; random
        walk of the bias, µg/√s.
    rate_drift_deg_h : float
        Constant error of the angular rate per axis, °/h.
    rate : float
        Rate of the table about the vertical, rad/s; 0 is at rest.
    offset : tuple of float
        Horizontal place of the unit off the axis, m.
    gravity : float
        Local gravity, m/s².
    monte_carlo : int
        Number of nonlinear Monte Carlo runs; 0 for none.
    seed : int
        Seed of the Monte Carlo.
    axis : TurningAxis, str or sequence of float, optional
        An axis about which alone the array turns: x, y, z, or three numbers, body frame. Few chips then suffice. By
        default the array's own, where it can't see all six motions.
    axis_point : sequence of float
        A point of that axis, body frame, m.
    hub : {"fixed", "free"}
        Whether that axis stands still (a table) or moves with a body (a wheel).
    inclination_rad : float, optional
        Angle between that axis and the vertical, rad; upright by default.
    hub_noise_m_s2_rthz : float
        Of a free hub, one-sided density of its own specific force, m/s²/√Hz.
    progress : callable, optional
        Called with the number of Monte Carlo runs done.

    Raises
    ------
    InputError
        If there is no error to budget, or an argument is out of range.
    GeometryError
        If the array can't see all six motions, and no axis is known.
    """
    import numpy as np

    from gfimu.commands.known_axis import known_axis, turning_axis
    from gfimu.commands.opened import as_array
    from gfimu.position_drift import ErrorSources, drift_budget
    from gfimu.position_drift.monte_carlo import monte_carlo_drift
    from gfimu.units import STANDARD_GRAVITY

    if monte_carlo == 1 or monte_carlo < 0:
        raise InputError(f"--monte-carlo {monte_carlo}: give 0 for none, or 2 or more runs")
    sources = ErrorSources(
        bias=bias_mg * 1e-3 * STANDARD_GRAVITY,
        noise_density=noise_ug * 1e-6 * STANDARD_GRAVITY,
        bias_random_walk=walk_ug * 1e-6 * STANDARD_GRAVITY,
        rate_drift=math.radians(rate_drift_deg_h / 3600.0),
    )
    if not any(vars(sources).values()):
        raise InputError(
            "no error to budget: give at least one of --bias-mg, --noise-ug, --walk-ug, --rate-drift-deg-h"
        )
    geometry = as_array(array)
    turning = known_axis(turning_axis(axis, axis_point, hub, inclination_rad), geometry)
    if turning is not None:
        from gfimu.known_axis.drift import axis_drift

        if rate_drift_deg_h or monte_carlo or any(offset):
            raise InputError("--rate-drift-deg-h, --offset and --monte-carlo have no use with a known axis (--axis)")
        return axis_drift(
            geometry,
            turning,
            time,
            bias=sources.bias,
            noise_density=sources.noise_density,
            bias_random_walk=sources.bias_random_walk,
            rate_rad_s=rate,
            hub_density=hub_noise_m_s2_rthz,
        )
    budget = drift_budget(geometry, time, sources, rate=rate, offset=offset, gravity=gravity)
    sample = None
    if monte_carlo:
        sample = monte_carlo_drift(
            geometry,
            time,
            sources,
            runs=monte_carlo,
            rng=np.random.default_rng(seed),
            rate=rate,
            offset=offset,
            gravity=gravity,
            progress=progress,
        )
    return Drift(budget, sample, seed)
