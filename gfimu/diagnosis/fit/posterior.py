"""`condition`: linearise a stretch about a point and integrate out its nuisance parameters.

Observations y, prediction f; residual r = y − f; columns A of some unknowns; J the derivative by the drive's
coefficients x, whose prior has precision P and energy xᵀPx. Slow noise is in the weight W (`slow_modes`). With

    H = JᵀWJ + P = LLᵀ,  V = L⁻¹JᵀWA,  u = L⁻¹(JᵀWr − Px),
    G = AᵀWA − VᵀV,      b = AᵀWr − Vᵀu,      objective = rᵀWr + xᵀPx − uᵀu,

everything after it is small algebra on G and b, whatever the length of the run. The posterior of the drive is
N(x + H⁻¹(JᵀWr − Px), H⁻¹).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack, solve_triangular
from scipy.linalg.blas import dsyrk

from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.terms.columns import Columns
from gfimu.diagnosis.terms.drive import Drive
from gfimu.diagnosis.terms.hand.drive import HandDrive
from gfimu.diagnosis.terms.hand.posterior import condition_hand
from gfimu.diagnosis.terms.jacobian import Jacobian, Reach, differentiate, measured_reach
from gfimu.diagnosis.terms.observed import Observed, observe
from gfimu.diagnosis.terms.slow_modes import SlowModes, WeighedModes
from gfimu.model.world_model import Effect, acts_back, memory_of

__all__ = ["Posterior", "condition", "energy", "posterior_of", "remembers_long"]

_RIDGE = 1e-12  # numerical: of the diagonal, where rounding leaves the normal equations not positive
_LONG_MEMORY = 0.5  # numerical: s of memory that the derivative follows only where it must
_MOST_INTERVALS = 100  # numerical: knot intervals of memory
_LEAST_SHARE = 1e-6  # numerical: of a channel's slow noise in a mode, below which the mode is left out


def energy(stretch: Stretch, drive: Any, effects: Sequence[Effect], levels: Any) -> float:
    """Return misfit and prior energy at a drive that is held; infinite where the simulation has no answer."""
    try:
        if isinstance(drive, HandDrive) and isinstance(stretch, BodyStretch):
            return condition_hand(stretch, drive, effects, levels).energy
        return observe(stretch, stretch.predict(effects, drive.spin), levels).misfit + drive.energy()
    except np.linalg.LinAlgError:
        return np.inf


@dataclass(frozen=True)
class Posterior:
    """A linearised stretch with its drive and slow noise integrated out.

    Parameters
    ----------
    observed : Observed
        Residuals, weights and modes.
    jacobian : Jacobian
        J.
    jacobian_modes : tuple of ndarray, each (m, K)
        J_cᵀQ_c.
    root : ndarray, shape (m, m)
        L.
    forward : ndarray, shape (m,)
        u.
    drive : Drive
        x and its prior.
    """

    observed: Observed
    jacobian: Jacobian
    jacobian_modes: tuple[NDArray[np.float64], ...]
    root: NDArray[np.float64]
    forward: NDArray[np.float64]
    drive: Drive

    @cached_property
    def energy(self) -> float:
        """rᵀWr + xᵀPx at the drive as it is."""
        return self.observed.misfit + self.drive.energy()

    @cached_property
    def objective(self) -> float:
        """The same with the drive at its best in a linear world."""
        return self.energy - float(self.forward @ self.forward)

    @cached_property
    def log_volume(self) -> float:
        """−½ log det H and half the log determinant of the prior: what the drive's freedom costs."""
        return self.drive.log_precision - float(np.log(self.root.diagonal()).sum())

    @cached_property
    def step(self) -> NDArray[np.float64]:
        """Step of the drive to its best, the unknowns of the columns held, shape (m,)."""
        return np.asarray(solve_triangular(self.root, self.forward, lower=True, trans=1, check_finite=False))

    @cached_property
    def covariance(self) -> NDArray[np.float64]:
        """H⁻¹, shape (m, m)."""
        inverse, _ = lapack.dpotri(self.root, lower=1)
        return np.asarray(np.tril(inverse) + np.tril(inverse, -1).T)

    def products(self, columns: Columns) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return G (P, P), b (P,) and V (m, P) of columns."""
        seen, count = self.observed, columns.count
        gram, score = seen.products(columns)
        cross = np.zeros((self.jacobian.size, count))
        for c, (at, part, weight) in enumerate(zip(columns.places, columns.parts, seen.weights, strict=True)):
            if len(at):
                damped = seen.modes.share[:, [c]] * seen.modes.of(part.T, c).T  # (K, p)
                cross[:, at] += weight * (self.jacobian.backward(c, part) - self.jacobian_modes[c] @ damped)
        across = solve_triangular(self.root, cross, lower=True, check_finite=False, overwrite_b=True)
        whole = gram.diagonal() * _RIDGE
        gram -= across.T @ across
        score -= across.T @ self.forward
        gone = gram.diagonal() <= whole  # what the drive takes whole leaves rounding errors
        gram[gone], gram[:, gone], score[gone] = 0.0, 0.0, 0.0
        return gram, score, across

    def response(self, across: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how the drive follows each unknown, shape (m, P), from V."""
        return -np.asarray(solve_triangular(self.root, across, lower=True, trans=1, check_finite=False))

    @cached_property
    def whitened(self) -> NDArray[np.float64]:
        """W(r − Jδ) with δ the drive's step, shape (n, c + 1): its product with any column is that column's score."""
        seen = self.observed
        rest = seen.residual - self.jacobian.times(self.step)
        return (rest - seen.modes.back(seen.modes.share * seen.modes.of_each(rest))) * seen.weights


