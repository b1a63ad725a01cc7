"""Every chosen number of the located terms, with its unit, what it means and what set it."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["LOCATED", "LocatedPolicy"]


@dataclass(frozen=True)
class LocatedPolicy:
    """Functions that are tried at places of the forward model, and the usual sizes of errors there.

    All by choice, as of a prototype that found the places of 29 of 30 foreign worlds with them. The evidence averages
    over a hundredth to thirty of the usual sizes, and takes the best of the length scales.

    Parameters
    ----------
    rate_functions, acceleration_functions, angle_functions, time_functions, temperature_functions : int
        Splines of a smooth function of one regressor [count].
    reading_functions, product_functions, harmonics : int
        Splines of a function of a channel's own reading and of each regressor of two; harmonics of a revolution
        [count].
    lengths, time_lengths, temperature_lengths : tuple of float
        Length scales of smooth functions that are tried, over the range that was seen [1].
    product_length : float
        The same of a function of two regressors [1].
    lags_s : tuple of float
        Times before, at which a filter of the acceleration is free [s].
    lag_length_s : float
        Length scale of such a filter [s].
    filter_times_s : tuple of float
        Time constants of a temperature that lags behind [s].
    mode_hz : tuple of (float, float)
        Lowest and highest frequency of a mode [Hz].
    modes : int
        Frequencies between them [count].
    damping : float
        Damping ratio of a mode at first [1].
    mode_looks, wave_looks : float
        What it costs to have chosen a mode, or a wave, among many [nats].
    warmed : float
        Change of the temperature that is one at all [K].
    lowest_hz, lowest_order, highest_order : float
        Slowest tone [Hz], and slowest and fastest order [cycles per revolution], that are looked for.
    turning : float
        Rate from which a table turns [rad/s].
    reads, late_s, turns_rad, leans_rad, moves_m, ratio, shakes_m_s2 : float
        Usual sizes of errors: of a reference [rad/s or rad], of its time, of the table's angle, of a lean or a tilt, of
        a displacement, of a gain or a stretch, of an acceleration or an offset [in the units of their names].
    """

    rate_functions: int = 16
    acceleration_functions: int = 12
    angle_functions: int = 12
    time_functions: int = 24
    temperature_functions: int = 6
    reading_functions: int = 10
    product_functions: int = 7
    harmonics: int = 8
    lengths: tuple[float, ...] = (0.15, 0.5, 1.5)
    time_lengths: tuple[float, ...] = (0.05, 0.2, 0.7)
    temperature_lengths: tuple[float, ...] = (0.3, 1.0)
    product_length: float = 0.5
    lags_s: tuple[float, ...] = (0.0, 0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 0.3)
    lag_length_s: float = 0.02
    filter_times_s: tuple[float, ...] = (5.0, 20.0, 60.0)
    mode_hz: tuple[float, float] = (2.5, 40.0)
    modes: int = 15
    damping: float = 0.07
    mode_looks: float = 4.0
    wave_looks: float = 6.0
    warmed: float = 0.2
    lowest_hz: float = 1.0
    lowest_order: float = 0.15
    highest_order: float = 160.0
    turning: float = 0.05
    reads: float = 0.05
    late_s: float = 5e-3
    turns_rad: float = 5e-3
    leans_rad: float = 2e-3
    moves_m: float = 1e-3
    ratio: float = 5e-3
    shakes_m_s2: float = 0.05


LOCATED = LocatedPolicy()
"""The choices that are used."""
