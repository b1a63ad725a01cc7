"""Causes: an effect at a place, with its fitted sizes and shape; and the sets of them that diagnosis compares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from gfimu.geometry.array import AccelerometerArray
from gfimu.world_model import Effect, EffectFamily, Pattern

WHOLE_NUMBERS = frozenset({"order", "moving_arms"})
"""Shape parameters that are whole numbers, picked from a grid and not refined."""
LEVEL_ERROR = 0.2
"""What a level of a reading is found to at best, in units of its white noise: half-widths of ten narrow plays were off
by 0.2, rms."""

__all__ = ["LEVEL_ERROR", "WHOLE_NUMBERS", "Cause", "Signature", "effects_of_run", "wired"]


@dataclass(frozen=True)
class Signature:
    """One effect in one shape: the columns that its sizes occupy in the normal equations.

    Parameters
    ----------
    family : EffectFamily
        The kind of effect.
    shape : mapping
        Shape parameters (frequency, order, time constant).
    columns : ndarray, shape (m,) or (runs · m,)
        Column numbers; per-run effects have one block per run.
    penalty : float
        Log of the number of alternatives that the shape was picked from.
    """

    family: EffectFamily
    shape: Mapping[str, float]
    columns: NDArray[np.intp]
    penalty: float = 0.0


@dataclass(frozen=True)
class Cause:
    """A hypothesis about one effect: where it acts, and how large it is.

    Parameters
    ----------
    family : EffectFamily
        The kind of effect.
    pattern : str
        Place or structure, for people.
    mixing : ndarray, shape (m, k)
        The m sizes (all runs) in units of their prior from the k coordinates.
    shape : mapping
        Shape parameters.
    coordinates : ndarray, shape (k,)
        Fitted coordinates.
    covariance : ndarray, shape (k, k)
        Their covariance.
    shape_std : mapping
        Standard deviations of the shape parameters.
    log_prior : float
        Log prior probability of the effect at this place.
    frozen : bool
        Whether the shape is held.
    """

    family: EffectFamily
    pattern: str
    mixing: NDArray[np.float64]
    shape: Mapping[str, float]
    log_prior: float
    coordinates: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    covariance: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0)))
    shape_std: Mapping[str, float] = field(default_factory=dict)
    frozen: bool = False

    @property
    def name(self) -> str:
        """Contract name of the effect."""
        return str(self.family.name)

    @property
    def key(self) -> tuple[str, str]:
        """Effect and place, which identify a hypothesis."""
        return (self.name, self.pattern)

    @property
    def free_shape(self) -> dict[str, float]:
        """Shape parameters that are refined: all but whole numbers, none when frozen."""
        if self.frozen:
            return {}
        return {key: value for key, value in self.shape.items() if key not in WHOLE_NUMBERS}

    @property
    def power(self) -> float:
        """Squared distance from nothing in standard deviations."""
        return float(self.coordinates @ np.linalg.pinv(self.covariance) @ self.coordinates)

    @property
    def levels(self) -> dict[str, float]:
        """Shape parameters that are levels of a reading at which something happens, m/s²."""
        return {key: value for key, value in self.shape.items() if key.endswith("_m_s2")}

    def inexactness(self, noise: float) -> float:
        """Return the share of what the cause explains that it may leave, given the white noise of a reading, m/s².

        What happens at a level is found only as well as the reading that gets there is estimated.
        """
        levels = np.array(list(self.levels.values()))
        return self.family.inexactness + float(np.sum((LEVEL_ERROR * noise / levels) ** 2))

    def at(self, coordinates: NDArray[np.float64], shape: Mapping[str, float] | None = None) -> Cause:
        """Return the cause with other coordinates and, where given, another shape."""
        return replace(self, coordinates=coordinates, shape=self.shape if shape is None else shape)

    def sizes(self, array: AccelerometerArray, run: int) -> NDArray[np.float64]:
        """Return the sizes in a run in their units."""
        prior = np.array([size.prior_std for size in self.family.sizes(array)])
        values = (self.mixing @ self.coordinates).reshape(-1, len(prior))
        return np.asarray(values[run if len(values) > 1 else 0] * prior)

    def effect(self, array: AccelerometerArray, run: int = 0) -> Effect:
        """Return the effect as it acts in a run."""
        return self.family.from_sizes(array, self.sizes(array, run), self.shape)

    def reach(self, array: AccelerometerArray) -> NDArray[np.bool_] | None:
        """Return which channels each coordinate changes, shape (k, c), or None where all may change."""
        each = self.family.reach(array)
        if each is None or len(each) != len(self.mixing):
            return None
        return np.asarray(np.abs(self.mixing.T) @ each > 0)

    def positive(self, array: AccelerometerArray) -> NDArray[np.bool_]:
        """Return which coordinates physics allows one sign only, shape (k,)."""
        sign = np.array([size.positive for size in self.family.sizes(array)])
        rows = np.tile(sign, len(self.mixing) // len(sign))
        return np.asarray((np.abs(self.mixing[rows]) > 0).any(axis=0))

    def most(self, array: AccelerometerArray) -> NDArray[np.float64]:
        """Return the largest coordinates that physics allows, shape (k,); infinite where it sets no limit."""
        # Other simulations need not say so.
        largest = np.array([getattr(size, "most", np.inf) / size.prior_std for size in self.family.sizes(array)])
        rows = np.tile(largest, len(self.mixing) // len(largest))[:, None]
        with np.errstate(divide="ignore"):
            return np.asarray(np.min(rows / np.abs(self.mixing), axis=0))


def effects_of_run(causes: Sequence[Cause], array: AccelerometerArray, run: int) -> list[Effect]:
    """Return the effects of a set of causes as they act in one run."""
    return [cause.effect(array, run) for cause in causes]


def wired(
    reach: NDArray[np.bool_] | None, effects: Sequence[Effect], array: AccelerometerArray
) -> NDArray[np.bool_] | None:
    """Return which channels of the file sizes change, shape (m, c), given those of the sensors they change.

    Exchanged wires carry what changes a sensor to the other channel.
    """
    if reach is None:
        return None
    order = np.arange(array.n_channels)
    for effect in effects:
        if effect.name == "axis_swap":
            places = [array.index(name) for name in effect.parameters["channels"]]
            order[[*places[::2], *places[1::2]]] = order[[*places[1::2], *places[::2]]]
    return np.asarray(reach[:, order])


def per_run_mixing(pattern: Pattern, runs: int) -> NDArray[np.float64]:
    """Return the mixing of a pattern whose sizes are free in each run."""
    return np.asarray(block_diag(*[pattern.mixing] * runs))
