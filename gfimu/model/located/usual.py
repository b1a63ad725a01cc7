"""Usual sizes of errors at places of the forward model, and the priors of the functions that they follow."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["USUAL", "Usual"]


@dataclass(frozen=True)
class Usual:
    """Sizes that would surprise nobody, and how smooth functions are.

    All by choice, as of a prototype that found the places of 29 of 30 foreign worlds with them. The evidence averages
    over a hundredth to thirty of the sizes, and takes the best of the length scales.

    Parameters
    ----------
    reads, late_s, turns_rad, leans_rad, moves_m, ratio, shakes_m_s2 : float
        Errors of a reference [rad/s or rad], of its time, of the table's angle, of a lean or a tilt, of a displacement,
        of a gain or a stretch, of an acceleration or an offset [in the units of their names].
    least_prior : float
        Share of the prior's variance below which it hardly allows a combination [1].
    harmonics, reading_functions : int
        Harmonics of a revolution, and splines of a function of a channel's own reading [count].
    lengths : tuple of float
        Length scales of smooth functions that are tried, over the range that was seen [1].
    lags_s : tuple of float
        Times before, at which a filter of the acceleration is free [s].
    lag_length_s, rough : float
        Length scale of such a filter [s], and the share of it that is independent from lag to lag [1].
    filter_times_s : tuple of float
        Time constants of a temperature that lags behind [s].
    damping : float
        Damping ratio of a mode at first [1].
    spacing : float
        Logarithm of the frequency between two modes that are tried, about [1].
    forgotten : float
        Time constants after which a mode has forgotten [1].
    mode_looks, wave_looks, step_looks : float
        What it costs to have chosen a mode, a wave, or the time of a step, among many [nats].
    step_s : float
        How long a step takes [s].
    turning : float
        Rate from which a table turns [rad/s].
    """

    reads: float = 0.05
    late_s: float = 5e-3
    turns_rad: float = 5e-3
    leans_rad: float = 2e-3
    moves_m: float = 1e-3
    ratio: float = 5e-3
    shakes_m_s2: float = 0.05
    least_prior: float = 1e-6
    harmonics: int = 8
    reading_functions: int = 10
    lengths: tuple[float, ...] = (0.15, 0.5, 1.5)
    lags_s: tuple[float, ...] = (0.0, 0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 0.3)
    lag_length_s: float = 0.02
    rough: float = 0.01
    filter_times_s: tuple[float, ...] = (5.0, 20.0, 60.0)
    damping: float = 0.07
    spacing: float = 0.15
    forgotten: float = 3.0
    mode_looks: float = 4.0
    wave_looks: float = 6.0
    step_looks: float = 4.0
    step_s: float = 0.1
    turning: float = 0.05


USUAL = Usual()
"""The choices that are used."""
