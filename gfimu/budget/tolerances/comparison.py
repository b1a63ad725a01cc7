"""A Monte Carlo of simulated units beside the first-order budget: quantiles, the ratio, and whether they agree."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from gfimu.base.declared import Declared, figure
from gfimu.base.short_repr import short_repr
from gfimu.budget.tolerances.budget import QuantityBudget

__all__ = ["DRAWS", "QUANTILES", "Comparison", "UnitErrors", "compare"]

Floats = NDArray[np.float64]

QUANTILES = (0.05, 0.5, 0.95)
"""Quantiles of the error over units that are reported."""

_SECOND_ORDER = 0.05
"""Relative difference that is left to terms of second order before first order is said to fail: less than what a
designer reads off the figures."""

_STANDARD_ERRORS = 3.0
"""Numerical: of the Monte Carlo; 0.3 % of right predictions lie beyond."""

DRAWS = 20_000
"""Numerical: units drawn by the first-order map for its quantiles and its curve."""


@dataclass(frozen=True)
class UnitErrors:
    """Errors of n simulated units after one calibration.

    Parameters
    ----------
    errors : dict of str to ndarray, shape (n,)
        By quantity (`gfimu.budget.tolerances.budget.QUANTITIES`), the norm of the error of each unit; NaN of one that
        failed.
    failures : dict of str to int
        How many units could not be calibrated or estimated, by the reason.
    """

    errors: dict[str, Floats]
    failures: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Comparison(Declared):
    """Errors of simulated units beside first order."""

    units: Annotated[int, figure("Units that could be estimated.")]
    rms: Annotated[float, figure("Error, rms over the units, in the unit of the quantity.")]
    quantiles: Annotated[Mapping[str, float], figure("Quantiles of the error.")]
    first_order_quantiles: Annotated[Mapping[str, float], figure("What first order gives for these.")]
    ratio: Annotated[
        float, figure("Rms over that of first order; null where that is zero.", key="ratio_to_first_order")
    ]
    ratio_std: Annotated[float, figure("Its standard deviation by the number of units, if first order is right.")]

    __repr__ = short_repr

    @property
    def agrees(self) -> Annotated[bool, figure("Whether the two agree.", key="first_order_holds")]:
        """Whether the two differ by no more than chance and 5 % for what is not of first order."""
        if not np.isfinite(self.ratio):
            return self.rms == 0.0
        return abs(self.ratio - 1.0) <= _SECOND_ORDER + _STANDARD_ERRORS * self.ratio_std


def compare(budget: QuantityBudget, errors: Floats, shape: str) -> Comparison:
    """Compare simulated errors with a budget.

    Parameters
    ----------
    budget : QuantityBudget
        First order.
    errors : ndarray, shape (n,)
        Norm of the error of each unit; NaN of units that could not be estimated.
    shape : {"uniform", "normal"}
        Distribution of the machining errors.
    """
    found = errors[np.isfinite(errors)]
    rms = float(np.sqrt(np.mean(found**2))) if len(found) else float("nan")
    first = budget.rms
    ratio = rms / first if first > 0.0 else float("nan")
    drawn = budget.draw(DRAWS, shape, np.random.default_rng(0))
    expected = drawn**2
    spread = 0.5 * float(expected.std()) / float(expected.mean()) if first > 0.0 else 0.0
    return Comparison(
        len(found),
        rms,
        {f"{100 * p:g}%": float(np.quantile(found, p)) if len(found) else float("nan") for p in QUANTILES},
        {f"{100 * p:g}%": float(np.quantile(drawn, p)) for p in QUANTILES},
        ratio,
        spread / np.sqrt(len(found)) if len(found) else float("nan"),
    )
