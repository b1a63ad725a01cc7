"""Calibration: the one result of every method, with covariance, unit, gauge and format version.

A calibration holds the error models of one or more triads (the chips of an array), the covariance of all its
parameters together, and, where motion was used, the chips' positions. It is written as JSON and refuses readings in
another unit than those it was made from.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.calibration.error_model import GAUGES, ErrorModel
from gfimu.calibration.parameter_names import KINDS, cubic_names, parameter_names, quadratic_names
from gfimu.calibration.valid_covariance import require_covariance, require_finite
from gfimu.errors import InputError, UnitError
from gfimu.files.atomic_file import write_text
from gfimu.files.input_file import check_input
from gfimu.geometry.array import AccelerometerArray
from gfimu.recording import Recording
from gfimu.results import Panel, PlottedResult, Series
from gfimu.short_repr import joined

__all__ = ["FORMAT_VERSION", "Calibration", "load_calibration"]

FORMAT = "gfimu-calibration"
FORMAT_VERSION = 1

_AXES = "xyz"
_READING_UNITS = {"lsb": ("lsb", "m_s2"), "m_s2": ("m_s2", "m_s2"), "rad_s": ("rad_s", "rad_s")}
"""Reading unit to (name of the reading unit, unit of the true input)."""


@dataclass(frozen=True)
class Calibration(PlottedResult):
    """Parameters of a calibrated triad or array, with their uncertainty.

    Parameters
    ----------
    method : str
        Method that made it.
    unit : {"lsb", "m_s2", "rad_s"}
        Unit of the readings it applies to; true inputs are in m/s² (rad/s for a gyro).
    channels : tuple of str
        Channels it applies to, three per chip, in order.
    gauge : str
        Which frame the true inputs are expressed in: a key of `gfimu.calibration.error_model.GAUGES`.
    gravity : float
        Magnitude of the true input used, m/s² (rad/s for a gyro).
    names : tuple of str
        Parameter names: ``a1_M_xy`` (sensitivity, reading unit per m/s²), ``a1_b_x`` (bias, reading unit),
        ``a1_q_x`` (quadratic coefficient, 1 per reading unit), ``a1_c_x`` (cubic coefficient, 1 per reading unit
        squared), ``a1_r_x`` (position, m),
        ``a1_d`` (delay of the chip against the mean of all, s; not applied).
    values : ndarray, shape (p,)
        Parameter values.
    covariance : ndarray, shape (p, p)
        Covariance of the values.
    null_space : ndarray, shape (p, k)
        Orthonormal parameter directions that the data did not determine; their values come from the gauge.
    statements : tuple of str
        What was not determined, and other statements a reader needs.
    warnings : tuple of str
        What looked wrong in the data.
    statistics : mapping of str to float or str
        Residual RMS, number of poses, redundancy, variance factor, rest threshold and so on; units in the keys.

    Examples
    --------
    >>> import gfimu
    >>> calibration = gfimu.calibrate("array", gfimu.simulate("calibration_poses", seed=2))
    >>> calibration
    Calibration(array, 12 channels in m/s², 60 parameters, 3 directions undetermined)
    >>> print(f"{calibration.value('a1_b_x'):.3f} ± {calibration.std_of('a1_b_x'):.3f} m/s²")
    -0.371 ± 0.001 m/s²
    """

    method: str
    unit: str
    channels: tuple[str, ...]
    gauge: str
    gravity: float
    names: tuple[str, ...]
    values: NDArray[np.float64]
    covariance: NDArray[np.float64]
    null_space: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 0)))
    statements: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    statistics: Mapping[str, float | str] = field(default_factory=dict)
    format_version: int = FORMAT_VERSION

    def __post_init__(self) -> None:
        if self.unit not in _READING_UNITS:
            raise UnitError(f"a calibration can't be in {self.unit!r}; valid: {', '.join(_READING_UNITS)}")
        count = len(self.names)
        if self.values.shape != (count,) or self.covariance.shape != (count, count):
            raise InputError(f"a calibration of {count} parameters needs that many values and their covariance matrix")
        if len(self.channels) % 3 or not self.channels:
            raise InputError("a calibration needs three channels per chip")
        require_finite(self.names, self.values)
        require_covariance(self.names, self.covariance)
        if self.null_space.size == 0:
            object.__setattr__(self, "null_space", np.empty((count, 0)))

    def __repr__(self) -> str:
        unit = {"m_s2": "m/s²", "rad_s": "rad/s", "lsb": "counts"}.get(self.unit, self.unit)
        undetermined = self.null_space.shape[1]
        return joined(
            self,
            [
                self.method,
                f"{len(self.channels)} channels in {unit}",
                f"{len(self.names)} parameters",
                f"{undetermined} directions undetermined" if undetermined else "",
                f"{len(self.warnings)} warnings" if self.warnings else "",
            ],
        )

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per parameter: name, value, standard deviation and unit."""
        texts = {"parameter": self.names, "unit": self.units}
        names = {key: np.array(values, dtype=object) for key, values in texts.items()}
        return {"parameter": names["parameter"], "value": self.values, "std": self.std, "unit": names["unit"]}

    def _table_metadata(self) -> dict[str, Any]:
        return {key: value for key, value in self.to_dict().items() if key != "parameters"}

    def _facts(self) -> list[tuple[str, str]]:
        unit = {"m_s2": "m/s²", "rad_s": "rad/s", "lsb": "counts"}[self.unit]
        undetermined = self.null_space.shape[1]
        facts = [("method", self.method), ("channels", f"{len(self.channels)} in {unit}"), ("frame", self.gauge)]
        facts += [("directions that the data do not determine", str(undetermined))] if undetermined else []
        return facts + [
            (key, f"{value:.4g}" if isinstance(value, float) else str(value)) for key, value in self.statistics.items()
        ]

    def _notes(self) -> tuple[str, ...]:
        return (*self.warnings, *self.statements)

    def _panels(self) -> list[Panel]:
        """One panel per kind of parameter, what it deviates from an ideal triad where that is 1 or 0."""
        panels = []
        for title, belongs in KINDS.items():
            places = [place for place, name in enumerate(self.names) if belongs(name.split("_"))]
            if not places:
                continue
            ideal = 1.0 if title == "sensitivity" and self.unit != "lsb" else 0.0
            unit = self.units[places[0]].replace("m_s2", "m/s²").replace("rad_s", "rad/s")
            label = f"{title} less 1" if ideal else f"{title}, {unit}" if unit != "1" else title
            series = Series("", self.values[places] - ideal, self.std[places])
            panels.append(Panel(f"{title}, ±2σ", label, (series,), tuple(self.names[place] for place in places)))
        return panels

    @property
    def std(self) -> NDArray[np.float64]:
        """Standard deviation of each parameter, shape (p,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def correlation(self) -> NDArray[np.float64]:
        """Correlation matrix of the parameters, shape (p, p); zero rows for parameters without variance."""
        std = self.std
        with np.errstate(divide="ignore", invalid="ignore"):
            matrix = self.covariance / np.outer(std, std)
        matrix[~np.isfinite(matrix)] = 0.0
        np.fill_diagonal(matrix, 1.0)
        return matrix

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each parameter."""
        reading, true = _READING_UNITS[self.unit]
        ratio = "1" if reading == true else f"{reading} per {true}"
        inverse, square = {"m_s2": ("s²/m", "s⁴/m²")}.get(reading, (f"1 per {reading}", f"1 per {reading}²"))
        units = {"M": ratio, "b": reading, "r": "m", "q": inverse, "c": square, "d": "s"}
        return tuple(units[name.split("_")[1]] for name in self.names)

    @property
    def chips(self) -> tuple[str, ...]:
        """Names of the chips, the channel names without their axis number."""
        return tuple(channel[:-1] if self.unit != "rad_s" else "gyro" for channel in self.channels[::3])

    @cached_property
    def models(self) -> dict[str, ErrorModel]:
        """Error model of each chip, by name."""

        def bends(names: tuple[str, ...]) -> NDArray[np.float64]:
            return np.array([self.value(name) if name in self.names else 0.0 for name in names])

        return {
            chip: replace(
                ErrorModel.from_parameters(
                    [self.value(name) for name in parameter_names(chip, self.gauge)], self.gauge
                ),
                quadratic=bends(quadratic_names((chip,))),
                cubic=bends(cubic_names((chip,))),
            )
            for chip in self.chips
        }

    @property
    def positions(self) -> dict[str, NDArray[np.float64]]:
        """Fitted position of each chip in the body frame, m, by name; empty if motion was not used."""
        return {
            chip: np.array([self.value(f"{chip}_r_{axis}") for axis in _AXES])
            for chip in self.chips
            if f"{chip}_r_x" in self.names
        }

    def value(self, name: str) -> float:
        """Value of a parameter by name; raises `InputError` that lists the names."""
        return float(self.values[self._index(name)])

    def std_of(self, name: str) -> float:
        """Return the standard deviation of a parameter by name."""
        return float(self.std[self._index(name)])

    def correlation_of(self, first: str, second: str) -> float:
        """Correlation of two parameters by name."""
        return float(self.correlation[self._index(first), self._index(second)])

    def _index(self, name: str) -> int:
        if name not in self.names:
            raise InputError(f"the calibration has no parameter {name!r}; it has {', '.join(self.names)}")
        return self.names.index(name)

    def apply(self, recording: Recording) -> Recording:
        """Correct a recording: a = M⁻¹ (u − q u² − c u³), u = l − b, for every chip.

        For an array, the result is what ideal sensors along the drawing's axes would read.

        Raises
        ------
        UnitError
            If the readings are not in the unit of the calibration.
        InputError
            If a calibrated channel is missing, or raw counts of uncalibrated channels would remain.
        """
        return self._convert(recording, self.unit, "m_s2", forward=False)

    def invert(self, recording: Recording) -> Recording:
        """Turn true inputs back into the readings of this triad or array: l = M a + b.

        Raises
        ------
        UnitError
            If the readings are not in m/s².
        InputError
            If a calibrated channel is missing.
        """
        return self._convert(recording, "m_s2", self.unit, forward=True)

    def _convert(self, recording: Recording, source: str, target: str, *, forward: bool) -> Recording:
        if self.unit == "rad_s":
            reference = dict(recording.reference)
            names = [f"{channel}_rad_s" for channel in self.channels]
            missing = [name for name in names if name not in reference]
            if missing:
                raise InputError(f"the recording lacks {', '.join(missing)}, which this calibration needs")
            model = self.models["gyro"]
            raw = np.column_stack([reference[name] for name in names])
            reference.update(zip(names, (model.read(raw) if forward else model.correct(raw)).T, strict=True))
            return replace(recording, reference=reference)
        if recording.unit != source:
            raise UnitError(
                f"readings are in {recording.unit}, this calibration needs {source}; "
                + ("read the recording as raw counts (unit='lsb')" if source == "lsb" else "read it in m/s²")
            )
        missing = [channel for channel in self.channels if channel not in recording.channels]
        if missing:
            raise InputError(
                f"the recording lacks {', '.join(missing)}, which this calibration was made for; "
                f"it has {', '.join(recording.channels)}"
            )
        left = [channel for channel in recording.channels if channel not in self.channels]
        if left and source != target:
            raise InputError(
                f"{', '.join(left)} would stay in {source}: calibrate these channels too or leave them out"
            )
        readings = recording.readings.copy()
        for chip, model in self.models.items():
            columns = [recording.channels.index(f"{chip}{axis}") for axis in (1, 2, 3)]
            readings[:, columns] = (model.read if forward else model.correct)(readings[:, columns])
        metadata = dict(recording.metadata) | {"calibration": self.method if not forward else "inverted"}
        if target == "m_s2":
            metadata.pop("lsb_m_s2", None)
        return replace(recording, readings=readings, unit=target, metadata=metadata)

    def calibrated_array(self, array: AccelerometerArray) -> AccelerometerArray:
        """Return the array with the fitted positions of its chips (unchanged where none were fitted)."""
        fitted = self.positions
        positions = [fitted.get(chip.name, chip.position) for chip in array.chips]
        return array.with_geometry(positions, [chip.axes for chip in array.chips])

    def rows(self) -> list[tuple[str, str, str, str]]:
        """Rows of a table for people: name, value, standard deviation, unit."""
        return [
            (name, f"{value:.3g}" if name.split("_")[1] in "qc" else f"{value:.6f}", f"{std:.2g}", unit)
            for name, value, std, unit in zip(self.names, self.values, self.std, self.units, strict=True)
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return the content of the calibration file."""
        return {
            "format": FORMAT,
            "format_version": self.format_version,
            "method": self.method,
            "unit": self.unit,
            "channels": list(self.channels),
            "gauge": self.gauge,
            "gauge_meaning": GAUGES[self.gauge],
            "gravity_m_s2" if self.unit != "rad_s" else "earth_rate_rad_s": self.gravity,
            "parameters": [
                {"name": name, "value": float(value), "std": float(std), "unit": unit}
                for name, value, std, unit in zip(self.names, self.values, self.std, self.units, strict=True)
            ],
            "covariance": self.covariance.tolist(),
            "correlation": self.correlation.tolist(),
            "null_space": self.null_space.T.tolist(),
            "statements": list(self.statements),
            "warnings": list(self.warnings),
            "statistics": {
                key: None if isinstance(value, float) and not math.isfinite(value) else value
                for key, value in self.statistics.items()
            },
        }

    def save(self, path: str | Path) -> None:
        """Write the calibration as JSON, whole or not at all."""
        write_text(path, json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n")

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], *, source: str = "calibration") -> Calibration:
        """Build a calibration from the content of its file.

        Raises
        ------
        InputError
            If it is not a calibration, of another version, or damaged.
        """
        if not isinstance(data, Mapping) or data.get("format") != FORMAT:
            raise InputError(f"{source}: not a calibration file; make one with `gfimu calibrate`")
        if data.get("format_version") != FORMAT_VERSION:
            raise InputError(
                f"{source}: format version {data.get('format_version')!r}, this program reads {FORMAT_VERSION}; "
                "calibrate again"
            )
        try:
            parameters = data["parameters"]
            magnitude = data["earth_rate_rad_s"] if data["unit"] == "rad_s" else data["gravity_m_s2"]
            null_space = np.array(data.get("null_space", []), dtype=float)
            calibration = cls(
                str(data["method"]),
                str(data["unit"]),
                tuple(data["channels"]),
                str(data["gauge"]),
                float(magnitude),
                tuple(str(parameter["name"]) for parameter in parameters),
                np.array([parameter["value"] for parameter in parameters], dtype=float),
                np.array(data["covariance"], dtype=float),
                null_space.T if null_space.size else np.empty((len(parameters), 0)),
                tuple(data.get("statements", ())),
                tuple(data.get("warnings", ())),
                {key: math.nan if value is None else value for key, value in data.get("statistics", {}).items()},
            )
            calibration.models  # noqa: B018  a damaged parameter list shows here, not at the first use
        except KeyError as error:
            raise InputError(f"{source}: key {error.args[0]!r} is missing; calibrate again") from None
        except (TypeError, ValueError, AttributeError) as error:
            raise InputError(f"{source}: damaged calibration file ({error}); calibrate again") from None
        return calibration


def load_calibration(path: str | Path) -> Calibration:
    """Read a calibration from its JSON file.

    Raises
    ------
    InputError
        If the file is missing, not JSON, not a calibration, or of another format version.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.load_calibration("cal.json").apply(run)  # doctest: +SKIP
    """
    file = check_input(path)
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{file}: {error.strerror or error}; check the path") from None
    except (ValueError, RecursionError):  # also of whole numbers with thousands of digits
        raise InputError(f"{file}: not a calibration file; make one with `gfimu calibrate`") from None
    return Calibration.from_dict(data, source=str(file))
