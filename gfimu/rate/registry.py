"""The methods for the angular rate by name: the one list from which every call and message takes the names.

The records name their functions instead of importing them, so that a command can list the methods without loading
the compiled filter.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol, cast

from gfimu.base.errors import InputError, check_name
from gfimu.base.plugins import plugins

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike

    from gfimu.array.array import AccelerometerArray
    from gfimu.rate.kalman import FilterSettings
    from gfimu.rate.result import RateEstimate
    from gfimu.rate.sensing import SensorErrors

__all__ = ["RATE_METHODS", "RateMethod", "RateSolver", "rate_method", "recursive_methods"]


class RateSolver(Protocol):
    """A method for the angular rate; ``gyro`` and ``progress`` go to recursive ones only."""

    def __call__(
        self,
        array: AccelerometerArray,
        t: ArrayLike,
        readings: ArrayLike,
        errors: SensorErrors,
        settings: FilterSettings,
        *,
        gyro: ArrayLike | None = None,
        progress: Callable[[float], object] | None = None,
    ) -> RateEstimate:
        """Estimate the angular rate at every sample."""
        ...


@dataclass(frozen=True)
class RateMethod:
    """One method for the angular rate.

    Parameters
    ----------
    name : str
        Name for ``--method``, and in the result.
    function : str
        Its `RateSolver`, as ``module:function``.
    uses : str
        Part of the readings it uses.
    recursive : bool
        A Kalman recursion over the samples: it can fuse a gyro, start from an unknown rate, report progress, and its
        innovations are tested for consistency.
    open_loop : bool
        α integrated from a known start: the error of a bias grows with time, and no measurement of ω bounds it.
    uses_later_samples : bool
        Later samples correct earlier ones: no method for a stream.
    """

    name: str
    function: str
    uses: str
    recursive: bool = False
    open_loop: bool = False
    uses_later_samples: bool = False

    @property
    def solver(self) -> RateSolver:
        """The function that estimates."""
        return cast(RateSolver, pkgutil.resolve_name(self.function))

    def refuse_gyro(self) -> None:
        """Raise `InputError` unless the method can fuse a gyro."""
        if not self.recursive:
            raise InputError(f"method {self.name!r} can't use a gyro; use {recursive_methods()}")

    def refuse_keep_faulty(self) -> None:
        """Raise `InputError` unless the method looks for faulty channels, which it may then be asked to keep."""
        if not self.recursive:
            raise InputError(
                f"--keep-faulty has no use with method {self.name!r}, which leaves no faulty channel out; "
                f"use {recursive_methods()}"
            )

    def refuse_unknown_start(self) -> None:
        """Raise `InputError` unless the method can start from an unknown rate."""
        if not self.recursive:
            raise InputError(
                f"method {self.name!r} needs the rate at the start; use {recursive_methods()} for an unknown one"
            )


_RECORDS = (
    RateMethod("integrate", "gfimu.rate.methods:integrate_from_rest", "α", open_loop=True),
    RateMethod("algebraic", "gfimu.rate.methods:algebraic_from_rest", "null space, sample by sample"),
    RateMethod("ml", "gfimu.rate.methods:maximum_likelihood_from_rest", "null space, sample by sample"),
    RateMethod("filter", "gfimu.rate.filter:filter_rate", "α, null space, rest, gyro; samples so far", recursive=True),
    RateMethod(
        "smoother", "gfimu.rate.smoother:smooth_rate", "the same, all samples", recursive=True, uses_later_samples=True
    ),
)

RATE_METHODS: Mapping[str, RateMethod] = MappingProxyType({method.name: method for method in _RECORDS})
"""Every method for the angular rate by name."""


def rate_method(name: str) -> RateMethod:
    """Look up a method for the angular rate, of gfimu or of another package (``gfimu.estimators``).

    Raises
    ------
    InputError
        If there is none of that name; it lists the methods.
    """
    if name in RATE_METHODS:
        return RATE_METHODS[name]
    known = {**RATE_METHODS, **plugins("gfimu.estimators", RateMethod, RATE_METHODS)}
    check_name("method", name, known)
    return known[name]


def recursive_methods(separator: str = " or ") -> str:
    """Names of the recursive methods, for messages."""
    return separator.join(method.name for method in _RECORDS if method.recursive)
