"""Plausibility: recordings that fit the twin only in another unit, turned over, with another drive, or not at all.

No effect of the library is that: such a file is wrong about itself; what is wrong is reported, no diagnosis made.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from gfimu.base.errors import InputError
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.diagnosis.data.faults.wiring import SIGNIFICANT_RMS
from gfimu.diagnosis.data.reference import REFERENCE_COLUMNS
from gfimu.diagnosis.data.run import Run
from gfimu.model.world_model import WorldModel, is_linear, reads_place
from gfimu.recording.quantities import REFERENCE_UNITS

__all__ = ["NOISE", "REMOVED", "refuse_implausible"]

_REVERSED_RMS = 2.0  # of the misfit, in noise units, for a reversed reference
REMOVED = 0.8
"""Share of a misfit that another reading of the file removes where it is the right one."""
_MISSED, _MISSED_VARYING = 0.05, 0.3  # of the power of the readings, and of what varies in them, by one that fits
NOISE = 4.0
"""Squares in units of noise that are no misfit."""
_AT_REST = 0.05  # of the largest rate
_FEWEST = 20
_UNRELATED = 0.1  # correlation
_KEPT = 3  # quarters of the channels

_READINGS: Mapping[str, float] = {
    "g (name the columns a11_g, a12_g …)": 1.0 / STANDARD_GRAVITY,
    "thousandths of g (name the columns a11_mg, a12_mg …)": 1000.0 / STANDARD_GRAVITY,
    "cm/s² (divide them by 100)": 100.0,
    "mm/s² (divide them by 1000)": 1000.0,
}
"""Units for which a reading of 1 m/s² may have been taken: how many there are in it."""
_RATES: Mapping[str, float] = {
    "is in rev/min": 30.0 / np.pi,
    "is in deg/s": 180.0 / np.pi,
    "is in rev/s": 0.5 / np.pi,
    "has the opposite sign": -1.0,
}
_ANGLES: Mapping[str, float] = {
    "is in degrees": 180.0 / np.pi,
    "is in turns": 0.5 / np.pi,
    "has the opposite sign": -1.0,
}
_TURNED: Mapping[str, tuple[float, float, float]] = {
    "upright": (0.0, 0.0, 0.0),
    "upside down": (np.pi, 0.0, 0.0),
    "on its side, turned by +90° about its x axis": (np.pi / 2, 0.0, 0.0),
    "on its side, turned by -90° about its x axis": (-np.pi / 2, 0.0, 0.0),
    "on its side, turned by +90° about its y axis": (0.0, np.pi / 2, 0.0),
    "on its side, turned by -90° about its y axis": (0.0, -np.pi / 2, 0.0),
}
"""How an array may lie on a table; a turn about the table's axis changes no reading."""


def refuse_implausible(
    model: WorldModel, run: Run, prediction: NDArray[np.float64], predict: Callable[[Run], NDArray[np.float64]]
) -> None:
    """Refuse a run that hardly fits as it is and fits well in other units, turned over, or with the drive reversed.

    Parameters
    ----------
    model : WorldModel
        The simulation.
    run : Run
        The run.
    prediction : ndarray, shape (n, c)
        What the simulation predicts for it, m/s².
    predict : callable
        The same for another run.

    Raises
    ------
    InputError
        Says what is wrong with the file and how to mend it.
    """
    expected = model.expected_noise(run.output_data_rate)
    misfit = _misfit(run, prediction, expected.white)
    if misfit.varying < _REVERSED_RMS**2 and misfit.whole < SIGNIFICANT_RMS**2:
        return
    column = REFERENCE_COLUMNS[model.drive_source]
    _refuse_unrelated(run, prediction, expected.white, column)
    scales = _scales(model)
    if misfit.whole < SIGNIFICANT_RMS**2:
        scales = {words: scale for words, scale in scales.items() if scale < 0.0}
    references = [
        _Reading(f"column {column} {words}, by what the channels read; mend it", other, predict(other), steady=False)
        for words, scale in scales.items()
        for other in [replace(run, reference=run.reference / scale)]
    ]
    options = list(references)
    if not reads_place(model):
        reverse = references[list(scales).index("has the opposite sign")]
        options += _signed_in_parts(run, prediction, reverse, expected.white, predict, column)
    if misfit.whole > SIGNIFICANT_RMS**2:
        options += _in_units([_Reading("", run, prediction), *references], expected.quantum)
        options += _turned(run, predict)
    found: list[tuple[float, str]] = []
    for option in options:
        after = _misfit(option.run, option.prediction, expected.white)
        power = _misfit(option.run, np.zeros_like(prediction), expected.white)
        # Of what varies too: gravity alone would make the power of most runs.
        fits = after.whole < _MISSED * power.whole and after.varying < max(_MISSED_VARYING * power.varying, NOISE)
        left = after.whole / misfit.whole if option.steady else after.varying / misfit.varying
        if fits and left < 1.0 - REMOVED:
            found.append((left, option.text))
    if found:
        raise InputError(f"{run.name}: {min(found)[1]}")


