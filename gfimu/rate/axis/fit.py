"""The noise, the inclination and the start of a rotation about one axis, found by the likelihood of the filter."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from gfimu.array.array import AccelerometerArray
from gfimu.array.turning_axis import TurningAxis
from gfimu.base.errors import InputError
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.rate.axis.channels import AxisChannels
from gfimu.rate.axis.mirror import clear_starts, first_odds, with_signs
from gfimu.rate.axis.mounting import Mounting
from gfimu.rate.axis.mounting_fit import MountingFit, fit_mounting
from gfimu.rate.axis.problem import AxisProblem, Settings
from gfimu.rate.axis.recursion import FilterRun
from gfimu.rate.axis.roughness import with_roughness

__all__ = ["AxisFit", "first_settings", "first_starts", "fit_axis"]

_LEARNT_FROM = 3000  # samples: enough for four numbers
_TRIED_ON = 600  # samples, on which starts are compared
_PHASES = 8  # of gravity at the start
_TURNS = 3  # of constants of the mounting and numbers of the filter, each given the other; by choice
_SAME = 0.1  # change of the log of the noise below which another turn changes nothing that matters; by choice
_CLEAR = 300.0  # nats: log odds of the sign with the mounting as drawn, above which the other is given up; by choice
_ALONG, _UNSEEN = 2, 1e-6  # column of the force along the axis; its smallest norm that is no rounding error
_LEVEL = 0.03  # rad: below it gravity across the axis shows no angle beside biases
_STD_START = np.array([0.5, 0.3, 5.0])  # of [θ, Ω, α] at a start that was tried, rad, rad/s, rad/s²


@dataclass(frozen=True)
class AxisFit:
    """What the likelihood found.

    Parameters
    ----------
    settings : Settings
        Numbers of the filter.
    start : ndarray, shape (3,)
        [θ, Ω, α] before the first sample.
    start_covariance : ndarray, shape (3, 3)
        Its covariance.
    sign_log_odds : float
        Log odds of the sign of the rate over the other one, nats.
    channels : AxisChannels
        What the channels read, with the uncertain constants at their estimates.
    mounting : MountingFit or None
        The constants that were uncertain; None where the mounting is exact.
    mirrored : ndarray, shape (k,)
        Samples before which the filter's rate is given the other sign (`gfimu.rate.axis.mirror`).
    roughness : ndarray, shape (n,), optional
        How the roughness of the motion differs from that of the settings (`gfimu.rate.axis.roughness`).
    """

    settings: Settings
    start: NDArray[np.float64]
    start_covariance: NDArray[np.float64]
    sign_log_odds: float
    channels: AxisChannels
    mounting: MountingFit | None = None
    mirrored: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    roughness: NDArray[np.float64] | None = None

    def on(self, problem: AxisProblem) -> AxisProblem:
        """Return a problem with the channels, signs and roughness that were found."""
        return replace(problem, channels=self.channels, mirrored=self.mirrored, roughness=self.roughness)


def fit_axis(
    t: NDArray[np.float64],
    y: NDArray[np.float64],
    array: AccelerometerArray,
    axis: TurningAxis,
    noise: NDArray[np.float64],
    *,
    at_rest: bool,
) -> AxisFit:
    """Find noise, smoothness, inclination, start and uncertain constants by the likelihood of the filter's innovations.

    Parameters
    ----------
    t, y : ndarray, shapes (n,) and (n, c)
        Times, s, and readings, m/s².
    array : AccelerometerArray
        The array.
    axis : TurningAxis
        The axis; a known inclination is kept.
    noise : ndarray, shape (c,)
        Standard deviation of the channels by their data sheets, m/s².
    at_rest : bool
        Whether the body is at rest at the first sample.
    """
    channels = AxisChannels.of(array, axis)
    problem = AxisProblem(t, y, channels, noise)
    settings, covariance = first_settings(y, channels, axis, noise, at_rest=at_rest)
    tilt, tried = settings.inclination, min(_TRIED_ON, len(t))
    starts = list(first_starts(y, channels, tilt, at_rest=at_rest))
    best = max(starts, key=lambda start: problem.likelihood(settings, start, covariance, tried))
    exact = axis.uncertainty.exact
    if exact:
        settings = _learnt(problem, settings, axis, best, covariance)
        best = max(starts, key=lambda start: problem.likelihood(settings, start, covariance, tried))
    else:
        settings = _slower(problem, settings, best, covariance)
    if at_rest:
        return _from_rest(problem, array, axis, settings, best, covariance)
    mirrored = [start for start in starts if start[1] * best[1] < 0.0] or [best * np.array([1.0, -1.0, -1.0])]
    other = max(mirrored, key=lambda start: problem.likelihood(settings, start, covariance, tried))
    runs = [problem.run(settings, start, covariance) for start in (best, other)]
    spread = max(min(run.squares / max(run.readings, 1) for run in runs), 1.0)
    ahead = (runs[0].likelihood - runs[1].likelihood) / spread
    if not exact and abs(ahead) > _CLEAR:
        fit = _with_mounting(problem, array, axis, settings, best if ahead > 0.0 else other, covariance)
        return replace(_with_own_signs(problem, array, axis, fit), sign_log_odds=float(abs(ahead)))
    fits = [_with_mounting(problem, array, axis, settings, start, covariance) for start in (best, other)]
    if not exact:
        runs = [one.on(problem).run(one.settings, one.start, covariance) for one in fits]
    odds = _density(fits[0], runs[0]) - _density(fits[1], runs[1])
    found = _with_own_signs(problem, array, axis, fits[0 if odds > 0.0 else 1])
    return replace(found, sign_log_odds=float("inf") if _alike(runs) else abs(float(odds)))


def _alike(runs: Sequence[FilterRun]) -> bool:
    """Return whether starts of either sign end in one motion: they began near zero, and there is no other sign."""
    rates = [run.states[:, 1] for run in runs]
    return bool(np.median(np.abs(rates[0] - rates[1])) < 0.1 * np.median(np.abs(rates[0] + rates[1])))


def first_settings(
    y: NDArray[np.float64],
    channels: AxisChannels,
    axis: TurningAxis,
    noise: NDArray[np.float64],
    *,
    at_rest: bool,
) -> tuple[Settings, NDArray[np.float64]]:
    """Return the numbers that a filter begins with, and the covariance (3, 3) of the state that it begins with.

    Raises
    ------
    InputError
        If the inclination of the axis is not given and does not show.
    """
    tilt = _inclination(y, channels, axis.hub) if axis.inclination is None else axis.inclination
    if axis.inclination is None and np.sin(tilt) <= _LEVEL:
        tilt = 0.0 if np.cos(tilt) > 0.0 else np.pi  # upright: what is across would be biases
    settings = Settings(_first_scale(axis, noise), 100.0, 0.0 if axis.hub == "fixed" else 1.0, tilt)
    return settings, np.diag([_STD_START[0] ** 2, 1e-4, 1e-2] if at_rest else _STD_START**2)


def _slower(
    problem: AxisProblem, settings: Settings, start: NDArray[np.float64], covariance: NDArray[np.float64]
) -> Settings:
    """Return numbers of a filter slow enough to keep a motion that an uncertain mounting, as drawn, can lose."""
    tried = [
        replace(settings, noise_scale=by * settings.noise_scale, jerk=jerk)
        for by in (1.0, 3.0, 10.0)
        for jerk in (10.0, 100.0)
    ]
    return max(tried, key=lambda one: problem.likelihood(one, start, covariance, len(problem.t)))


def _from_rest(
    problem: AxisProblem,
    array: AccelerometerArray,
    axis: TurningAxis,
    settings: Settings,
    start: NDArray[np.float64],
    covariance: NDArray[np.float64],
) -> AxisFit:
    """Return the fit of a run that begins at rest, in which the filter may take the mirrored rate.

    Of an uncertain mounting, both signs that the body may have gone off with are fitted, unless one is clear.
    """
    signed = with_signs(problem, settings, start, covariance)
    if axis.uncertainty.exact:
        if len(signed.mirrored):
            settings = _learnt(signed, settings, axis, start, covariance)
            signed = with_signs(signed, settings, start, covariance)
        return _with_mounting(signed, array, axis, settings, start, covariance)
    if len(signed.mirrored):
        settings = _slower(signed, settings, start, covariance)
    fit = _with_mounting(signed, array, axis, settings, start, covariance)
    run = signed.run(settings, start, covariance)
    starts = clear_starts(run)
    if not starts or first_odds(signed, settings, run) > _CLEAR:
        return _with_own_signs(problem, array, axis, fit)
    toggled = np.setxor1d(signed.mirrored[signed.mirrored <= starts[0]], starts[:1]).astype(np.int64)
    other = with_signs(replace(problem, mirrored=toggled), settings, start, covariance, first_kept=True)
    fits = [fit, _with_mounting(other, array, axis, settings, start, covariance)]
    runs = [one.on(problem).run(one.settings, start, covariance) for one in fits]
    odds = _density(fits[0], runs[0]) - _density(fits[1], runs[1])
    found = _with_own_signs(problem, array, axis, fits[0 if odds > 0.0 else 1])
    return replace(found, sign_log_odds=float("inf") if _alike(runs) else abs(float(odds)))


def _with_own_signs(problem: AxisProblem, array: AccelerometerArray, axis: TurningAxis, fit: AxisFit) -> AxisFit:
    """Return the fit again with the signs that its own numbers and constants show, where these are others.

    A sign that was changed before the constants were known may have mirrored a drift at rest.
    """
    for _ in range(_TURNS):
        bare = replace(fit.on(problem), mirrored=problem.mirrored)
        found = with_signs(bare, fit.settings, fit.start, fit.start_covariance)
        if np.array_equal(found.mirrored, fit.mirrored):
            break
        signed = replace(problem, mirrored=found.mirrored)
        again = _with_mounting(signed, array, axis, fit.settings, fit.start, fit.start_covariance, fit.mounting)
        fit = replace(again, sign_log_odds=fit.sign_log_odds)
    return fit


def _first_scale(axis: TurningAxis, noise: NDArray[np.float64]) -> float:
    """Return the noise to begin with, over the data sheets': an uncertain mounting adds its own, at rest."""
    doubt = axis.uncertainty
    turned = STANDARD_GRAVITY * np.hypot(doubt.rotation_std_rad, doubt.direction_std_rad)
    return float(max(2.0, np.hypot(doubt.bias_std_m_s2, turned) / np.median(noise)))


