"""The arrays that the rate filter works on: samples, numbers of the run, the state it carries, and its estimates.

`gfimu.rate.body_rate` has the state model and its equations, `gfimu.rate.path` those of the path.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gfimu.rate.path import ROWS, TILT, Path, PathTuning

__all__ = [
    "CHANGE", "COMPLETE", "CONSTANT", "COUNTS", "EXCESS", "FIFTH", "FOURTH", "JUDGED", "LAGGED", "LAST_ALPHA",
    "LAST_SET", "LEVEL", "LIKELIHOOD", "MISFIT", "PARITY", "POWER", "RATE", "RESTING", "ROUGH", "SCALARS", "SOLVED",
    "STARTED", "STILL", "SUMMED", "TIME", "WALK", "WANDER", "Carried", "Estimates", "Given", "Places",
    "ReferenceRows", "Samples", "SingleRates", "Tuning", "no_rates",
]  # fmt: skip

# Places in Carried.scalars
TIME, LAST_ALPHA, WALK, FOURTH, FIFTH, PARITY, LEVEL, EXCESS, LAGGED, MISFIT, LIKELIHOOD = range(11)
WANDER, POWER, SCALARS = range(11, 14)
# Places in Carried.counts
STARTED, STILL, JUDGED, LAST_SET, ROUGH, SUMMED, COMPLETE, RESTING, SOLVED, COUNTS = range(10)
# What an error of a reference is multiplied by: nothing, the rate about the path's axis, or its change
CONSTANT, RATE, CHANGE = range(3)


class Places(NamedTuple):
    """Places in the state."""

    alpha: int  # of b_α, the first constant
    products: int  # of b_z
    force: int  # of b_p
    references: int  # of the first error of a reference
    errors: int  # of the first error of a channel
    end: int

    @classmethod
    def of(cls, products: int, errors: int, *, path: bool, references: int = 0) -> Places:
        """Return the places for so many rows of the null space and errors of channels and references."""
        alpha = TILT + (ROWS if path else 0)
        force = alpha + 3 + products
        references_at = force + (3 if path else 0)
        errors_at = references_at + references
        return cls(alpha, alpha + 3, force, references_at, errors_at, errors_at + errors)


class ReferenceRows(NamedTuple):
    """Values beside the readings, each weights · x[first : first + 3] + its errors + noise; f values, e errors."""

    first: NDArray[np.int64]  # (f,) component of the state
    weights: NDArray[np.float64]  # (f, 3)
    variance: NDArray[np.float64]  # (f,)
    value_of: NDArray[np.int64]  # (e,) value that an error is of
    grows_with: NDArray[np.int64]  # (e,) what it is multiplied by: CONSTANT, RATE or CHANGE


class Tuning(NamedTuple):
    """Numbers that stay the same over a run."""

    period: float  # nominal sample period, s
    overshoot: float  # g of (1)
    rest_variance: float  # of the rate at rest, (rad/s)²
    rest_limit: float  # χ² of ω up to which a rest goes on
    entry_rate: float  # χ² of ω up to which one begins
    entry_alpha: float  # the same of the mean α of the still blocks
    rest_clear: float  # χ² by which rest must explain still blocks better than a rate does
    rest_entry: int  # still blocks in a row before rest begins anew
    forget_second: float  # share of a sample in a mean over a second
    forget_half: float  # the same over half a second
    forget_parity: float  # the same over the memory of the parity rows
    excess_limit: float  # mean innovation squared per degree of freedom from which it counts
    parity_limit: float  # how far from 1 that of the parity rows must be to count
    parity_alone: float  # that of a single sample from which it counts by itself
    parity_freedom: float  # number of parity rows
    lag_limit: float  # correlation of innovations from which they count as coloured
    guard_window: int  # samples of a window of the guard; 0: no guard
    guard_limit: float  # sum of misfits less their mean from which the guard looks closer
    guard_clear: float  # χ² by which a rate of one sample must fit better
    at: Places
    solved_in_motion: int  # components of the state that are estimated before the first rest
    compares: bool  # whether the likelihood of two mirrored rates is to be compared
    path: PathTuning
    references: ReferenceRows


class Carried(NamedTuple):
    """What is carried from one sample to the next."""

    x: NDArray[np.float64]  # (n,)
    covariance: NDArray[np.float64]  # (n, n)
    scalars: NDArray[np.float64]  # (13,)
    counts: NDArray[np.int64]  # (9,)
    last_z: NDArray[np.float64]  # (m,)
    last_white: NDArray[np.float64]  # (m,) whitened innovations
    sums: NDArray[np.float64]  # (3 + m,) of α and z over the still blocks in a row
    prior: NDArray[np.float64]  # (n, n) covariance before the run, for a restart
    guard_white: NDArray[np.float64]  # (m, m) lower triangle, whitens z of set 0 with the biases' prior
    guard_sensitivity: NDArray[np.float64]  # (m, 6) of that
    attitude: NDArray[np.float64]  # (4,) w, x, y, z, where the path is followed
    recent: NDArray[np.float64]  # (4,) acceleration of the origin before the last sample, world axes, and last step

    @classmethod
    def at_start(
        cls,
        time: float,
        omega: NDArray[np.float64],
        std: NDArray[np.float64],
        prior: NDArray[np.float64],
        spread: NDArray[np.float64],
        sensitivity: NDArray[np.float64],
    ) -> Carried:
        """Return the state before the first sample.

        ``prior`` (n, n) is the covariance before the run, ``spread`` (m, m) what biases and errors of the channels make
        of the null space in the motion at hand, and ``sensitivity`` (m, 6) that of the null space.
        """
        m, covariance, x = len(spread), prior.copy(), np.zeros(len(prior))
        x[:3], covariance[range(3), range(3)] = omega, std**2
        scalars, counts = np.zeros(SCALARS), np.zeros(COUNTS, dtype=np.int64)
        scalars[[TIME, PARITY, EXCESS]] = time, 1.0, 1.0
        counts[SOLVED] = len(x)
        white = np.linalg.inv(np.linalg.cholesky(spread + np.eye(m)))
        return cls(
            x, covariance, scalars, counts, np.zeros(m), np.zeros(m), np.zeros(3 + m), prior, white,
            white @ sensitivity, np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(4),
        )  # fmt: skip

    def copy(self) -> Carried:
        """Return a state that shares nothing with this one."""
        return Carried._make(field.copy() for field in self)


class Samples(NamedTuple):
    """Samples, reduced to α and z."""

    t: NDArray[np.float64]  # (N,)
    z: NDArray[np.float64]  # (N, m)
    increment: NDArray[np.float64]  # (N, 3) ∫α over the interval before
    alpha: NDArray[np.float64]  # (N, 3)
    force: NDArray[np.float64]  # (N, 3) P y
    differences: NDArray[np.float64]  # (N, 2) squares of the fourth and fifth difference of α
    channel_set: NDArray[np.int64]  # (N,) −1: α is not seen
    parity: NDArray[np.float64]  # (N,) χ² of the parity rows per degree of freedom; NaN where there are none
    references: NDArray[np.float64]  # (N, f) values beside the readings, NaN where there is none
    still: NDArray[np.int64]  # (N,) verdict on the block that ends here (`gfimu.rate.rest_test`), 0 where none does
    model_error: NDArray[np.float64]  # (N,) variance by errors of the sampling times over that of the noise
    features: NDArray[np.float64]  # (N, 12) of the motion, by this sample; (N, 0) where no errors are considered
    alpha_errors: NDArray[np.float64]  # (N, 3, q) A D
    force_errors: NDArray[np.float64]  # (N, 3, q) P D
    error_increment: NDArray[np.float64]  # (N, 3, q) ∫A D over the interval before
    product_errors: NDArray[np.float64]  # (N, m, q) Z D


class SingleRates(NamedTuple):
    """Rates of single samples, by a method of its own, that a path is to follow; empty (N = 0) where there are none."""

    omega: NDArray[np.float64]  # (N, 3) NaN where there is none
    gain: NDArray[np.float64]  # (N, 3, m) derivative by the null space
    covariance: NDArray[np.float64]  # (N, 3, 3) by the noise of the sample


def no_rates() -> SingleRates:
    """Return no rates of single samples."""
    return SingleRates(np.empty((0, 3)), np.empty((0, 3, 0)), np.empty((0, 3, 3)))


class Given(NamedTuple):
    """What is given of an estimate that is made anew about another one; empty (N = 0) otherwise."""

    omega: NDArray[np.float64]  # (N, 3) about which everything is linearised
    level: NDArray[np.float64]  # (N,) variance of the noise over the stated one
    rest: NDArray[np.bool_]  # (N,) a block of rest ends here
    restart: NDArray[np.bool_]  # (N,) it starts anew behind this sample
    attitude: NDArray[np.float64]  # (N, 4) where the path is followed
    levelled: NDArray[np.bool_]  # (N,) tilt and velocity are found anew behind this sample

    @classmethod
    def nothing(cls) -> Given:
        """Return what a first estimate is given."""
        flags = np.empty(0, dtype=np.bool_)
        return cls(np.empty((0, 3)), np.empty(0), flags, flags, np.empty((0, 4)), flags)


class Estimates(NamedTuple):
    """Estimates per sample."""

    omega: NDArray[np.float64]  # (N, 3)
    covariance: NDArray[np.float64]  # (N, 6) xx, yy, zz, xy, xz, yz
    nis: NDArray[np.float64]  # (N,)
    dof: NDArray[np.int64]  # (N,)
    stated: NDArray[np.float64]  # (N,) innovations squared by the stated noise
    inflation: NDArray[np.float64]  # (N,) variance of the noise over the stated one
    rest: NDArray[np.bool_]  # (N,) a block of rest ended here
    restart: NDArray[np.bool_]  # (N,) the guard started anew behind this sample
    path: Path

    @classmethod
    def empty(cls, n: int, *, path: bool = False) -> Estimates:
        """Return room for n samples."""
        return cls(
            np.empty((n, 3)), np.empty((n, 6)), np.zeros(n), np.zeros(n, dtype=np.int64), np.zeros(n), np.ones(n),
            np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_), Path.empty(n if path else 0),
        )  # fmt: skip
