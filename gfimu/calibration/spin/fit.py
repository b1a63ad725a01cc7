"""Non-linearity of the sensing axes from a turntable with a tachometer: spin reduction after IEEE Std 836-2009.

At a constant rate a chip at the arm ρ reads its bias, gravity along the axis, and ω² ρ: with several speeds the powers
ω², ω⁴, ω⁶ of the reading separate K1 ρ, K2 and K3. What the table adds has a prior and is an unknown of the fit: the
radius of every chip, arm stretch, dynamic levelling, direction and place of the axis, the tachometer. A radius error
looks like one of K1; arm stretch adds to ω⁴ as K2 does, with the sign of the arm (the standard calls it bucking). All
channels are fitted together, so that what they share shows as such; their correlations are reported.

The powers of the rate that each error makes, and the names, are those of the definitions in clause 3 of IEEE Std
836-2001 and the contents of its 2009 edition, from excerpts that sellers publish; the printed standard was not at hand.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.calibration.fit_quality import covariance_scale
from gfimu.calibration.result import Calibration
from gfimu.calibration.spin.model import Geometry, SpinGeometry, read_plateaus
from gfimu.calibration.spin.plateaus import Plateaus, find_plateaus
from gfimu.calibration.spin.policy import SpinPolicy
from gfimu.calibration.spin.prior import SensorPrior, sensor_prior
from gfimu.calibration.spin.report import spin_statements, spin_statistics
from gfimu.recording import Recording

__all__ = ["spin"]

Floats = NDArray[np.float64]

_ITERATIONS = 20  # numerical
_SETTLED = 1e-3  # numerical: of a standard deviation
_FEWEST_SPEEDS = 2
_ACROSS = 0.7  # cosine: a sensing axis nearer to the table's axis than 45° is not across it


def spin(
    recording: Recording,
    array: AccelerometerArray,
    *,
    start: Calibration | None = None,
    gravity: float = STANDARD_GRAVITY,
    min_plateau_s: float = 1.0,
    turn_on_std_m_s2: float = 0.03,
    policy: SpinPolicy | None = None,
) -> Calibration:
    """Estimate quadratic and cubic coefficients of every channel from plateaus of constant table rate.

    Parameters
    ----------
    recording : Recording
        Array fixed to a turntable that holds several speeds, m/s² or raw counts, with ``tacho_rad_s``. It may stand
        upright or lie on its side: the direction of the axis is found from gravity.
    array : AccelerometerArray
        The drawing, of tri-axial chips.
    start : Calibration, optional
        Static calibration of the array, for K0, K1 and alignment, or the result of another spin, say on another side;
        without one they have the priors of the data sheet.
    gravity : float
        Local gravity, m/s².
    min_plateau_s : float
        Shortest plateau, s.
    turn_on_std_m_s2 : float
        Change of a bias since ``start``, standard deviation, m/s².
    policy : SpinPolicy, optional
        Priors of the table.

    Returns
    -------
    Calibration
        Parameters of ``start``, updated, with q and c of every axis (`gfimu.calibration.error_model.ErrorModel`).

    Raises
    ------
    InputError
        If there is no tachometer, no plateau, one speed only, or a chip without three axes.
    UnitError
        If ``start`` is for readings in another unit.
    """
    table = policy or SpinPolicy()
    run = _in_order(recording, array)
    nominal = sensor_prior(
        start,
        run,
        array,
        gravity=gravity,
        turn_on_std_m_s2=turn_on_std_m_s2,
        largest=np.maximum(np.nanmax(np.abs(run.readings), axis=0), np.finfo(float).eps),
        policy=table,
    )
    gains = np.concatenate([np.linalg.norm(model.sensitivity, axis=1) for model in nominal.calibration.models.values()])
    plateaus = find_plateaus(run, gains * gravity * table.lean_std_rad, min_plateau_s, table)
    speeds = plateaus.speeds(table.distinct)
    if len(speeds) < _FEWEST_SPEEDS:
        raise InputError(
            f"one speed only ({speeds[0]:.3g} rad/s): non-linearity shows in how the reading grows from speed to "
            "speed; hold three or more"
        )
    problem = _Problem.of(nominal, plateaus, array, gravity, table)
    solution = problem.solve()
    factor, doubts = covariance_scale(solution.misfit / solution.redundancy, round(solution.redundancy))
    if factor > 1.0:
        solution = problem.solve(factor, solution.values)
    result = problem.result(solution)
    return replace(
        result,
        statements=spin_statements(nominal, result, plateaus, solution.covariance, problem.at, problem.arms(), table),
        warnings=(*_saturation(plateaus, array.channels), *doubts),
        statistics={
            **spin_statistics(plateaus, solution.values, solution.covariance, problem.at, table),
            "lean_rad": problem.lean,
            "covariance_factor": factor,
            "redundancy": solution.redundancy,
        },
    )


def _in_order(recording: Recording, array: AccelerometerArray) -> Recording:
    """Return the run with the channels of the array, in its order."""
    if any(chip.axes.shape != (3, 3) for chip in array.chips):
        raise InputError(f"array {array.name!r} has chips without three axes; spin calibrates whole triads")
    missing = [name for name in array.channels if name not in recording.channels]
    if missing:
        raise InputError(f"the recording lacks {', '.join(missing)} of array {array.name!r}; give the right array")
    columns = [recording.channels.index(name) for name in array.channels]
    return replace(recording, readings=recording.readings[:, columns], channels=array.channels)


def _saturation(plateaus: Plateaus, channels: tuple[str, ...]) -> tuple[str, ...]:
    """Name the channels that are saturated on a plateau, a sentence each."""
    return tuple(
        f"channel {name} is saturated on {count} of {len(plateaus)} plateaus, which are left out for it: set a wider "
        "range, or turn more slowly"
        for name, count in zip(channels, plateaus.saturated.sum(axis=0).tolist(), strict=True)
        if count
    )


@dataclass(frozen=True)
class _Solution:
    """Values (u,) and covariance (u, u) after the data, misfit of the means, and its expectation."""

    values: Floats
    covariance: Floats
    misfit: float
    redundancy: float


@dataclass(frozen=True)
class _Problem:
    """Everything of a fit: u = s + m unknowns, those of the sensors and those of the table, with their prior."""

    sensors: SensorPrior
    geometry: SpinGeometry
    at: dict[str, NDArray[np.intp]]
    values: Floats
    covariance: Floats
    lean: float

    @classmethod
    def of(
        cls, sensors: SensorPrior, plateaus: Plateaus, array: AccelerometerArray, gravity: float, table: SpinPolicy
    ) -> _Problem:
        """Lay out the unknowns and their prior."""
        start = sensors.calibration
        placed = start.calibrated_array(array)
        frame, offset, lean = _axis(start, plateaus, placed, gravity)
        layout = Geometry.of(len(array.chips), plateaus, own_frames=start.gauge != "array")
        geometry = SpinGeometry(placed, plateaus, frame, offset, gravity * np.cos(lean), layout)
        std = np.zeros(layout.size)
        for name, value in (
            ("radii", table.radius_std_m),
            ("offset", table.offset_std_m),
            ("direction", table.axis_std_rad),
            ("levelling", table.dynamic_levelling_std_s2_rad),
            ("shift", table.shift_std_m_s2_rad2),
            ("stretch", table.stretch_std_s2_rad2),
            ("tacho_scale", table.tacho_scale_std),
            ("squares", plateaus.square_std[plateaus.spinning]),
            ("leans", table.lean_std_rad),
            ("drawing", 0.0 if start.positions else table.frame_std_rad),
            ("rotations", table.frame_std_rad),
        ):
            std[getattr(layout, name)] = np.maximum(value, np.finfo(float).eps)
        # Fitted positions are parameters of the earlier calibration and unknowns of the table at once.
        sensing = [index for index, name in enumerate(start.names) if "_r_" not in name]
        count = len(sensing)
        values, covariance = np.zeros(count + layout.size), np.zeros((count + layout.size,) * 2)
        values[:count] = start.values[sensing]
        covariance[range(count, len(values)), range(count, len(values))] = std**2
        places = np.empty(len(start.names), dtype=np.intp)
        places[sensing] = np.arange(count)
        known = list(range(len(start.names)))
        for number, chip in enumerate(array.chips):
            for column, axis in enumerate("xyz"):
                if (name := f"{chip.name}_r_{axis}") in start.names:
                    places[start.names.index(name)] = count + layout.radii.start + 3 * number + column
        earlier = start.covariance.copy()
        if count < len(start.names):  # what the motion left undetermined is as in the drawing
            moved = [place for place in known if place not in sensing]
            directions = start.null_space[moved]
            earlier[np.ix_(moved, moved)] += table.radius_std_m**2 * directions @ directions.T
        covariance[np.ix_(places, places)] = earlier
        at = {name: count + np.arange(layout.size)[getattr(layout, name)] for name in layout.__dataclass_fields__}
        at |= {"parameters": places, "sensors": np.arange(count)}
        return cls(sensors, geometry, at, values, covariance, lean)

    def solve(self, factor: float = 1.0, near: Floats | None = None) -> _Solution:
        """Find the unknowns of greatest posterior density by an iterated Kalman update that begins near some values.

        The variance of the means is multiplied by the factor.
        """
        runs = self.geometry.plateaus
        used = np.isfinite(runs.variance).ravel()
        measured, noise = runs.means.ravel()[used], factor * runs.variance.ravel()[used]
        values, prior = self.values if near is None else near, self.covariance
        std, before = np.sqrt(np.diag(prior)), values
        for _ in range(_ITERATIONS):
            try:
                with np.errstate(all="ignore"):
                    predicted, slopes = self._predict(values)
                    predicted, slopes = predicted.ravel()[used], slopes.reshape(-1, len(values))[used]
                    spread = prior @ slopes.T  # (u, n)
                    total = cho_factor(slopes @ spread + np.diag(noise), lower=True)
            except ValueError:  # the step led to where the equations have no solution: half of it
                values = 0.5 * (before + values)
                continue
            gain = cho_solve(total, spread.T).T
            before, values = values, self.values + gain @ (measured - predicted - slopes @ (self.values - values))
            if np.all(np.abs(values - before) <= _SETTLED * std):
                break
        else:
            raise InputError(
                "the fit to the plateaus did not settle: the recording is not that of this array on a turntable"
            )
        remaining = np.eye(len(values)) - gain @ slopes
        covariance = remaining @ prior @ remaining.T + (gain * noise) @ gain.T  # Joseph's form
        residual = measured - self._predict(values)[0].ravel()[used]
        redundancy = len(measured) - float(np.sum(gain.T * slopes))
        return _Solution(values, covariance, float(residual**2 @ (1.0 / noise)), redundancy)

    def _predict(self, values: Floats) -> tuple[Floats, Floats]:
        """Return the readings of the plateaus and their derivatives by all unknowns."""
        start, count = self.sensors.calibration, len(self.at["sensors"])
        parameters = start.values.copy()
        sensing = self.at["parameters"] < count
        parameters[sensing] = values[self.at["parameters"][sensing]]
        models = self.sensors.models(parameters)
        index = {name: int(place) for name, place in zip(start.names, self.at["parameters"], strict=True)}

        def place(number: int, kind: str) -> int:
            return index.get(f"{start.chips[number]}_{kind}", -1)

        std = np.sqrt(np.diag(self.covariance))[count:]
        return read_plateaus(self.geometry, values[count:], std, models, place, count)

    def arms(self) -> dict[str, Floats]:
        """Return the arm along each sensing axis across the table's, as weights of the unknowns, by name of its K1."""
        across, axis = self.geometry.frame[:2], self.geometry.frame[2]
        found = {}
        for index, chip in enumerate(self.geometry.array.chips):
            for sensing, letter in zip(chip.axes, "xyz", strict=True):
                if abs(float(sensing @ axis)) < _ACROSS:
                    weights = np.zeros(len(self.values))
                    weights[self.at["radii"][3 * index : 3 * index + 3]] = sensing
                    weights[self.at["offset"]] = -across @ sensing
                    weights[self.at["drawing"]] = np.cross(chip.position, sensing)
                    found[f"{chip.name}_M_{letter}{letter}"] = weights
        return found

    def result(self, solution: _Solution) -> Calibration:
        """Return the parameters of the sensing axes, and positions where the earlier calibration has them."""
        start, places = self.sensors.calibration, self.at["parameters"]
        values = solution.values[places].copy()
        fitted = places >= len(self.at["sensors"])
        values[fitted] += start.values[fitted]
        covariance = solution.covariance[np.ix_(places, places)]
        fresh = replace(
            start, method="spin", values=values, covariance=(covariance + covariance.T) / 2.0, statistics={}
        )
        return replace(fresh, null_space=_carried_directions(start, fresh))