def _density(fit: AxisFit, run: FilterRun) -> float:
    """Return what decides between starts, nats: of uncertain constants their prior counts too."""
    return run.likelihood if fit.mounting is None else fit.mounting.density


def _with_mounting(
    problem: AxisProblem,
    array: AccelerometerArray,
    axis: TurningAxis,
    settings: Settings,
    start: NDArray[np.float64],
    covariance: NDArray[np.float64],
    known: MountingFit | None = None,
) -> AxisFit:
    """Return the fit from one start, with the uncertain constants estimated in turn with the filter's numbers.

    ``known`` holds values of the constants to begin with; zero by default.
    """
    if axis.uncertainty.exact:
        return AxisFit(
            settings, start, covariance, float("inf"), problem.channels, None, problem.mirrored, problem.roughness
        )
    free = axis.inclination is None and np.sin(settings.inclination) > _LEVEL
    mounting = Mounting.of(array, axis, settings.inclination, free_inclination=bool(free))
    values = np.zeros(len(mounting.constants)) if known is None else known.values_of(mounting)
    problem = replace(problem, channels=mounting.channels(values))
    for turn in range(_TURNS):
        settings = _enlarged(problem, settings, start, covariance)
        found = fit_mounting(problem, mounting, settings, start, covariance, values)
        values = found.values
        settings = replace(settings, inclination=mounting.tilt(values))
        problem = replace(problem, channels=mounting.channels(values))
        if turn + 1 == _TURNS:
            break
        stood = replace(axis, inclination=settings.inclination)
        learnt = _learnt(problem, settings, stood, start, covariance)
        problem = with_roughness(problem, learnt, start, covariance)
        again = _enlarged(problem, learnt, start, covariance)
        if abs(np.log(again.noise_scale / settings.noise_scale)) < _SAME:
            break
        settings = learnt
    return AxisFit(
        settings, start, covariance, float("inf"), problem.channels, found, problem.mirrored, problem.roughness
    )


