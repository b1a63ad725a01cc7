"""How a prediction compares with a stretch: residuals, weights, and the modes of slow noise."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.data.cosine_basis import NoiseLevels
from gfimu.diagnosis.data.rounding import NO_STEPS, Steps
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.terms.columns import Columns
from gfimu.diagnosis.terms.slow_modes import SlowModes, WeighedModes

__all__ = ["Observed", "observe"]

_ROUNDS, _STEP = 10, 0.05  # numerical: to the most probable random walk over coarse steps; of the white noise


@dataclass(frozen=True)
class Observed:
    """Residuals as least squares take them: their weights by sample, and the modes of slow noise.

    Parameters
    ----------
    prediction : ndarray, shape (n, c + 1)
        f.
    residual : ndarray, shape (n, c + 1)
        r, weighed; zero where an observation does not count.
    weight : ndarray, shape (n, c + 1)
        Share of its amplitude that each sample counts: 1, 0, or in between for coarse readings (`rounding`).
    lacking : float
        What the squares lack of −2 log likelihood, where readings are coarse.
    modes : SlowModes
        Modes of slow noise.
    levels : NoiseLevels
        The noise.
    steps : Steps
        Steps that observations are rounded to, where these are coarse.
    """

    prediction: NDArray[np.float64]
    residual: NDArray[np.float64]
    weight: NDArray[np.float64]
    lacking: float
    modes: SlowModes
    levels: NoiseLevels
    steps: Steps = NO_STEPS

    @cached_property
    def weights(self) -> NDArray[np.float64]:
        """One over the white variance of each observation, shape (c + 1,)."""
        return 1.0 / self.levels.white**2

    @cached_property
    def slow(self) -> NDArray[np.float64]:
        """The residual in the modes, shape (K, c + 1)."""
        return self.modes.of_each(self.residual)

    @cached_property
    def misfit(self) -> float:
        """rᵀWr."""
        power = np.sum(self.residual**2, axis=0) - self.modes.explained(self.residual)
        return self.lacking + float(self.weights @ power)

    @cached_property
    def log_noise(self) -> float:
        """−½ log det of the noise covariance; of coarse observations the misfit holds it."""
        total = 0.0
        if not self.steps.channels:
            total -= 0.5 * self.modes.log_determinant
        if not self.steps.reference:
            total -= float((self.weight[:, -1] > 0.0).sum() * np.log(self.levels.white[-1]))
        return total

    def products(self, columns: Columns) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return AᵀWA (P, P) and AᵀWr (P,) of columns, the drive held."""
        gram, score = np.zeros((columns.count, columns.count)), np.zeros(columns.count)
        for c, (at, part, weight) in enumerate(zip(columns.places, columns.parts, self.weights, strict=True)):
            if len(at):
                slow = self.modes.of(part.T, c).T  # (K, p)
                damped = self.modes.share[:, [c]] * slow
                gram[np.ix_(at, at)] += weight * (part.T @ part - slow.T @ damped)
                score[at] += weight * (part.T @ self.residual[:, c] - damped.T @ self.slow[:, c])
        return gram, score


def observe(stretch: Stretch, prediction: NDArray[np.float64], levels: NoiseLevels) -> Observed:
    """Compare a prediction (n, c + 1) with a stretch under given noise."""
    residual = np.where(stretch.mask, stretch.measured - prediction, 0.0)
    steps, basis = stretch.steps, stretch.basis
    if not steps.coarse:
        return Observed(prediction, residual, stretch.mask.astype(float), 0.0, SlowModes(basis, levels), levels)
    working, weight, lacking = steps.weigh(residual, levels.white, stretch.mask)
    if not steps.channels:
        return Observed(prediction, working, weight, lacking, SlowModes(basis, levels), levels, steps)
    modes = WeighedModes(basis, levels, weight)
    # A random walk over coarse steps moves the edges at which readings are informative: they are expanded about the
    # most probable walk (penalised quasi-likelihood, Breslow and Clayton 1993). Bias instability keeps within a step.
    about: NDArray[np.float64] | float = 0.0
    for _ in range(_ROUNDS if levels.walk > 0.0 else 0):
        slow = modes.slow_noise(working)
        if np.abs((slow - about) / levels.white).max() < _STEP:
            break
        about = slow
        working, weight, lacking = steps.weigh(residual - slow * stretch.mask, levels.white, stretch.mask)
        working = working + weight * slow
        modes = WeighedModes(basis, levels, weight)
    # Laplace: the log determinant of what is known of slow noise goes with the misfit.
    return Observed(prediction, working, weight, lacking + modes.log_narrowing, modes, levels, steps)
