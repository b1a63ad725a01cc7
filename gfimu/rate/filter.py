"""Rate filter and smoother over a whole recording."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import GeometryError, InputError
from gfimu.rate.filter_state import LIKELIHOOD, Estimates
from gfimu.rate.live import LiveRateFilter
from gfimu.rate.path_start import PathStart
from gfimu.rate.references import Measured
from gfimu.rate.result import DECIDED, RateEstimate, SignDecision, clear_of_zero
from gfimu.rate.sensing import SensorErrors
from gfimu.rate.settings import FilterSettings
from gfimu.rate.signs import DISAGREEING, DISAGREES_OFTEN, SignJudge, likelier, merged, with_filter, with_signs

__all__ = ["adjust_rate", "filter_rate", "increasing_times", "smooth_rate"]

_PREFERRED = 1.0  # samples' worth of decided signs from which the single samples choose between two rates


def filter_rate(
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    settings: FilterSettings | None = None,
    *,
    references: Sequence[Measured] = (),
    path: PathStart | None = None,
    progress: Callable[[float], object] | None = None,
) -> RateEstimate:
    """Filter a recording: the estimate of the angular rate by the samples up to each.

    Start, noise and the sign of a start in motion are inferred from the recording.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions.
    t : array_like, shape (n,)
        Sample times, s.
    readings : array_like, shape (n, c)
        Specific force, m/s²; NaN where a channel is missing.
    errors : SensorErrors
        Errors of the sensors.
    settings : FilterSettings, optional
        Start, quadrature, rest.
    references : sequence of Measured, optional
        What was measured beside the readings, such as `Reference.gyro`.
    path : PathStart, optional
        Where attitude, velocity and position start, if they are asked for.
    progress : callable, optional
        Called with the share of the work done so far, 0 to 1.

    Raises
    ------
    InputError
        If the shapes don't fit, time does not increase or there are fewer than two samples.
    GeometryError
        If the array can't see all six motions.
    """
    return _solve("filter", array, t, readings, errors, settings, references, path, progress, smooth=False)


def smooth_rate(
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    settings: FilterSettings | None = None,
    *,
    references: Sequence[Measured] = (),
    path: PathStart | None = None,
    progress: Callable[[float], object] | None = None,
) -> RateEstimate:
    """Smooth a recording: the estimate of the angular rate by all samples; arguments are those of `filter_rate`.

    ``nis`` are those of the filter.
    """
    return _solve("smoother", array, t, readings, errors, settings, references, path, progress, smooth=True)


def adjust_rate(
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    settings: FilterSettings | None = None,
    *,
    references: Sequence[Measured] = (),
    path: PathStart | None = None,
    progress: Callable[[float], object] | None = None,
) -> RateEstimate:
    """Adjust a recording: the most probable run by all samples and references; arguments are those of `filter_rate`.

    Each pass smooths about the rates of the pass before, until they stay, which is Gauss and Newton's method for the
    whole run (B. M. Bell, SIAM J. Optim. 4, 1994). ``nis`` are those of the filter.
    """
    return _solve(
        "batch", array, t, readings, errors, settings, references, path, progress, smooth=True, until_stays=True
    )


def increasing_times(t: ArrayLike, needed_by: str) -> tuple[NDArray[np.float64], float]:
    """Return sample times, shape (n,), s, and their median step, s.

    Raises
    ------
    InputError
        If there are fewer than two, or they do not increase.
    """
    times = np.asarray(t, dtype=float)
    if times.ndim != 1 or len(times) < 2:
        raise InputError(f"{needed_by} needs at least two samples; record longer")
    if not np.isfinite(times).all() or np.any(np.diff(times) <= 0):
        raise InputError("sample times must be finite and increase; drop repeated or reordered samples")
    return times, float(np.median(np.diff(times)))


def _solve(
    method: str,
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    settings: FilterSettings | None,
    references: Sequence[Measured],
    path: PathStart | None,
    progress: Callable[[float], object] | None,
    *,
    smooth: bool,
    until_stays: bool = False,
) -> RateEstimate:
    times, period = increasing_times(t, f"the {method}")
    live = LiveRateFilter(
        array, errors, period, settings, references=[one.reference for one in references], path=path, progress=progress
    )
    beside = np.concatenate([np.zeros((len(times), 0)), *(one.values for one in references)], axis=1)
    tracks = live.run_recording(times, readings, beside, smooth=smooth, until_stays=until_stays)
    assert live.start is not None
    found = [live.estimate_of(times, out, method, index) for index, out in enumerate(tracks)]
    for one in found:
        _require_finite(array, one)
    return _signed(live, tracks, found)


def _signed(live: LiveRateFilter, tracks: list[Estimates], found: list[RateEstimate]) -> RateEstimate:
    """Choose the track, and the sign of each rate where it is in doubt."""
    assert live.start is not None
    judge = SignJudge(live.sets, live.start, live.period)
    disagrees = np.mean(tracks[0].inflation > DISAGREEING) >= DISAGREES_OFTEN
    if live.sign_is_measured:
        best, _ = likelier(*live.carried) if len(found) > 1 else (0, 1.0)
        return replace(found[best], sign=SignDecision())
    if not judge.possible or not (live.start.sign_open or live.restarts or disagrees):
        return replace(found[0], sign=SignDecision())
    chances = [
        judge.of_recording(live.samples, live.constants(index), out, one.rest)
        for index, (out, one) in enumerate(zip(tracks, found, strict=True))
    ]
    best, sure = likelier(*live.carried) if len(found) > 1 else (0, 0.5)
    if len(found) > 1 and merged(found[0], found[1]):
        sure = 1.0
    if sure < DECIDED and len(found) > 1:  # the single samples may know better
        scores = [float(np.sum(np.abs(chance - 0.5) * (chance - 0.5))) for chance in chances]
        best = int(np.argmax(scores)) if max(scores) > _PREFERRED else best
    chance = chances[best]
    if (len(found) == 1 and not live.start.sign_open) or sure >= DECIDED:
        chance = with_filter(chance)
    result = with_signs(found[best], chance, known=not live.start.sign_open)
    if len(found) == 1:
        return result
    if sure >= DECIDED:
        result = replace(result, sign=replace(result.sign, state="decided"))
    if result.sign.state == "undecided":
        return replace(result, mirrored=replace(found[1 - best], sign=result.sign))
    so_far = judge.of_stream(live.samples, live.constants(best), tracks[best], found[best].rest)
    decided = np.flatnonzero((so_far > DECIDED) & clear_of_zero(result.omega, result.std))
    at = float(result.t_s[decided[0]]) if decided.size else float(result.t_s[-1])
    ratio = abs(float(live.carried[0].scalars[LIKELIHOOD] - live.carried[1].scalars[LIKELIHOOD]))
    return replace(result, sign=replace(result.sign, decided_at_s=at, log_likelihood_ratio=ratio))


def _require_finite(array: AccelerometerArray, result: RateEstimate) -> None:
    """Refuse an estimate that ran away.

    Raises
    ------
    GeometryError
        If the rate is not finite everywhere: the array leaves products of ω in α that its null space doesn't see.
    """
    broken = ~np.isfinite(result.omega).all(axis=1)
    if broken.any():
        raise GeometryError(
            f"the rate ran away at t = {result.t_s[int(np.argmax(broken))]:.4g} s: array {array.name!r} leaves "
            "products of the rate in α, which feed back on themselves; turn slower, or use an array that sees them"
        )