def _enlarged(
    problem: AxisProblem, settings: Settings, start: NDArray[np.float64], covariance: NDArray[np.float64]
) -> Settings:
    """Return settings with all noises larger by one factor where the innovations of the whole run are larger.

    The noise is learnt from the first samples; what vibrates more later would count for more than it is worth.
    """
    run = problem.run(settings, start, covariance)
    by = np.sqrt(max(run.squares / max(run.readings, 1), 1.0))
    return replace(settings, noise_scale=settings.noise_scale * by, hub=settings.hub * by, jerk=settings.jerk * by**2)


def _inclination(y: NDArray[np.float64], channels: AxisChannels, hub: str) -> float:
    """Return the angle between axis and vertical, rad, from the mean force along the axis.

    Where no channel senses that force, it is the angle whose gravity across the axis the channels read; of that and its
    supplement, which then read the same, the smaller one.

    Raises
    ------
    InputError
        If neither shows, or the hub's own acceleration is across the axis as well.
    """
    matrix = channels.motion_matrix()
    rows = y[np.isfinite(y).all(axis=1)]
    if not len(rows):
        return 0.0
    if np.linalg.norm(matrix[:, _ALONG]) < _UNSEEN:
        others = np.delete(matrix, _ALONG, axis=1)
        if hub != "fixed" or np.linalg.matrix_rank(others) < others.shape[1]:
            raise InputError(
                "no channel senses along the axis, so that its inclination does not show; give inclination_rad in "
                "[turning_axis], or --inclination-rad: 0 for an upright axis, 1.5708 for a level one"
            )
        across = np.median(np.linalg.norm((rows @ np.linalg.pinv(others).T)[:, -2:], axis=1))
        return float(np.arcsin(min(across / STANDARD_GRAVITY, 1.0)))
    along = float(np.linalg.lstsq(matrix, rows.mean(axis=0), rcond=None)[0][_ALONG])
    return float(np.arccos(np.clip(along / STANDARD_GRAVITY, -1.0, 1.0)))