def condition(
    stretch: Any,
    drive: Any,
    effects: Sequence[Effect],
    levels: Any,
    *,
    jacobian: Any = None,
    exact: bool = False,
) -> Any:
    """Linearise a stretch about a drive and effects, and integrate out drive and slow noise.

    Raises
    ------
    numpy.linalg.LinAlgError
        If data and prior do not determine a drive, as after a step to where the prediction overflows.
    """
    if isinstance(drive, HandDrive):
        return condition_hand(stretch, drive, effects, levels, jacobian)
    prediction = stretch.predict(effects, drive.spin)
    seen = observe(stretch, prediction, levels)
    if jacobian is None:
        jacobian = _jacobian(stretch, drive, effects, seen, exact=exact)
    return posterior_of(seen, jacobian, drive)


def posterior_of(seen: Observed, jacobian: Jacobian, drive: Drive) -> Posterior:
    """Integrate out drive and slow noise, the derivative being known."""
    weights, share = seen.weights, seen.modes.share
    information = drive.add_precision(jacobian.information(weights))
    modes = _modes_of(jacobian, seen.modes, seen.weight)
    rows = _slow_rows(jacobian, modes, share, weights, shared=not isinstance(seen.modes, WeighedModes))
    if rows.shape[1]:
        information = dsyrk(-1.0, rows, beta=1.0, c=information.T, lower=1, overwrite_c=1)
    root = _cholesky(np.asfortranarray(information))
    whitened = (seen.residual - seen.modes.back(share * seen.slow)) * weights
    right = jacobian.correlate((jacobian.loading @ whitened.T)[:, :, None])[:, 0] + drive.pull()
    forward = solve_triangular(root, right, lower=True, check_finite=False)
    return Posterior(seen, jacobian, modes, root, np.asarray(forward), drive)


def _cholesky(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    diagonal = matrix.diagonal().copy()
    root, failed = lapack.dpotrf(matrix, lower=1, clean=1)
    if failed:
        matrix[np.diag_indices(len(matrix))] = diagonal * (1.0 + 1e-10)
        root, failed = lapack.dpotrf(matrix, lower=1, clean=1)
    if failed:
        raise np.linalg.LinAlgError("the normal equations of the drive are not positive definite")
    return np.asarray(root)


def remembers_long(effects: Sequence[Effect]) -> bool:
    """Whether an effect remembers the drive for so long that the derivative leaves it out unless it is exact."""
    return any(memory_of(effect) > _LONG_MEMORY and acts_back(effect) for effect in effects)


def _jacobian(stretch: Stretch, drive: Drive, effects: Sequence[Effect], seen: Observed, *, exact: bool) -> Jacobian:
    """Differentiate by the drive; without what remembers it for long, unless that acts back and ``exact`` is asked."""
    present = [effect for effect in effects if memory_of(effect) <= _LONG_MEMORY or (exact and acts_back(effect))]
    longest = max((memory_of(effect) for effect in (*stretch.model.effects, *present)), default=0.0)
    base = seen.prediction if len(present) == len(effects) else stretch.predict(present, drive.spin)

    def predict(coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
        return stretch.predict(present, drive.spline.spin(coefficients))

    rows, chips = stretch.counted, np.append(stretch.model.array.chip_of_channel, -1)

    def counted(coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
        return predict(coefficients)[rows]

    now, t = drive.coefficients, stretch.run.t
    times = stretch.counted_times(present)[:, chips]
    reach = measured_reach(counted, drive.spline, now, base[rows], t[rows], times)
    if exact and longest > 0.0:
        remembered = min(int(longest / drive.spline.finest), _MOST_INTERVALS)
        reach = Reach(max(reach.before, remembered), reach.after)
    return differentiate(predict, drive.spline, now, base, seen.weight, t, reach)


def _slow_rows(
    jacobian: Jacobian,
    modes: tuple[NDArray[np.float64], ...],
    share: NDArray[np.float64],
    weights: NDArray[np.float64],
    *,
    shared: bool,
) -> NDArray[np.float64]:
    """Return U (m, k): slow noise takes UUᵀ of JᵀWJ.

    Where all observations share the modes, as many columns as there are functions of time through which they see the
    drive suffice for each mode, instead of one for each observation.
    """
    if not shared:
        parts = [mine * np.sqrt(weights[c] * share[:, c]) for c, mine in enumerate(modes)]
        rows = np.concatenate(parts, axis=1)
        return rows[:, np.einsum("mk,mk->k", rows, rows) > 0.0]
    loading = jacobian.loading
    # J_r Qᵀ from J_c Q: the loading has orthonormal rows.
    each = np.tensordot(loading, np.stack(modes), axes=1)  # (R, m, K)
    power, turn = np.linalg.eigh(np.einsum("rc,kc,sc->krs", loading * weights, share, loading))  # (K, R), (K, R, R)
    kept = power > _LEAST_SHARE * power.max(initial=1e-300)
    roots = turn * np.sqrt(np.maximum(power, 0.0))[:, None, :]
    rows = np.einsum("krq,rmk->mkq", roots, each, optimize=True)
    return np.ascontiguousarray(rows.reshape(len(rows), -1)[:, kept.ravel()])


def _modes_of(jacobian: Jacobian, modes: SlowModes, weight: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Return J_cᵀQ_c of each observation, each (m, K)."""
    if isinstance(modes, WeighedModes):
        return tuple(
            np.tensordot(jacobian.loading[:, c], jacobian.transposed(modes.columns(c)), axes=1)
            for c in range(jacobian.loading.shape[1])
        )
    shared = jacobian.transposed(modes.cosines)  # (R, m, K)
    return tuple(np.tensordot(row, shared, axes=1) for row in jacobian.loading.T)
