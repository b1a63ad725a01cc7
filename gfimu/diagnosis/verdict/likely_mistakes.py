"""Mistakes that are likely where a simulation does not fit at all, and which of them makes it fit.

The file may have its channels in another order or with other signs than the check of the samples mends, the array file
may give lengths in another unit, or the array may be another one of the library. None of that is an effect of a part or
a rig: it is tried where the sizes found are impossible, or where nothing in the library fits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from gfimu.array.array import AccelerometerArray
from gfimu.base.files.model_files import list_models
from gfimu.diagnosis.data.plausibility import NOISE, REMOVED
from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.learn import predicted_by_reference
from gfimu.diagnosis.verdict.gate import NOT_THIS_UNIT
from gfimu.diagnosis.verdict.verdict import Diagnosis
from gfimu.model.world_model import WorldModel, is_linear

__all__ = ["LikelyMistake", "likely_mistake", "with_mistake"]

_NO_MISTAKE = (
    "Other orders and signs of the channels, millimetres, centimetres or inches for metres, and other arrays of the "
    "library were tried: none of them fits."
)

_LENGTHS = {"mm": 1e3, "cm": 1e2, "inches": 1.0 / 0.0254}
"""Numerical: units for which a length of the array file may have been taken, and how many there are in a metre."""

Predict = Callable[[WorldModel, Run], NDArray[np.float64]]


@dataclass(frozen=True)
class LikelyMistake:
    """A mistake that would explain what does not fit.

    Parameters
    ----------
    text : str
        What is wrong, in words.
    before, after : float
        Rms of the misfit without it and with it mended, m/s².
    """

    text: str
    before: float
    after: float

    @property
    def sentence(self) -> str:
        """The mistake with what mending it is worth."""
        text = f"{self.text[:1].upper()}{self.text[1:]}"
        return f"{text}: with that mended the misfit falls from {self.before:.3g} to {self.after:.3g} m/s²."


def likely_mistake(model: WorldModel, runs: Sequence[Run], predict: Predict) -> LikelyMistake | None:
    """Return the likely mistake that removes the most of a misfit; None where none removes four fifths of it.

    Parameters
    ----------
    model : WorldModel
        The simulation.
    runs : sequence of Run
        The recordings.
    predict : callable
        Predicts the channels (n, c), m/s², of a run by a model that its reference drives.
    """
    white = model.expected_noise(runs[0].output_data_rate).white
    predictions = [predict(model, run) for run in runs]
    before = _Misfit.of(runs, predictions, white)
    if before.squares < NOISE:
        return None
    options: list[tuple[str, _Misfit]] = []
    for text, array in _other_arrays(model.array):
        other = model.with_array(array)
        options.append((text, _Misfit.of(runs, [predict(other, run) for run in runs], white)))
    options += _placed_otherwise(model, runs, predict, predictions, white)
    options += _read_otherwise(model.array, runs, predictions, white)
    least = min(misfit.squares for _, misfit in options)
    if least > (1.0 - REMOVED) * before.squares:
        return None
    # Another order of the channels does as well as some other arrays: the plainest comes first.
    text, after = next(option for option in options if option[1].squares <= least + NOISE)
    return LikelyMistake(text, before.rms, after.rms)


def with_mistake(found: Diagnosis, stretches: Sequence[Stretch], runs: Sequence[Run]) -> Diagnosis:
    """Return a verdict with a mistake in the files that explains what nothing in the library does.

    Parameters
    ----------
    found : Diagnosis
        The verdict.
    stretches : sequence of Stretch
        The data with the simulation as it was given.
    runs : sequence of Run
        The recordings.
    """
    model = stretches[0].model
    if found.verdict != "unknown" or is_linear(model) or model.drive_source == "gyro":
        return found
    mistake, more = likely_mistake(model, runs, predicted_by_reference), ""
    if mistake is not None:
        found = replace(found, unexplained=replace(found.unexplained, mistake=mistake.text))
        more = mistake.sentence
    elif found.unexplained.signature.startswith(NOT_THIS_UNIT):
        more = _NO_MISTAKE
    first, *others = found.sentences
    return replace(found, sentences=(first, more, *others)) if more else found


@dataclass(frozen=True)
class _Misfit:
    """Mean square of a misfit in units of the noise, and its rms, m/s²."""

    squares: float
    rms: float

    @classmethod
    def of(cls, runs: Sequence[Run], predictions: Sequence[NDArray[np.float64]], white: NDArray[np.float64]) -> _Misfit:
        error = np.concatenate(
            [np.where(run.valid, run.readings - one, 0.0) for run, one in zip(runs, predictions, strict=True)]
        )
        return cls(float(np.mean((error / white) ** 2)), float(np.sqrt(np.mean(error**2))))


def _placed_otherwise(
    model: WorldModel,
    runs: Sequence[Run],
    predict: Predict,
    predictions: Sequence[NDArray[np.float64]],
    white: NDArray[np.float64],
) -> Iterator[tuple[str, _Misfit]]:
    """Yield for each chip the place from which it reads best: a reading is linear in its chip's place."""
    array = model.array
    positions, axes = array.chip_positions, [chip.axes for chip in array.chips]
    base = np.concatenate(predictions)
    slopes = []
    for direction in array.length_unit * np.eye(3):
        moved = model.with_array(array.with_geometry(positions + direction, axes))
        slopes.append(np.concatenate([predict(moved, run) for run in runs]) - base)  # (n, c)
    valid = np.concatenate([run.valid for run in runs])
    error = np.where(valid, np.concatenate([run.readings for run in runs]) - base, 0.0) / white
    starts = np.cumsum([len(prediction) for prediction in predictions])[:-1]
    for index, chip in enumerate(array.chips):
        mine = array.chip_of_channel == index
        design = np.stack([np.where(valid, slope / white, 0.0)[:, mine].ravel() for slope in slopes], axis=1)
        step = np.linalg.lstsq(design, error[:, mine].ravel(), rcond=1e-6)[0]  # numerical: an axis shows no height
        change = sum(part * slope for part, slope in zip(step, slopes, strict=True))
        place = positions[index] + array.length_unit * step
        placed = np.split(base + np.where(mine, change, 0.0), starts)
        text = f"chip {chip.name} reads as if at {_in_metres(place)}, not at {_in_metres(positions[index])}"
        yield text, _Misfit.of(runs, placed, white)


