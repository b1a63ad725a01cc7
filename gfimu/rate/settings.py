"""How a rate filter starts and integrates."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from gfimu.array.quadrature import STENCILS
from gfimu.base.errors import InputError, check_name
from gfimu.rate.rest_test import RestTest

__all__ = ["QUADRATURES", "FilterSettings"]

QUADRATURES = {name: stencil for name, stencil in STENCILS.items() if not stencil.alternates}
"""Quadratures of a filter; samples of the stencil behind the interval are the filter's lag."""


@dataclass(frozen=True)
class FilterSettings:
    """How a filter starts and what it relies on.

    Parameters
    ----------
    start_omega : ndarray, shape (3,), or None
        Rate at the first sample, rad/s, zeros for rest. By default it is inferred from the first readings.
    start_std : float
        Its uncertainty, rad/s.
    quadrature : {"centred6", "centred4", "adams_moulton4", "trapezoid"}
        Integration of α: two samples late and of sixth order, one late, not late, of second order.
    rest : RestTest or None
        Recognition of rest; None to never use it.
    measure_noise : bool
        Whether the noise of the channels is measured, with the stated one as prior.
    """

    start_omega: NDArray[np.float64] | None = None
    start_std: float = 1e-3
    quadrature: str = "centred6"
    rest: RestTest | None = field(default_factory=RestTest)
    measure_noise: bool = True

    @classmethod
    def starting(cls, start: str) -> Self:
        """Return the settings for a start at ``rest``, or ``any``."""
        return cls(start_omega=np.zeros(3) if start == "rest" else None)

    def __post_init__(self) -> None:
        check_name("quadrature", self.quadrature, QUADRATURES)
        start = self.start_omega
        if start is not None and (np.shape(start) != (3,) or not np.isfinite(start).all()):
            raise InputError("start_omega must hold three numbers, rad/s, or be None for an unknown start")
        if not (np.isfinite(self.start_std) and self.start_std > 0):
            raise InputError(f"start_std = {self.start_std!r}: must be a positive number, rad/s")
