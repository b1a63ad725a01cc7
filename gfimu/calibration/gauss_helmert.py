"""Combined (Gauss–Helmert) adjustment: conditions that join parameters and noisy observations.

f(x, l + v) = 0 is linearised in the parameters x and in the observations, A dx + B v + w = 0, and iterated while the
observation corrections v of least weighted square are found along the way (Persian calibration paper, figure 6). The
linearisation point of the observations is moved with them (L. Lenzmann and E. Lenzmann, "Strenge Auswertung des
nichtlinearen Gauß-Helmert-Modells", AVN 111(2):68-73, 2004): keeping it at the raw observations gives another,
biased answer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.base.errors import InputError

__all__ = ["Adjustment", "Condition", "gauss_helmert"]

Floats = NDArray[np.float64]

Condition = Callable[[Floats, Floats], tuple[Floats, Floats, Floats]]
"""f(x, l): parameters (u,) and observations (n, d) to the misclosures (n, r), A (n, r, u) and B (n, r, d)."""

_RANK_TOLERANCE = 1e-9
_NORMAL_LIMIT = 1e-8


@dataclass(frozen=True)
class Adjustment:
    """Outcome of a combined adjustment.

    Parameters
    ----------
    parameters : ndarray, shape (u,)
        Adjusted parameters.
    cofactor : ndarray, shape (u, u)
        Covariance of the parameters for the given covariance of the observations (variance factor one).
    corrections : ndarray, shape (n, d)
        Corrections v to the observations.
    variance_factor : float
        vᵀ P v / redundancy; NaN without redundancy.
    redundancy : int
        Conditions and priors minus determinable parameters.
    null_space : ndarray, shape (u, k)
        Orthonormal directions of the parameters that the conditions do not determine.
    iterations : int
        Linearisations done.
    """

    parameters: Floats
    cofactor: Floats
    corrections: Floats
    variance_factor: float
    redundancy: int
    null_space: Floats
    iterations: int

    @property
    def covariance(self) -> Floats:
        """Covariance of the parameters scaled by the variance factor, shape (u, u)."""
        return self.cofactor * self.variance_factor


def gauss_helmert(
    condition: Condition,
    parameters: ArrayLike,
    observations: ArrayLike,
    covariance: ArrayLike,
    *,
    basis: ArrayLike | None = None,
    prior_std: ArrayLike | None = None,
    minimum_norm: bool = False,
    move_observations: bool = True,
    tolerance: float = 1e-10,
    max_iterations: int = 50,
) -> Adjustment:
    """Adjust parameters and observations so that the conditions hold.

    Parameters
    ----------
    condition : callable
        f(x, l) with its two Jacobians; observations come in n independent groups of d with r conditions each.
    parameters : array_like, shape (u,)
        Starting values.
    observations : array_like, shape (n, d)
        Observations l.
    covariance : array_like, shape (d, d) or (n, d, d)
        Covariance of each group.
    basis : array_like, shape (u, m), optional
        Columns that span the parameter changes allowed; a linear constraint is the null space of its rows.
    prior_std : array_like, shape (u,), optional
        Standard deviation of each parameter about zero before the observations; infinite where nothing is known.
    minimum_norm : bool
        With undetermined directions, take the step of least norm instead of refusing.
    move_observations : bool
        Linearise at the corrected observations; False keeps the raw ones, which is weighted least squares on f.
    tolerance : float
        Stop when no parameter changes by more than this share of its standard deviation or of its size.
    max_iterations : int
        Refuse after this many linearisations.

    Raises
    ------
    InputError
        If the conditions leave parameters undetermined and ``minimum_norm`` is not set, or the iteration does not
        settle.
    """
    x = np.array(parameters, dtype=float)
    raw = np.asarray(observations, dtype=float)  # (n, d)
    q = np.asarray(covariance, dtype=float)
    span = None if basis is None else np.asarray(basis, dtype=float)
    prior = _prior_rows(prior_std, len(x))  # (m, u)
    v: Floats | None = None
    from_x, from_v = x, v  # where the last step began
    for iteration in range(1, max_iterations + 1):
        try:
            with np.errstate(all="ignore"):
                f, a, b = condition(x, raw if v is None else raw + v)  # (n, r), (n, r, u), (n, r, d)
                w = f if v is None else f - np.einsum("nrd,nd->nr", b, v)
                bq = _times_covariance(b, q)  # (n, r, d)
                root = _whitening(bq, b)  # (B Q Bᵀ)⁻¹ = Lᵀ L, (n, r, r)
                design = np.concatenate([_whitened(root, a).reshape(-1, len(x)), prior])
                if span is not None:
                    design = design @ span
                closure = np.concatenate([_whitened(root, w[..., None]).ravel(), prior @ x])
                step, cofactor, null = _solve(design, closure, minimum_norm)
        except np.linalg.LinAlgError:  # the step led to where the conditions have no solution: half of it
            if x is from_x or not np.isfinite(x).all():
                break
            x, v = 0.5 * (from_x + x), v if v is None or from_v is None else 0.5 * (from_v + v)
            continue
        from_x, from_v = x, v
        dx = step if span is None else span @ step
        x = x + dx
        full = cofactor if span is None else span @ cofactor @ span.T
        std = np.sqrt(np.diag(full))
        settled = bool(np.all(np.abs(dx) <= np.maximum(tolerance * std, 1e-14 * np.abs(x))))
        last = settled or (not move_observations and iteration > 1 and bool(np.all(np.abs(dx) <= 1e-9 * std)))
        if move_observations or last:
            rest = _whitened(root, (w + a @ dx)[..., None])  # whitened A dx + w, (n, r, 1)
            new_v = -np.einsum("nrd,nr->nd", bq, _whitened(root.swapaxes(1, 2), rest)[..., 0])
            if move_observations:
                noise = np.sqrt(np.einsum("...dd->...d", q))
                moved = np.abs(new_v if v is None else new_v - v)
                last = settled and bool(np.all(moved <= 1e3 * tolerance * noise))
                v = new_v
        if last:
            redundancy = len(closure) - (design.shape[-1] - null.shape[1])
            square = float(np.sum(rest**2)) + float(np.sum((prior @ x) ** 2))
            factor = square / redundancy if redundancy > 0 else np.nan
            directions = np.linalg.qr(null if span is None else span @ null)[0]
            return Adjustment(x, full, new_v, factor, redundancy, directions, iteration)
    raise InputError(
        f"the adjustment did not settle in {max_iterations} iterations; the starting values are too far off, "
        "or some observations do not belong: check the poses and the gravity"
    )


def _prior_rows(prior_std: ArrayLike | None, count: int) -> Floats:
    """Return a row 1 / std for every parameter with a prior, shape (m, u)."""
    if prior_std is None:
        return np.zeros((0, count))
    std = np.asarray(prior_std, dtype=float)
    return np.asarray(np.eye(count)[np.isfinite(std)] / std[np.isfinite(std), None], dtype=np.float64)


def _times_covariance(b: Floats, q: Floats) -> Floats:
    """Return B Q, shape (n, r, d), for a covariance common to all groups or one of each."""
    if q.ndim == 2:
        return np.asarray((b.reshape(-1, b.shape[2]) @ q).reshape(b.shape), dtype=np.float64)
    return b @ q


def _whitening(bq: Floats, b: Floats) -> Floats:
    """Inverse of the Cholesky factor of B Q Bᵀ, shape (n, r, r)."""
    if b.shape[1] == 1:
        return np.asarray(1.0 / np.sqrt(np.einsum("nrd,nrd->n", bq, b)), dtype=np.float64)[:, None, None]
    return np.asarray(np.linalg.inv(np.linalg.cholesky(bq @ b.swapaxes(1, 2))), dtype=np.float64)


def _whitened(root: Floats, matrix: Floats) -> Floats:
    """Multiply each group's matrix by its root, which is a number where a group has one condition."""
    return root * matrix if root.shape[1] == 1 else root @ matrix


