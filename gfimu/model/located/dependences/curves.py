"""Curves: functions without a form of one or two regressors, or of a channel's own reading.

Such a function is a Gaussian process with a squared-exponential covariance, on cubic B-splines of a warped regressor
(Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, ch. 2). One-number forms compete with these:
they win where they serve, as they have fewer coefficients, and they extrapolate.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from gfimu.base.units import STANDARD_GRAVITY
from gfimu.model.located.dependences.dependence import Dependence, covariance_root
from gfimu.model.located.dependences.regressors import TIME, Regressor
from gfimu.model.located.rig_state import RigState
from gfimu.model.located.usual import USUAL

__all__ = ["Curve", "OfReading", "Product", "curve_over"]

_Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Curve(Dependence):
    """A smooth function of one regressor: cubic B-splines of asinh(x / warp), or of x itself where ``warp`` is 0."""

    regressor: Regressor
    low: float
    high: float
    functions: int
    lengths: tuple[float, ...] = USUAL.lengths
    warp: float = 0.0

    @property
    def name(self) -> str:  # type: ignore[override]
        """Name in ``verdict.json``."""
        return f"f({self.regressor.name})"

    @property
    def kind(self) -> str:  # type: ignore[override]
        """The same for all that mean the same to a person."""
        return self.regressor.name

    @property
    def words(self) -> str:  # type: ignore[override]
        """How an error goes with it."""
        return f"as a function of {self.regressor.words}"

    @property
    def of_one_recording(self) -> bool:  # type: ignore[override]
        """Whether it is of absolute time."""
        return self.regressor is TIME

    @property
    def numbers(self) -> dict[str, Any]:
        """What makes it."""
        return {"low": self.low, "high": self.high, "functions": self.functions, "warp": self.warp}

    @cached_property
    def grid(self) -> _Floats:
        """Knots, on the scale 0 to 1."""
        inner = np.linspace(-1e-9, 1.0 + 1e-9, self.functions - 2)  # numerical
        return np.concatenate([[inner[0]] * 3, inner, [inner[-1]] * 3])

    @cached_property
    def roots(self) -> tuple[_Floats, ...]:  # type: ignore[override]
        """Roots of the prior covariance, one for each length scale."""
        centres = np.convolve(self.grid, np.ones(3) / 3.0, "valid")[1:-1]
        return tuple(covariance_root(centres, length) for length in self.lengths)

    @property
    def abscissa(self) -> Regressor | None:
        """What a picture of the function is drawn over."""
        return self.regressor

    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples."""
        return self.at(self.regressor.of(state))

    def at(self, x: _Floats) -> _Floats:
        """Return the splines at values (n,) of the regressor, shape (n, K)."""
        low, high, here = (np.arcsinh(v / self.warp) if self.warp else v for v in (self.low, self.high, x))
        share = np.clip((here - low) / max(high - low, 1e-12), 0.0, 1.0)  # numerical
        return np.asarray(BSpline.design_matrix(share, self.grid, 3).toarray())


def curve_over(
    regressor: Regressor, seen: _Floats, functions: int, lengths: tuple[float, ...], *, warp: float = 0.0
) -> Curve:
    """Return a smooth function over the range of a regressor that was seen (n,)."""
    return Curve(regressor, float(seen.min()), float(seen.max()), functions, lengths, warp)


@dataclass(frozen=True)
class Product(Dependence):
    """A smooth function of two regressors."""

    first: Curve
    second: Curve

    @property
    def numbers(self) -> dict[str, Any]:
        """What makes it."""
        return {"first": self.first.numbers, "second": self.second.numbers}

    @property
    def name(self) -> str:  # type: ignore[override]
        """Name in ``verdict.json``."""
        return f"f({self.kind})"

    @property
    def kind(self) -> str:  # type: ignore[override]
        """The same for all that mean the same to a person."""
        return f"{self.first.kind}, {self.second.kind}"

    @property
    def words(self) -> str:  # type: ignore[override]
        """How an error goes with it."""
        return f"as a function of {self.first.regressor.words} and {self.second.regressor.words}"

    @cached_property
    def roots(self) -> tuple[_Floats, ...]:  # type: ignore[override]
        """Roots of the prior covariance, one for each length scale."""
        return (np.asarray(np.kron(self.first.roots[0], self.second.roots[0]), dtype=np.float64),)

    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples."""
        one, other = self.first.values(state), self.second.values(state)
        return (one[:, :, None] * other[:, None, :]).reshape(len(one), -1)


@dataclass(frozen=True)
class OfReading(Dependence):
    """A function of each channel's own reading: its power, or a smooth one up to the largest reading."""

    most: float
    power: int = 0
    kind: str = "own reading"

    @property
    def name(self) -> str:  # type: ignore[override]
        """Name in ``verdict.json``."""
        return f"y^{self.power}" if self.power else "f(y)"

    @property
    def words(self) -> str:  # type: ignore[override]
        """How an error goes with it."""
        return (
            f"in proportion to reading{'²' if self.power == 2 else '³'}"
            if self.power
            else "as a function of the reading"
        )

    @property
    def numbers(self) -> dict[str, Any]:
        """What makes it."""
        return {"most": self.most}

    @cached_property
    def _curve(self) -> Curve:
        reading = Regressor("y", "the reading", "m/s²", lambda state: state.t)
        functions, warp = USUAL.reading_functions, self.most / USUAL.harmonics
        return Curve(reading, -self.most, self.most, functions, warp=warp)

    @property
    def roots(self) -> tuple[_Floats, ...]:
        """Roots of the prior covariance, one for each length scale."""
        return (np.eye(1),) if self.power else self._curve.roots

    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples."""
        readings = np.column_stack([state.readings, np.zeros(len(state.t))]).T  # (c + 1, n)
        if self.power:
            return np.asarray((readings[:, :, None] / STANDARD_GRAVITY) ** self.power)
        return np.stack([self._curve.at(mine) for mine in readings])
