"""What the rate estimators know about the sensors: their errors, and what each set of working channels determines.

For any set of working channels the readings y split into two parts that share no unknown motion:

* the angular acceleration, α = A y − L s(ω) − (bias), with A J = [I 0]: the filter integrates it;
* the null space of J, z = Z y = M s(ω) + (bias) + noise: the filter's measurement of the products s of ω.

A is the unweighted left inverse wherever J is orthogonal to Q (no products of ω in α), otherwise the joint form that
removes the products as far as the null space sees them well; L is what is left. Z is whitened: its noise has unit
variance. Biases are constant per channel; what the filter can know of them is b_α = A b and b_z = Z b of the full set,
and every smaller set of channels sees linear combinations of those: A' = A + K Z and Z' = T Z.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.kinematics import require_all_motions
from gfimu.array.observability import null_rows
from gfimu.array.parts.part import white_noise_std
from gfimu.array.parts.part_file import PartFile
from gfimu.base.errors import InputError
from gfimu.base.short_repr import short_repr

__all__ = ["ChannelTables", "SensorErrors", "calibrated_bias_std", "step_of_readings"]

_RANK_TOLERANCE = 1e-9
_LARGEST = 1e6  # numerical: m/s², far beyond any part
_SEEN = 1e-6  # numerical: of the best seen product
_WEAK = 0.1  # products seen more weakly than this share of the best are not used to clean α
_LEAST_NOISE_LSB = 0.3  # LSB: below that equal readings prove nothing
_FOR_STEP = 20_000  # numerical: samples in which the step of the readings is looked for
_EQUAL_READINGS = 1e-7  # probability per sample at which equal readings count as a stuck channel


@dataclass(frozen=True)
class SensorErrors:
    """Errors of the sensors of an array that an estimator takes into account.

    Parameters
    ----------
    noise_std : ndarray, shape (c,)
        White noise of each channel per sample, m/s².
    bias_std : ndarray, shape (c,)
        Uncertainty of the constant bias of each channel before the run, m/s².
    scale_std : float
        Uncertainty of the scale factors, a ratio (0.01 is 1 %).
    axis_std : float
        Uncertainty of the directions of the channels, each by itself, rad.
    rotation_std : float
        Uncertainty of the direction of all chips together against the drawing, rad: what poses of a calibration can't
        see.
    placement_std : float
        Uncertainty of the positions, m.
    timing_std : float
        How far a channel's sampling times are from the stated ones, independently from sample to sample, s.
    full_range : ndarray, shape (c,)
        Readings at or beyond ± this are saturated, m/s².
    coarse_step : float
        Step of the readings where it is coarse beside the noise, m/s²; 0 where it is not.
    stuck_after : int
        So many equal readings in a row mean that a channel is stuck; 0 switches the check off.
    gyro_noise_std : float
        White noise of a gyro axis per sample, rad/s.
    gyro_bias_std : float
        Uncertainty of the constant bias of a gyro axis before the run, rad/s.

    Examples
    --------
    >>> import gfimu
    >>> errors = gfimu.SensorErrors.from_parts(gfimu.AccelerometerArray.load("cube12"), 100.0)
    >>> errors.noise_std.round(4)[:3]
    array([0.0307, 0.0307, 0.0435])
    """

    noise_std: NDArray[np.float64]
    bias_std: NDArray[np.float64]
    scale_std: float = 0.0
    axis_std: float = 0.0
    rotation_std: float = 0.0
    placement_std: float = 0.0
    timing_std: float = 0.0
    full_range: NDArray[np.float64] | None = None
    coarse_step: float = 0.0
    stuck_after: int = 0
    gyro_noise_std: float = 0.005
    gyro_bias_std: float = 0.35

    __repr__ = short_repr

    def __post_init__(self) -> None:
        for name in ("noise_std", "bias_std"):
            value = getattr(self, name)
            if value.ndim != 1 or not np.all(value <= _LARGEST) or np.any(value < 0):
                raise InputError(f"{name} must hold one number per channel, none negative or above {_LARGEST:g} m/s²")
        if np.any(self.noise_std <= 0):
            raise InputError("noise_std must be positive for every channel; a real sensor has noise, m/s²")
        for name in (
            "scale_std",
            "axis_std",
            "rotation_std",
            "placement_std",
            "timing_std",
            "coarse_step",
            "gyro_noise_std",
            "gyro_bias_std",
        ):
            if not 0 <= getattr(self, name) <= _LARGEST:
                raise InputError(f"{name} = {getattr(self, name)!r}: must be a number ≥ 0, at most {_LARGEST:g}")

    @classmethod
    def uniform(
        cls, array: AccelerometerArray, noise_std: ArrayLike, bias_std: ArrayLike = 0.0, **others: Any
    ) -> SensorErrors:
        """Build the same errors for all channels, or one number per channel; other fields by name."""
        c = array.n_channels
        try:
            noise = np.array(np.broadcast_to(np.asarray(noise_std, dtype=float), (c,)))
            bias = np.array(np.broadcast_to(np.asarray(bias_std, dtype=float), (c,)))
        except ValueError:
            raise InputError(f"noise_std and bias_std need one number, or {c}: one per channel") from None
        return cls(noise, bias, **others)

    @classmethod
    def from_parts(
        cls, array: AccelerometerArray, sample_rate: float, *, step: float = 0.0, **others: Any
    ) -> SensorErrors:
        """Take the errors from the data sheets of the array's parts (``models/parts``).

        White noise is the part's (`gfimu.array.parts.part.white_noise_std`), with the quantisation step's Δ²/12 added;
        bias is the typical deviation at switch-on. Other fields by name; ``noise_std`` is the white part. ``step``,
        m/s², is that of the readings, where it is coarser than the parts'.

        Raises
        ------
        InputError
            If a part is unknown or its file lacks a figure.
        """
        bias, limit, steps = [], [], []
        rms = white_noise_std(array, sample_rate)
        for chip in array.chips:
            part = PartFile.load(chip.part, array.part_files, needs=("offset_std_m_s2", "full_range_m_s2"))
            lsb, axes = part.lsb_m_s2, len(chip.axes)
            bias.append(np.array(part.offset_std_m_s2)[:axes])
            limit.append(np.full(axes, np.array(part.full_range_m_s2) - lsb))
            steps.append(np.full(axes, lsb))
        each = np.maximum(np.concatenate(steps), step)
        noise = [np.sqrt(rms**2 + each**2 / 12.0)]
        stuck = _equal_run(float((rms / each).min()))
        fields: dict[str, Any] = {
            "full_range": np.concatenate(limit),
            "stuck_after": stuck,
            "coarse_step": 0.0 if stuck else float(each.max()),
        } | others
        if "noise_std" in fields:
            white = np.broadcast_to(np.asarray(fields.pop("noise_std"), dtype=float), (array.n_channels,))
            noise = [np.sqrt(white**2 + each**2 / 12.0)]
        if "bias_std" in fields:
            bias = [np.broadcast_to(np.asarray(fields.pop("bias_std"), dtype=float), (array.n_channels,))]
        return cls(np.concatenate(noise), np.concatenate(bias), **fields)

    @classmethod
    def of_recording(
        cls,
        array: AccelerometerArray,
        metadata: Mapping[str, Any],
        sample_rate: float,
        *,
        step: float = 0.0,
        **others: Any,
    ) -> SensorErrors:
        """Take the errors that a recording's metadata state after a calibration, else those of the data sheets.

        A calibration states what it leaves of biases, gains, axes and positions. Directions that its poses left open
        are as uncertain as the parts' axes: those of each chip, or of all together their mean. Parameters are those of
        `from_parts`.
        """
        errors = cls.from_parts(array, sample_rate, step=step, **others)
        bias = calibrated_bias_std(metadata, array)
        if bias is None:
            return errors.with_part_gains(array)
        stated = metadata.get("calibration_std")
        left: Mapping[str, Any] = stated if isinstance(stated, Mapping) else {}
        scale, axis, place = (left.get(key, 0.0) for key in ("scale", "axis_rad", "placement_m"))
        if not all(isinstance(size, int | float) and 0.0 <= size <= _LARGEST for size in (scale, axis, place)):
            raise InputError(f"calibration_std in the recording's metadata is {left!r}; it holds numbers ≥ 0")
        turned = left.get("turned", "all")
        return replace(
            errors,
            bias_std=errors.bias_std if "bias_std" in others else bias,
            scale_std=scale,
            axis_std=float(np.hypot(axis, _turn_of_chips(array))) if turned == "each" else axis,
            rotation_std=_turn_of_chips(array) / np.sqrt(len(array.chips)) if turned == "all" else 0.0,
            placement_std=place,
        )

    def with_part_gains(self, array: AccelerometerArray) -> Self:
        """Return the errors of channels that were not calibrated: gains and axes as sure as the data sheets say."""
        parts = [PartFile.load(chip.part, array.part_files) for chip in array.chips]
        gain = max(part.sensitivity_std for part in parts)
        axis = max(float(np.hypot(part.cross_axis_std, part.misalignment_std_rad)) for part in parts)
        return replace(self, scale_std=max(self.scale_std, gain), axis_std=max(self.axis_std, axis))

    def of_channels(self, kept: NDArray[np.bool_]) -> Self:
        """Return the errors of the channels marked in ``kept`` (c,) alone."""
        limits = None if self.full_range is None else self.full_range[kept]
        return replace(self, noise_std=self.noise_std[kept], bias_std=self.bias_std[kept], full_range=limits)

    @property
    def gain_std(self) -> float:
        """Uncertainty of a reading in proportion to the specific force, along the channel and across."""
        return float(np.hypot(self.scale_std, self.axis_std))

    def noise_at_rest(self, noise_std: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the largest noise (c,) that channels of noise ``noise_std`` (c,), m/s², may have at rest.

        A channel that rests between two coarse steps reads either, with a variance of up to a fourth of the step²
        instead of a twelfth.
        """
        return np.asarray(np.sqrt(noise_std**2 + self.coarse_step**2 / 6.0))

    @property
    def limits(self) -> NDArray[np.float64]:
        """Saturation limit of each channel, shape (c,), m/s²; infinite where none is known."""
        return np.full(len(self.noise_std), np.inf) if self.full_range is None else np.asarray(self.full_range)


