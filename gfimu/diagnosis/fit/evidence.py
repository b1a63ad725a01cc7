"""Evidence: how much better the data are predicted when a set of effects is admitted.

With signatures in units of their physical prior, coordinates z ~ N(0, k²) and the Gram form (G, b),

    log E = ½ k² bᵀ(I + k²G)⁻¹b − ½ log det(I + k²G),

averaged over scales k, so that neither a timid nor a bold prior decides; coordinates of one sign have half-normal
priors. Unlike BIC it charges for the prior volume that the data rule out, not for the number of samples.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack
from scipy.special import log_ndtr

__all__ = ["SCALES", "inverse", "likeliest_scale", "log_evidence", "log_evidence_each", "posterior"]

SCALES = (0.01, 0.03, 0.08, 0.2, 0.45, 1.0, 2.2, 5.0, 12.0, 30.0)
"""Scales k of the prior: a fraction of the usual size up to a large error.

Numerical: nodes of a sum over it. Close to each other: with twelve coordinates a prior three times too wide costs
eight nats, and a rival that happens to have a narrower one would win.
"""
_LEAST_POWER = 1e-13  # numerical
# Numerical: weights of that sum, even in the logarithm from a thirtieth to twice the usual size, less beyond.
_SCALE_WEIGHTS = np.log(np.array([0.07, 0.13, 0.14, 0.14, 0.14, 0.13, 0.10, 0.07, 0.05, 0.03]))


def inverse(information: NDArray[np.float64]) -> NDArray[np.float64]:
    """Invert an information matrix (k, k); directions that the data and the prior leave open get a wide variance."""
    if not len(information):
        return information
    size = 1.0 / np.sqrt(np.maximum(information.diagonal(), 1e-300))
    power, vectors = np.linalg.eigh(information * np.outer(size, size))
    power = np.maximum(power, _LEAST_POWER * max(float(power[-1]), 1.0))
    return np.asarray(np.outer(size, size) * ((vectors / power) @ vectors.T), dtype=np.float64)


def posterior(
    gram: NDArray[np.float64], score: NDArray[np.float64], scale: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Posterior mean (k,) and covariance (k, k) of coordinates with prior N(0, scale²)."""
    information = gram + np.eye(len(score)) / scale**2
    covariance = inverse(information)
    return np.asarray(covariance @ score), covariance


def log_evidence_each(
    information: NDArray[np.float64], score: NDArray[np.float64], positive: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Log evidence of many single coordinates at once: diagonal of G (k,), b (k,), signs (k,)."""
    scale = np.array(SCALES)[:, None]
    total = 1.0 + scale**2 * information
    values = 0.5 * scale**2 * score**2 / total - 0.5 * np.log(total)
    sign = log_ndtr(scale * score / np.sqrt(total)) + np.log(2.0)
    values = values + np.where(positive, sign, 0.0)
    return np.asarray(np.logaddexp.reduce(values + _SCALE_WEIGHTS[:, None], axis=0))


def log_evidence(
    gram: NDArray[np.float64], score: NDArray[np.float64], positive: NDArray[np.bool_] | None = None
) -> float:
    """Log of the evidence of coordinates against none.

    Parameters
    ----------
    gram : ndarray, shape (k, k)
        G.
    score : ndarray, shape (k,)
        b.
    positive : ndarray of bool, shape (k,), optional
        Coordinates that can only be positive.
    """
    values = _unsigned(gram, score) if positive is None or not positive.any() else _signed(gram, score, positive)
    return float(np.logaddexp.reduce(values + _SCALE_WEIGHTS))


def likeliest_scale(gram: NDArray[np.float64], score: NDArray[np.float64]) -> float:
    """Return the scale k of the prior under which coordinates with G (k, k) and b (k,) are the most probable."""
    return SCALES[int(np.argmax(_unsigned(gram, score) + _SCALE_WEIGHTS))]


def _unsigned(gram: NDArray[np.float64], score: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the log evidence at each scale; −∞ at all where G is not positive, even with the prior."""
    square = np.square(SCALES)[:, None]
    power, vectors = np.linalg.eigh(gram)
    total = 1.0 + square * power  # (scales, k)
    if not (total > 0.0).all():
        return np.full(len(SCALES), -np.inf)
    return np.asarray(0.5 * np.sum(square * (score @ vectors) ** 2 / total - np.log(total), axis=1))


def _signed(gram: NDArray[np.float64], score: NDArray[np.float64], positive: NDArray[np.bool_]) -> NDArray[np.float64]:
    count = len(score)
    values = np.empty(len(SCALES))
    for index, scale in enumerate(SCALES):
        matrix = gram * scale**2
        matrix.flat[:: count + 1] += 1.0
        factor, info = lapack.dpotrf(matrix, lower=1)
        if info:
            return np.full(len(SCALES), -np.inf)
        half, _ = lapack.dtrtrs(factor, score * scale, lower=1)
        inverse, _ = lapack.dpotri(factor, lower=1)
        inverse = np.tril(inverse) + np.tril(inverse, -1).T
        mean = inverse @ (score * scale)
        values[index] = 0.5 * float(half @ half) - float(np.log(factor.diagonal()).sum())
        for sign in np.flatnonzero(positive):
            values[index] += float(log_ndtr(mean[sign] / np.sqrt(inverse[sign, sign]))) + np.log(2.0)
    return values
