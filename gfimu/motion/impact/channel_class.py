"""Channel frequency classes of crash tests: the phaseless four-pole low pass of SAE J211-1 and ISO 6487."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.base.errors import InputError, did_you_mean

__all__ = ["CHANNEL_CLASSES", "STANDARDS", "channel_filter", "filter_coefficients"]

CHANNEL_CLASSES = (60, 180, 600, 1000)
"""CFC 60: vehicle structure; 180: chest, angular acceleration by difference; 600: neck, thorax; 1000: head."""

STANDARDS = {"sae": 2.0775, "iso": 1.25 * 5.0 / 3.0}
"""Cut-off frequency of one pass over the class: SAE J211-1, appendix C; ISO 6487, annex A."""

_SAMPLES_PER_CLASS = 10.0
"""Sample rate, Hz, per unit of the class, at least (SAE J211-1, 8.2)."""

_MOST_SAMPLES_PER_CLASS = 1e5  # numerical: of more, rounding moves the gain of the filter by 1e-6

_EDGE_S = 0.01
"""Length, s, by which the data are continued at both ends, turned about the end point (ISO 6487, annex A)."""


def filter_coefficients(
    channel_class: float, sample_rate_hz: float, standard: str = "sae"
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the coefficients of one pass of the filter of a channel frequency class.

    Parameters
    ----------
    channel_class : float
        The class: 60, 180, 600, 1000, or any other number above 0.
    sample_rate_hz : float
        Sample rate, Hz; at least ten times the class.
    standard : {"sae", "iso"}
        SAE J211-1 or ISO 6487; their cut-off frequencies differ by 0.3 %.

    Returns
    -------
    feed_forward : ndarray, shape (3,)
        a0, a1, a2 in the words of the standards.
    feed_back : ndarray, shape (3,)
        1, −b1, −b2.

    Raises
    ------
    InputError
        If the class is not above 0, the sample rate is too low for it, or there is no such standard.

    Notes
    -----
    A two-pole Butterworth low pass by the bilinear transform; it runs forwards and backwards (`channel_filter`), which
    makes four poles without phase.
    """
    if standard not in STANDARDS:
        remedy = did_you_mean(standard, STANDARDS)
        raise InputError(f"standard {standard!r}; choose among {', '.join(STANDARDS)}{remedy}")
    if not (math.isfinite(channel_class) and channel_class > 0.0):
        raise InputError(f"channel class {channel_class:g}; give one above 0, such as 1000, 600, 180 or 60")
    needed = _SAMPLES_PER_CLASS * channel_class
    if not sample_rate_hz >= needed * (1.0 - 1e-3):
        fitting = [one for one in CHANNEL_CLASSES if _SAMPLES_PER_CLASS * one <= sample_rate_hz]
        advice = f"take class {max(fitting)}" if fitting else "record faster"
        raise InputError(
            f"channel class {channel_class:g} needs {needed:g} samples per second, "
            f"there are {sample_rate_hz:g}; {advice}"
        )
    if sample_rate_hz > _MOST_SAMPLES_PER_CLASS * channel_class:
        raise InputError(
            f"channel class {channel_class:g} is too low for {sample_rate_hz:g} samples per second; "
            f"give one of at least {sample_rate_hz / _MOST_SAMPLES_PER_CLASS:g}"
        )
    warped = math.tan(math.pi * STANDARDS[standard] * channel_class / sample_rate_hz)  # ωa
    scale = 1.0 + math.sqrt(2.0) * warped + warped**2
    first = warped**2 / scale  # a0
    back = -2.0 * (warped**2 - 1.0) / scale, (-1.0 + math.sqrt(2.0) * warped - warped**2) / scale  # b1, b2
    return np.array([first, 2.0 * first, first]), np.array([1.0, -back[0], -back[1]])


def channel_filter(
    readings: ArrayLike, sample_rate_hz: float, channel_class: float, standard: str = "sae"
) -> NDArray[np.float64]:
    """Filter channels to a frequency class, without phase.

    Parameters
    ----------
    readings : array_like, shape (n,) or (n, c)
        Readings on an even grid, without gaps.
    sample_rate_hz : float
        Sample rate, Hz.
    channel_class : float
        The class; see `filter_coefficients`.
    standard : {"sae", "iso"}
        SAE J211-1 or ISO 6487.

    Returns
    -------
    ndarray, of the shape of the readings
        In their unit.

    Raises
    ------
    InputError
        As `filter_coefficients`; or if readings are missing, or there are fewer than 10 ms of them.
    """
    from scipy.signal import filtfilt

    values = np.asarray(readings, dtype=float)
    feed_forward, feed_back = filter_coefficients(channel_class, sample_rate_hz, standard)
    edge = max(3, round(_EDGE_S * sample_rate_hz))
    if len(values) <= edge:
        raise InputError(f"{len(values)} samples are too few for a channel filter; it needs more than 10 ms ({edge})")
    if not np.isfinite(values).all():
        raise InputError("readings are missing; a channel filter needs all of them, so take a stretch without gaps")
    filtered: NDArray[np.float64] = filtfilt(feed_forward, feed_back, values, axis=0, padtype="odd", padlen=edge)
    return filtered
