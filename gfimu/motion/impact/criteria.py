"""Injury criteria of an acceleration."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["head_injury_criterion"]


def head_injury_criterion(resultant_g: ArrayLike, period_s: float, longest_s: float = 0.015) -> float:
    """Return the head injury criterion, max (t₂ − t₁) · [1/(t₂ − t₁) ∫ a dt]^2.5 (FMVSS 208, S6.2).

    Parameters
    ----------
    resultant_g : array_like, shape (n,)
        Resultant acceleration of the head's centre of mass, g.
    period_s : float
        Sample period, s.
    longest_s : float
        Longest window, s: 15 or 36 ms.
    """
    values = np.asarray(resultant_g, dtype=float)
    steps = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * period_s)])  # ∫ a dt, (n,)
    best = 0.0
    for count in range(1, min(len(values) - 1, int(longest_s / period_s + 1e-9)) + 1):
        span = count * period_s
        best = max(best, span * float(((steps[count:] - steps[:-count]).max() / span) ** 2.5))
    return best
