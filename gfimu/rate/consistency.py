"""Whether a rate filter's innovations are as large as it states: χ² tests of the whole run and of each second.

With a right model the normalised innovations squared (NIS) of a sample are χ² with one degree of freedom per
combination that was compared, independent of those of other samples (Bar-Shalom, Li & Kirubarajan, Estimation with
Applications to Tracking and Navigation, 2001, ch. 5.4). Their sum over N degrees of freedom is χ² with N.

A real chip has errors that the filter's white noise and constant bias don't cover: its gain and its axes are known to
its data sheet's typical deviation only, and its bias changes with temperature. The filter takes the mean of such an
error so far for a bias; the innovations get the rest, in proportion to how far the readings are from their mean so
far. With g the vector of such errors in their standard deviations, the sum grows by gᵀΛg, where Λ holds the energies
and correlations that one standard deviation of each puts into the null space. The quantile of that quadratic form is
that of a shifted and scaled χ² with the same mean tr Λ, variance 2 tr Λ² and skewness (Pearson 1959; Liu, Tang & Zhang
2009). The bound is the χ² quantile of the noise plus this.
Where that bound is exceeded, the mean is found again by filtering with such errors added, and the larger one counts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.limits import PartLimits
from gfimu.base.declared import Declared, figure, plain
from gfimu.base.errors import InputError
from gfimu.rate.result import RateEstimate
from gfimu.rate.sensing import ChannelTables, SensorErrors

__all__ = ["FALSE_ALARM", "Consistency", "judge_consistency", "slow_error_signatures"]

FALSE_ALARM = 1e-4
"""Probability that a run whose sensors are as stated is called inconsistent, at most, by each of the two tests."""

_WINDOW_S = 1.0
_SEARCHED = 200_000  # samples in which the channel is looked for
_DRAWS = 6  # of the slow errors, each with both signs, where the closed form calls a run inconsistent
_SETTLED = 0.5  # of the excess has to go with a channel that is named alone


@dataclass(frozen=True)
class Consistency(Declared):
    """How the innovations of a filter compare with what it states.

    A mean between the bound of the noise and the bound says that the stated standard deviation is too small by about
    √nis, and that a calibration would mend it.
    """

    nis: Annotated[float, figure("Mean normalised innovation squared per degree of freedom, over the run.")]
    expected: Annotated[float, figure("What a right model gives: 1.")]
    bound: Annotated[
        float,
        figure(
            "Largest mean that noise and channels within their data sheets' typical deviations give, but for "
            "false_alarm."
        ),
    ]
    noise_bound: Annotated[float, figure("Largest mean that the noise alone gives.")]
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

    def to_dict(self) -> dict[str, Any]:
        """Return the figures by name, for JSON; None for those that are not known."""
        return plain(super().to_dict())


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
    used = (found.nis_dof > 0) & np.isfinite(found.nis)
    dof = np.where(used, found.nis_dof, 0)
    nis = np.where(used, found.nis, 0.0)
    total = int(dof.sum())
    if total == 0:
        return None
    signatures = slow_error_signatures(array, readings, temperature)  # (n, k)
    signatures[~used] = 0.0
    null = ChannelTables(array, errors).null_rows[0]
    seen = np.tile(null.T @ null, (signatures.shape[1] // array.n_channels,) * 2)  # (k, k)
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
    slow = np.zeros(len(parts))
    for number in np.flatnonzero((sums > noise) | (np.arange(len(parts)) == 0)):  # the others need no allowance
        slow[number] = _slow_quantile(signatures[parts[number]], seen, float(probability[number]))
    if np.any(sums > noise + slow) and filter_again is not None:
        excess = _excess(array, readings, temperature, parts, nis, filter_again)
        for number in np.flatnonzero(sums > noise + slow):
            predicted = float(np.sum(signatures[parts[number]] ** 2 @ np.diag(seen)))
            slow[number] *= max(1.0, excess[number] / max(predicted, 1e-12))
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


def _excess(
    array: AccelerometerArray,
    readings: NDArray[np.float64],
    temperature: NDArray[np.float64] | None,
    parts: list[slice],
    nis: NDArray[np.float64],
    filter_again: Callable[[slice, NDArray[np.float64]], RateEstimate],
) -> NDArray[np.float64]:
    """Return by how much typical slow errors raise the sum of the innovations in parts of the run, found by trial.

    The closed form counts what they put into the null space alone. They also give a false α, and so a wrong rate,
    which matters where the body is turned over. Each draw is tried with both signs, which cancels its product with the
    errors that are there already.
    """
    rng = np.random.default_rng(0)
    columns = slow_error_signatures(array, readings, temperature, from_mean=False)
    size = array.n_channels
    raised = np.zeros(len(readings))
    for _ in range(_DRAWS):
        drawn = columns * rng.standard_normal(columns.shape[1])
        added = drawn.reshape(len(readings), -1, size).sum(axis=1)
        for sign in (1.0, -1.0):
            again = filter_again(slice(0, len(readings)), readings + sign * added)
            raised += np.where(np.isfinite(again.nis), again.nis, 0.0) / (2 * _DRAWS)
    return np.array([raised[part].sum() - nis[part].sum() for part in parts])


def slow_error_signatures(
    array: AccelerometerArray,
    readings: NDArray[np.float64],
    temperature: NDArray[np.float64] | None = None,
    *,
    from_mean: bool = True,
) -> NDArray[np.float64]:
    """Return what one standard deviation of each slow error adds to the readings, less what a constant bias takes off.

    Shape (n, k) with the c channels' errors of the gain first, then of the axis to its two sides, then, if the
    ``temperature`` (n,), °C, is known, of the bias with temperature; m/s². Each is the data sheet's typical deviation
    times how far the reading, the specific force across the axis, or the temperature is from its mean so far, or with
    ``from_mean`` false from its first value. Zero where no data sheet is known.
    """
    change = _from_mean_so_far if from_mean else _from_first
    moved = change(readings)  # (n, c)
    try:
        sheet = PartLimits.of(array, 100.0)
    except InputError:
        return np.zeros_like(moved)
    sides = np.zeros((2, *moved.shape))
    for index in range(len(array.chips)):
        mine = np.flatnonzero(array.chip_of_channel == index)
        for side in range(min(2, len(mine) - 1)):
            sides[side][:, mine] = moved[:, np.roll(mine, -1 - side)]
        if len(mine) < 3:  # the chip does not read this side; it moves as much as all channels do on average
            sides[len(mine) - 1 :, :, mine] = np.sqrt(np.mean(moved**2, axis=1, keepdims=True))
    columns = [sheet.gain_std * moved, sheet.axis_std * sides[0], sheet.axis_std * sides[1]]
    if temperature is not None and np.isfinite(temperature).any():
        columns.append(change(temperature[:, None]) * sheet.bias_tempco)
    return np.hstack(columns)


def _from_mean_so_far(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what each column (n, k) differs from the mean of its values up to there; zero where missing."""
    seen = np.isfinite(values)
    count = np.maximum(np.cumsum(seen, axis=0), 1)
    mean = np.cumsum(np.where(seen, values, 0.0), axis=0) / count
    return np.where(seen, values - mean, 0.0)