def _in_metres(place: NDArray[np.float64]) -> str:
    return f"({', '.join(f'{part + 0.0:.3f}' for part in np.round(place, 3))}) m"


def _read_otherwise(
    array: AccelerometerArray,
    runs: Sequence[Run],
    predictions: Sequence[NDArray[np.float64]],
    white: NDArray[np.float64],
) -> Iterator[tuple[str, _Misfit]]:
    """Yield the best order and signs of the channels, if they are others than those of the array."""
    valid = np.concatenate([run.valid for run in runs])
    readings = np.concatenate([np.where(run.valid, run.readings, 0.0) for run in runs])
    predicted = np.concatenate(predictions)
    count = np.maximum(valid.sum(axis=0), 1)[:, None]
    power = np.sum(readings**2, axis=0)[:, None] + valid.T.astype(float) @ predicted**2  # (c, c)
    cross = readings.T @ predicted
    weight = np.where(valid.any(axis=0), 1.0 / white, 0.0)[:, None] ** 2 / count
    costs = np.stack([(power - 2.0 * sign * cross) * weight for sign in (1.0, -1.0)])
    # Arrays have symmetries. Of orders that fit the same: no wrong sign, then as named, then the axis of that number.
    axis = np.concatenate([np.arange(len(chip.axes)) for chip in array.chips])
    costs[1] += NOISE + NOISE
    costs += NOISE * (1.0 - np.eye(len(axis)))
    costs += NOISE * (axis[:, None] != axis) / len(axis)
    mine, its = linear_sum_assignment(costs.min(axis=0))
    signs = np.where(costs[0, mine, its] <= costs[1, mine, its], 1.0, -1.0)
    changed = np.flatnonzero((its != mine) | (signs < 0.0))
    if not len(changed):
        return
    starts = np.cumsum([len(prediction) for prediction in predictions])[:-1]
    otherwise = np.split(predicted[:, its] * signs, starts)
    yield _order_in_words(array.channels, its, signs, changed), _Misfit.of(runs, otherwise, white)


def _order_in_words(
    channels: Sequence[str], its: NDArray[np.intp], signs: NDArray[np.float64], changed: NDArray[np.intp]
) -> str:
    """Say which channels read what others, or their opposites, should."""
    reads = [f"{channels[place]} reads {'−' if signs[place] < 0 else ''}{channels[its[place]]}" for place in changed]
    return f"the order or the signs of the channels are wrong ({', '.join(reads)})"


def _other_arrays(array: AccelerometerArray) -> Iterator[tuple[str, AccelerometerArray]]:
    """Yield the array with lengths in other units, and arrays of the library that have the same channels."""
    axes = [chip.axes for chip in array.chips]
    for unit, scale in _LENGTHS.items():
        too_large = array.with_geometry(array.chip_positions / scale, axes)
        yield f"the lengths of the array file are in {unit}, not in m", too_large
        yield (
            f"the lengths of the array file are {scale:.4g} times too small",
            array.with_geometry(array.chip_positions * scale, axes),
        )
    for name in list_models("arrays"):
        other = AccelerometerArray.load(name)
        if other.channels == array.channels:
            placed = array.with_geometry(other.chip_positions, [chip.axes for chip in other.chips])
            yield f"the array is {name} of the library, not the one that the simulation has", placed
