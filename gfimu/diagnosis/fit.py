"""A set of causes fitted to the data, and where other fits may start from it."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.causes import Cause
from gfimu.diagnosis.evidence import SCALES, inverse
from gfimu.diagnosis.segment import Segment
from gfimu.geometry.array import AccelerometerArray

__all__ = ["SMALLEST_POSITIVE", "Fit", "Start", "segments_at", "without"]

SMALLEST_POSITIVE = 1e-6
"""Least coordinate of what can't be negative."""


@dataclass(frozen=True)
class Fit:
    """A set of causes at its optimum.

    Parameters
    ----------
    causes : tuple of Cause
        With coordinates and covariance.
    log_evidence : float
        Log of the marginal likelihood (up to a constant common to all sets), without the prior of the set.
    log_posterior : float
        The same with the prior of the set.
    objective : float
        Drive-marginalised sum of squares at the optimum.
    drives : tuple of ndarray
        Drive coefficients of every segment.
    gram, score : ndarray
        Normal equations of the coordinates relative to no effect.
    responses : tuple of ndarray
        How the drive coefficients of every segment follow the coordinates, each (m, k).
    """

    causes: tuple[Cause, ...]
    log_evidence: float
    log_posterior: float
    objective: float
    drives: tuple[NDArray[np.float64], ...]
    gram: NDArray[np.float64]
    score: NDArray[np.float64]
    responses: tuple[NDArray[np.float64], ...] = ()

    @property
    def key(self) -> frozenset[tuple[str, str]]:
        """Effects and places, which identify the set."""
        return frozenset(cause.key for cause in self.causes)

    @property
    def names(self) -> frozenset[str]:
        """Names of the effects."""
        return frozenset(cause.name for cause in self.causes)

    def of(self, places: Sequence[int]) -> Fit:
        """Return the fit with the drives of some of its segments only."""
        return replace(
            self,
            drives=tuple(self.drives[place] for place in places),
            responses=tuple(self.responses[place] for place in places),
        )


@dataclass(frozen=True)
class Start:
    """Causes and drives from which a fit may start.

    Parameters
    ----------
    causes : sequence of Cause
        At starting coordinates.
    drives : sequence of ndarray
        Drive coefficients of every segment.
    """

    causes: Sequence[Cause]
    drives: Sequence[NDArray[np.float64]]


def without(fit: Fit, number: int, array: AccelerometerArray) -> Start:
    """Return where the other causes of a fit, and the drives, would go without one of them in a linear world."""
    owners = np.repeat(np.arange(len(fit.causes)), [len(cause.coordinates) for cause in fit.causes])
    old = np.concatenate([cause.coordinates for cause in fit.causes])
    kept = np.flatnonzero(owners != number)
    new = np.zeros_like(old)
    information = fit.gram[np.ix_(kept, kept)] + np.eye(len(kept)) / SCALES[-1] ** 2
    positive = np.concatenate([cause.positive(array) for cause in fit.causes])
    if len(kept):
        new[kept] = inverse(information) @ fit.score[kept]
        new = np.where(positive, np.maximum(new, SMALLEST_POSITIVE), new)
    new[owners == number] = 0.0
    causes = [cause.at(new[owners == place]) for place, cause in enumerate(fit.causes) if place != number]
    moves = [response @ (new - old) for response in fit.responses]
    return Start(causes, [drive + move for drive, move in zip(fit.drives, moves, strict=True)])


def segments_at(segments: Sequence[Segment], fit: Fit) -> list[Segment]:
    """Return copies of segments at the drives of a fit, for work that nothing else is to notice."""
    copies = [copy(segment) for segment in segments]
    for segment, drive in zip(copies, fit.drives, strict=True):
        segment.coefficients = drive
    return copies
