"""Type B uncertainty of a calibration's figures: their spread over simulated calibrations on an erroneous stage.

Each source of the stage acts alone in a number of simulated calibrations of the same unit by the same estimator. The
standard uncertainty of a figure is the root mean square of its deviation from the calibration without errors, so that a
shift of second order counts as well as the scatter (distributions are propagated as in JCGM 101:2008). Gravity and the
rate of a table scale the sensitivities and positions, which needs no simulation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from gfimu.base.units import STANDARD_GRAVITY
from gfimu.calibration.certificate.stage.simulated_calibration import (
    calibrate_under,
    chip_statistic,
    poses_of,
    simulated_method,
)
from gfimu.calibration.certificate.stage.stage import Stage
from gfimu.calibration.certificate.stage.stage_errors import SOURCES, draw_errors
from gfimu.calibration.parameter_names import kind_of
from gfimu.calibration.result import Calibration

__all__ = ["FORMULA_GRAVITY_STD", "RUNS", "STANDARD_GRAVITY_STD", "Figures", "Share", "TypeB", "type_b"]

Floats = NDArray[np.float64]

Figures = Callable[[Calibration], Floats]
"""Takes a calibration and returns t figures that follow from it, shape (t,)."""

RUNS = 100
"""Numerical: simulated calibrations per source; the standard uncertainty is then known to 7 %."""

FORMULA_GRAVITY_STD = 3e-4
"""m/s²: what local anomalies leave of the gravity of a formula (`gfimu.array.gravity`)."""

STANDARD_GRAVITY_STD = 0.015
"""m/s²: 9.780 to 9.832 m/s² at sea level (WGS 84, equator and poles), rectangular: 0.052 / √12."""

_SAME_GRAVITY = 1e-9
"""Numerical: m/s²."""

_ROUNDING = 1e-12
"""Numerical: relative to the figure; what is below is rounding of the arithmetic."""

_SIMULATED = tuple(key for key in SOURCES if key != "gravity_std_m_s2")

_UNITS = {"rad": "rad", "m_s2": "m/s²"}


@dataclass(frozen=True)
class Share:
    """What one source contributes to every figure.

    Parameters
    ----------
    source : str
        What it is and how large, and what of it the fit holds already.
    standard : ndarray, shape (t,)
        Standard uncertainty that it contributes, in the unit of each figure.
    """

    source: str
    standard: Floats


@dataclass(frozen=True)
class TypeB:
    """Type B shares of a set of figures.

    Parameters
    ----------
    shares : tuple of Share
        One per source that the stage file states, and gravity.
    misfit : float
        vᵀPv over the redundancy that all sources together leave in the fit on average: what of the misfit of the fit
        the stage explains, in units of its noise.
    """

    shares: tuple[Share, ...]
    misfit: float


def type_b(
    calibration: Calibration, stage: Stage, figures: Figures, *, rng: np.random.Generator, runs: int = RUNS
) -> TypeB:
    """Simulate the type B shares of figures of a calibration.

    Parameters
    ----------
    calibration : Calibration
        Of accelerometers: triads, or a whole array.
    stage : Stage
        Standard uncertainties of stage and gravity.
    figures : callable
        Takes a `Calibration` and returns the figures, shape (t,).
    rng : numpy.random.Generator
        Random number generator.
    runs : int
        Simulated calibrations per source.
    """
    shares, misfit = [], 0.0
    sources = {key: found for key in _SIMULATED if (found := _acting(calibration, stage, key))[1]}
    if sources and simulated_method(calibration) is not None:
        directions = poses_of(calibration)
        ideal = draw_errors(stage, directions, 1, rng, ())
        wanted = figures(calibrate_under(calibration, directions, ideal)[0].calibration)
        for key, (acting, remark) in sources.items():
            standard = np.zeros(len(wanted))
            if getattr(acting, key) > 0.0:
                fits = calibrate_under(calibration, directions, draw_errors(acting, directions, runs, rng, (key,)))
                off = np.array([figures(fit.calibration) for fit in fits]) - wanted  # (n, t)
                standard = np.sqrt(np.mean(off**2, axis=0))
                standard[standard < _ROUNDING * np.abs(wanted)] = 0.0
                misfit += float(np.mean([one.misfit for one in fits]))
            shares.append(Share(f"{SOURCES[key]}: {remark}", standard))
    return TypeB((*shares, *_of_scale(calibration, stage, figures)), misfit)


def _acting(calibration: Calibration, stage: Stage, key: str) -> tuple[Stage, str]:
    """Return the stage with what of a source is not in the fit already, and a remark; empty if there is no source."""
    stated: float = getattr(stage, key)
    remark = f"{stated:.2g} {_UNITS['rad' if key.endswith('rad') else 'm_s2']}" if stated > 0.0 else ""
    if key != "pose_tilt_std_rad":
        return stage, remark
    included = max(chip_statistic(calibration, chip, "levelling_std_rad") or 0.0 for chip in calibration.chips)
    if included == 0.0:
        return stage, remark
    rest = float(np.sqrt(max(stated**2 - included**2, 0.0)))
    remark = f"{included:.2g} rad is in the covariance of the fit" + (f", of {stated:.2g} rad" if rest > 0.0 else "")
    return msgspec.structs.replace(stage, pose_tilt_std_rad=rest), remark


def _gravity(calibration: Calibration, stage: Stage) -> tuple[float, str]:
    """Return the standard uncertainty of local gravity, m/s², and where it is from."""
    if stage.gravity_std_m_s2 is not None:
        return stage.gravity_std_m_s2, f"{stage.gravity_std_m_s2:.2g} m/s²"
    if abs(calibration.gravity - STANDARD_GRAVITY) < _SAME_GRAVITY:
        text = f"{STANDARD_GRAVITY_STD:g} m/s², its range over the Earth: standard gravity was taken"
        return STANDARD_GRAVITY_STD, text
    return FORMULA_GRAVITY_STD, f"{FORMULA_GRAVITY_STD:g} m/s², what local anomalies leave of a formula"


def _of_scale(calibration: Calibration, stage: Stage, figures: Figures) -> Iterator[Share]:
    """Yield the shares that scale M and the positions, whatever the method.

    True gravity larger than the given one by the ratio δ makes M larger by it and every position r smaller. A table
    that turns faster than it reads by δ makes r larger, by 2 δ from the centripetal field and by δ from α: the first
    is taken. In a spin calibration it is M that grows so, where the radius is known.
    """
    kinds = np.array([kind_of(name) for name in calibration.names])
    wanted = figures(calibration)

    def moved(m: float, r: float) -> Floats:
        factor = np.where(kinds == "M", m, np.where(kinds == "r", r, 1.0))
        standard = np.abs(figures(replace(calibration, values=calibration.values * factor)) - wanted)
        return np.where(standard < _ROUNDING * np.abs(wanted), 0.0, standard)

    std, remark = _gravity(calibration, stage)
    scale = 1.0 + std / calibration.gravity
    yield Share(f"{SOURCES['gravity_std_m_s2']}: {remark}", moved(scale, 1.0 / scale))
    if stage.table_rate_std > 0.0:
        square = (1.0 + stage.table_rate_std) ** 2
        source = f"rate of the table: {stage.table_rate_std:.2g} (relative)"
        yield Share(source, moved(square, 1.0) if calibration.method == "spin" else moved(1.0, square))