def first_starts(
    y: NDArray[np.float64], channels: AxisChannels, tilt: float, *, at_rest: bool
) -> Iterator[NDArray[np.float64]]:
    """Yield states to start from: the phase of gravity, and either sign of the rate that the first samples show."""
    first = y[: max(min(20, len(y)), 1)]
    known = first[np.isfinite(first).all(axis=1)]
    mean = known.mean(axis=0) if len(known) else np.zeros(y.shape[1])
    solution = np.linalg.lstsq(channels.motion_matrix(), mean, rcond=None)[0]
    rate = 0.0 if at_rest else float(np.sqrt(max(solution[1], 0.0)))
    phases = np.arange(_PHASES) * 2.0 * np.pi / _PHASES if np.sin(tilt) > _LEVEL else np.zeros(1)
    if at_rest and np.sin(tilt) > _LEVEL:
        phases = np.array([np.arctan2(-solution[4], solution[3])])
    for phase in phases:
        if at_rest:
            yield np.array([phase, 0.0, 0.0])
            continue
        for speed in (rate, 0.5 * rate + 0.5, 2.0 * rate + 1.0):
            yield np.array([phase, speed, 0.0])
            yield np.array([phase, -speed, 0.0])


def _learnt(
    problem: AxisProblem,
    settings: Settings,
    axis: TurningAxis,
    start: NDArray[np.float64],
    covariance: NDArray[np.float64],
) -> Settings:
    """Return the settings of the greatest likelihood over the first minutes."""
    samples = min(_LEARNT_FROM, len(problem.t))
    free_tilt = axis.inclination is None and np.sin(settings.inclination) > _LEVEL

    def of(values: NDArray[np.float64]) -> Settings:
        scale, jerk, *others = values
        found = replace(settings, noise_scale=float(np.exp(scale)), jerk=float(np.exp(jerk)))
        if axis.hub == "free":
            found = replace(found, hub=float(np.exp(others.pop(0))))
        if free_tilt:
            found = replace(found, inclination=float(np.clip(others.pop(0), 0.0, np.pi)))
        return found

    guess = [np.log(settings.noise_scale), np.log(settings.jerk)]
    spans = [0.7, 2.0]
    if axis.hub == "free":
        guess.append(np.log(settings.hub))
        spans.append(0.7)
    if free_tilt:
        guess.append(settings.inclination)
        spans.append(0.1)
    simplex = np.array(
        [guess, *(np.array(guess) + np.eye(len(guess))[index] * span for index, span in enumerate(spans))]
    )
    found = minimize(
        lambda values: -problem.likelihood(of(values), start, covariance, samples),
        guess,
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "maxfev": 20 + 20 * len(guess), "xatol": 0.05, "fatol": 1.0},
    )
    return of(found.x)
