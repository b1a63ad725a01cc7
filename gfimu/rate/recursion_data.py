"""Arrays that the rate filter's recursion works on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Record",
    "RecursionInput",
    "RecursionOutput",
    "RecursionState",
    "Tables",
    "Tuning",
]

# Places in RecursionState.scalars
TIME, WALK, LAST_GOOD, FOURTH, FIFTH = range(5)
# Places in RecursionState.counts
STARTED, BLOCK, REST_BLOCKS, SAMPLES, RUN, RESTING, PAST, RETURN, RETRY, DOUBT, PAIR, HELD = range(12)


class Tables(NamedTuple):
    """Matrices per set of channels (`gfimu.rate.sensing.ChannelTables`), stacked."""

    alpha_bias: NDArray[np.float64]  # (sets, 3, d)
    alpha_leak: NDArray[np.float64]  # (sets, 3, 6)
    alpha_noise: NDArray[np.float64]  # (sets, 3, 3)
    null_sensitivity: NDArray[np.float64]  # (sets, d, 6)
    null_bias: NDArray[np.float64]  # (sets, d, d)
    null_count: NDArray[np.int64]  # (sets,)
    plain: NDArray[np.bool_]  # (sets,)
    alpha_rows: NDArray[np.float64]  # (sets, 3, c)
    null_rows: NDArray[np.float64]  # (sets, d, c)
    products: NDArray[np.float64]  # (sets, 6, d)
    square_seen: NDArray[np.bool_]  # (sets, 3)
    null_size: NDArray[np.float64]  # (sets,)


class Tuning(NamedTuple):
    """Numbers that stay the same over a run."""

    period: float  # nominal sample period, s
    weights: NDArray[np.float64]  # (m − 1, m): quadrature of each interval of the stencil, in periods
    position: int  # interval of the stencil that is integrated
    overshoot: float  # g of (1b) in `gfimu.rate.recursion`
    inverse_noise: NDArray[np.float64]  # (c,) 1/σ, s²/m
    scale_variance: float  # of the scale factors
    placement_variance: float  # over σ² of a channel, 1/(m/s²)² m²
    timing_variance: float  # of a channel's sampling time, s²
    gyro_variance: float  # (rad/s)²
    rest_window: int  # samples per block of the rest test; 0: no test
    rest_variance: float  # of the rate at rest, (rad/s)²
    rest_entry: int  # blocks in a row before rest begins anew
    rest_retry: int  # the same right behind a single block that was no rest
    rest_limits: NDArray[np.float64]  # (3, 8) `gfimu.rate.rest_test.RestTest.all_limits`
    likelihood: bool
    live: bool  # a block in doubt takes back the one before until it is decided; a recorded run leaves it


class RecursionState(NamedTuple):
    """What is carried from one sample to the next."""

    x: NDArray[np.float64]  # (n,)
    covariance: NDArray[np.float64]  # (n, n)
    scalars: NDArray[np.float64]  # (5,)
    mean_alpha: NDArray[np.float64]  # (3,) over the filter's memory
    counts: NDArray[np.int64]  # (12,)
    held: NDArray[np.float64]  # (d,) sum of the z of this block that were not used
    block_x: NDArray[np.float64]  # (n,) state when the block began
    block_covariance: NDArray[np.float64]  # (n, n)
    reference: NDArray[np.float64]  # (c,) mean reading while the biases were learned, m/s²
    run_alpha: NDArray[np.float64]  # (r, 3) mean α of the last blocks that passed, ring
    run_bias: NDArray[np.float64]  # (r, 3) its bias as known when each began
    run_covariance: NDArray[np.float64]  # (r, 3, 3)
    # State after each of the last blocks of rest, rings
    past_x: NDArray[np.float64]  # (m, n)
    past_covariance: NDArray[np.float64]  # (m, n, n)
    past_scalars: NDArray[np.float64]  # (m, 5)
    past_samples: NDArray[np.int64]  # (m,)

    def copy(self) -> RecursionState:
        """Return a state that shares nothing with this one."""
        return RecursionState._make(field.copy() for field in self)


class RecursionInput(NamedTuple):
    """Samples, with enough of the ones before and after for the quadrature."""

    t: NDArray[np.float64]  # (N,)
    y: NDArray[np.float64]  # (N, c)
    alpha: NDArray[np.float64]  # (N, 3) A y
    z: NDArray[np.float64]  # (N, d) Z y
    channel_set: NDArray[np.int64]  # (N,)
    gyro: NDArray[np.float64]  # (N, 3), NaN where there is none
    uniform_run: NDArray[np.int64]  # (N,) equal steps between complete samples in a row up to here
    whole_run: NDArray[np.int64]  # (N,) steps without a gap up to here
    corrected: NDArray[np.float64]  # (N, 3) α of the past without what the products of ω left in it
    vetoed: NDArray[np.bool_]  # (N,) a block that ends here is known not to be rest
    excess: NDArray[np.float64]  # (N,) measured variance of the noise over the stated one, less 1


class RecursionOutput(NamedTuple):
    """Estimates per sample."""

    omega: NDArray[np.float64]  # (N, 3)
    covariance: NDArray[np.float64]  # (N, 6) xx, yy, zz, xy, xz, yz
    nis: NDArray[np.float64]  # (N,)
    dof: NDArray[np.int64]  # (N,)
    likelihood: NDArray[np.float64]  # (N,)
    rest: NDArray[np.bool_]  # (N,) a block of rest ended here
    manoeuvre: NDArray[np.float64]  # (N,) recent α against its uncertainty, squared


class Record(NamedTuple):
    """What the backward pass needs of each sample of a block of length B, with up to u scalar updates."""

    x: NDArray[np.float64]  # (B, 3) predicted rate
    rows: NDArray[np.float64]  # (B, 3, n) rows of the predicted covariance
    transition: NDArray[np.float64]  # (B, 3, n) rows of the transition to this sample
    updates: NDArray[np.int64]  # (B,) how many scalar updates
    h: NDArray[np.float64]  # (B, u, n)
    gain: NDArray[np.float64]  # (B, u, n)
    inverse: NDArray[np.float64]  # (B, u) 1/S
    innovation: NDArray[np.float64]  # (B, u)
