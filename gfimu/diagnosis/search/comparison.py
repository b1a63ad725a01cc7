"""Sets of causes compared under the same nuisance parameters: all that a verdict asks of a search.

A table and a free body marginalise different nuisance parameters, so that what a fit holds differs; what a verdict
needs of it does not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from gfimu.diagnosis.search.screening import Screening
from gfimu.diagnosis.terms.cause import Cause

__all__ = ["Comparison", "F", "FittedSet"]


class FittedSet(Protocol):
    """A set of causes at its optimum."""

    @property
    def causes(self) -> tuple[Cause, ...]:
        """The causes."""
        ...

    @property
    def names(self) -> frozenset[str]:
        """Names of the effects."""
        ...

    @property
    def key(self) -> frozenset[tuple[str, str]]:
        """Effects and places, which identify the set."""
        ...

    @property
    def log_posterior(self) -> float:
        """Log posterior probability up to a constant common to all sets."""
        ...

    @property
    def objective(self) -> float:
        """Sum of squares at the optimum."""
        ...


F = TypeVar("F", bound=FittedSet)
"""What a search fits."""


@dataclass(frozen=True)
class Comparison(Generic[F]):
    """The most probable set of causes and what it is compared with.

    Parameters
    ----------
    best : FittedSet
        The most probable set.
    nothing : FittedSet
        No cause at all, under the same nuisance parameters.
    without : dict of str to FittedSet
        The best fit without each cause.
    rivals : tuple of FittedSet
        Other sets, best first, under the same nuisance parameters.
    screening : Screening
        The last one, about the best set.
    elsewhere : tuple of FittedSet
        The best set under each other model of the nuisance parameters, its log posterior less what that model needs
        more than this one.
    """

    best: F
    nothing: F
    without: dict[str, F]
    rivals: tuple[F, ...]
    screening: Screening
    elsewhere: tuple[F, ...] = ()
