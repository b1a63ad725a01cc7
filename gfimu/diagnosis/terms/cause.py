"""A cause: an effect of the library at a place, with its sizes and shape."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from gfimu.array.array import AccelerometerArray
from gfimu.model.world_model import Effect, EffectFamily, Pattern

__all__ = ["ALIKE", "SMALLEST_POSITIVE", "Cause", "effects_of", "mixing_of"]

ALIKE = 0.3
"""Numerical: shapes nearer than that, as a logarithm or in rad, belong to one optimum."""

_AT_END = 1.0 - 1e-6  # numerical: share of a limit that is at it
SMALLEST_POSITIVE = 1e-6
"""Numerical: least coordinate of what can't be negative."""


@dataclass(frozen=True)
class Cause:
    """A hypothesis about one effect: where it acts, and how large it is.

    Parameters
    ----------
    family : EffectFamily
        The kind of effect.
    place : str
        Where it acts, for people.
    mixing : ndarray, shape (m, k)
        The m sizes, in units of their prior, from the k coordinates; an effect that each run has anew has m sizes for
        each.
    shape : mapping
        Shape parameters (frequency, order, time constant).
    coordinates : ndarray, shape (k,)
        The sizes.
    log_prior : float
        Log prior probability of the effect at this place and shape.
    covariance : ndarray, shape (k, k)
        Of the coordinates.
    shape_std : mapping
        Standard deviations of the shape parameters.
    held : bool
        Whether a fit holds the shape as it is.
    """

    family: EffectFamily
    place: str
    mixing: NDArray[np.float64]
    shape: Mapping[str, float]
    coordinates: NDArray[np.float64]
    log_prior: float = 0.0
    covariance: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0)))
    shape_std: Mapping[str, float] = field(default_factory=dict)
    held: bool = False

    @property
    def name(self) -> str:
        """Contract name of the effect."""
        return str(self.family.name)

    @property
    def key(self) -> tuple[str, str]:
        """Effect and place, which identify the cause in a set."""
        return (self.name, self.place)

    @cached_property
    def free_shape(self) -> tuple[str, ...]:
        """Shape parameters that a fit may move."""
        if self.held:
            return ()
        whole: frozenset[str] = getattr(self.family, "whole", frozenset())
        return tuple(key for key in self.shape if key not in whole)

    @property
    def unknowns(self) -> int:
        """Number of coordinates and free shape parameters."""
        return len(self.coordinates) + len(self.free_shape)

    def at(self, coordinates: NDArray[np.float64], shape: Mapping[str, float] | None = None) -> Cause:
        """Return the cause with other coordinates and, where given, another shape."""
        return replace(self, coordinates=coordinates, shape=self.shape if shape is None else shape)

    def sizes(self, array: AccelerometerArray, run: int) -> NDArray[np.float64]:
        """Return the sizes in a run, in their units."""
        prior = np.array([size.prior_std for size in self.family.sizes(array)])
        values = (self.mixing @ self.coordinates).reshape(-1, len(prior))
        return np.asarray(values[run if len(values) > 1 else 0] * prior)

    def effect(self, array: AccelerometerArray, run: int) -> Effect:
        """Return the effect as it acts in a run."""
        return self.family.from_sizes(array, self.sizes(array, run), self.shape)

    def reach(self, array: AccelerometerArray) -> NDArray[np.bool_] | None:
        """Return which channels each coordinate changes, shape (k, c), or None where all may change."""
        each = self.family.reach(array)
        if each is None or len(each) != len(self.mixing):
            return None
        return np.asarray(np.abs(self.mixing.T) @ each > 0)

    def limits(self, array: AccelerometerArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the least and the largest coordinates that physics allows, each (k,)."""
        sizes = self.family.sizes(array)
        used = np.abs(self.mixing) > 0
        repeat = len(self.mixing) // len(sizes)
        signed = np.tile([size.positive for size in sizes], repeat)
        most = np.tile([size.most / size.prior_std for size in sizes], repeat)
        with np.errstate(divide="ignore"):
            high = np.min(most[:, None] / np.abs(self.mixing), axis=0)
        return np.where((used & signed[:, None]).any(axis=0), SMALLEST_POSITIVE, -high), high

    def at_limits(self, array: AccelerometerArray) -> list[str]:
        """Return the parameters that stand at the end of their range, from where the data may pull them on."""
        ends = [
            size.key
            for size, value in zip(self.family.sizes(array), self.sizes(array, 0), strict=True)
            if abs(value) >= _AT_END * size.most
        ]
        for key in self.free_shape:
            low, high = self._shape_range(key)
            if not low < _AT_END * self.shape[key] or not self.shape[key] < _AT_END * high:
                ends.append(key)
        return ends

    def positive(self, array: AccelerometerArray) -> NDArray[np.bool_]:
        """Return which coordinates physics allows one sign only, shape (k,)."""
        return self.limits(array)[0] > 0.0

    def moved(self, step: NDArray[np.float64], array: AccelerometerArray) -> Cause:
        """Return the cause after a step of its coordinates and of its free shape, within what physics allows."""
        low, high = self.limits(array)
        count = len(self.coordinates)
        shape = dict(self.shape)
        for key, by in zip(self.free_shape, step[count:], strict=True):
            shape[key] = self.shape_moved(key, float(by))
        return self.at(np.clip(self.coordinates + step[:count], low, high), shape)

    def apart(self, other: Cause) -> float:
        """Return how far the shapes of two causes are apart, in their natural coordinates."""
        steps = [
            self.shape[key] - other.shape[key] if key.endswith("_rad") else np.log(self.shape[key] / other.shape[key])
            for key in self.free_shape
        ]
        return float(np.linalg.norm(steps))

    def shape_moved(self, key: str, step: float) -> float:
        """Return a shape parameter after a step in its natural coordinate: log, or linear for angles."""
        if key.endswith("_rad"):
            return float(self.shape[key]) + step
        return float(np.clip(self.shape[key] * np.exp(step), *self._shape_range(key)))

    def _shape_range(self, key: str) -> tuple[float, float]:
        return getattr(self.family, "shape_limits", {}).get(key, (0.0, np.inf))  # type: ignore[no-any-return]


def effects_of(causes: Sequence[Cause], array: AccelerometerArray, run: int) -> list[Effect]:
    """Return the effects of a set of causes as they act in a run."""
    return [cause.effect(array, run) for cause in causes]


def mixing_of(pattern: Pattern, runs: int) -> NDArray[np.float64]:
    """Return the mixing of a pattern whose sizes are free in each run."""
    return np.asarray(block_diag(*[pattern.mixing] * runs))
