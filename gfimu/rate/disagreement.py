"""How much more the channels disagree than their stated noise explains, measured from the readings themselves.

Combinations of readings that the estimated motion leaves free scatter by the noise alone if the model is right. With r
such a residual in units of the stated noise, s² = ‖r‖²/ν over its ν degrees of freedom is 1 in the mean. Chips that
sample at different instants, a residue of the calibration or vibration make it larger, by an amount that changes with
the motion, so it is measured sample by sample and shrunk to its neighbours,

    s̃² = (ν s² + 4 ⟨s²⟩)/(ν + 4),

where ⟨·⟩ is the mean over the samples around with the weights exp(−|j|/1.5): the posterior mean of a variance whose
prior, worth four degrees of freedom, is what the neighbours show. The covariance of an estimate is multiplied by s̃²:
the a posteriori variance factor of W. Baarda (A Testing Procedure for Use in Geodetic Networks, 1968) with a memory.

Two safeguards keep estimates as they are where the stated noise is right: s̃ is never below 1, and it is used only
where it is significant, that is above the quantile of χ² that a right model exceeds in one of a thousand samples. A
disagreement too small for a single sample shows in the mean over a second; then that is used, up to what the single
sample would not have shown.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from gfimu.base.compiled import compiled
from gfimu.base.declared import Declared, figure

__all__ = ["Disagreement", "measured_scale", "sum_up_disagreement"]


_MEMORIES = 8.0  # numerical: of the longer memory, beyond which samples count for nothing
_ALONE = 1e9  # numerical: degrees of freedom beside which a single sample counts for nothing


@dataclass(frozen=True)
class DisagreementPolicy:
    """Thresholds of the measured noise.

    Parameters
    ----------
    prior : float
        Degrees of freedom that the neighbours of a sample are worth.
    memory : float
        Samples over which the weight of a neighbour falls to 1/e.
    long_memory_s : float
        The same for small lasting disagreements, s.
    false_alarm : float
        Share of the samples of a right model whose standard deviation is enlarged.
    long_false_alarm : float
        The same of the mean over a second, whose excursions last as long.
    notable_ratio : float
        s̃ from which a sample is reported.
    notable_share : float
        Share of such samples from which a run is reported.
    """

    prior: float = 4.0
    memory: float = 1.5
    long_memory_s: float = 0.5
    false_alarm: float = 1e-3
    long_false_alarm: float = 1e-6
    notable_ratio: float = 2.0
    notable_share: float = 0.05


POLICY = DisagreementPolicy()


def measured_scale(
    squares: NDArray[np.float64],
    freedom: NDArray[np.float64],
    period: float,
    *,
    policy: DisagreementPolicy = POLICY,
) -> NDArray[np.float64]:
    """Return s̃ of each sample, shape (n,), by which standard deviations are to be multiplied: 1 or more.

    Parameters
    ----------
    squares : ndarray, shape (n,)
        Sum of squares of the residual in units of the stated noise; not finite where there is none.
    freedom : ndarray, shape (n,)
        Its degrees of freedom ν, not necessarily whole numbers.
    period : float
        Sample period, s.
    policy : DisagreementPolicy, optional
        Memory and significance.

    Notes
    -----
    ν s̃² is no χ² exactly: s̃² mixes residuals of several samples. Its mean and variance are those of a scaled χ² (F. E.
    Satterthwaite, Biometrics Bulletin 2, 1946), whose quantile is Wilson & Hilferty's (PNAS 17, 1931).
    """
    used = np.isfinite(squares) & (freedom > 0)
    sums = np.where(used, squares, 0.0)
    counts = np.where(used, freedom, 0.0).astype(float)
    kept = np.exp(-1.0 / policy.memory), np.exp(-period / policy.long_memory_s)
    deviates = -float(ndtri(policy.false_alarm)), -float(ndtri(policy.long_false_alarm))
    return _scale(sums, counts, *kept, policy.prior, *deviates)


@compiled
def _scale(sums, counts, keep, keep_long, prior, deviate, deviate_long):  # type: ignore[no-untyped-def]
    """Scale of each sample from sums of squares (n,) and degrees of freedom (n,)."""
    n = len(sums)
    # Weighted sums of squares and degrees of freedom, and of the other samples' with squared weights.
    near = np.zeros((n, 3))
    far = np.zeros((n, 3))
    for direction in range(2):
        near_square, near_count, near_spread = 0.0, 0.0, 0.0
        far_square, far_count, far_spread = 0.0, 0.0, 0.0
        for i in range(n):
            k = i if direction == 0 else n - 1 - i
            near[k, 0] += near_square if direction == 1 else near_square + sums[k]
            near[k, 1] += near_count if direction == 1 else near_count + counts[k]
            near[k, 2] += near_spread
            far[k, 0] += far_square
            far[k, 1] += far_count
            far[k, 2] += far_spread
            near_square = keep * (near_square + sums[k])
            near_count = keep * (near_count + counts[k])
            near_spread = keep * keep * (near_spread + counts[k])
            far_square = keep_long * (far_square + sums[k])
            far_count = keep_long * (far_count + counts[k])
            far_spread = keep_long * keep_long * (far_spread + counts[k])
    scale = np.ones(n)
    for k in range(n):
        worth = prior if near[k, 1] > 1e-6 else 0.0
        weight = counts[k] + worth
        if weight <= 0.0:
            continue
        mean = near[k, 0] / near[k, 1] if worth > 0.0 else 0.0
        spread = near[k, 2] / (near[k, 1] * near[k, 1]) if worth > 0.0 else 0.0
        level = (sums[k] + worth * mean) / weight
        own = 1.0 + worth / near[k, 1] if worth > 0.0 else 1.0  # weight of the sample itself
        limit = _limit(weight * weight / (counts[k] * own * own + worth * worth * spread), deviate)
        if level <= limit:  # not significant by itself: perhaps over a second
            total = far[k, 1] + counts[k]
            lasting = (far[k, 0] + sums[k]) / total
            if lasting <= _limit(total * total / (far[k, 2] + counts[k]), deviate_long):
                continue
            level = min(lasting, limit)
        if level > 1.0:
            scale[k] = np.sqrt(level)
    return scale


@compiled
def _limit(freedom, deviate):  # type: ignore[no-untyped-def]
    """Quantile of χ²/ν for ν degrees of freedom, at a quantile of the normal distribution (Wilson & Hilferty)."""
    part = 2.0 / (9.0 * max(freedom, 0.5))
    root = 1.0 - part + deviate * np.sqrt(part)
    return root * root * root


@dataclass(frozen=True)
class Disagreement(Declared):
    """How much more the channels disagree than their stated noise, over a run."""

    enlarged: Annotated[bool, figure("Whether standard deviations were multiplied by s̃ anywhere.")]
    notable: Annotated[bool, figure("Whether s̃ exceeds 2 in a notable share of the samples.")]
    share: Annotated[float, figure("Share of the samples in which it does.")]
    times: Annotated[float, figure("Median of s̃ over those samples; 1 without any.")]
    slow_times: Annotated[
        float, figure("Median of s̃ in the slowest third of the samples that turn; not known where too few do.")
    ]
    fast_times: Annotated[float, figure("Median of s̃ in the fastest third.")]
    slow_rad_s: Annotated[float, figure("Median rate of the slowest third.", "rad/s")]
    fast_rad_s: Annotated[float, figure("Median rate of the fastest third.", "rad/s")]

    @classmethod
    def from_dict(cls, figures: Mapping[str, Any]) -> Disagreement:
        """Return what `to_dict` gave."""
        values: dict[str, Any] = {name: float("nan") if value is None else value for name, value in figures.items()}
        return cls(**values)

    def sentences(self) -> list[str]:
        """Return the warning of a run whose channels disagree notably, in a list; else an empty one."""
        if not self.notable:
            return []
        where = f"in {self.share:.0%} of the samples"
        if np.isfinite(self.slow_times):
            where += (
                f"; {self.slow_times:.2g} times near {self.slow_rad_s:.2g} rad/s, {self.fast_times:.2g} times near "
                f"{self.fast_rad_s:.2g} rad/s"
            )
        text = (
            f"the channels disagree {self.times:.2g} times more than their stated noise ({where}); the stated standard "
            "deviations are enlarged accordingly; likely causes: chips that sample at different times, calibration, "
            "vibration; next: `gfimu calibrate array` and --calibration, or `gfimu diagnose` for the cause"
        )
        return [text]


_FEWEST_TURNING = 30
_TURNING = 1.0  # rad/s


def sum_up_disagreement(scale: NDArray[np.float64], omega: NDArray[np.float64]) -> Disagreement:
    """Sum up the scale s̃ (n,) of a run with the rates ``omega`` (n, 3), rad/s."""
    large = scale > POLICY.notable_ratio
    share = float(np.mean(large)) if len(large) else 0.0
    speed = np.linalg.norm(omega, axis=1)
    turning = np.flatnonzero(speed > _TURNING)
    slow = fast = np.zeros(0, dtype=np.intp)
    if len(turning) >= _FEWEST_TURNING:
        order = turning[np.argsort(speed[turning])]
        slow, fast = order[: len(order) // 3], order[-(len(order) // 3) :]
    median = [float(np.median(values)) if len(values) else float("nan") for values in
              (scale[slow], scale[fast], speed[slow], speed[fast])]  # fmt: skip
    return Disagreement(
        enlarged=bool(np.any(scale > 1.0)),
        notable=share >= POLICY.notable_share,
        share=share,
        times=float(np.median(scale[large])) if large.any() else 1.0,
        slow_times=median[0],
        fast_times=median[1],
        slow_rad_s=median[2],
        fast_rad_s=median[3],
    )
