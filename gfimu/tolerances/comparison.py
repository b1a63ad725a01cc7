"""A Monte Carlo of simulated units beside the first-order budget: quantiles, the ratio, and whether they agree."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.short_repr import short_repr
from gfimu.tolerances.budget import QuantityBudget

__all__ = ["DRAWS", "QUANTILES", "Comparison", "compare"]

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
class Comparison:
    """Error of one quantity over simulated units, and by first order.

    Parameters
    ----------
    units : int
        Units that could be estimated.
    rms : float
        Root mean square of the error over units.
    quantiles, first_order_quantiles : mapping of float to float
        By probability, of the simulated units and of the first-order map.
    ratio : float
        ``rms`` over that of first order; NaN where that is zero.
    ratio_std : float
        Standard deviation that this ratio has by the number of units, if first order is right.
    """

    units: int
    rms: float
    quantiles: Mapping[float, float]
    first_order_quantiles: Mapping[float, float]
    ratio: float
    ratio_std: float

    __repr__ = short_repr

    @property
    def agrees(self) -> bool:
        """Whether the two differ by no more than chance and 5 % for what is not of first order."""
        if not np.isfinite(self.ratio):
            return self.rms == 0.0
        return abs(self.ratio - 1.0) <= _SECOND_ORDER + _STANDARD_ERRORS * self.ratio_std

    def to_dict(self) -> dict[str, Any]:
        """Return the figures by name for JSON."""
        return {
            "units": self.units,
            "rms": self.rms,
            "quantiles": {f"{100 * p:g}%": value for p, value in self.quantiles.items()},
            "first_order_quantiles": {f"{100 * p:g}%": value for p, value in self.first_order_quantiles.items()},
            "ratio_to_first_order": self.ratio,
            "ratio_std": self.ratio_std,
            "first_order_holds": self.agrees,
        }


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
        {p: float(np.quantile(found, p)) if len(found) else float("nan") for p in QUANTILES},
        {p: float(np.quantile(drawn, p)) for p in QUANTILES},
        ratio,
        spread / np.sqrt(len(found)) if len(found) else float("nan"),
    )
