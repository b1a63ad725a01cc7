"""Every chosen number of the located terms, with its unit, what it means and what set it."""

from __future__ import annotations

import math
from dataclasses import dataclass

__all__ = ["LOCATED", "LocatedPolicy"]


@dataclass(frozen=True)
class LocatedPolicy:
    """Functions that are tried at places of the forward model, and how they are searched.

    All by choice, as of a prototype that found the places of 29 of 30 foreign worlds with them.

    Parameters
    ----------
    log_prior : float
        Log prior of a function at a place, as one of the many that have no name [nats]. Set in a prototype, where it
        separated right names from descriptions of the same worlds.
    free_odds : float
        Log odds that an error that is free in time needs [nats]. Set on runs with nothing hidden, which reached 23. A
        cause that held-out data refute is searched for anew where it explained more than this.
    most_certain_place : float
        Largest probability of a place that is reported [1]. Set by two lists of worlds outside the library: of places
        that were far ahead of others by the evidence, 19 of 22 and 38 of 40 were right.
    terms, fitted, compared : int
        Most terms, and how many leaders of each are fitted and compared under their own noise [count].
    behind : float
        Log odds behind the leader, and half of its own, from which a term is not fitted [nats].
    widest : int
        Coefficients of a term beyond which it describes anything [count].
    least_information : float
        Information below which a term is not seen at all [1].
    together : int
        Coefficients of narrow terms whose products are computed at once [count].
    averaged_hz : float
        Least rate of the averages on which terms are screened, four times that of a motion [Hz].
    oversampled : float
        The same over the highest frequency that a term adds to the motion [1].
    widths : tuple of float
        How wide the steps of that are, one after another [1].
    stretches, samples : int
        Stretches in which terms are searched, and most samples of each [count].
    rows : int
        Of the table of a function [count].
    block_s, bands : float and int
        Blocks of an error that is free in time [s], and its bands of frequency [count].
    waves, padded, apart : int
        Strongest waves of each kind at a place; length of the transform they are looked for in over that of its signal;
        its points between two waves [count].
    least_turned : float
        Angle in which an order can be separated from a function of the angle [rad].
    rate_functions, acceleration_functions, angle_functions, time_functions, temperature_functions : int
        Splines of a smooth function of one regressor [count].
    product_functions : int
        Splines of each regressor of a function of two [count].
    time_lengths, temperature_lengths : tuple of float
        Length scales of functions of time and of temperature that are tried, over the range that was seen [1].
    product_length : float
        The same of a function of two regressors [1].
    mode_hz : tuple of (float, float)
        Lowest and highest frequency of a mode [Hz].
    steps : int
        Steps that are tried all over the time of a run, of whose leader the time is refined [count].
    modes : int
        Frequencies between them [count].
    fastest : float
        Share of the sample rate up to which a mode is sampled [1].
    warmed : float
        Change of the temperature that is one at all [K].
    lowest_hz, lowest_order, highest_order : float
        Slowest tone [Hz], and slowest and fastest order [cycles per revolution], that are looked for.
    """

    log_prior: float = -13.0
    free_odds: float = 25.0
    most_certain_place: float = 0.9
    terms: int = 3
    fitted: int = 4
    compared: int = 2
    behind: float = 40.0
    widest: int = 320
    least_information: float = 1e-9
    together: int = 128
    averaged_hz: float = 25.0
    oversampled: float = 2.5
    widths: tuple[float, ...] = (1.0, 0.3, 0.1, 0.03)
    stretches: int = 2
    samples: int = 20_000
    rows: int = 25
    block_s: float = 0.5
    bands: int = 40
    waves: int = 2
    padded: int = 4
    apart: int = 24
    least_turned: float = 4.0 * math.pi
    rate_functions: int = 16
    acceleration_functions: int = 12
    angle_functions: int = 12
    time_functions: int = 24
    temperature_functions: int = 6
    product_functions: int = 7
    time_lengths: tuple[float, ...] = (0.05, 0.2, 0.7)
    temperature_lengths: tuple[float, ...] = (0.3, 1.0)
    product_length: float = 0.5
    mode_hz: tuple[float, float] = (2.5, 40.0)
    steps: int = 9
    modes: int = 15
    fastest: float = 0.4
    warmed: float = 0.2
    lowest_hz: float = 1.0
    lowest_order: float = 0.15
    highest_order: float = 160.0


LOCATED = LocatedPolicy()
"""The choices that are used."""
