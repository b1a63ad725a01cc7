"""The drift of an array as `gfimu.drift` returns it: the budget in closed form, beside a Monte Carlo."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.declared import Declared, Line, Table, figure
from gfimu.base.results import Panel, PlottedResult, Series
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.budget.drift.budget import TILT_LIMIT, DriftBudget
from gfimu.budget.drift.monte_carlo import DriftSample

__all__ = ["Drift", "MonteCarlo"]


@dataclass(frozen=True)
class MonteCarlo(Declared):
    """Position errors of simulated runs at the end."""

    runs: Annotated[int, figure("Runs.")]
    seed: Annotated[int, figure("Seed.")]
    std_m: Annotated[NDArray[np.float64], figure("Standard deviation of the position error, world axes.", "m")]
    mean_m: Annotated[NDArray[np.float64], figure("Mean of the position error, world axes.", "m")]
    relative_sampling_error: Annotated[float, figure("Relative standard deviation of that standard deviation.")]


@dataclass(frozen=True)
class Drift(Declared, PlottedResult):
    """Position drift: the budget in closed form, and the Monte Carlo where one was run.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.drift("cube12", duration=10.0, noise_ug=290.0).budget.total_std.round(1)
    array([27.8, 27.8,  3.3])
    """

    budget: Annotated[DriftBudget, figure("Position error, cause by cause.", flat=True)]
    sample: DriftSample | None
    seed: int

    @property
    def monte_carlo(
        self,
    ) -> Annotated[MonteCarlo | None, figure("Position errors of simulated runs, with --monte-carlo.", absent=True)]:
        """Figures of the Monte Carlo at the end."""
        one = self.sample
        if one is None:
            return None
        return MonteCarlo(one.runs, self.seed, one.std[-1], one.mean[-1], one.relative_sampling_error)

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
            sample = self.sample
            series = tuple(
                Series(axis, std, std * sample.relative_sampling_error, role=axis)
                for axis, std in zip("xyz", sample.std.T, strict=True)
            )
            title = f"position error of {sample.runs} simulated runs"
            panels.append(Panel(title, "σ, m", series, sample.t_s, "time, s", scale="zero"))
        return panels

    def shown(self) -> Iterator[Table | Line]:
        """Yield the causes with their shares, and how far the figures hold."""
        budget, sample = self.budget, self.sample
        rows = [
            (f"{term.name}, {term.size:.3g} {term.size_unit}", term.form, *map(_length, term.std), f"{term.share:.1%}")
            for term in budget.terms
        ]
        rows.append(("total", "", *map(_length, budget.total_std), ""))
        if sample is not None:
            rows.append((f"Monte Carlo, {sample.runs} runs", "", *map(_length, sample.std[-1]), ""))
            rows.append(("Monte Carlo / total", "", *(f"{r:.2f}" for r in sample.std[-1] / budget.total_std), ""))
        where = f"turning at {budget.rate:g} rad/s" if budget.rate else "at rest"
        title = f"Position error after {budget.time:g} s, {budget.array}, {where} (1 σ)"
        yield Table(title, ("cause", "law at rest", "x", "y", "z", "share"), rows)
        for remark in self._remarks():
            yield Line(remark, "" if budget.valid else "yellow")

    def _remarks(self) -> Iterator[str]:
        budget, until = self.budget, "far later"
        if math.isfinite(budget.valid_until):
            until = f"{budget.valid_until:.3g} s"
        if budget.valid:
            yield (
                f"The closed forms hold: attitude error {budget.attitude_error:.2g} rad (1 σ); "
                f"the limit of {TILT_LIMIT} rad comes after {until}."
            )
        else:
            yield (
                f"The closed forms hold for {until} only, where the attitude error "
                f"reaches {TILT_LIMIT} rad (1 σ). The figures above extrapolate them; the true error is below "
                f"g t² = {_length(STANDARD_GRAVITY * budget.time**2)}. Calibrate the biases, or see --monte-carlo."
            )
        yield (
            f"At rest a bias acts more through alpha and gravity than through p after {budget.alpha_overtakes:.3g} s."
        )
        if self.sample is not None:
            yield f"Sampling error of the Monte Carlo: {self.sample.relative_sampling_error:.1%} per axis."
        if budget.note:
            yield f"Note: {budget.note}."


def _length(metres: float) -> str:
    """Write a length with the prefix that fits."""
    if metres == 0:
        return "0"
    for factor, unit in ((1e3, "km"), (1.0, "m"), (1e-3, "mm")):
        if metres >= factor:
            return f"{metres / factor:.3g} {unit}"
    return f"{metres / 1e-6:.3g} µm"
