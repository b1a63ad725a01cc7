"""Combined and expanded uncertainty of a quantity from its components: root of squares, Welch-Satterthwaite, k.

Source: JCGM 100:2008 (GUM), 5.1.2 (independent components), G.4.1 (effective degrees of freedom), G.6.4 (k = t_95).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from scipy.special import stdtrit

from gfimu.calibration.certificate.certificate import Component

__all__ = ["LEVEL", "Uncertainty", "coverage_factor", "uncertainties"]

LEVEL = 0.95
"""Coverage probability of every expanded uncertainty."""

_MANY = 1e6  # numerical: so many degrees of freedom are infinite


@dataclass(frozen=True)
class Uncertainty:
    """Combined standard uncertainty, its effective degrees of freedom (None: infinite) and coverage factor."""

    std: float
    degrees_of_freedom: float | None

    @property
    def coverage_factor(self) -> float:
        """Factor k of a two-sided 95 % interval."""
        return coverage_factor(self.degrees_of_freedom)

    @property
    def expanded(self) -> float:
        """Expanded uncertainty U = k u."""
        return self.coverage_factor * self.std


def coverage_factor(degrees_of_freedom: float | None) -> float:
    """Two-sided 95 % quantile of Student's t; of the normal distribution for None."""
    return float(stdtrit(_MANY if degrees_of_freedom is None else degrees_of_freedom, 0.5 * (1.0 + LEVEL)))


def uncertainties(budget: Iterable[Component]) -> Mapping[str, Uncertainty]:
    """Combine the components of each quantity.

    Parameters
    ----------
    budget : iterable of Component
        Components; those of one quantity are independent of each other.

    Returns
    -------
    mapping of str to Uncertainty
        By quantity.
    """
    groups: dict[str, list[Component]] = {}
    for component in budget:
        groups.setdefault(component.quantity, []).append(component)
    return {name: _combined(group) for name, group in groups.items()}


def _combined(group: list[Component]) -> Uncertainty:
    std = math.hypot(*(one.std for one in group))
    if std == 0.0:
        return Uncertainty(0.0, None)
    shares = sum((one.std / std) ** 4 / one.degrees_of_freedom for one in group if one.degrees_of_freedom is not None)
    return Uncertainty(std, 1.0 / shares if shares > 1.0 / _MANY else None)
