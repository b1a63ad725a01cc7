"""The methods for the angular rate by name: the one list from which every call and message takes the names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

from gfimu.base.errors import InputError, check_name
from gfimu.base.plugins import plugins
from gfimu.rate import solvers

if TYPE_CHECKING:
    from gfimu.rate.result import RateEstimate

__all__ = ["RATE_METHODS", "RateMethod", "rate_method", "recursive_methods"]


@dataclass(frozen=True)
class RateMethod:
    """One method for the angular rate.

    Parameters
    ----------
    name : str
        Name for ``--method``, and in the result.
    solver : callable
        Estimates the rate at every sample: called with the array, times (n,) in s, readings (n, c) in m/s²,
        `gfimu.SensorErrors` and `gfimu.rate.settings.FilterSettings`, a recursive one also with
        ``references`` and ``progress`` by name (`gfimu.estimate_rate`), it returns a `gfimu.RateEstimate`.
    uses : str
        Part of the readings it uses.
    recursive : bool
        A Kalman recursion over the samples: it can use references, start from an unknown rate, report progress, and its
        innovations are tested for consistency.
    open_loop : bool
        α integrated from a known start: the error of a bias grows with time, and no measurement of ω bounds it.
    uses_later_samples : bool
        Later samples correct earlier ones: no method for a stream.
    follows_path : bool
        The solver takes ``path`` by name as well, and then also gives attitude, velocity and position.
    """

    name: str
    solver: Callable[..., RateEstimate]
    uses: str
    recursive: bool = False
    open_loop: bool = False
    uses_later_samples: bool = False
    follows_path: bool = False

    def refuse_references(self, name: str) -> None:
        """Raise `InputError` unless the method can use references, such as the one named."""
        if not self.recursive:
            raise InputError(f"method {self.name!r} can't use {name}; use {recursive_methods()}")

    def refuse_keep_faulty(self) -> None:
        """Raise `InputError` unless the method looks for faulty channels, which it may then be asked to keep."""
        if not self.recursive:
            raise InputError(
                f"--keep-faulty has no use with method {self.name!r}, which leaves no faulty channel out; "
                f"use {recursive_methods()}"
            )


_RECORDS = (
    RateMethod("integrate", solvers.integrate_from_rest, "α", open_loop=True, follows_path=True),
    RateMethod("algebraic", solvers.algebraic_from_rest, "null space, sample by sample", follows_path=True),
    RateMethod("ml", solvers.maximum_likelihood_from_rest, "null space, sample by sample", follows_path=True),
    RateMethod(
        "filter",
        solvers.filter_readings,
        "α, null space, rest, references; samples so far",
        recursive=True,
        follows_path=True,
    ),
    RateMethod(
        "smoother",
        solvers.smooth_readings,
        "the same, all samples",
        recursive=True,
        uses_later_samples=True,
        follows_path=True,
    ),
    RateMethod(
        "batch",
        solvers.adjust_readings,
        "the same, adjusted until nothing changes",
        recursive=True,
        uses_later_samples=True,
        follows_path=True,
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


def recursive_methods() -> str:
    """Names of the recursive methods, for messages."""
    *others, last = (method.name for method in _RECORDS if method.recursive)
    return f"{', '.join(others)} or {last}"