def _from_first(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what each column (n, k) differs from its first value; zero where missing."""
    seen = np.isfinite(values)
    first = values[np.argmax(seen, axis=0), np.arange(values.shape[1])]
    return np.where(seen, values - first, 0.0)


def _slow_quantile(signatures: NDArray[np.float64], seen: NDArray[np.float64], probability: float) -> float:
    """Return the upper quantile of gᵀΛg for signatures (m, k) and what the null space sees of each pair (k, k)."""
    energies = seen * (signatures.T @ signatures)
    product = energies @ energies
    mean, square, cube = float(np.trace(energies)), float(np.trace(product)), float(np.sum(product * energies))
    if not (mean > 0.0 and square > 0.0 and cube > 0.0):
        return 0.0
    freedom = square**3 / cube**2
    return mean + float(np.sqrt(square / freedom) * (chdtri(freedom, probability) - freedom))


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
            means[channel] = again.mean_nis
            focused[channel] = again.nis[inside].sum() / max(1, again.nis_dof[inside].sum())
    best = int(np.argmin(means))
    before = found.nis[rows].sum() / max(1, found.nis_dof[rows].sum())
    before_there = found.nis[focus].sum() / max(1, found.nis_dof[focus].sum())
    gone = means[best] - 1.0 < _SETTLED * (before - 1.0) or focused[best] - 1.0 < _SETTLED * (before_there - 1.0)
    if not (np.isfinite(means[best]) and gone):
        return None, np.nan
    return array.channels[best], float(means[best])