def _scales(model: WorldModel) -> Mapping[str, float]:
    """Return what may be wrong with a reference as a whole, in words, and by what it is too large then."""
    if not is_linear(model):
        return _ANGLES if reads_place(model) else _RATES
    units = REFERENCE_UNITS[model.drive_source]
    words = {unit: unit.replace("_s2", "/s²").replace("_s", "/s") for unit, factor in units.items() if factor != 1.0}
    return {**{f"is in {words[unit]}": 1.0 / units[unit] for unit in words}, "has the opposite sign": -1.0}


@dataclass(frozen=True)
class _Reading:
    """A run read otherwise, what the twin predicts for that, and what to say if it fits.

    ``steady``: whether the means of the channels change too.
    """

    text: str
    run: Run
    prediction: NDArray[np.float64]
    steady: bool = True


@dataclass(frozen=True)
class _Misfit:
    """Mean square of what a prediction misses, in noise units: whole, and what varies."""

    whole: float
    varying: float


def _signed_in_parts(
    run: Run,
    prediction: NDArray[np.float64],
    reverse: _Reading,
    white: NDArray[np.float64],
    predict: Callable[[Run], NDArray[np.float64]],
    column: str,
) -> list[_Reading]:
    """Return the run with the reference reversed between some of its rests, as one without a direction needs it."""
    known = run.reference_valid
    size = np.abs(np.interp(run.t, run.t[known], run.reference[known]))
    parts, count = label(size > _AT_REST * size.max())
    reference = run.reference.copy()
    turned = 0
    for number in range(1, count + 1):
        rows = parts == number
        as_stated, other = (
            float(np.sum(np.where(run.valid[rows], (run.readings[rows] - expected[rows]) / white, 0.0) ** 2))
            for expected in (prediction, reverse.prediction)
        )
        if other < (1.0 - REMOVED) * as_stated:
            reference[rows] *= -1.0
            turned += 1
    if turned == 0:
        return []
    signed = replace(run, reference=reference)
    text = f"column {column} has the wrong sign in {turned} of {count} turns; give it a direction"
    return [_Reading(text, signed, predict(signed), steady=False)]


def _refuse_unrelated(run: Run, prediction: NDArray[np.float64], white: NDArray[np.float64], column: str) -> None:
    """Refuse a run in which much should vary and no channel goes with what it should read."""
    related, spreads = [], []
    for mine, expected, valid, sigma in zip(run.readings.T, prediction.T, run.valid.T, white, strict=True):
        if valid.sum() < _FEWEST or np.std(expected[valid]) < SIGNIFICANT_RMS * sigma:
            continue
        spreads.append(float(np.ptp(mine[valid])))
        related.append(abs(float(np.corrcoef(mine[valid], expected[valid])[0, 1])) if spreads[-1] > 0.0 else 0.0)
    if len(related) <= prediction.shape[1] // 3 or max(related) > _UNRELATED:
        return
    if not any(spreads):
        raise InputError(
            f"{run.name}: the channels hold one value while the table turns; check that the board was read"
        )
    raise InputError(
        f"{run.name}: no channel follows the motion that column {column} states; "
        "are they of the same run, and was the board on the table?"
    )


def _in_units(references: Sequence[_Reading], quantum: float) -> list[_Reading]:
    """Return runs with the readings in other units too."""
    counts = "counts of the converter (name the columns a11_lsb, a12_lsb …)"
    units = {**_READINGS, **({counts: 1.0 / quantum} if quantum > 0.0 else {})}
    found = []
    for one in references:
        for unit, scale in units.items():
            text = f"readings are {scale:.4g} times what the twin predicts, as if they were in {unit}"
            scaled = replace(one.run, readings=one.run.readings / scale)
            found.append(_Reading(f"{text}; and {one.text}" if one.text else text, scaled, one.prediction))
    return found


def _turned(run: Run, predict: Callable[[Run], NDArray[np.float64]]) -> list[_Reading]:
    """Return the run with the array lying otherwise."""
    found = []
    for words, rotvec in _TURNED.items():
        turned = replace(run, mounting=np.array(rotvec))
        given = ", ".join(f"{angle:.4f}" for angle in rotvec)
        text = (
            f"the readings are those of an array {words}, not of one mounted as the metadata say; "
            f"give the run mounting_rotvec_rad: [{given}]"
        )
        found.append(_Reading(text, turned, predict(turned)))
    return found


def _misfit(run: Run, prediction: NDArray[np.float64], white: NDArray[np.float64]) -> _Misfit:
    """Return the misfit over three quarters of the channels, those that miss least: a chip may be dead besides."""
    error = (run.readings - prediction) / white
    columns = [mine[valid] for mine, valid in zip(error.T, run.valid.T, strict=True) if valid.any()]
    if not columns:
        return _Misfit(0.0, 0.0)
    kept = -(-_KEPT * len(columns) // 4)
    whole = np.sort([np.mean(mine**2) for mine in columns])[:kept]
    varying = np.sort([np.var(mine) for mine in columns])[:kept]
    return _Misfit(float(whole.mean()), float(varying.mean()))
