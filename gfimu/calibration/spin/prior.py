"""What is known of the sensing axes before a run on the turntable: a static calibration, or the data sheet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.limits import PartLimits
from gfimu.base.errors import InputError, UnitError
from gfimu.calibration.error_model import ErrorModel
from gfimu.calibration.nonlinearity import cubic_std, quadratic_std
from gfimu.calibration.parameter_names import cubic_names, parameter_names, quadratic_names
from gfimu.calibration.result import Calibration
from gfimu.calibration.spin.policy import SpinPolicy
from gfimu.recording import Recording

__all__ = ["SensorPrior", "sensor_prior"]

Floats = NDArray[np.float64]

_LIMIT = 3.0  # standard deviations at which a data sheet's limits of bias and gain are taken to lie


@dataclass(frozen=True)
class SensorPrior:
    """Parameters of the sensing axes before the run, as a calibration, and where they are from.

    Parameters
    ----------
    calibration : Calibration
        With q and c of every axis; the positions of an earlier one stay in it.
    source : str
        For people.
    bends_std : mapping of str to float
        Standard deviation of each q and c before any run on a table.
    """

    calibration: Calibration
    source: str
    bends_std: Mapping[str, float]

    def models(self, values: Floats) -> list[ErrorModel]:
        """Return the error model of each chip for other values of the parameters."""
        start = self.calibration
        index = {name: place for place, name in enumerate(start.names)}

        def of(names: tuple[str, ...]) -> Floats:
            return values[[index[name] for name in names]]

        return [
            replace(
                ErrorModel.from_parameters(of(parameter_names(chip, start.gauge)), start.gauge),
                quadratic=of(quadratic_names((chip,))),
                cubic=of(cubic_names((chip,))),
            )
            for chip in start.chips
        ]


def sensor_prior(
    start: Calibration | None,
    recording: Recording,
    array: AccelerometerArray,
    *,
    gravity: float,
    turn_on_std_m_s2: float,
    largest: Floats,
    policy: SpinPolicy,
) -> SensorPrior:
    """Return what is known of the axes before the run.

    Parameters
    ----------
    start : Calibration, optional
        Static calibration, or that of an earlier run on the table; else the data sheets of the parts.
    recording : Recording
        The run, its channels in the order of the array.
    array : AccelerometerArray
        The drawing.
    gravity : float
        Local gravity, m/s².
    turn_on_std_m_s2 : float
        Change of a bias since ``start``, standard deviation, m/s².
    largest : ndarray, shape (c,)
        Largest input of each channel in the run, reading unit.
    policy : SpinPolicy
        Figures for what neither states.

    Raises
    ------
    UnitError
        If ``start`` is for readings in another unit.
    InputError
        If it is of other channels, or the size of a count is unknown.
    """
    source = "the data sheets" if start is None else f"the {start.method} calibration"
    if start is None:
        start = _of_data_sheets(recording, array)
    elif start.unit != recording.unit:
        raise UnitError(f"the readings are in {recording.unit}, the calibration in {start.unit}; give both in one unit")
    elif start.channels != array.channels:
        raise InputError(f"the calibration is of {', '.join(start.channels)}, not of array {array.name!r}")
    else:
        start = _with_turn_on(start, turn_on_std_m_s2)
    stated = _bends(start, recording, array, largest, policy)
    found = _with_bends(start, stated, gravity, policy)
    if start.method != "spin":
        stated = {name: found.std_of(name) for name in stated}
    return SensorPrior(found, source, stated)


def _of_data_sheets(recording: Recording, array: AccelerometerArray) -> Calibration:
    """Return nominal sensitivities and no bias, with the standard deviations of the parts."""
    limits = PartLimits.of(array, recording.sample_rate)
    scale = np.ones(array.n_channels)
    if recording.unit == "lsb":
        count = recording.metadata.get("lsb_m_s2")
        scale = 1.0 / (limits.lsb if count is None else np.full(array.n_channels, float(count)))
    names: list[str] = []
    values, std = [], []
    for index, chip in enumerate(array.chips):
        own = slice(3 * index, 3 * index + 3)
        gain, side = scale[own, None] * np.eye(3), scale[own, None] * (1.0 - np.eye(3))
        names += parameter_names(chip.name, "array")
        values += [*gain.ravel(), *np.zeros(3)]
        spread = gain * limits.gain[own, None] / _LIMIT + side * limits.axis_std[own, None]
        std += [*spread.ravel(), *(limits.bias[own] / _LIMIT * scale[own])]
    return Calibration(
        "data-sheet",
        recording.unit,
        array.channels,
        "array",
        float("nan"),
        tuple(names),
        np.array(values),
        np.diag(np.square(std)),
    )


def _with_turn_on(start: Calibration, std_m_s2: float) -> Calibration:
    """Return a calibration whose biases may have changed since."""
    covariance = start.covariance.copy()
    for chip, model in start.models.items():
        for axis, gain in zip("xyz", np.linalg.norm(model.sensitivity, axis=1), strict=True):
            place = start.names.index(f"{chip}_b_{axis}")
            covariance[place, place] += (std_m_s2 * gain) ** 2
    return replace(start, covariance=covariance)


def _bends(
    start: Calibration, recording: Recording, array: AccelerometerArray, largest: Floats, policy: SpinPolicy
) -> dict[str, float]:
    """Return the standard deviation of every q and c by the data sheets, where they state one."""
    wide = policy.unknown_nonlinearity
    found: dict[str, float] = {}
    for names, stated, unknown in (
        (quadratic_names(start.chips), quadratic_std(recording, array), wide / largest),
        (cubic_names(start.chips), cubic_std(recording, array), wide / largest**2),
    ):
        found |= dict(zip(names, np.where(stated > 0.0, stated, unknown).tolist(), strict=True))
    return found


def _with_bends(start: Calibration, stated: Mapping[str, float], gravity: float, policy: SpinPolicy) -> Calibration:
    """Return a calibration with q and c of every axis: those it has, else zero with the data sheet's prior.

    A model of poses that has no c takes a part of c (K1 g)² for gain: the two are correlated from then on.
    """
    added = [name for name in stated if name not in start.names]
    names, count = (*start.names, *added), len(start.names)
    size = len(names)
    covariance = np.zeros((size, size))
    covariance[:count, :count] = start.covariance
    covariance[range(count, size), range(count, size)] = np.square([stated[name] for name in added])
    if start.method != "data-sheet":
        mix = np.eye(size)
        for name in added:
            chip, kind, axis = name.rsplit("_", 2)
            if kind == "c":
                gain = float(np.linalg.norm(start.models[chip].sensitivity["xyz".index(axis)]))
                share = policy.cubic_of_poses * gravity**2 * gain**3
                mix[names.index(f"{chip}_M_{axis}{axis}"), names.index(name)] = -share
        covariance = mix @ covariance @ mix.T
    return replace(
        start,
        names=names,
        values=np.concatenate([start.values, np.zeros(len(added))]),
        covariance=covariance,
        null_space=np.vstack([start.null_space, np.zeros((len(added), start.null_space.shape[1]))]),
        gravity=gravity,
    )
