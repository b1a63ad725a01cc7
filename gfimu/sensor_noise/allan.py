"""Allan deviation of a series, overlapping by default.

Source: W. J. Riley, "Handbook of Frequency Stability Analysis", NIST SP 1065, 2008, eqs 8 and 11; IEEE Std 952.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.base.declared import Declared, figure
from gfimu.base.errors import InputError
from gfimu.base.short_repr import short_repr

__all__ = ["FLICKER_FLOOR", "AllanDeviation", "allan_deviation", "averaging_factors"]

Floats = NDArray[np.float64]

FLICKER_FLOOR = float(np.sqrt(2.0 * np.log(2.0) / np.pi))
"""Allan deviation of flicker noise over B: 0.664."""

_PER_DECADE = 10
_FEWEST = 9
_BLOCK = 8192


@dataclass(frozen=True)
class AllanDeviation(Declared):
    """Allan deviation of one series of n samples, with the averaging times at which it was computed, shape (k,).

    ``factor`` are samples per average; ``rate`` is the sample rate, Hz; with ``overlapping`` every starting sample was
    used.

    Examples
    --------
    >>> import numpy as np
    >>> import gfimu
    >>> found = gfimu.allan_deviation(np.random.default_rng(1).normal(size=4096), rate=100.0)
    >>> print(f"{found.deviation[0]:.2f} at {found.tau[0]:.2f} s")
    1.00 at 0.01 s
    """

    factor: NDArray[np.int64]
    tau: Annotated[Floats, figure("Averaging times.", "s", key="tau_s")]
    deviation: Annotated[Floats, figure("Allan deviation at these, unit of the readings.")]
    n: int
    rate: float
    overlapping: bool = True

    __repr__ = short_repr

    @property
    def variance(self) -> Floats:
        """Allan variance, shape (k,)."""
        return self.deviation**2

    @property
    def minimum(self) -> tuple[float, float]:
        """Averaging time and deviation at the lowest point, s and unit of the series."""
        place = int(np.argmin(self.deviation))
        return float(self.tau[place]), float(self.deviation[place])

    @property
    def minimum_tau(
        self,
    ) -> Annotated[float, figure("Averaging time of that minimum.", "s", key="minimum_tau_s", before="tau")]:
        """Averaging time of the minimum, s."""
        return self.minimum[0]

    @property
    def bias_instability(
        self,
    ) -> Annotated[
        float,
        figure(
            "Bias instability by the minimum of the Allan deviation, unit of the readings.",
            key="bias_instability_from_minimum", before="minimum_tau",
        ),
    ]:  # fmt: skip
        """Bias instability read off the curve: its minimum over 0.664; an upper limit if the curve still falls."""
        return self.minimum[1] / FLICKER_FLOOR


def averaging_factors(n: int) -> NDArray[np.int64]:
    """Averaging factors on a logarithmic grid, from 1 to a ninth of the series."""
    largest = max(n // _FEWEST, 1)
    count = int(np.ceil(np.log10(largest) * _PER_DECADE)) + 1
    return np.unique(np.round(np.geomspace(1, largest, max(count, 1))).astype(np.int64))


def allan_deviation(
    values: ArrayLike, rate: float, *, factors: ArrayLike | None = None, overlapping: bool = True
) -> AllanDeviation:
    """Compute the Allan deviation of a series.

    Parameters
    ----------
    values : array_like, shape (n,)
        Evenly sampled series, such as a specific force at rest, m/s².
    rate : float
        Sample rate, Hz.
    factors : array_like of int, optional
        Samples per average; by default ten per decade up to a ninth of the series.
    overlapping : bool
        Use every starting sample (default) or only every m-th.

    Returns
    -------
    AllanDeviation

    Raises
    ------
    InputError
        If the series is too short, has missing values, or a factor does not fit into it.

    Examples
    --------
    >>> import numpy as np
    >>> import gfimu
    >>> found = gfimu.allan_deviation(np.random.default_rng(1).normal(size=4096), rate=100.0)
    >>> print(f"{found.deviation[0]:.2f}")
    1.00
    """
    series = np.asarray(values, dtype=float)
    if series.ndim != 1 or len(series) < 3:
        raise InputError("an Allan deviation needs a series of three or more values")
    if not np.isfinite(series).all():
        raise InputError("an Allan deviation needs a series without gaps or missing values; take a stretch without")
    if not rate > 0.0:
        raise InputError(f"sample rate {rate:g} Hz must be positive")
    m = averaging_factors(len(series)) if factors is None else np.atleast_1d(np.asarray(factors, dtype=np.int64))
    if m.min() < 1 or 2 * m.max() > len(series):
        raise InputError(
            f"averaging factors must be 1 to half the series ({len(series) // 2}); got {m.min()}…{m.max()}"
        )
    phase = np.empty(len(series) + 1)
    phase[0] = 0.0
    np.cumsum(series - series.mean(), out=phase[1:])
    phase /= rate
    if overlapping:
        squares, count = _second_difference_squares(phase, m), len(phase) - 2 * m
    else:
        second = [phase[2 * k :: k] - 2.0 * phase[k:-k:k] + phase[: -2 * k : k] for k in m]
        squares, count = np.array([x @ x for x in second]), np.array([len(x) for x in second])
    tau = m / rate
    return AllanDeviation(m, tau, np.sqrt(squares / (2.0 * count)) / tau, len(series), float(rate), overlapping)


@numba.njit(cache=True, fastmath={"reassoc", "contract"})
def _second_difference_squares(phase: Floats, factors: NDArray[np.int64]) -> Floats:
    """Return the sums of (x_{i+2m} − 2 x_{i+m} + x_i)² over i, for every m.

    All m share a block of i before the next one, so that a long series passes through the cache once and not once for
    every m; sums of blocks also keep rounding from growing with length.
    """
    total = np.zeros(len(factors))
    for begin in range(0, len(phase), _BLOCK):
        for index in range(len(factors)):
            m = factors[index]
            part = 0.0
            for i in range(begin, min(begin + _BLOCK, len(phase) - 2 * m)):
                second = phase[i + 2 * m] - 2.0 * phase[i + m] + phase[i]
                part += second * second
            total[index] += part
    return total
