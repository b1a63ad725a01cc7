"""Non-linearity of the sensing axes as unknowns of a calibration: l = b + y + q y², with y = M a.

A data sheet states the deviation from a straight line at full scale; of an ADXL345 it is 0.5 % of 16 g, which is
3 mm/s² at 1 g: more than the noise of a mean over a rest, and the same whenever a pose is repeated, so that no
averaging removes it and no scatter of the poses shows all of it. The coefficient q of every axis is therefore estimated
with the other parameters, under the prior of the data sheet. What the poses do not show of it (in poses about the
six faces, much) enters the standard deviations of bias and sensitivity. Poses show nothing of a cubic coefficient c; a
turntable does (`gfimu.calibration.spin`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.part_file import PartFile
from gfimu.base.errors import InputError
from gfimu.calibration.gauss_helmert import Condition
from gfimu.calibration.observations import Observations
from gfimu.recording import Recording

__all__ = ["cubic_std", "quadratic_statement", "quadratic_std", "with_quadratic"]

Floats = NDArray[np.float64]


def quadratic_std(recording: Recording, array: AccelerometerArray | None = None) -> Floats:
    """Take the standard deviation of each channel's quadratic coefficient from the data sheet of its part.

    Parameters
    ----------
    recording : Recording
        Readings in m/s² or raw counts.
    array : AccelerometerArray, optional
        The array, whose chips have parts; by default that of the recording, or the part that its metadata name.

    Returns
    -------
    ndarray, shape (c,)
        Deviation at full scale over the full range, 1 per reading unit; zero where no data sheet states it.
    """
    return _of_data_sheets(recording, array, 1)


def cubic_std(recording: Recording, array: AccelerometerArray | None = None) -> Floats:
    """Take the standard deviation of each channel's cubic coefficient from the data sheet of its part.

    Parameters
    ----------
    recording : Recording
        Readings in m/s² or raw counts.
    array : AccelerometerArray, optional
        The array, whose chips have parts; by default that of the recording, or the part that its metadata name.

    Returns
    -------
    ndarray, shape (c,)
        Deviation at full scale over the full range squared, 1 per reading unit squared; zero where no data sheet states
        it. The data sheet does not say which power it is of: each may be all of it.
    """
    return _of_data_sheets(recording, array, 2)


def _of_data_sheets(recording: Recording, array: AccelerometerArray | None, power: int) -> Floats:
    """Return the deviation at full scale over the full range to a power, in reading units, (c,)."""
    if recording.unit not in {"m_s2", "lsb"}:
        return np.zeros(len(recording.channels))
    if array is None:
        try:
            array = recording.array
        except InputError:
            array = None
    parts = {} if array is None else {chip.name: chip.part for chip in array.chips}
    files = recording.metadata.get("parts_toml") if array is None else array.part_files
    default = str(recording.metadata.get("part", ""))
    values, known = [], {}
    for channel in recording.channels:
        name = parts.get(channel[:-1], default)
        if name not in known:
            try:
                known[name] = PartFile.load(name, files) if name else None
            except InputError:
                known[name] = None
        part = known[name]
        if part is None or part.full_range_m_s2 is None:
            values.append(0.0)
            continue
        unit = float(recording.metadata.get("lsb_m_s2", part.lsb_m_s2)) if recording.unit == "lsb" else 1.0
        values.append(part.nonlinearity_full_scale / (part.full_range_m_s2 / unit) ** power)
    return np.array(values)


def quadratic_statement(observations: Observations) -> tuple[str, ...]:
    """Say that the axes are taken to bend, and by how much before the data."""
    if not observations.bends:
        return ()
    at_1_g = float(observations.quadratic_prior.max() * np.ptp(observations.means, axis=0).max() ** 2 / 4.0)
    unit = observations.unit.replace("m_s2", "m/s²").replace("lsb", "counts")
    text = (
        f"non-linearity of the data sheet ({at_1_g:.2g} {unit} at 1 g, standard deviation): quadratic "
        "coefficients q are estimated with the other parameters and are in their standard deviations"
    )
    return (text,)


def with_quadratic(condition: Condition, biases: NDArray[np.intp]) -> Condition:
    """Extend a condition on straight readings to bent ones: d more parameters, the coefficients q.

    Parameters
    ----------
    condition : callable
        f(x, l) with its Jacobians, for u parameters and d observations.
    biases : ndarray of int, shape (d,)
        Place of the bias of each observation among the u parameters.

    Returns
    -------
    callable
        The condition for the parameters x, then q, shape (u + d,). With l' = l − q (l − b)²: ∂l'/∂l = 1 − 2 q (l − b),
        ∂l'/∂b = 2 q (l − b), ∂l'/∂q = −(l − b)².
    """

    def bent(parameters: Floats, readings: Floats) -> tuple[Floats, Floats, Floats]:
        own = len(parameters) - len(biases)
        q, y = parameters[own:], readings - parameters[biases]  # (d,), (n, d)
        f, a, b = condition(parameters[:own], readings - q * y**2)
        by_q = -b * (y**2)[:, None, :]  # (n, r, d)
        by_x = a.copy()
        by_x[:, :, biases] += b * (2.0 * q * y)[:, None, :]
        return f, np.concatenate([by_x, by_q], axis=2), b * (1.0 - 2.0 * q * y)[:, None, :]

    return bent
