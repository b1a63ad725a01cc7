"""Whether a rate filter's innovations are as large as it states: χ² tests of the whole run and of each second.

With a right model the normalised innovations squared (NIS) of a sample are χ² with one degree of freedom per
combination that was compared, independent of those of other samples (Bar-Shalom, Li & Kirubarajan, Estimation with
Applications to Tracking and Navigation, 2001, ch. 5.4). Their sum over N degrees of freedom is χ² with N.

Errors of gains and axes, as the calibration or the data sheet states them, are in the variances of the innovations. A
change of the bias with temperature is not: of a vector g of such errors in their standard deviations the sum grows by
gᵀΛg, of which tr Λ times the quantile of χ² with one degree of freedom is an upper bound. Where a run began in motion
its biases are not estimated before the first rest, and all innovations share their error: the mean is then held
against a single sample's quantile.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.limits import PartLimits
from gfimu.base.declared import Declared, figure
from gfimu.base.errors import InputError
from gfimu.rate.channel_sets import ChannelSets
from gfimu.rate.result import RateEstimate
from gfimu.rate.sensing import SensorErrors

__all__ = ["FALSE_ALARM", "Consistency", "judge_consistency"]

FALSE_ALARM = 1e-4
"""Probability that a run whose sensors are as stated is called inconsistent, at most, by each of the two tests."""

_WINDOW_S = 1.0
_SEARCHED = 200_000  # samples in which the channel is looked for
_SETTLED = 0.5  # of the excess has to go with a channel that is named alone


@dataclass(frozen=True)
class Consistency(Declared):
    """How the innovations of a filter compare with what it states.

    Beyond the bound the stated standard deviation is too small by about √nis.
    """

    nis: Annotated[float, figure("Mean normalised innovation squared per degree of freedom, over the run.")]
    expected: Annotated[float, figure("What a right model gives: 1.")]
    bound: Annotated[
        float,
        figure(
            "Largest mean that noise and biases that change with temperature within their data sheets' typical "
            "deviations give, but for false_alarm."
        ),
    ]
    noise_bound: Annotated[float, figure("Largest mean at a constant temperature.")]
    worst_second: Annotated[
        float, figure("The mean over the second that exceeds its own bound most; not known without a whole second.")
    ]
    worst_second_bound: Annotated[float, figure("Its bound.")]
    worst_second_at_s: Annotated[float, figure("When that second begins.", "s")]
    consistent: Annotated[bool, figure("Whether both means are within their bounds.")]
    worst_channel: Annotated[
        str | None, figure("Channel without which the innovations shrink most; null where none stands out.")
    ]
    nis_without_worst: Annotated[float, figure("The mean without it; not known if none was looked for.")]
    degrees_of_freedom: Annotated[int, figure("Combinations that were compared, over all samples.")]
    false_alarm: Annotated[
        float, figure("Probability of calling a right model inconsistent, by each of the two tests.")
    ]


def judge_consistency(
    array: AccelerometerArray,
    readings: NDArray[np.float64],
    errors: SensorErrors,
    found: RateEstimate,
    *,
    temperature: NDArray[np.float64] | None = None,
    filter_again: Callable[[slice, NDArray[np.float64]], RateEstimate] | None = None,
) -> Consistency | None:
    """Judge the innovations of a filter, and look for the channel that disagrees.

    Parameters
    ----------
    array : AccelerometerArray
        The array, with c channels.
    readings : ndarray, shape (n, c)
        What was filtered, m/s²; NaN where missing.
    errors : SensorErrors
        Noise that the filter was given.
    found : RateEstimate
        What it found.
    temperature : ndarray, shape (n,), optional
        Temperature of the chips, °C.
    filter_again : callable, optional
        Filters some rows of the run again with these readings; needed to name a channel.

    Returns
    -------
    Consistency or None
        None where nothing was compared, as with an array without redundant directions.
    """
    squares = _stated(found)
    used = (found.nis_dof > 0) & np.isfinite(squares)
    dof = np.where(used, found.nis_dof, 0)
    nis = np.where(used, squares, 0.0)
    total = int(dof.sum())
    if total == 0:
        return None
    warming = _warming(array, errors, temperature, used)
    period = float(np.median(np.diff(found.t_s)))
    length = max(1, round(_WINDOW_S / period))
    count = len(nis) // length
    whole = slice(0, len(nis))
    parts = [whole] + [slice(index * length, (index + 1) * length) for index in range(count)]
    sums = np.array([nis[part].sum() for part in parts])
    freedom = np.array([dof[part].sum() for part in parts])
    # One test for the run and one for the worst of its seconds, so those share the probability.
    probability = np.array([FALSE_ALARM] + [FALSE_ALARM / max(count, 1)] * count)
    noise = np.where(freedom > 0, chdtri(np.maximum(freedom, 1), probability), np.inf)
    if found.start is not None and found.start.sign_open:
        rows = int(dof.max())
        noise = np.maximum(noise, freedom / rows * chdtri(rows, probability))
    slow = np.array([warming[part].sum() for part in parts]) * chdtri(1, probability)
    limit = noise + slow
    place = 1 + int(np.argmax(sums[1:] / limit[1:])) if count else 0
    late = place > 0 and bool(sums[place] > limit[place])
    consistent = bool(sums[0] <= limit[0]) and not late
    channel, without = None, np.nan
    if not consistent and filter_again is not None:
        channel, without = _worst_channel(array, readings, found, parts[place], filter_again)
    known = count > 0 and freedom[place] > 0
    return Consistency(
        nis=float(sums[0]) / total,
        expected=1.0,
        bound=float(limit[0]) / total,
        noise_bound=float(noise[0]) / total,
        worst_second=float(sums[place] / freedom[place]) if known else np.nan,
        worst_second_bound=float(limit[place] / freedom[place]) if known else np.nan,
        worst_second_at_s=float(found.t_s[parts[place].start]) if known else np.nan,
        consistent=consistent,
        worst_channel=channel,
        nis_without_worst=without,
        degrees_of_freedom=total,
        false_alarm=FALSE_ALARM,
    )


def _warming(
    array: AccelerometerArray,
    errors: SensorErrors,
    temperature: NDArray[np.float64] | None,
    used: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """Return what the data sheet's change of the bias with temperature, °C, adds to the squares, shape (n,)."""
    added = np.zeros(len(used))
    if temperature is None or not np.isfinite(temperature).any():
        return added
    try:
        coefficient = PartLimits.of(array, 100.0).bias_tempco
    except InputError:
        return added
    sets = ChannelSets(array, errors.noise_std)
    energy = float(np.sum((sets.full.product_rows * coefficient) ** 2))
    seen = np.isfinite(temperature)
    change = np.where(seen, temperature - temperature[np.argmax(seen)], 0.0)
    added[used] = energy * change[used] ** 2
    return added