def _carried_directions(start: Calibration, fresh: Calibration) -> Floats:
    """Return the directions that the start left undetermined, rotations dM = M X of the frame, at the fitted M."""
    directions = start.null_space.copy()
    for chip in start.chips:
        rows = [
            start.names.index(f"{chip}_M_{i}{j}") for i in "xyz" for j in "xyz" if f"{chip}_M_{i}{j}" in start.names
        ]
        if len(rows) == 9:  # a triangular M has its frame
            turned = fresh.models[chip].sensitivity @ start.models[chip].inverse
            directions[rows] = np.einsum("ij,jkn->ikn", turned, directions[rows].reshape(3, 3, -1)).reshape(9, -1)
    return np.asarray(np.linalg.qr(directions)[0], dtype=np.float64)


def _axis(
    start: Calibration, plateaus: Plateaus, array: AccelerometerArray, gravity: float
) -> tuple[Floats, Floats, float]:
    """Return where the readings show the axis to be: its frame (3, 3), a point (3,), m, and its lean, rad.

    The mean specific force over the chips is g n − ω² ρ: a straight line in ω².
    """

    def body(readings: Floats) -> Floats:
        parts = [
            model.correct(readings[:, 3 * index : 3 * index + 3]) @ chip.axes
            for index, (model, chip) in enumerate(zip(start.models.values(), array.chips, strict=True))
        ]
        return np.asarray(np.mean(parts, axis=0), dtype=np.float64)

    whole = np.isfinite(plateaus.variance).all(axis=1)
    if int(whole.sum()) < _FEWEST_SPEEDS:
        raise InputError("fewer than two plateaus have all channels: set a wider range, or turn more slowly")
    design = np.column_stack([np.ones(int(whole.sum())), plateaus.square[whole]])
    up, pull = np.linalg.lstsq(design, body(plateaus.means[whole]), rcond=None)[0]
    size = float(np.linalg.norm(up))
    if not 0.8 * gravity < size < 1.2 * gravity:
        raise InputError(
            f"at no rate the readings amount to {size:.3g} m/s², not to gravity: wrong unit, calibration or array, or "
            "an axis that is not vertical"
        )
    n = up / size
    across = np.linalg.svd(n[None])[2][1:]
    offset = array.chip_positions.mean(axis=0) + across.T @ (across @ pull)
    turning = plateaus.spinning & whole & (plateaus.turns >= 1.0)
    lean = 0.0
    if turning.any():
        bias = np.concatenate([model.bias for model in start.models.values()])
        waves = [body(plateaus.wave[turning, :, part] + bias) @ across.T for part in (0, 1)]
        squares = sum(np.sum(wave**2, axis=1) for wave in waves) / 2.0
        lean = float(np.sqrt(np.average(squares, weights=plateaus.turns[turning]))) / gravity
    return np.vstack([across, n]), offset, lean