def _solve(design: Floats, closure: Floats, minimum_norm: bool) -> tuple[Floats, Floats, Floats]:
    """Least-squares step −(design)⁺ closure, its cofactor matrix and the undetermined directions."""
    if not (np.isfinite(design).all() and np.isfinite(closure).all()):
        raise np.linalg.LinAlgError("the conditions are not finite")
    u = design.shape[1]
    scale = np.linalg.norm(design, axis=0)
    scale[scale == 0.0] = 1.0
    if minimum_norm:  # one common scale: the norm that is least is that of the parameters themselves
        scale[:] = scale.max()
    scaled = design / scale
    if not minimum_norm:
        # Normal equations where they keep enough digits: the iteration corrects what they lose in the step.
        normal = scaled.T @ scaled
        values, vectors = np.linalg.eigh(normal)
        if values[0] > _NORMAL_LIMIT * values[-1]:
            root = vectors / np.sqrt(values) / scale[:, None]
            cofactor = root @ root.T
            return -cofactor @ (design.T @ closure), cofactor, np.empty((u, 0))
    triangle = np.zeros((u + 1, u + 1))
    reduced = np.linalg.qr(np.column_stack([scaled, closure]), mode="r")
    triangle[: len(reduced)] = reduced
    left, s, vt = np.linalg.svd(triangle[:u, :u])
    rank = int(np.sum(s > _RANK_TOLERANCE * s[0]))
    if rank < u and not minimum_norm:
        raise InputError(
            f"{u - rank} of {u} parameters are not determined by these observations; "
            "add poses in other directions or use the model with fewer parameters"
        )
    inverse = (vt[:rank].T / s[:rank]) / scale[:, None]  # (u, rank)
    step = -inverse @ (left[:, :rank].T @ triangle[:u, u])
    return step, inverse @ inverse.T, vt[rank:].T