def _worst_channel(
    array: AccelerometerArray,
    readings: NDArray[np.float64],
    found: RateEstimate,
    focus: slice,
    filter_again: Callable[[slice, NDArray[np.float64]], RateEstimate],
) -> tuple[str | None, float]:
    """Filter again without each channel in turn: the one whose absence shrinks the innovations most, and their mean.

    None where most of the excess stays, over the run as over the second in ``focus``.
    """
    first = max(0, min(focus.start - _SEARCHED // 2, len(readings) - _SEARCHED))
    rows = slice(first, first + _SEARCHED)
    part = readings[rows]
    inside = slice(focus.start - first, min(focus.stop - first, _SEARCHED))
    means, focused = np.full(array.n_channels, np.inf), np.full(array.n_channels, np.inf)
    for channel in range(array.n_channels):
        if not np.isfinite(part[:, channel]).any():
            continue
        fewer = part.copy()
        fewer[:, channel] = np.nan
        again = filter_again(rows, fewer)
        if again.nis_dof.sum() > 0:
            means[channel] = _stated(again).sum() / again.nis_dof.sum()
            focused[channel] = _stated(again)[inside].sum() / max(1, again.nis_dof[inside].sum())
    best = int(np.argmin(means))
    before = _stated(found)[rows].sum() / max(1, found.nis_dof[rows].sum())
    before_there = _stated(found)[focus].sum() / max(1, found.nis_dof[focus].sum())
    gone = means[best] - 1.0 < _SETTLED * (before - 1.0) or focused[best] - 1.0 < _SETTLED * (before_there - 1.0)
    if not (np.isfinite(means[best]) and gone):
        return None, np.nan
    return array.channels[best], float(means[best])


def _stated(found: RateEstimate) -> NDArray[np.float64]:
    """Return the innovations squared by the stated noise, shape (n,)."""
    return found.nis if found.stated_nis is None else found.stated_nis
