"""The library of effects as a linear model of one recording: columns, least squares, answers from them.

What a method of any kind may begin with. Each column is the finite difference of the twin's prediction by one size of
an effect; the noise is taken for white. The motion of the table is either free, a spline that is fitted with everything
else, or taken from the smoothed tachometer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.linalg import cho_factor, cho_solve
from scipy.ndimage import gaussian_filter1d
from scipy.sparse import csr_array
from scipy.stats import norm

from gfimu.array.array import AccelerometerArray
from gfimu.recording import Recording
from sim.effects import Effect
from sim.motions.motion import SpinMotion, SplineSpin
from sim.twin import Twin

__all__ = ["Block", "Candidate", "KnownDrive", "LinearLibrary", "fitted_sizes", "motion_columns", "stated_parameters"]

Floats = NDArray[np.float64]

_SMOOTHING = 0.03  # of the tachometer, s
_STEP = 0.1  # finite difference as a share of the prior's standard deviation
_KNOTS_S = 0.03  # distance of the knots of a free motion
_SLOPE = 1e-4  # step of the slope of a parameter, in standard deviations of a size
_NEAR = 0.02  # the same about effects that are large already
_SINGULAR = 1e-10  # numerical: singular values below this share count as zero
_SEEN = 1e-6  # standard deviation as a share of the prior below which a size was left out, not measured


class KnownDrive:
    """Predictions for a recording whose smoothed tachometer is taken for the truth.

    Parameters
    ----------
    recording : Recording
        With a tachometer.
    twin : Twin
        The simulation.
    """

    def __init__(self, recording: Recording, twin: Twin) -> None:
        self._twin = twin
        self._t = recording.t_s
        self._rate = gaussian_filter1d(recording.reference["tacho_rad_s"], _SMOOTHING / recording.sample_period)
        self._temperature = recording.reference.get("temperature_degC")
        self._motion = SplineSpin.through(self._t, self._rate)
        self.nominal, self._reference = self._predict(self._motion, ())

    def _predict(self, motion: SplineSpin, effects: Sequence[Effect]) -> tuple[Floats, Floats]:
        return self._twin.predict(motion, self._t, effects=effects, temperature=self._temperature)

    def readings(self, *effects: Effect) -> Floats:
        """Return the channels (n, c) with effects, m/s²; a wrong reference means another motion than it says."""
        moved, reading = self._predict(self._motion, effects)
        if np.array_equal(reading, self._reference):
            return moved
        corrected = SplineSpin.through(self._t, self._rate - (reading - self._reference))
        return self._predict(corrected, ())[0]


def motion_columns(motion: SpinMotion, t: Floats, nominal: Floats, tacho_noise: float, knots_s: float) -> csr_array:
    """Return what the coefficients of a cubic spline of the table's rate change, shape (n (c + 1), knots).

    Parameters
    ----------
    motion : SpinMotion
        Motion about which the change is linear.
    t : ndarray, shape (n,)
        Sample times, s.
    nominal : ndarray, shape (n, c)
        Prediction of the channels in this motion, in units of their noise.
    tacho_noise : float
        White noise of the tachometer, rad/s, whose reading stands behind the channels of each sample.
    knots_s : float
        Distance of the knots, s.
    """
    state = motion.at(t)
    known = np.column_stack([np.ones_like(t), state.acceleration, state.rate**2])
    _, tangential, centripetal = np.linalg.lstsq(known, nominal, rcond=None)[0]  # a level table reads nothing else
    knots = np.arange(t[0] - 3 * knots_s, t[-1] + 4 * knots_s, knots_s)
    count = len(knots) - 4
    rate = BSpline(knots, np.eye(count), 3, extrapolate=False)
    b, slope = np.nan_to_num(rate(t)), np.nan_to_num(rate.derivative()(t))  # (n, knots)
    moved = slope[:, None] * tangential[:, None] + 2.0 * (state.rate[:, None] * b)[:, None] * centripetal[:, None]
    return csr_array(np.concatenate([moved, b[:, None] / tacho_noise], axis=1).reshape(-1, count))


class FreeDrive:
    """Channels and tachometer of a recording in units of their noise, with the motion of the table projected out.

    Parameters
    ----------
    recording : Recording
        With a tachometer.
    twin : Twin
        The simulation.
    """

    def __init__(self, recording: Recording, twin: Twin) -> None:
        self._twin, self._t = twin, recording.t_s
        tacho = recording.reference["tacho_rad_s"]
        rate = gaussian_filter1d(tacho, _SMOOTHING / recording.sample_period)
        self._temperature = recording.reference.get("temperature_degC")
        self._motion = SplineSpin.through(self._t, rate)
        self._tacho_noise = float(np.median(np.abs(tacho - rate))) / norm.ppf(0.75)
        self._white = twin.expected_noise(recording.sample_rate).white
        nominal = self.predicted().reshape(len(tacho), -1)[:, :-1]
        self._moves = motion_columns(self._motion, self._t, nominal, self._tacho_noise, _KNOTS_S)
        self._motion_gram = cho_factor((self._moves.T @ self._moves).toarray())
        self.measured = self._joined(recording.for_array(twin.array), tacho)

    def predicted(self, *effects: Effect) -> Floats:
        """Return the prediction with effects, (n (c + 1),)."""
        channels, reference = self._twin.predict(self._motion, self._t, effects=effects, temperature=self._temperature)
        return self._joined(channels, reference)

    def _joined(self, channels: Floats, reference: Floats) -> Floats:
        return np.column_stack([channels / self._white, reference / self._tacho_noise]).ravel()

    def products(self, columns: Floats, residual: Floats) -> tuple[Floats, Floats, float]:
        """Return normal matrix, score and sum of squares, (m, m), (m,) and a number, the motion at its best."""
        along, moved = self._moves.T @ columns, self._moves.T @ residual
        gram = columns.T @ columns - along.T @ cho_solve(self._motion_gram, along)
        best = cho_solve(self._motion_gram, moved)
        return gram, columns.T @ residual - along.T @ best, float(residual @ residual - moved @ best)


@dataclass(frozen=True)
class Block:
    """Columns of one kind of effect at one shape.

    Parameters
    ----------
    family : type of Effect
        The kind of effect.
    shape : dict of str to float
        Its shape parameters.
    columns : slice
        Where its columns stand.
    keys : tuple of str
        Name of each size.
    places : tuple of ndarray, each of shape (m, k)
        Mixing matrices of the places that its sizes may be confined to.
    """

    family: type[Effect]
    shape: dict[str, float]
    columns: slice
    keys: tuple[str, ...]
    places: tuple[Floats, ...]


@dataclass(frozen=True)
class Candidate:
    """One effect at one place and shape: a term that a fit may include.

    Parameters
    ----------
    effect : str
        Contract name.
    block : Block
        Its columns.
    spread : ndarray, shape (columns, k)
        Its free coordinates as combinations of all columns.
    """

    effect: str
    block: Block
    spread: Floats

    @property
    def free(self) -> int:
        """Number of free coordinates."""
        return int(self.spread.shape[1])


@dataclass(frozen=True)
class LinearLibrary:
    """All effects of a twin's library as columns against the residual of one recording.

    Parameters
    ----------
    blocks : tuple of Block
        Kinds of effects and shapes.
    gram : ndarray, shape (m, m)
        Normal matrix of the columns, in units of the noise and of the prior.
    score : ndarray, shape (m,)
        Columns times residual.
    scale : ndarray, shape (m,)
        Prior standard deviation of each size.
    samples : int
        Number of readings.
    chi2 : float
        Sum of squares of the residual, in units of the noise.
    array : AccelerometerArray
        Array of the twin.
    """

    blocks: tuple[Block, ...]
    gram: Floats
    score: Floats
    scale: Floats
    samples: int
    chi2: float
    array: AccelerometerArray

    @classmethod
    def of(cls, recording: Recording, twin: Twin, *, free_motion: bool = False) -> LinearLibrary:
        """Compute the columns of a recording, the motion of the table free or that of the smoothed tachometer."""
        white = twin.expected_noise(recording.sample_rate).white
        drive = KnownDrive(recording, twin)
        free = FreeDrive(recording, twin) if free_motion else None
        begun = free.predicted() if free else (drive.nominal / white).ravel()
        residual = np.nan_to_num(recording.for_array(twin.array) - drive.nominal)
        blocks: list[Block] = []
        columns: list[Floats] = []
        scale: list[float] = []
        for family in twin.families().values():
            sizes = family.sizes(twin.array)
            for shape in _shapes(family, recording, residual) if sizes else ():
                first = len(columns)
                for index, size in enumerate(sizes):
                    values = np.zeros(len(sizes))
                    values[index] = _STEP * size.prior_std
                    effect = family.from_sizes(twin.array, values, shape)
                    moved = free.predicted(effect) if free else (drive.readings(effect) / white).ravel()
                    columns.append((moved - begun) / _STEP)
                    scale.append(size.prior_std)
                places = tuple(pattern.mixing for pattern in family.patterns(twin.array))
                keys = tuple(size.key for size in sizes)
                blocks.append(Block(family, shape, slice(first, len(columns)), keys, places))
        design, whitened = np.column_stack(columns), (residual / white).ravel()
        if free:
            products = free.products(design, np.nan_to_num(free.measured - begun))
        else:
            products = design.T @ design, design.T @ whitened, float(whitened @ whitened)
        gram, score, chi2 = products
        return cls(tuple(blocks), gram, score, np.array(scale), residual.size, chi2, twin.array)

    @cached_property
    def candidates(self) -> tuple[Candidate, ...]:
        """Every effect at every shape and place, each once."""
        found = []
        for block in self.blocks:
            for mixing in block.places:
                spread = np.zeros((len(self.score), mixing.shape[1]))
                spread[block.columns] = mixing
                found.append(Candidate(block.family.name, block, spread))
        return tuple(found)

    def explained(self, chosen: Sequence[Candidate]) -> float:
        """Return the drop of χ² by a least-squares fit of some terms."""
        mixing = np.hstack([one.spread for one in chosen])
        score = mixing.T @ self.score
        return float(score @ np.linalg.pinv(mixing.T @ self.gram @ mixing, rcond=_SINGULAR) @ score)

    def fit(self, chosen: Sequence[Candidate]) -> tuple[Floats, Floats]:
        """Return the sizes (m,) of a least-squares fit in units of the prior, and their covariance (m, m)."""
        mixing = np.hstack([one.spread for one in chosen])
        covariance = np.linalg.pinv(mixing.T @ self.gram @ mixing, rcond=_SINGULAR)
        return mixing @ (covariance @ (mixing.T @ self.score)), mixing @ covariance @ mixing.T

    def causes(self, chosen: Sequence[Candidate]) -> list[dict[str, Any]]:
        """Return the causes of an answer: the terms with their fitted sizes, standard deviations and shapes."""
        causes: list[dict[str, Any]] = []
        if not chosen:
            return causes
        estimate, covariance = self.fit(chosen)
        for block in {one.effect: one.block for one in chosen}.values():
            here, scale = block.columns, self.scale[block.columns]
            spread = covariance[here, here] * np.outer(scale, scale)
            parameters = stated_parameters(block.family, self.array, estimate[here] * scale, spread, block.shape)
            causes.append({"effect": block.family.name, "parameters": parameters})
        return causes


def stated_parameters(
    family: type[Effect], array: AccelerometerArray, sizes: Floats, covariance: Floats, shape: Mapping[str, float]
) -> dict[str, dict[str, float]]:
    """Return the parameters of an effect in the contract's keys, with standard deviations to first order.

    Parameters
    ----------
    family : type of Effect
        The kind of effect.
    array : AccelerometerArray
        The array.
    sizes, covariance : ndarray, shapes (k,) and (k, k)
        Linear coordinates, as of `sim.effects.Effect.from_sizes`, and their covariance.
    shape : mapping of str to float
        Shape parameters.
    """
    keys = [key for key in family.from_sizes(array, sizes, shape).parameters if key not in shape]

    def values(at: Floats) -> Floats:
        found = family.from_sizes(array, at, shape)
        return np.array([found.value(key) for key in keys])

    found, slopes = values(sizes), np.zeros((len(keys), len(sizes)))
    for index, std in enumerate(np.sqrt(np.maximum(np.diag(covariance), 0.0))):
        if std > 0.0:
            moved = sizes.copy()
            moved[index] += _SLOPE * std
            change = values(moved) - found
            turned = [key == "phase_rad" for key in keys]  # a phase may jump by a turn
            slopes[:, index] = np.where(turned, np.angle(np.exp(1j * change)), change) / (_SLOPE * std)
    stds = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slopes, covariance, slopes), 0.0))
    least = {size.key: _SEEN * size.prior_std for size in family.sizes(array)}
    parameters = {
        key: {"value": float(value), "std": float(std)}
        for key, value, std in zip(keys, found, stds, strict=True)
        if std > least.get(key, 0.0)
    }
    return parameters | {key: {"value": value} for key, value in shape.items()}


def fitted_sizes(recording: Recording, twin: Twin, effects: Sequence[Effect]) -> list[dict[str, Any]]:
    """Return the causes of an answer: given effects with all their sizes fitted by one Gauss–Newton step.

    Parameters
    ----------
    recording : Recording
        With a tachometer.
    twin : Twin
        The simulation.
    effects : sequence of Effect
        What the recording is known to have, near its true sizes and shapes.
    """
    array, drive = twin.array, FreeDrive(recording, twin)
    sizes = [(index, place, size) for index, one in enumerate(effects) for place, size in enumerate(one.sizes(array))]
    begun, columns = drive.predicted(*effects), []
    for number, place, size in sizes:
        values = effects[number].size_values(array)
        values[place] += _NEAR * size.prior_std
        moved = list(effects)
        moved[number] = type(effects[number]).from_sizes(array, values, effects[number].shape_values())
        columns.append((drive.predicted(*moved) - begun) / _NEAR)
    design = np.column_stack(columns) if columns else np.zeros((begun.size, 0))
    gram, score, _ = drive.products(design, np.nan_to_num(drive.measured - begun))
    scale = np.array([size.prior_std for _, _, size in sizes])
    covariance = np.asarray(np.linalg.pinv(gram, rcond=_SINGULAR, hermitian=True) * np.outer(scale, scale), float)
    step = covariance @ (score / scale)
    causes: list[dict[str, Any]] = []
    for number, one in enumerate(effects):
        given = {key: {"value": value} for key, value in one.parameters.items()}
        here = [column for column, (owner, _, _) in enumerate(sizes) if owner == number]
        fitted = one.size_values(array) + step[here]
        found = stated_parameters(type(one), array, fitted, covariance[np.ix_(here, here)], one.shape_values())
        causes.append({"effect": one.name, "parameters": given | (found if here else {})})
    return causes


def _shapes(family: type[Effect], recording: Recording, residual: Floats) -> tuple[dict[str, float], ...]:
    """Return the grid of a family; a tone is put at the highest line of the mean periodogram."""
    if family.name != "interference_tone":
        return family.shapes(recording.duration, recording.sample_rate)
    power = np.mean(np.abs(np.fft.rfft(residual - residual.mean(axis=0), axis=0)) ** 2, axis=1)
    line = int(np.argmax(power[1:])) + 1
    return ({"frequency_hz": line * recording.sample_rate / len(residual)},)
