"""Positions, biases and delays of an array's chips from a shake of the array alone: no table, no gyro.

A corrected reading is y_i = A_i (p + Γ r_i) + β_i − d_i dy_i/dt with Γ = [α×] + ωωᵀ − |ω|² I. The specific force p of
the origin is unknown at every sample and eliminated. The rate ω(t) is a cubic spline, and its derivative is the angular
acceleration: α = dω/dt + ε, where ε is vibration that the sampling does not resolve, of a variance learned with the
rest (restricted maximum likelihood). Without that tie the scale of the positions would be open: larger positions with
slower rates give the same centripetal field. The signs are settled by it as well, and by the rests at both ends, where
ω is zero. What the static calibration leaves uncertain in sensitivities and bends is taken along with its covariance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.linalg import block_diag

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.calibration.array_motion import ArrayMotion, gradient, rate_derivative, turning_readings
from gfimu.calibration.motion_observability import describe_null_space
from gfimu.calibration.result import Calibration
from gfimu.calibration.shake_equations import BorderedBand, RateSpline, Solved
from gfimu.calibration.shake_scale import scale_from_band
from gfimu.calibration.shake_start import Shake, shakes, signed_rate
from gfimu.recording import Recording
from gfimu.recording.rest import Rest

__all__ = ["array_shake"]

Floats = NDArray[np.float64]

_KNOT_S = 0.016
_STILL_RATE = 0.01  # rad/s: of an array that the rest detection finds still
_RANK_TOLERANCE = 1e-9
_ITERATIONS = 8
_BLOCK = 500
_CLUSTER_S = 0.5
_LEAST_SCALE = 0.2  # standard deviation of the scale beyond which the drawing says more, a ratio
_NOT_AT_ALL = 1.0  # standard deviation of the scale as large as the scale
_RESOLVED = 0.5  # with more vibration than that against the noise, α = dω/dt does not hold sample by sample
_SCALE_BY_ALL = "from α = dω/dt"
_SCALE_BY_BAND = (
    "from α = dω/dt between 2 and 8 Hz, as vibration beyond the sample rate spoils it elsewhere; record faster for more"
)
_RATIOS = (100.0, 30.0, 10.0, 3.0, 1.0, 0.3, 0.1, 0.01)  # of vibration to noise, both as readings


@dataclass(frozen=True)
class _Data:
    """Samples of all shakes, and what is fixed of the array."""

    readings: Floats  # (n, c)
    slopes: Floats  # (n, c), m/s³
    still: NDArray[np.bool_]
    spline: RateSpline
    array: AccelerometerArray
    free: Floats  # (c − 3, c): combinations without p
    doubt: Floats  # (c, 4, z): what the static calibration leaves open, by channel
    start_noise: float  # m/s²
    rate: float  # Hz


@dataclass(frozen=True)
class _State:
    """Everything that is adjusted."""

    coefficients: Floats
    positions: Floats
    biases: Floats
    delays: Floats
    doubt: Floats
    noise: float  # m/s², of a reading


@dataclass(frozen=True)
class _Step:
    """Outcome of one linearisation."""

    state: _State
    response: Floats  # (3 size, m): of the spline by the common parameters
    inverse: Floats  # (m, rank): root of the covariance for unit noise
    null: Floats  # (m, u)
    moved: float
    square: float
    freedom: int
    minus_log_likelihood: float


def array_shake(
    recording: Recording,
    array: AccelerometerArray,
    static: Calibration,
    rest: Rest,
    *,
    progress: Callable[[float], object] | None = None,
) -> ArrayMotion:
    """Fit positions, residual biases and delays of the chips to shakes of the array between rests.

    Parameters
    ----------
    recording : Recording
        Readings corrected by the static calibration, m/s².
    array : AccelerometerArray
        The drawing, where the fit starts.
    static : Calibration
        The static calibration, whose uncertainty is taken along.
    rest : Rest
        Rests of the recording; two samples or more of them bound each shake.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    ArrayMotion
        With ``delays`` and their part of the covariance after positions and biases.

    Raises
    ------
    InputError
        If there is no rest, nothing turns fast enough, or the fit does not settle.
    """
    if not len(rest):
        raise InputError("a shake needs a rest before it; hold the array still for a few seconds first")
    noise = _noise(recording, array, rest)
    found = shakes(recording, array, rest, noise)
    setup = _data(recording, array, static, found, float(np.sqrt(np.mean(noise**2))))
    omega = np.concatenate([shake.omega for shake in found])
    k, c = len(array.chips), array.n_channels
    state = _State(
        setup.spline.fit(omega),
        array.chip_positions.copy(),
        np.zeros(c),
        np.zeros(k),
        np.zeros(setup.doubt.shape[2]),
        setup.start_noise,
    )
    done = progress or (lambda _: None)
    ratio, others = _learned_ratio(setup, state, done)
    resolved = ratio <= _RESOLVED
    step = _settled(setup, others[-2], ratio)
    state = step.state
    sigma2 = step.square / max(step.freedom, 1) * _block_factor(setup, state, ratio, step)
    count = 3 * k + c + k
    covariance = (step.inverse @ step.inverse.T)[:count, :count] * sigma2
    relative = block_diag(np.eye(3 * k + c), np.eye(k) - 1.0 / k)
    covariance = relative @ covariance @ relative.T
    if not resolved:
        state, covariance = _scaled(setup, state, covariance, found, [other.positions for other in others[-3:]])
    scale_std = _scale_std(state, covariance)
    if not scale_std < _LEAST_SCALE:
        how = f"to {100.0 * scale_std:.2g} % only" if scale_std < _NOT_AT_ALL else "not at all"
        raise InputError(
            f"this motion shows the scale of the positions {how}; shake the array faster "
            "(5 rad/s and more, about all axes, from rest to rest)"
        )
    null = step.null[: 3 * k + c]
    sizes = np.linalg.norm(null, axis=0)
    null = np.linalg.qr(null[:, sizes > 1e-6])[0]
    fitted = array.with_geometry(state.positions, [chip.axes for chip in array.chips])
    text = _SCALE_BY_ALL if resolved else _SCALE_BY_BAND
    return ArrayMotion(
        state.positions,
        state.biases.reshape(k, -1),
        covariance,
        null,
        (*describe_null_space(null, fitted), *_statements(state, covariance, text)),
        float(np.sqrt(sigma2)),
        _residual_rms(setup, replace(state, positions=array.chip_positions)),
        len(setup.readings),
        "shake",
        delays=state.delays - state.delays.mean(),
    )


def _data(
    recording: Recording, array: AccelerometerArray, static: Calibration, found: list[Shake], noise: float
) -> _Data:
    readings = np.concatenate([shake.readings for shake in found])
    slopes = np.concatenate([np.gradient(shake.readings, shake.t_s, axis=0) for shake in found])
    still = np.concatenate([shake.still for shake in found])
    spline = RateSpline.of(found, max(_KNOT_S, recording.sample_period))
    free = np.linalg.svd(array.axes)[0][:, 3:].T
    return _Data(readings, slopes, still, spline, array, free, _doubt(static, array), noise, recording.sample_rate)


def _noise(recording: Recording, array: AccelerometerArray, rest: Rest) -> Floats:
    """White noise of each channel at rest, m/s², shape (c,)."""
    rows = recording.for_array(array)
    parts = [np.nanvar(rows[a:b], axis=0) for a, b in zip(rest.start, rest.stop, strict=True)]
    return np.asarray(np.sqrt(np.maximum(np.median(parts, axis=0), 1e-12)))


def _doubt(static: Calibration, array: AccelerometerArray) -> Floats:
    """Root of the covariance that the static calibration leaves in M and q, as errors of corrected readings.

    Returns
    -------
    ndarray, shape (c, 4, z)
        For channel c: change of its reading per true input x, y, z of its chip, and per squared own input, for z
        independent unknowns of unit variance. Biases are free in the fit and not in it.
    """
    names, places, rows = static.names, [], []
    for number, chip in enumerate(array.chips):
        model = static.models[chip.name]
        inverse = model.inverse
        for row, i in enumerate("xyz"):
            for column, j in enumerate("xyz"):
                places.append(names.index(f"{chip.name}_M_{i}{j}"))
                rows.append((number, row, column, inverse[:, row]))
            if f"{chip.name}_q_{i}" in names:
                places.append(names.index(f"{chip.name}_q_{i}"))
                rows.append((number, row, 3, inverse[:, row] * model.sensitivity[row, row] ** 2))
    values, vectors = np.linalg.eigh(static.covariance[np.ix_(places, places)])
    root = vectors[:, values > 1e-12 * values[-1]] * np.sqrt(values[values > 1e-12 * values[-1]])  # (s, z)
    doubt = np.zeros((array.n_channels, 4, root.shape[1]))
    for (number, row, column, effect), line in zip(rows, root, strict=True):
        if column == 3:  # the bend of its own axis, cross-axis parts left out
            doubt[3 * number + row, 3] += effect[row] * line
        else:
            doubt[3 * number : 3 * number + 3, column] += effect[:, None] * line
    return doubt


def _lever(array: AccelerometerArray) -> float:
    """RMS effect of an angular acceleration of 1 rad/s² on a reading, m."""
    arms = np.cross(array.positions, array.axes)
    return float(np.sqrt(np.mean(np.sum(arms**2, axis=1)) / 3.0))


def _learned_ratio(data: _Data, state: _State, done: Callable[[float], object]) -> tuple[float, list[_State]]:
    """Find the size of unresolved vibration by restricted maximum likelihood, as a ratio to the noise.

    From large to small: with much of it α does not bind the rate, and any start settles. Returned are the best ratio
    and the states found; that of the best ratio is the last but one.
    """
    states: list[_State] = []
    best, least = _RATIOS[0], np.inf
    for index, ratio in enumerate(_RATIOS):
        done(index / (len(_RATIOS) + 1))  # settling counts as one more
        step = _settled(data, state, ratio, enough=0.3, iterations=4)
        state = step.state
        states.append(state)
        if step.minus_log_likelihood >= least:
            return best, states
        best, least = ratio, step.minus_log_likelihood
    return best, [*states, state]


def _settled(data: _Data, state: _State, ratio: float, *, enough: float = 0.01, iterations: int = _ITERATIONS) -> _Step:
    """Iterate until the positions move by less than ``enough`` of their standard deviations."""
    for _ in range(iterations):
        step = _step(data, state, ratio)
        if not np.isfinite(step.moved):
            break
        state = step.state
        if step.moved < enough:
            return step
    if not np.isfinite(step.square):
        raise InputError("the fit of the shake does not settle; turn the array faster, from rest to rest")
    return step


def _step(data: _Data, state: _State, ratio: float) -> _Step:
    """Linearise all samples, eliminate the rate, and solve for what is common to them."""
    array, spline = data.array, data.spline
    k, c, z = len(array.chips), array.n_channels, data.doubt.shape[2]
    m = 4 * k + c + z
    omega, alpha = spline.at_samples(state.coefficients)
    white, log_root = _whitening(data, state, ratio)
    normal = BorderedBand(spline.size, m)
    for rows, own, border, residual in _whitened_rows(data, state, white, omega, alpha):
        normal.add(spline.place[rows], own, border, residual)
    _add_rests(normal, data, state, omega)
    normal.border[range(m - z, m), range(m - z, m)] += state.noise**2
    normal.border_right[m - z :] -= state.noise**2 * state.doubt
    return _solved(normal.solve(), normal, data, state, log_root)


def _whitening(data: _Data, state: _State, ratio: float) -> tuple[Floats, float]:
    """Return the root (c − 3, c) of the weight of what is free of p, and the log determinant of its inverse."""
    array = data.array
    by_alpha = np.cross(state.positions[array.chip_of_channel], array.axes)  # (c, 3)
    spread = np.eye(array.n_channels) + (ratio / _lever(array)) ** 2 * by_alpha @ by_alpha.T
    root = np.linalg.cholesky(data.free @ spread @ data.free.T)
    return np.linalg.solve(root, data.free), 2.0 * float(np.sum(np.log(np.diag(root))))


def _whitened_rows(
    data: _Data, state: _State, white: Floats, omega: Floats, alpha: Floats
) -> Iterator[tuple[slice, Floats, Floats, Floats]]:
    """Yield whitened rows block by block: samples, Jacobians by the spline and what is common, residuals."""
    array, spline = data.array, data.spline
    chip = array.chip_of_channel
    by_alpha = np.cross(state.positions[chip], array.axes)  # (c, 3)
    for first in range(0, len(omega), _BLOCK):
        rows = slice(first, first + _BLOCK)
        residual, border = _linearised(data, state, rows, omega[rows], alpha[rows])
        by_rate = np.einsum("ci,ncij->ncj", array.axes, rate_derivative(omega[rows], state.positions)[:, chip])
        own = (
            by_rate[:, :, None, :] * spline.basis[rows][:, None, :, None]
            + by_alpha[None, :, None, :] * spline.slope[rows][:, None, :, None]
        ).reshape(len(residual), array.n_channels, 12)
        yield rows, white @ own, white @ border, residual @ white.T


def _block_factor(data: _Data, state: _State, ratio: float, step: _Step) -> float:
    """Ratio of the scatter of the scores of blocks of samples to that of independent errors, at least 1.

    Vibration and the motion between samples make errors that last longer than a sample; then the scores of whole blocks
    scatter more than the sum of squares says (as clustered standard errors do).
    """
    omega, alpha = data.spline.at_samples(state.coefficients)
    white, _ = _whitening(data, state, ratio)
    used = 3 * len(state.positions)
    scores = []
    for rows, own, border, residual in _whitened_rows(data, state, white, omega, alpha):
        response = step.response.reshape(-1, 3, border.shape[2])[data.spline.place[rows][:, None] + np.arange(4)]
        reduced = border - own @ response.reshape(len(residual), 12, -1)
        scores.append(np.einsum("npm,np->nm", reduced, residual))
    # What each sample contributes to the positions, in units of their standard deviations.
    influence = np.concatenate(scores) @ step.inverse @ step.inverse[:used].T
    influence /= np.linalg.norm(step.inverse[:used], axis=1)
    size = max(round(_CLUSTER_S * data.rate), 2)
    blocks = np.add.reduceat(influence, np.arange(0, len(influence), size), axis=0)
    factor = float(np.sum(blocks**2) / np.sum(influence**2))
    spread = np.sqrt(2.0 / len(blocks) / max(used - 3, 1))
    return factor if factor > 1.0 + 3.0 * spread else 1.0


def _linearised(data: _Data, state: _State, rows: slice, omega: Floats, alpha: Floats) -> tuple[Floats, Floats]:
    """Residuals (n, c) of some samples, and Jacobian (n, c, m) by positions, biases, delays and doubt."""
    array, y, slopes = data.array, data.readings[rows], data.slopes[rows]
    k, c, n = len(array.chips), array.n_channels, len(y)
    chip = array.chip_of_channel
    field = gradient(omega, alpha)
    moved = np.einsum("nij,kj->nki", field, state.positions)[:, chip]
    inputs = np.concatenate([y.reshape(n, k, 3)[:, chip], (y**2)[:, :, None]], axis=2)  # (n, c, 4)
    by_doubt = np.einsum("nci,ciz->ncz", inputs, data.doubt)
    model = np.einsum("ci,nci->nc", array.axes, moved) + state.biases - slopes * state.delays[chip]
    residual = y - model - by_doubt @ state.doubt
    border = np.zeros((n, c, 4 * k + c))
    by_position = np.einsum("ci,nij->ncj", array.axes, field)
    for channel in range(c):
        border[:, channel, 3 * chip[channel] : 3 * chip[channel] + 3] = by_position[:, channel]
        border[:, channel, 3 * k + channel] = 1.0
        border[:, channel, 3 * k + c + chip[channel]] = -slopes[:, channel]
    return residual, np.concatenate([border, by_doubt], axis=2)


def _add_rests(normal: BorderedBand, data: _Data, state: _State, omega: Floats) -> None:
    """Add ω = 0 for the samples at rest."""
    still = np.flatnonzero(data.still)
    if not len(still):
        return
    weight = state.noise / _STILL_RATE
    jacobian = np.einsum("na,ij->niaj", data.spline.basis[still], np.eye(3)).reshape(len(still), 3, 12)
    normal.add(data.spline.place[still], weight * jacobian, None, -weight * omega[still])


def _solved(solved: Solved, normal: BorderedBand, data: _Data, state: _State, log_root: float) -> _Step:
    """Solve the reduced equations: steps of least norm where they leave directions open."""
    k, c = len(data.array.chips), data.array.n_channels
    size = 1.0 / np.sqrt(np.maximum(np.diag(normal.border), 1e-30))
    values, vectors = np.linalg.eigh(solved.normal * np.outer(size, size))
    kept = values > _RANK_TOLERANCE * values[-1]
    inverse = size[:, None] * vectors[:, kept] / np.sqrt(values[kept])
    step = inverse @ (inverse.T @ solved.right)
    spline = solved.spline - (solved.response @ step).reshape(solved.spline.shape)
    rows = len(data.readings) * (c - 3) + 3 * int(data.still.sum())
    freedom = max(rows - 3 * data.spline.size - int(kept.sum()) + data.doubt.shape[2], 1)
    square = normal.square + state.noise**2 * float(state.doubt @ state.doubt)
    determinant = solved.log_determinant + float(np.sum(np.log(values[kept])))
    likelihood = freedom * np.log(square / freedom) + len(data.readings) * log_root + determinant
    place = np.cumsum([3 * k, c, k])
    parts = np.split(step, place)
    std = np.sqrt(square / freedom) * np.linalg.norm(inverse[: 3 * k], axis=1)
    new = _State(
        state.coefficients + spline,
        state.positions + parts[0].reshape(k, 3),
        state.biases + parts[1],
        state.delays + parts[2],
        state.doubt + parts[3],
        float(np.sqrt(square / freedom)),
    )
    moved = float(np.max(np.abs(parts[0]) / np.maximum(std, 1e-9)))
    return _Step(
        new, solved.response, inverse, size[:, None] * vectors[:, ~kept], moved, square, freedom, float(likelihood)
    )


def _residual_rms(data: _Data, state: _State) -> float:
    """RMS of what the chips disagree, with the rate as fitted, m/s²."""
    omega, alpha = data.spline.at_samples(state.coefficients)
    total = 0.0
    for first in range(0, len(omega), _BLOCK):
        rows = slice(first, first + _BLOCK)
        residual, _ = _linearised(data, state, rows, omega[rows], alpha[rows])
        total += float(np.sum((residual @ data.free.T) ** 2))
    return float(np.sqrt(total / len(omega) / len(data.free)))


def _scaled(
    data: _Data, state: _State, covariance: Floats, found: list[Shake], others: list[Floats]
) -> tuple[_State, Floats]:
    """Take the scale of the positions from the band of the shaking, in place of the tie of every sample.

    White vibration is then a poor model of the errors: how far the form of the array differs from ``others``, the fits
    with three times more and less of it, is added to the covariance.
    """
    k, centre = len(state.positions), state.positions.mean(axis=0)
    size = float(np.linalg.norm(data.array.chip_positions - data.array.chip_positions.mean(axis=0)))
    arms = _of_size(state.positions, size)  # the drawing's size, to start with
    fitted = data.array.with_geometry(centre + arms, [chip.axes for chip in data.array.chips])
    parts = []
    for shake in found:
        readings = shake.readings - state.biases
        rate = signed_rate(fitted, shake.t_s, readings, np.full(data.array.n_channels, data.start_noise), shake.still)
        parts.append((shake.t_s, turning_readings(readings, fitted, rate), CubicSpline(shake.t_s, rate)(shake.t_s, 1)))
    scale, std = scale_from_band(parts)
    rest = np.zeros(len(covariance) - 3 * k)
    along = np.concatenate([(scale * arms).ravel(), rest])
    unit = along / np.linalg.norm(along)
    across = np.eye(len(along)) - np.outer(unit, unit)
    total = across @ covariance @ across + (std / scale) ** 2 * np.outer(along, along)
    for other in others:
        apart = np.concatenate([(_of_size(other, size) - arms).ravel(), rest])
        total = total + np.outer(apart, apart)
    return replace(state, positions=centre + scale * arms), total


def _of_size(positions: Floats, size: float) -> Floats:
    """Positions about their mean, scaled to a norm."""
    arms = positions - positions.mean(axis=0)
    return np.asarray(arms * (size / np.linalg.norm(arms)))


def _scale_std(state: _State, covariance: Floats) -> float:
    """Return the standard deviation of the common scale of the positions, a ratio."""
    centred = (state.positions - state.positions.mean(axis=0)).ravel()
    along = centred / np.sum(centred**2)
    count = len(centred)
    return float(np.sqrt(along @ covariance[:count, :count] @ along))


def _statements(state: _State, covariance: Floats, source: str) -> tuple[str, ...]:
    """Say what fixes the scale, how well, and what the delays are relative to."""
    scale = f"± {100.0 * _scale_std(state, covariance):.2g} % (1 standard deviation)"
    return (
        f"scale of the positions: {scale}, {source}; gravity is not used for it",
        "a mirrored motion is excluded by the drawing, where the fit starts, and by the rests, where ω is zero",
        "delays of the chips are relative to their mean: a delay common to all is not determined",
    )