def _equal_run(noise_in_lsb: float) -> int:
    """Count equal readings in a row that noise of this size, rounded to whole LSB, hardly ever gives; 0 for no limit.

    At rest in the middle of a step that is coarse beside the noise, a channel reads the same for as long as it likes.
    """
    if noise_in_lsb < _LEAST_NOISE_LSB:
        return 0
    # Two readings round to the same count with a probability of about 1/(2 √π σ), σ in LSB (at most near 1).
    probability = min(0.9, 1.0 / (2.0 * np.sqrt(np.pi) * max(noise_in_lsb, 1e-3)))
    return int(np.ceil(np.log(_EQUAL_READINGS) / np.log(probability))) + 1


def _turn_of_chips(array: AccelerometerArray) -> float:
    """Return how far the axes of a chip together are turned against the drawing, rad, one standard deviation."""
    parts = [PartFile.load(chip.part, array.part_files) for chip in array.chips]
    squares = [part.misalignment_std_rad**2 + part.cross_axis_std**2 / 2.0 for part in parts]
    return float(np.sqrt(np.mean(squares)))


class ChannelTables:
    """Matrices of α and of the null space for each set of working channels met so far.

    Set 0 has every channel. Another set is added when a sample needs it (`index`). All tables are stacked over the
    sets; a missing channel has zero columns.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions.
    errors : SensorErrors
        Noise of its channels.

    Raises
    ------
    GeometryError
        If the array can't see all six motions.
    """

    def __init__(self, array: AccelerometerArray, errors: SensorErrors) -> None:
        require_all_motions(array)
        if len(errors.noise_std) != array.n_channels:
            raise InputError(
                f"noise_std holds {len(errors.noise_std)} numbers; array {array.name!r} has {array.n_channels} channels"
            )
        self.array = array
        self._variance = errors.noise_std**2
        self._length_scale = np.array([array.length_unit] * 3 + [1.0] * 3)
        c = array.n_channels
        basis = self._whitened_null_space()
        self.n_null = len(basis)
        self._basis = basis
        self._base_alpha = self._alpha_rows(np.ones(c, dtype=bool), basis)
        d = self.n_null
        self.masks = np.zeros(0, dtype=np.int64)
        self.alpha_rows = np.zeros((0, 3, c))
        self.alpha_bias = np.zeros((0, 3, d))  # K
        self.alpha_leak = np.zeros((0, 3, 6))  # L
        self.alpha_noise = np.zeros((0, 3, 3))
        self.null_rows = np.zeros((0, d, c))  # Z
        self.null_sensitivity = np.zeros((0, d, 6))  # M
        self.null_bias = np.zeros((0, d, d))  # T
        self.null_count = np.zeros(0, dtype=np.int64)  # −1: α can't be seen with this set
        self.plain = np.zeros(0, dtype=np.bool_)  # α = A y − b_α with nothing else to subtract
        self.products = np.zeros((0, 6, d))  # M⁺, of the products of ω
        self.square_seen = np.zeros((0, 3), dtype=np.bool_)  # whether the null space shows the square of each axis
        self.null_size = np.zeros(0)  # ‖M‖², s⁴/rad⁴ in units of the noise
        self.index(0)

    def index(self, missing: int) -> int:
        """Place of the set without the channels whose bits are set in ``missing``, built if new."""
        known = np.flatnonzero(self.masks == missing)
        if known.size:
            return int(known[0])
        c, d = self.array.n_channels, self.n_null
        present = np.array([not (missing >> channel) & 1 for channel in range(c)])
        rows = np.zeros((3, c))
        bias, leak, noise = np.zeros((3, d)), np.zeros((3, 6)), np.zeros((3, 3))
        rows_of_null, sensitivity, combination = np.zeros((d, c)), np.zeros((d, 6)), np.zeros((d, d))
        products = np.zeros((6, d))
        count = -1
        if np.linalg.matrix_rank(self.array.regression_matrix[present] / self._length_scale, tol=1e-6) == 6:
            # Combinations of the null space that don't touch the missing channels.
            kept = np.eye(d) if missing == 0 else null_rows(self._basis[:, ~present].T)
            count = len(kept)
            smaller = kept @ self._basis  # (count, c)
            smaller[:, ~present] = 0.0
            rows_of_null[:count], combination[:count] = smaller, kept
            sensitivity[:count] = _clean(smaller @ self.array.centripetal_matrix)
            rows = self._base_alpha if missing == 0 else self._alpha_rows(present, smaller)
            bias = (rows - self._base_alpha) * self._variance @ self._basis.T  # (3, d), Z R Zᵀ = I
            leak = _clean(rows @ self.array.centripetal_matrix)
            noise = rows * self._variance @ rows.T
            products = np.asarray(np.linalg.pinv(sensitivity, rcond=_SEEN), dtype=np.float64)
        seen = np.abs((products @ sensitivity)[:3] - np.eye(6)[:3]).max(axis=1) < _SEEN
        self.masks = np.append(self.masks, np.int64(missing))
        self.alpha_rows = np.concatenate([self.alpha_rows, rows[None]])
        self.alpha_bias = np.concatenate([self.alpha_bias, bias[None]])
        self.alpha_leak = np.concatenate([self.alpha_leak, leak[None]])
        self.alpha_noise = np.concatenate([self.alpha_noise, noise[None]])
        self.null_rows = np.concatenate([self.null_rows, rows_of_null[None]])
        self.null_sensitivity = np.concatenate([self.null_sensitivity, sensitivity[None]])
        self.null_bias = np.concatenate([self.null_bias, combination[None]])
        self.null_count = np.append(self.null_count, np.int64(count))
        self.plain = np.append(self.plain, not (leak.any() or missing))
        self.products = np.concatenate([self.products, products[None]])
        self.square_seen = np.concatenate([self.square_seen, seen[None]])
        self.null_size = np.append(self.null_size, np.sum(sensitivity**2))
        return len(self.masks) - 1

    def bias_covariance(self, bias_std: NDArray[np.float64]) -> NDArray[np.float64]:
        """Covariance of [b_α; b_z] for independent channel biases, shape (3 + d, 3 + d)."""
        rows = np.vstack([self._base_alpha, self._basis])
        return rows * bias_std**2 @ rows.T

    def _whitened_null_space(self) -> NDArray[np.float64]:
        """Rows Z with Z J = 0 and unit noise, those that see ω best first."""
        basis = null_rows((self.array.regression_matrix / self._length_scale).T)  # (c - 6, c)
        if len(basis) == 0:
            return basis
        cholesky = np.linalg.cholesky(basis * self._variance @ basis.T)
        white = np.linalg.solve(cholesky, basis)
        rotation, _, _ = np.linalg.svd(white @ self.array.centripetal_matrix)
        return rotation.T @ white

    def _alpha_rows(self, present: NDArray[np.bool_], null_rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rows A of the working channels: unweighted left inverse, cleaned of ω² by well-seen products."""
        rows = np.zeros((3, self.array.n_channels))
        inverse = np.linalg.pinv(self.array.regression_matrix[present] / self._length_scale)
        rows[:, present] = inverse[:3] / self.array.length_unit
        leak = _clean(rows @ self.array.centripetal_matrix)
        if leak.any() and len(null_rows):
            rows = rows - leak @ np.linalg.pinv(null_rows @ self.array.centripetal_matrix, rcond=_WEAK) @ null_rows
        return rows


def _clean(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Set rounding errors to zero, so that what cancels exactly is an exact zero."""
    largest = np.abs(matrix).max(initial=0.0)
    return np.where(np.abs(matrix) > _RANK_TOLERANCE * max(1.0, largest), matrix, 0.0)


def calibrated_bias_std(metadata: Mapping[str, Any], array: AccelerometerArray) -> NDArray[np.float64] | None:
    """Return how exactly a calibration knows the biases of a recording's channels, shape (c,), m/s².

    None where the metadata state no calibration of every channel (``bias_std_m_s2``).
    """
    stated = metadata.get("bias_std_m_s2")
    values = [stated.get(name) for name in array.channels] if isinstance(stated, Mapping) else [None]
    if not all(isinstance(value, int | float) and 0.0 <= value <= _LARGEST for value in values):
        return None
    return np.array(values, dtype=float)


def step_of_readings(readings: NDArray[np.float64]) -> float:
    """Return the step of the readings (n, c), m/s²: the least difference of two values, the median of the channels."""
    steps = []
    for column in readings[:_FOR_STEP].T:
        values = np.unique(column[np.isfinite(column)])
        if len(values) > 1:
            steps.append(float(np.diff(values).min()))
    return float(np.median(steps)) if steps else 0.0
