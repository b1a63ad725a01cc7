"""First-order budget of an array's tolerances: standard deviations of the errors, shares per cause, what halving gains.

Every parameter of every cause is independent, so variances add: the error of a quantity is a linear map of the
parameters, its mean square the sum of the squares of the map's columns, and the share of a cause that of its columns.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.declared import Declared, figure
from gfimu.base.short_repr import short_repr
from gfimu.budget.tolerances.calibrated import Poses, Remaining, remaining
from gfimu.budget.tolerances.known_motion import KnownMotion
from gfimu.budget.tolerances.propagation import ErrorMaps, error_maps
from gfimu.budget.tolerances.tolerances import CAUSES, SHAPES, Tolerances

__all__ = ["QUANTITIES", "QuantityBudget", "ToleranceBudget", "tolerance_budget"]

Floats = NDArray[np.float64]

QUANTITIES: Mapping[str, tuple[str, str]] = {
    "alpha": ("rad/s²", "α, rms over the run"),
    "omega": ("rad/s", "ω by integration of α, at the end"),
    "omega_null_space": ("rad/s", "ω by the null space of each sample, rms while turning"),
    "position": ("m", "position, at the end"),
}
"""Errors that are budgeted: unit and meaning. Each is the norm of three components."""

_END = {"omega": slice(0, 3), "attitude": slice(3, 6), "position": slice(6, 9)}
_HALVED = 0.75  # of a variance goes with half a tolerance
_A_TENTH_MORE = 1.1  # of an error: what a designer may give away for a cheaper tolerance


@dataclass(frozen=True)
class QuantityBudget(Declared):
    """Error of one quantity (`QUANTITIES`), to first order.

    Parameters
    ----------
    factors : mapping of str to ndarray, shape (r, m)
        By cause, a matrix F whose |F x| is the error for parameters x of unit variance; noise is not among them.
    noise_covariance : ndarray, shape (3, 3)
        What white noise adds: covariance of the components, its mean where the error is one over many samples.
    samples : int
        Number of samples over whose mean square the error is the root; 0 of an error at the end.
    """

    name: str
    unit: Annotated[str, figure("Its unit.")]
    meaning: Annotated[str, figure("What it is.", before="unit")]
    by_cause: Annotated[
        Mapping[str, float], figure("Its parts by cause, each alone, rms over units.", key="rms_by_cause")
    ]
    factors: Mapping[str, Floats]
    noise_covariance: Floats
    samples: int

    __repr__ = short_repr

    @property
    def rms(self) -> Annotated[float, figure("Error by first order, rms.", before="by_cause")]:
        """Root mean square of the norm of the error over units."""
        return math.hypot(*self.by_cause.values())

    @property
    def shares(self) -> Annotated[dict[str, float], figure("Share of each cause in the variance.", key="share")]:
        """Share of each cause in the variance; they sum to 1. Without any error all are 0."""
        total = self.rms**2
        return {cause: value**2 / total if total else 0.0 for cause, value in self.by_cause.items()}

    @property
    def halving(
        self,
    ) -> Annotated[
        dict[str, float],
        figure("Relative reduction of the error when a cause is halved.", key="reduction_by_halving"),
    ]:
        """By how much the error shrinks, relatively, if the tolerance of one cause is halved."""
        return {cause: 1.0 - math.sqrt(1.0 - _HALVED * share) for cause, share in self.shares.items()}

    @property
    def allowance(
        self,
    ) -> Annotated[
        dict[str, float],
        figure("Factor on a cause that makes the error a tenth larger.", key="factor_for_a_tenth_more"),
    ]:
        """By which factor the tolerance of one cause may grow before the error grows by a tenth; at least 1."""
        return {
            cause: math.sqrt(1.0 + (_A_TENTH_MORE**2 - 1.0) / share) if share else math.inf
            for cause, share in self.shares.items()
        }

    def draw(self, count: int, shape: str, rng: np.random.Generator) -> Floats:
        """Draw the norm of the error of ``count`` units by the first-order map, shape (count,).

        Parameters
        ----------
        count : int
            Number of units.
        shape : {"uniform", "normal"}
            Distribution of placement and angles inside their limits; all other parameters are normal.
        rng : numpy.random.Generator
            Random number generator.
        """
        rows = max((factor.shape[0] for factor in self.factors.values()), default=3)
        total = np.zeros((count, rows))
        for cause, factor in self.factors.items():
            size = (count, factor.shape[1])
            if shape == "uniform" and cause in {"placement", "angles"}:
                unit_draws = rng.uniform(-SHAPES["uniform"], SHAPES["uniform"], size)  # of unit variance
            else:
                unit_draws = rng.standard_normal(size)
            total += unit_draws @ factor.T
        if self.samples:
            return np.asarray(np.sqrt(self._with_mean_noise(np.sum(total**2, axis=1), rng)))
        total[:, :3] += rng.multivariate_normal(np.zeros(3), self.noise_covariance, count, check_valid="ignore")
        return np.asarray(np.linalg.norm(total, axis=1))

    def _with_mean_noise(self, squares: Floats, rng: np.random.Generator) -> Floats:
        """Add the mean square of noise over the samples, and its product with the error that is there, both normal."""
        size = float(np.trace(self.noise_covariance))
        variance = 2.0 * np.sum(self.noise_covariance**2) + 4.0 * squares * size / 3.0
        return np.maximum(squares + size + np.sqrt(variance / self.samples) * rng.standard_normal(len(squares)), 0.0)


@dataclass(frozen=True)
class ToleranceBudget:
    """Errors of an array in a motion after one calibration, to first order.

    Parameters
    ----------
    quantities : mapping of str to QuantityBudget
        By name; without the rate from the null space where that does not determine it.
    attitude_rad : float
        Attitude error at the end, root mean square per axis, rad: how far first order can be trusted.
    """

    quantities: Mapping[str, QuantityBudget]
    attitude_rad: float

    __repr__ = short_repr


def tolerance_budget(
    array: AccelerometerArray,
    motion: KnownMotion,
    tolerances: Tolerances,
    *,
    calibration: str,
    poses: Poses,
    maps: ErrorMaps | None = None,
) -> ToleranceBudget:
    """Budget the errors of α, ω and position of an array whose chips and machining have tolerances.

    Parameters
    ----------
    array : AccelerometerArray
        The drawing, which the estimate uses.
    motion : KnownMotion
        The motion.
    tolerances : Tolerances
        Limits and standard deviations.
    calibration : str
        A key of `gfimu.budget.tolerances.calibrated.CALIBRATIONS`.
    poses : Poses
        Poses of the calibration from poses.
    maps : ErrorMaps, optional
        ``error_maps(array, motion)`` where it is at hand.

    Raises
    ------
    InputError
        If the array or the motion do not allow the calibration.
    GeometryError
        If the array can't see all six motions.
    """
    linear = error_maps(array, motion) if maps is None else maps
    left = remaining(calibration, array, motion, tolerances, poses)
    noise = _NoiseParts(linear, motion, tolerances.noise, left.rest)
    every = np.concatenate([np.zeros((len(motion), array.n_channels, 0)), *left.signatures.values()], axis=2)
    end, noise_end = np.einsum("nrc,ncm->rm", linear.end, every), noise.at_end()  # (9, m), (9, 9)
    quantities, samples = {}, {"alpha": len(motion), "omega_null_space": int(motion.turning.sum())}
    for name in QUANTITIES:
        if name == "alpha":
            whole, spread = _root(_alpha_gram(linear, motion, every)), noise.of_alpha()
        elif name == "omega_null_space":
            if linear.rate is None:
                continue
            whole, spread = _root(_mean_products(linear.rate @ every[motion.turning])), noise.of_rate()
        else:
            whole, spread = end[_END[name]], noise_end[_END[name], _END[name]]
        quantities[name] = _quantity(name, _by_cause(whole, left), spread, samples.get(name, 0))
    turned = np.sum(end[_END["attitude"]] ** 2) + np.trace(noise_end[_END["attitude"], _END["attitude"]])
    return ToleranceBudget(quantities, math.sqrt(float(turned) / 3.0))


def _by_cause(whole: Floats, left: Remaining) -> dict[str, Floats]:
    """Split the columns of a matrix of all parameters by cause."""
    ends = np.cumsum([part.shape[2] for part in left.signatures.values()])
    return dict(zip(left.signatures, np.split(whole, ends[:-1], axis=1), strict=True)) if len(ends) else {}


def _quantity(name: str, factors: Mapping[str, Floats], noise: Floats, samples: int) -> QuantityBudget:
    unit, meaning = QUANTITIES[name]
    sizes = {cause: math.sqrt(float(np.sum(factor**2))) for cause, factor in factors.items()}
    sizes["noise"] = math.sqrt(float(np.trace(noise)))
    ordered = {cause: sizes[cause] for cause in CAUSES if sizes.get(cause, 0.0) > 0.0}
    return QuantityBudget(name, unit, meaning, ordered, factors, noise, samples)


def _alpha_gram(maps: ErrorMaps, motion: KnownMotion, signature: Floats) -> Floats:
    """Return the mean over the run of the products of the errors of α by every two parameters, (m, m)."""
    errors = maps.alpha @ signature  # (n, 3, m)
    if maps.feedback.any():
        errors = errors - maps.feedback @ integrated_with_feedback(errors, maps.feedback, motion.step)
    return _mean_products(errors)


def _mean_products(errors: Floats) -> Floats:
    rows = errors.reshape(3 * len(errors), errors.shape[2])  # (3 n, m)
    return rows.T @ rows / len(errors)


def _root(gram: Floats) -> Floats:
    """Return F with FᵀF = ``gram``, (m, m)."""
    values, vectors = np.linalg.eigh(gram)
    return np.asarray(np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T)


def integrated_with_feedback(forcing: Floats, feedback: Floats, step: float) -> Floats:
    """Integrate δω̇ = u − Λ_α S δω from zero by the trapezoid, for m parameters at once, shape (n, 3, m)."""
    found = np.zeros_like(forcing)
    eye, half = np.eye(3), 0.5 * step
    for index in range(len(forcing) - 1):
        right = (eye - half * feedback[index]) @ found[index] + half * (forcing[index] + forcing[index + 1])
        found[index + 1] = np.linalg.solve(eye + half * feedback[index + 1], right)
    return found


@dataclass(frozen=True)
class _NoiseParts:
    """Covariances by white noise, its mean over the rest taken off where biases are read there."""

    maps: ErrorMaps
    motion: KnownMotion
    noise: Floats
    rest: int

    def at_end(self) -> Floats:
        """Of [δω; φ; δr] at the end, (9, 9)."""
        weights = self.maps.end.copy()
        if self.rest:
            weights[: self.rest] -= weights.sum(axis=0) / self.rest
        scaled = (weights * self.noise).transpose(1, 0, 2).reshape(9, -1)
        return np.asarray(scaled @ scaled.T)

    def of_alpha(self) -> Floats:
        """Mean over the run, (3, 3)."""
        scaled = self.maps.alpha * self.noise
        unit = scaled @ scaled.T
        total = unit * self._factor(np.ones(len(self.motion), dtype=bool))
        if self.maps.feedback.any():
            total = total + self._fed_back(unit)
        return np.asarray(total)

    def of_rate(self) -> Floats:
        """Mean over the samples that turn, (3, 3)."""
        assert self.maps.rate is not None
        scaled = self.maps.rate * self.noise
        mean = np.einsum("kac,kbc->ab", scaled, scaled) / len(scaled)
        return np.asarray(mean * self._factor(self.motion.turning))

    def _factor(self, samples: NDArray[np.bool_]) -> float:
        """Variance of noise less its mean over the rest, mean over some samples, relative to that of noise."""
        if not self.rest:
            return 1.0
        inside = np.arange(len(samples)) < self.rest
        return float(np.mean(np.where(inside, 1.0 - 1.0 / self.rest, 1.0 + 1.0 / self.rest)[samples]))

    def _fed_back(self, unit: Floats) -> Floats:
        """Mean over the run of Λ_α S P Sᵀ Λ_αᵀ, with P the covariance of the integrated rate, (3, 3)."""
        step, feedback = self.motion.step, self.maps.feedback
        constant = unit / self.rest if self.rest else np.zeros((3, 3))
        covariance, total = np.zeros((3, 3)), np.zeros((3, 3))
        response = np.zeros((3, 3))  # of the rate to a constant error of α: that of the biases read at rest
        for index in range(len(feedback)):
            whole = covariance + response @ constant @ response.T
            total += feedback[index] @ whole @ feedback[index].T
            if index >= self.rest:  # the mean over the rest takes the integral over it to zero
                flow = np.eye(3) - step * feedback[index]
                covariance = flow @ covariance @ flow.T + step**2 * unit
                response = flow @ response + step * np.eye(3)
        return total / len(feedback)
