"""Errors of an array by its tolerances, as `gfimu.tolerance` returns them: first order beside simulated units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.declared import Declared, Line, Table, figure
from gfimu.base.results import Panel, PlottedResult, Series, text_column
from gfimu.budget.drift import TILT_LIMIT
from gfimu.budget.tolerances.budget import QuantityBudget, ToleranceBudget
from gfimu.budget.tolerances.calibrated import CALIBRATIONS
from gfimu.budget.tolerances.comparison import Comparison, UnitErrors, compare
from gfimu.budget.tolerances.tolerances import CAUSES, Tolerances
from gfimu.budget.tolerances.words import pay_for, room_for, stated_tolerances

__all__ = ["CalibrationErrors", "QuantityErrors", "ToleranceResult"]

_FORMAT_VERSION = 1
_SHORT = {"alpha": "α", "omega": "ω integrated", "omega_null_space": "ω null space", "position": "position"}
"""Names of the quantities in the heads of columns."""


@dataclass(frozen=True)
class QuantityErrors(Declared):
    """Error of one quantity."""

    budget: Annotated[QuantityBudget, figure("By first order.", flat=True)]
    simulated: Annotated[Comparison | None, figure("Simulated units, where they were asked for.", absent=True)] = None

    @property
    def column(self) -> str:
        """Head of its column."""
        return f"{_SHORT[self.budget.name]}, {self.budget.unit}"


@dataclass(frozen=True)
class CalibrationErrors(Declared):
    """Errors after one calibration."""

    attitude_error_rad: Annotated[float, figure("Attitude error at the end, 1 σ per axis.", "rad")]
    failed_units: Annotated[Mapping[str, int], figure("Units that could not be estimated, by reason.")]
    quantities: Annotated[Mapping[str, QuantityErrors], figure("The quantities.")]

    @property
    def failing(self) -> list[str]:
        """Quantities for which simulated units contradict first order."""
        return [name for name, one in self.quantities.items() if one.simulated is not None and not one.simulated.agrees]


@dataclass(frozen=True)
class ToleranceResult(Declared, PlottedResult):
    """Errors of an array from its tolerances, before and after a calibration.

    ``budgets`` are of first order, and ``units`` the errors of simulated units, where any were asked for; both by
    calibration.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.tolerance("cube12", closed_form=True)
    >>> sorted(found.budgets)
    ['none', 'poses', 'poses+rest', 'rest']
    """

    array: Annotated[str, figure("Name of the array.")]
    motion: Annotated[str, figure("The motion in words.", head="motion")]
    levelled: Annotated[
        bool,
        figure(
            "Whether estimates level themselves at the start; else attitude and rate are known there.",
            key="levelled_at_start",
        ),
    ]
    tolerances: Annotated[Tolerances, figure("What was assumed.")]
    budgets: Mapping[str, ToleranceBudget]
    units: Mapping[str, UnitErrors]
    seed: Annotated[int, figure("Seed of the simulated units.")]
    format_version: Annotated[int, figure("Version of the format.", before="array")] = _FORMAT_VERSION

    @cached_property
    def comparisons(self) -> dict[str, dict[str, Comparison]]:
        """Simulated units beside first order, by calibration and quantity."""
        return {
            calibration: {
                name: compare(self.budgets[calibration].quantities[name], errors, self.tolerances.shape)
                for name, errors in units.errors.items()
            }
            for calibration, units in self.units.items()
        }

    @property
    def calibrations(self) -> Annotated[dict[str, CalibrationErrors], figure("Errors by calibration.")]:
        """First order and simulated units together, by calibration."""
        return {name: self._after(name, budget) for name, budget in self.budgets.items()}

    def _after(self, calibration: str, budget: ToleranceBudget) -> CalibrationErrors:
        simulated = self.comparisons.get(calibration, {})
        quantities = {name: QuantityErrors(one, simulated.get(name)) for name, one in budget.quantities.items()}
        failures = self.units[calibration].failures if self.units else {}
        return CalibrationErrors(budget.attitude_rad, failures, quantities)

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per calibration, quantity and cause: the rms error it makes, its share of the variance."""
        rows = [
            (calibration, quantity, cause)
            for calibration, budget in self.budgets.items()
            for quantity in budget.quantities.values()
            for cause in quantity.by_cause
        ]
        return {
            "calibration": text_column(calibration for calibration, _, _ in rows),
            "quantity": text_column(one.name for _, one, _ in rows),
            "cause": text_column(cause for _, _, cause in rows),
            "rms": np.array([one.by_cause[cause] for _, one, cause in rows], dtype=float),
            "unit": text_column(one.unit for _, one, _ in rows),
            "share": np.array([one.shares[cause] for _, one, cause in rows], dtype=float),
        }

    def _heading(self) -> str:
        return f"Tolerances of {self.array}"

    def _facts(self) -> list[tuple[str, str]]:
        facts = self.facts()
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

    def shown(self) -> Iterator[Table | Line | str]:
        """Yield what was assumed, the causes after each calibration, and what each calibration makes of the errors."""
        start = "levelled by themselves at rest" if self.levelled else "with known attitude and rate at the start"
        yield Table(
            f"{self.array}: {self.motion}; estimates by integration, {start}",
            ("tolerance", "size", "what it is"),
            list(stated_tolerances(self.tolerances)),
            left=3,
        )
        calibrations = self.calibrations
        for name, errors in calibrations.items():
            yield self._table_of_causes(name, errors)
            yield from self._remarks(errors)
        first = next(iter(calibrations.values())).quantities
        yield Table(
            "Error, norm of three components, rms over units",
            ("calibration", *(one.column for one in first.values())),
            [
                (name, *(self._total(quantity) for quantity in errors.quantities.values()))
                for name, errors in calibrations.items()
            ],
            note="; ".join(f"{_SHORT[name]}: {one.budget.meaning}" for name, one in first.items()),
        )

    def _total(self, error: QuantityErrors) -> str:
        """Return the size of an error; where first order fails, what was simulated stands in its place."""
        simulated = error.simulated
        if simulated is None:
            return "no unit estimated" if self.units else f"{error.budget.rms:.3g}"
        return f"{error.budget.rms:.3g}" if simulated.agrees else f"{simulated.rms:.3g} (simulated)"

    def _table_of_causes(self, calibration: str, errors: CalibrationErrors) -> Table:
        """Return shares, totals and simulated units after one calibration."""
        budgets = [quantity.budget for quantity in errors.quantities.values()]
        rows: list[tuple[str, ...]] = [
            (cause, *(f"{budget.shares[cause]:.1%}" if cause in budget.shares else "0" for budget in budgets))
            for cause in CAUSES
            if any(cause in one.by_cause for one in budgets)
        ]
        rows.append(("total, first order", *(f"{one.rms:.3g}" for one in budgets)))
        simulated = [one.simulated for one in errors.quantities.values() if one.simulated is not None]
        if simulated:
            rows.append((f"total, {simulated[0].units} simulated", *(f"{one.rms:.3g}" for one in simulated)))
            rows.append(("simulated / first order", *(f"{one.ratio:.3f} ± {one.ratio_std:.3f}" for one in simulated)))
            rows.append(("95 % of units below", *(f"{one.quantiles['95%']:.3g}" for one in simulated)))
        title = f"Calibration {calibration}: {CALIBRATIONS[calibration]}; shares of the variance"
        return Table(title, ("cause", *(one.column for one in errors.quantities.values())), rows)

    def _remarks(self, errors: CalibrationErrors) -> Iterator[Line | str]:
        """Yield what to pay for, and where the figures do not hold."""
        for name, one in errors.quantities.items():
            room = room_for(one.budget, self.tolerances)
            yield f"  {_SHORT[name]}: {pay_for(one.budget)}" + (f"; {room}" if room else "")
        if errors.failing:
            failing = "; ".join(_SHORT[name] for name in errors.failing)
            yield Line(
                f"  FIRST ORDER FAILS for {failing}: there the simulated figures hold, and the shares do not.", "yellow"
            )
        if errors.attitude_error_rad > TILT_LIMIT:
            yield Line(
                f"  The attitude error reaches {errors.attitude_error_rad:.2g} rad (1 σ per axis); position is of "
                f"first order up to {TILT_LIMIT} rad: calibrate, or give a shorter --duration.",
                "yellow",
            )
        for reason, count in errors.failed_units.items():
            yield Line(f"  {count} units could not be estimated: {reason}", "yellow")
