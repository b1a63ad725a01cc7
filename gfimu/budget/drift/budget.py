"""Position-drift budget: how far strapdown navigation runs off, cause by cause, from the errors of the sensors.

Errors of the channels become errors of p and α through the array's pseudo-inverse, and these become position by the
closed forms of `gfimu.budget.drift.closed_forms`. The forms are of first order; each budget states until when the
attitude error stays below `TILT_LIMIT`, which is as long as they hold, and adds the one effect of second order that
shows before: tilt ψ leaves only g cos ψ of gravity, so the unit seems to fall. `gfimu.budget.drift.monte_carlo`
checks the budget against the full nonlinear navigation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.kinematics import omega_leakage, pseudo_inverse
from gfimu.base.declared import Declared, figure
from gfimu.base.errors import InputError
from gfimu.base.results import Panel, PlottedResult, Series, text_column
from gfimu.base.short_repr import short_repr
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.budget.drift.closed_forms import (
    ErrorSources,
    accumulated_covariance,
    attitude_growth,
    position_from_bias,
    position_from_impulse,
    position_from_rate,
)

__all__ = [
    "TILT_LIMIT",
    "DriftBudget",
    "DriftTerm",
    "ErrorSources",
    "drift_budget",
]

TILT_LIMIT = 0.25
"""Attitude error up to which the first-order forms are taken to hold, rad, one standard deviation per axis."""

_FORMAT_VERSION = 1
_LONGEST_SEARCH = 1000.0  # times the time asked for
_MOST_RADIANS = 1e4
_LONGEST = 1e8  # numerical: s, three years
_LARGEST = 1e6  # numerical: of a rate, an offset and gravity, SI


@dataclass(frozen=True)
class DriftTerm(Declared):
    """Share of one cause in the position error."""

    name: Annotated[str, figure("The cause.")]
    form: Annotated[str, figure("Its law at rest.", key="form_at_rest")]
    size: Annotated[float, figure("Standard deviation of the error that drives it, of the largest axis.")]
    size_unit: Annotated[str, figure("Unit of that.")]
    std: Annotated[
        NDArray[np.float64], figure("Standard deviation of the position error, world axes.", "m", key="std_m")
    ]
    share: Annotated[float, figure("Share of the total variance.")]

    __repr__ = short_repr


@dataclass(frozen=True)
class DriftBudget(Declared, PlottedResult):
    """Position error after a time, cause by cause.

    ``covariance`` is that of the position error in world axes, m², shape (3, 3). The fall is negative: tilt always
    loses some of gravity (second order). `AttitudeGrowth.deciding` is the attitude error that counts for validity;
    ``valid_until`` is infinite where it does not reach `TILT_LIMIT` within a thousand times ``time`` (or 10⁴ rad of
    turning).

    Examples
    --------
    >>> import gfimu
    >>> sources = gfimu.ErrorSources(noise_density=290e-6 * 9.80665)
    >>> budget = gfimu.drift_budget(gfimu.AccelerometerArray.load("cube12"), 10.0, sources)
    >>> [term.name for term in budget.terms]
    ['noise of p', 'noise of alpha', 'gravity lost by tilt']
    """

    array: Annotated[str, figure("Name of the array.")]
    time: Annotated[float, figure("Time since the start of navigation.", "s", key="time_s")]
    rate: Annotated[float, figure("Rate about the vertical.", "rad/s", key="rate_rad_s")]
    offset: Annotated[
        tuple[float, float], figure("Horizontal place of the unit off the axis, at the start.", "m", key="offset_m")
    ]
    sources: Annotated[ErrorSources, figure("What was assumed of the sensors.")]
    terms: Annotated[tuple[DriftTerm, ...], figure("The causes.")]
    covariance: NDArray[np.float64]
    fall: Annotated[float, figure("Mean vertical error, of second order.", "m", key="fall_m")]
    tilt_std: Annotated[float, figure("Attitude error about a horizontal axis, 1 σ.", "rad", key="tilt_std_rad")]
    heading_std: Annotated[float, figure("Attitude error about the vertical, 1 σ.", "rad", key="heading_std_rad")]
    attitude_error: Annotated[
        float, figure("The attitude error that decides on validity, 1 σ.", "rad", key="attitude_error_rad")
    ]
    valid_until: Annotated[float, figure("Time until which they hold; null: far later.", "s", key="valid_until_s")]
    alpha_overtakes: Annotated[
        float,
        figure("Time after which a bias acts more through α than through p.", "s", key="alpha_overtakes_p_s"),
    ]
    note: Annotated[str, figure("What the budget leaves out; empty if nothing.")] = ""
    format_version: Annotated[int, figure("Version of the format.", before="array")] = _FORMAT_VERSION

    __repr__ = short_repr

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per cause: its size, standard deviations of the position error, share of the variance."""
        std = np.array([term.std for term in self.terms]).reshape(-1, 3)
        return {
            "cause": text_column(term.name for term in self.terms),
            "form_at_rest": text_column(term.form for term in self.terms),
            "size": np.array([term.size for term in self.terms]),
            "size_unit": text_column(term.size_unit for term in self.terms),
            **{f"std_{axis}_m": std[:, index] for index, axis in enumerate("xyz")},
            "share": np.array([term.share for term in self.terms]),
        }

    def _heading(self) -> str:
        return f"Position drift of {self.array} after {self.time:g} s"

    def _facts(self) -> list[tuple[str, str]]:
        total = ", ".join(f"{one:.3g}" for one in self.total_std)
        validity = "" if self.valid else " (exceeded: the figures are of first order)"
        return [
            ("position error, σ of x, y, z", f"({total}) m"),
            ("mean fall by tilt", f"{self.fall:.3g} m"),
            ("tilt, σ", f"{self.tilt_std:.3g} rad"),
            ("first-order forms hold until", f"{self.valid_until:.4g} s{validity}"),
        ]

    def _notes(self) -> tuple[str, ...]:
        return (self.note,) if self.note else ()

    def _panels(self) -> list[Panel]:
        names = (*(term.name for term in self.terms), "total")
        std = np.vstack([*(term.std for term in self.terms), self.total_std])
        std = np.where(std > 0.0, std, np.nan)
        series = tuple(Series(axis, std[:, index], role=axis) for index, axis in enumerate("xyz"))
        return [Panel(f"position error after {self.time:g} s, by cause", "σ, m", series, names, scale="log")]

    @property
    def total_std(
        self,
    ) -> Annotated[
        NDArray[np.float64],
        figure("Standard deviation of the position error, world axes.", "m", key="total_std_m", before="fall"),
    ]:
        """Standard deviation of the position error in world axes, m, shape (3,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def tilt_limit(
        self,
    ) -> Annotated[float, figure("Limit of that error.", "rad", key="tilt_limit_rad", before="valid_until")]:
        """Attitude error up to which the first-order forms are taken to hold, rad."""
        return TILT_LIMIT

    @property
    def valid(self) -> Annotated[bool, figure("Whether the closed forms hold.", before="valid_until")]:
        """Whether the first-order forms hold at ``time``."""
        return self.time <= self.valid_until


def drift_budget(
    array: AccelerometerArray,
    time: float,
    sources: ErrorSources,
    *,
    rate: float = 0.0,
    offset: tuple[float, float] = (0.0, 0.0),
    gravity: float = STANDARD_GRAVITY,
) -> DriftBudget:
    """Compute the position error after a time from the sensors' errors, through the array's geometry.

    Parameters
    ----------
    array : AccelerometerArray
        The array; its pseudo-inverse maps errors of the channels to errors of [alpha; p].
    time : float
        Time since the start of navigation, s.
    sources : ErrorSources
        Errors of the sensors.
    rate : float
        Constant rate of the table about the vertical, rad/s; 0 at rest.
    offset : tuple of float
        Horizontal position of the unit from the axis, body axes at the start, m.
    gravity : float
        Magnitude of gravity, m/s².

    Returns
    -------
    DriftBudget
        Standard deviations by cause and in total, the mean fall, and the validity limit.

    Raises
    ------
    InputError
        If ``time`` is not positive or a value is not finite.
    GeometryError
        If the array can't see all six motions.

    Examples
    --------
    >>> import gfimu
    >>> sources = gfimu.ErrorSources(noise_density=290e-6 * 9.80665)
    >>> budget = gfimu.drift_budget(gfimu.AccelerometerArray.load("cube12"), 10.0, sources)
    >>> print(f"{budget.total_std[0]:.1f} m")
    27.8 m
    """
    if not 0.0 < time <= _LONGEST:
        raise InputError(f"time is {time} s; it must be above zero, and {_LONGEST:g} s at most")
    if not np.all(np.abs([rate, *offset, gravity]) <= _LARGEST):
        raise InputError(f"rate, offset and gravity must be finite numbers of at most {_LARGEST:g}")
    if gravity <= 0.0:
        raise InputError(f"gravity {gravity:g}: must be positive; the budget is of a body in a field")
    unit = motion_covariance(array)  # (6, 6) of [alpha; p] for channels of unit variance
    alpha_only, p_only = unit.copy(), unit.copy()
    alpha_only[3:], alpha_only[:, 3:], p_only[:3], p_only[:, :3] = 0.0, 0.0, 0.0, 0.0
    sd_alpha, sd_p = math.sqrt(unit.diagonal()[:3].max()), math.sqrt(unit.diagonal()[3:].max())
    covariance_of = _Covariances(time, rate, complex(*offset), gravity)

    growth = attitude_growth(unit[:3, :3], sources, time, rate, off_axis=any(offset))
    # Tilt ψ leaves g cos ψ of gravity: δz̈ = −g ψ²/2, with ψ² the sum over two horizontal axes.
    fall = float(-gravity * np.trapezoid((time - growth.t_s) * growth.tilt**2, growth.t_s))

    bias, walk, drift = sources.bias, sources.bias_random_walk, sources.rate_drift
    density = sources.noise_density / math.sqrt(2.0)  # two-sided: variance per channel = density² · sample rate
    constant, white, walking = covariance_of.constant, covariance_of.white, covariance_of.walking
    of_drift = drift**2 * covariance_of.rate_drift()
    # For constant errors ψ² is exponentially distributed: the fall scatters by its mean (by less for noise).
    of_fall = np.diag([0.0, 0.0, fall**2])
    rows = [
        ("bias of p", "b t²/2", bias * sd_p, "m/s²", bias**2 * constant(p_only)),
        ("drift of the rate", "g d t³/6", drift, "rad/s", of_drift),
        ("bias of alpha", "g b t⁴/24", bias * sd_alpha, "rad/s²", bias**2 * constant(alpha_only)),
        ("noise of p", "√(S t³/3)", density * sd_p, "m/s²/√Hz", density**2 * white(p_only)),
        ("noise of alpha", "g √(S t⁷/252)", density * sd_alpha, "rad/s²/√Hz", density**2 * white(alpha_only)),
        ("bias random walk of p", "K √(t⁵/20)", walk * sd_p, "m/s²/√s", walk**2 * walking(p_only)),
        ("bias random walk of alpha", "g K √(t⁹/5184)", walk * sd_alpha, "rad/s²/√s", walk**2 * walking(alpha_only)),
        ("gravity lost by tilt", "∬ g ψ²/2", float(growth.tilt[-1]), "rad", of_fall),
    ]
    # The whole covariance, not the sum of its parts: in a skew geometry the errors of alpha and p are correlated.
    covariance = bias**2 * constant(unit) + of_drift + density**2 * white(unit) + walk**2 * walking(unit) + of_fall
    total = float(np.trace(covariance)) or 1.0
    return DriftBudget(
        array=array.name,
        time=time,
        rate=rate,
        offset=offset,
        sources=sources,
        terms=tuple(
            DriftTerm(name, form, size, size_unit, np.sqrt(part.diagonal()), float(np.trace(part)) / total)
            for name, form, size, size_unit, part in rows
            if size > 0
        ),
        covariance=covariance,
        fall=fall,
        tilt_std=float(growth.tilt[-1]),
        heading_std=float(growth.heading[-1]),
        attitude_error=float(growth.deciding[-1]),
        valid_until=_valid_until(unit[:3, :3], sources, time, rate, off_axis=any(offset)),
        alpha_overtakes=math.sqrt(12.0 * sd_p / (gravity * sd_alpha)),
        note=_leakage_note(array, rate),
    )


def motion_covariance(array: AccelerometerArray) -> NDArray[np.float64]:
    """Covariance of [alpha; p] for channels of unit variance, shape (6, 6)."""
    inverse = pseudo_inverse(array)
    return inverse @ inverse.T


def _leakage_note(array: AccelerometerArray, rate: float) -> str:
    if rate and np.any(omega_leakage(array)):
        return (
            f"array {array.name!r} lets ω² into its linear solution; the budget takes the correction for it as exact, "
            "so at speed the true drift is larger"
        )
    return ""


@dataclass(frozen=True)
class _Covariances:
    """Covariance of the position, (3, 3), from errors of [alpha; p] of a given covariance, (6, 6)."""

    time: float
    rate: float
    offset: complex
    gravity: float

    def constant(self, motion: NDArray[np.float64]) -> NDArray[np.float64]:
        response = self._of_bias(np.asarray(self.time))  # (3, 6)
        return response @ motion @ response.T

    def rate_drift(self) -> NDArray[np.float64]:
        response = position_from_rate(self.time, self.rate, self.offset, self.gravity)
        return response @ response.T

    def white(self, motion: NDArray[np.float64]) -> NDArray[np.float64]:
        return accumulated_covariance(self._of_impulse, motion, self.time, self.rate)

    def walking(self, motion: NDArray[np.float64]) -> NDArray[np.float64]:
        return accumulated_covariance(self._of_bias, motion, self.time, self.rate)

    def _of_bias(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        return position_from_bias(t, self.rate, self.offset, self.gravity)  # (..., 3, 6)

    def _of_impulse(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        return position_from_impulse(t, self.rate, self.offset, self.gravity)  # (m, 3, 6)


def _valid_until(
    alpha_covariance: NDArray[np.float64], sources: ErrorSources, time: float, rate: float, *, off_axis: bool
) -> float:
    """First time at which the attitude error reaches the limit, s; infinite if it was not found."""
    horizon = time
    while horizon <= _LONGEST_SEARCH * time and abs(rate) * horizon < max(_MOST_RADIANS, abs(rate) * time + 1.0):
        growth = attitude_growth(alpha_covariance, sources, horizon, rate, off_axis=off_axis)
        beyond = np.flatnonzero(growth.deciding >= TILT_LIMIT)
        if len(beyond) == 0:
            horizon *= 4.0
        elif beyond[0] < len(growth.t_s) // 2:
            horizon = float(growth.t_s[max(beyond[0], 1)])  # look closer
        else:
            pair = slice(int(beyond[0]) - 1, int(beyond[0]) + 1)
            return float(np.interp(TILT_LIMIT, growth.deciding[pair], growth.t_s[pair]))
    return math.inf
