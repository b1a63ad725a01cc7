"""Calibration: the one result of every method, with covariance, unit, gauge and format version.

A calibration holds the error models of one or more triads (the chips of an array), the covariance of all its
parameters together, and, where motion was used, the chips' positions. It is written as JSON and refuses readings in
another unit than those it was made from.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.declared import Declared, Matrix, Table, cell, figure, table
from gfimu.base.errors import InputError, UnitError
from gfimu.base.files.atomic_file import write_text
from gfimu.base.results import Panel, PlottedResult, Series
from gfimu.base.short_repr import joined
from gfimu.base.units import LARGEST
from gfimu.calibration.error_model import GAUGES, ErrorModel
from gfimu.calibration.parameter_names import KINDS, cubic_names, kind_of, parameter_names, quadratic_names
from gfimu.calibration.valid_covariance import require_covariance, require_finite
from gfimu.recording import Recording
from gfimu.recording.reading import read_json

__all__ = ["FORMAT_VERSION", "Calibration", "CalibrationParameter", "load_calibration"]

FORMAT = "gfimu-calibration"
FORMAT_VERSION = 1

Floats = NDArray[np.float64]

_AXES = "xyz"
_PAIRS = ("xy", "xz", "yz")
_NOTABLE = 0.9  # correlation of two misalignments
TURN_ON_STD_M_S2 = 0.01
"""Change of a bias from one power-on to the next, m/s²: twice the 4.5 mm/s² between two sessions of a MIMU4444."""
_READING_UNITS = {"lsb": ("lsb", "m_s2"), "m_s2": ("m_s2", "m_s2"), "rad_s": ("rad_s", "rad_s")}
"""Reading unit to (name of the reading unit, unit of the true input)."""


@dataclass(frozen=True)
class CalibrationParameter(Declared):
    """A parameter of a calibration."""

    name: Annotated[str, figure("Chip or channel, and the parameter.", head="parameter")]
    value: Annotated[float, figure("Its value.", head="value", form=".7g")]
    std: Annotated[float, figure("Its standard deviation.", head="std", form=".2g")]
    unit: Annotated[str, figure("Unit of both.", head="unit")]


@dataclass(frozen=True)
class Calibration(Declared, PlottedResult):
    """A calibration; the file holds the same keys but files.

    ``names`` (p,) are those of the parameters ``values`` (p,): ``a1_M_xy`` (sensitivity, reading unit per m/s²),
    ``a1_b_x`` (bias, reading unit), ``a1_q_x`` (quadratic coefficient, 1 per reading unit), ``a1_c_x`` (cubic
    coefficient, 1 per reading unit squared), ``a1_r_x`` (position, m), ``a1_d`` (delay of the chip against the mean of
    all, s; not applied). ``gravity`` is the magnitude of the true input used, m/s² (rad/s for a gyro). ``null_space``
    (p, k) holds orthonormal directions that the data did not determine; their values come from the gauge.

    Examples
    --------
    >>> import gfimu
    >>> calibration = gfimu.calibrate("array", gfimu.simulate("calibration_poses", seed=2))
    >>> calibration
    Calibration(array, 12 channels in m/s², 60 parameters, 3 directions undetermined)
    >>> print(f"{calibration.value('a1_b_x'):.3f} ± {calibration.std_of('a1_b_x'):.3f} m/s²")
    -0.371 ± 0.001 m/s²
    """

    method: Annotated[str, figure("Method that made it.")]
    unit: Annotated[str, figure("Unit of the readings that it applies to; true inputs are in m/s² (rad/s of a gyro).")]
    channels: Annotated[tuple[str, ...], figure("Channels that it applies to, three per chip, in order.")]
    gauge: Annotated[str, figure("Frame in which the true inputs are expressed.")]
    gravity: float
    names: tuple[str, ...]
    values: Floats
    covariance: Annotated[Floats, figure("Covariance of the parameters, in products of their units.", json=Matrix)]
    null_space: Floats = field(default_factory=lambda: np.empty((0, 0)))
    statements: Annotated[tuple[str, ...], figure("What was not determined, and further statements.")] = ()
    warnings: Annotated[tuple[str, ...], figure("What looked wrong in the data.")] = ()
    statistics: Annotated[
        Mapping[str, float | str],
        figure(
            "Residuals, number of poses, redundancy, variance factor and so on; units in the keys.", json=dict[str, Any]
        ),
    ] = field(default_factory=dict)
    format_version: Annotated[int, figure("Version of the format.", before="method")] = FORMAT_VERSION

    @property
    def format(self) -> Annotated[str, figure("gfimu-calibration.", before="format_version")]:
        """Name of the file's format."""
        return FORMAT

    @property
    def gauge_meaning(self) -> Annotated[str, figure("That frame in words.", before="covariance")]:
        """Frame in which the true inputs are expressed, in words."""
        return GAUGES[self.gauge]

    @property
    def gravity_m_s2(
        self,
    ) -> Annotated[float | None, figure("Magnitude of the true input.", "m/s²", absent=True, before="covariance")]:
        """Gravity used, m/s²; None for a gyro."""
        return None if self.unit == "rad_s" else self.gravity

    @property
    def earth_rate_rad_s(
        self,
    ) -> Annotated[
        float | None, figure("Of a gyro: magnitude of the true input.", "rad/s", absent=True, before="covariance")
    ]:
        """Rate of the Earth used for a gyro, rad/s; None for accelerometers."""
        return self.gravity if self.unit == "rad_s" else None

    @property
    def parameters(self) -> Annotated[list[CalibrationParameter], figure("The parameters.", before="covariance")]:
        """The parameters, each with its standard deviation and unit."""
        rows = zip(self.names, self.values.tolist(), self.std.tolist(), self.units, strict=True)
        return [CalibrationParameter(*row) for row in rows]

    def __post_init__(self) -> None:
        if self.unit not in _READING_UNITS:
            raise UnitError(f"a calibration can't be in {self.unit!r}; valid: {', '.join(_READING_UNITS)}")
        count = len(self.names)
        if self.values.shape != (count,) or self.covariance.shape != (count, count):
            raise InputError(f"a calibration of {count} parameters needs that many values and their covariance matrix")
        if len(self.channels) % 3 or not self.channels:
            raise InputError("a calibration needs three channels per chip")
        for name in self.names:
            kind_of(name)
        if abs(self.gravity) > LARGEST:  # NaN where the method needs none
            raise InputError(f"a true input of {self.gravity:g} can't be; it is at most {LARGEST:g}")
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
            places = [index for index, name in enumerate(self.names) if belongs(name)]
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
    def correlation(
        self,
    ) -> Annotated[Floats, figure("Correlation of the parameters.", json=Matrix, before="statements")]:
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
        return tuple(units[kind_of(name)] for name in self.names)

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

    @property
    def bias_std(self) -> dict[str, float]:
        """Standard deviation of what the correction leaves of each channel's bias in a later session, m/s²."""
        stds = {}
        for chip, model in self.models.items():
            places = [self._index(f"{chip}_b_{axis}") for axis in _AXES]
            spread = model.inverse @ self.covariance[np.ix_(places, places)] @ model.inverse.T
            for number, variance in enumerate(np.diag(spread), 1):
                stds[f"{chip}{number}"] = math.hypot(math.sqrt(max(float(variance), 0.0)), TURN_ON_STD_M_S2)
        return stds

    @property
    def gain_std(self) -> dict[str, float | str]:
        """Standard deviations of what the correction leaves, over the channels: gains, axes, rad, and positions, m.

        ``turned`` says which directions the data left open: of ``each`` chip, of ``all`` together, or ``none``.
        """
        std, values = self.std, np.abs(self.values)
        turned = "each" if self.gauge in ("x_axis", "z_axis") else "all" if self.null_space.shape[1] else "none"
        found: dict[str, float | str] = {"turned": turned}
        sizes = [value for name, value in zip(self.names, values, strict=True) if KINDS["sensitivity"](name)]
        size = float(np.mean(sizes)) if sizes else 1.0
        kinds = {"scale": "sensitivity", "axis_rad": "cross-axis sensitivity", "placement_m": "position"}
        for key, kind in kinds.items():
            stds = [one for name, one in zip(self.names, std, strict=True) if KINDS[kind](name)]
            rms = float(np.sqrt(np.mean(np.square(stds)))) if stds else 0.0
            found[key] = rms if kind == "position" else rms / size
        return found

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
        for key in ("bias_std_m_s2", "calibration_std"):
            metadata.pop(key, None)
        if not forward:
            metadata |= {"bias_std_m_s2": self.bias_std, "calibration_std": self.gain_std}
        if target == "m_s2":
            metadata.pop("lsb_m_s2", None)
        return replace(recording, readings=readings, unit=target, metadata=metadata)

    def calibrated_array(self, array: AccelerometerArray) -> AccelerometerArray:
        """Return the array with the fitted positions of its chips (unchanged where none were fitted)."""
        fitted = self.positions
        positions = [fitted.get(chip.name, chip.position) for chip in array.chips]
        return array.with_geometry(positions, [chip.axes for chip in array.chips])

    @property
    def undetermined(
        self,
    ) -> Annotated[
        Floats,
        figure(
            "Orthonormal directions of the parameters that the data did not determine.",
            key="null_space", json=Matrix, before="statements",
        ),
    ]:  # fmt: skip
        """Directions of the parameters that the data did not determine, one a row, shape (k, p)."""
        return self.null_space.T

    def shown(self) -> Iterator[Table | str]:
        """Yield the tables and sentences that people read."""
        yield table(f"{self.method} calibration, unit {self.unit}", self.parameters, "name value std unit")
        # Correlation is news where magnitudes alone leave a rotation open, and only there.
        pairs = [
            (f"{chip} {pair.upper()} / {pair[::-1].upper()}", f"{self.correlation_of(first, second):+.4f}")
            for chip in self.chips
            for pair in _PAIRS
            if (first := f"{chip}_M_{pair}") in self.names
            and (second := f"{chip}_M_{pair[::-1]}") in self.names
            and abs(self.correlation_of(first, second)) > _NOTABLE
        ]
        if pairs:
            yield Table("correlation of the misalignments", ("pair", "correlation"), pairs)
        rows = [(key, cell(value, ".6g")) for key, value in self.statistics.items()]
        yield Table("fit", ("quantity", "value"), rows)
        yield from (f"note: {text}" for text in self.statements)
        yield from (f"warning: {text}" for text in self.warnings)

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
            msgspec.convert(data, _CalibrationFile)
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


class _Entry(msgspec.Struct):
    name: str
    value: float


class _CalibrationFile(msgspec.Struct):
    """Types of the keys of a file that are read."""

    channels: list[str]
    parameters: list[_Entry]
    covariance: list[list[float]]
    null_space: list[list[float]] = []
    gravity_m_s2: float = 0.0
    earth_rate_rad_s: float = 0.0
    statements: list[str] = []
    warnings: list[str] = []
    statistics: dict[str, float | str | None] = {}


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
    data = read_json(path, "not a calibration file; make one with `gfimu calibrate`")
    return Calibration.from_dict(data, source=str(path))
