"""Numbers that a rate filter runs with, from the array, its sensors and the sample period."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from gfimu.array.quadrature import even_weights
from gfimu.rate.channel_sets import ChannelSets
from gfimu.rate.filter_state import Places, ReferenceRows, Tuning
from gfimu.rate.path import PathTuning
from gfimu.rate.rest_test import RestTest
from gfimu.rate.sensing import SensorErrors
from gfimu.rate.settings import QUADRATURES, FilterSettings

__all__ = ["FilterPolicy", "tuning_of"]


@dataclass(frozen=True)
class FilterPolicy:
    """Memories and limits of the filter.

    Parameters
    ----------
    innovation_s : float
        Memory of the mean innovation squared, s: some times that of the filter itself.
    colour_s : float
        Memory of the correlation of innovations from sample to sample, and of the differences of α, s.
    parity_s : float
        Memory of the parity rows, s: they follow a shock.
    significance : float
        Standard deviations by which a mean must exceed what noise gives.
    colour_significance : float
        The same of the correlation, which is looked at all the time.
    parity_false_alarm : float
        Share of the samples of a right model whose own parity rows count by themselves.
    rest_clear : float
        χ² by which rest must explain the mean null space of still blocks better than the filter's rate does, with the
        biases as uncertain as before the run, to start anew from rest.
    guard_s : float
        Length of a window whose misfit is judged, s.
    guard_significance : float
        Standard deviations by which the misfit of a window must exceed that of a right rate with biases as uncertain as
        before the run.
    guard_clear : float
        χ² by which the rate of a window's last sample must fit better, to start anew from it: once in 7e4 by chance.
    """

    innovation_s: float = 0.5
    colour_s: float = 1.0
    parity_s: float = 0.1
    significance: float = 3.0
    colour_significance: float = 4.0
    parity_false_alarm: float = 1e-3
    rest_clear: float = 9.0
    guard_s: float = 0.5
    guard_significance: float = 5.0
    guard_clear: float = 25.0


def tuning_of(
    sets: ChannelSets,
    errors: SensorErrors,
    period: float,
    settings: FilterSettings,
    *,
    at: Places,
    solved_in_motion: int,
    path: PathTuning,
    references: ReferenceRows,
    compares: bool = False,
    policy: FilterPolicy = FilterPolicy(),
) -> Tuning:
    """Return the numbers for a run.

    Parameters
    ----------
    sets : ChannelSets
        The array, with the noise of its channels.
    errors : SensorErrors
        Errors of its sensors.
    period : float
        Nominal sample period, s.
    settings : FilterSettings
        Rest, quadrature.
    at : Places
        Places in the state.
    solved_in_motion : int
        Components of the state that are estimated before the first rest.
    path : PathTuning
        Axis, gravity and rest of the path.
    references : ReferenceRows
        Values beside the readings.
    compares : bool
        Whether two mirrored rates are followed.
    policy : FilterPolicy, optional
        Memories and limits.
    """
    m, d = sets.products, len(sets.parity_rows)
    sees = m > 0 and np.linalg.matrix_rank(sets.full.sensitivity, tol=1e-9) >= 3
    stencil = QUADRATURES[settings.quadrature]
    window = max(4, round(policy.guard_s / period)) if sees else 0
    test = settings.rest or RestTest()
    half, second, parity = (_share(period, one) for one in (policy.innovation_s, policy.colour_s, policy.parity_s))
    return Tuning(
        period=period,
        overshoot=float(2.0 * np.sum(even_weights(stencil.points)[-stencil.before[0]] ** 2) - 1.0),
        rest_variance=test.rate_std**2,
        rest_limit=test.rate_limit,
        entry_rate=float(chdtri(3, test.entry_rate_level)),
        entry_alpha=float(chdtri(3, test.entry_alpha_level)),
        rest_clear=policy.rest_clear,
        rest_entry=test.entry_blocks(period),
        forget_second=second,
        forget_half=half,
        forget_parity=parity,
        excess_limit=1.0 + policy.significance * _spread(half, m),
        parity_limit=policy.significance * _spread(parity, d),
        parity_alone=float(chdtri(max(d, 1), policy.parity_false_alarm)) / max(d, 1),
        parity_freedom=float(d),
        lag_limit=policy.colour_significance * _spread(second, 2 * m),
        guard_window=window,
        guard_limit=policy.guard_significance * np.sqrt(2.0 * m * window),
        guard_clear=policy.guard_clear,
        at=at,
        solved_in_motion=solved_in_motion,
        compares=compares,
        path=path,
        references=references,
    )


def _share(period: float, memory: float) -> float:
    return float(-np.expm1(-period / memory))


def _spread(forget: float, freedom: int) -> float:
    """Return the standard deviation of a mean with a memory over squares per degree of freedom."""
    return float(np.sqrt(2.0 / max(freedom, 1) * forget / (2.0 - forget)))
