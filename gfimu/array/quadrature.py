"""Weights of the quadrature over one sample interval: the integral of the polynomial through neighbouring samples.

Integration of a recording, the rate filter's prediction and the integration with feedback all take their weights from
`polynomial_weights`. A `Stencil` names the neighbours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.base.compiled import compiled

__all__ = ["STENCILS", "Stencil", "even_weights", "polynomial_weights"]


@dataclass(frozen=True)
class Stencil:
    """Samples that the polynomial of one interval passes through.

    Parameters
    ----------
    before : tuple of (int, int)
        First sample, counted from the interval's left end, for intervals of even and of odd number.
    points : int
        Number of samples.
    causal : bool
        Whether no sample behind the interval's right end is used, also at the start of a stretch.
    """

    before: tuple[int, int]
    points: int
    causal: bool = False

    @property
    def alternates(self) -> bool:
        """Whether intervals of even and of odd number have different neighbours."""
        return self.before[0] != self.before[1]


STENCILS = {
    "trapezoid": Stencil((0, 0), 2, causal=True),
    "runge_kutta": Stencil((0, -1), 3),
    "adams_moulton4": Stencil((-2, -2), 4, causal=True),
    "centred4": Stencil((-1, -1), 4),
    "centred6": Stencil((-2, -2), 6),
}
"""Stencils by the name of the integration method; `gfimu.array.integration` compares them."""


@compiled
def polynomial_weights(t, first, points, left, weights):  # type: ignore[no-untyped-def]
    """Weights, s, of the samples ``first`` … ``first + points − 1`` in the integral from sample ``left`` to the next.

    Lagrange's polynomials of the actual sample times are integrated by the three-point Gauss–Legendre rule, which is
    exact up to six points. The result goes to the first ``points`` places of ``weights``.
    """
    step = t[left + 1] - t[left]
    for j in range(points):
        weights[j] = 0.0
    for g in range(3):
        abscissa = 0.5 + (g - 1) * 0.3872983346207417
        share = 0.4444444444444444 if g == 1 else 0.2777777777777778
        at = t[left] + abscissa * step
        for j in range(points):
            basis = 1.0
            for i in range(points):
                if i != j:
                    basis *= (at - t[first + i]) / (t[first + j] - t[first + i])
            weights[j] += share * basis * step


def even_weights(points: int) -> NDArray[np.float64]:
    """Weights of ``points`` even samples over each interval between them, in periods, shape (points − 1, points)."""
    weights = np.empty((points - 1, points))
    nodes = np.arange(points, dtype=float)
    for left in range(points - 1):
        polynomial_weights(nodes, 0, points, left, weights[left])
    return weights
