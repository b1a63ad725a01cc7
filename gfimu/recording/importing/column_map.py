"""Maps from the columns of a foreign file to a recording: a small TOML file, checked against one schema."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import msgspec

from gfimu.base.errors import InputError, did_you_mean
from gfimu.base.files.input_file import is_ordinary
from gfimu.base.files.model_files import find_model, list_models, read_toml, set_key
from gfimu.recording.quantities import REFERENCE_UNITS
from gfimu.recording.units import factor_of, kind_of

__all__ = [
    "REFERENCE_KINDS",
    "UNMAPPED",
    "ColumnMap",
    "ColumnSpec",
    "TextSpec",
    "TimeSpec",
    "complete",
    "list_maps",
    "load_map",
    "map_toml",
]

_Meta = msgspec.Meta

DropKind = Literal["corrupt", "out_of_range", "missing", "wrong_read", "duplicates", "unordered"]
"""Rows that a map can leave out; see `gfimu.recording.filtered`."""

REFERENCE_KINDS = {
    f"{quantity}_{unit}": kind_of(unit) for quantity, (unit, *_) in REFERENCE_UNITS.items() if quantity != "t"
}
"""References of a recording, and the kind of their unit."""

_Positive = Annotated[float, _Meta(gt=0)]
_Column = Annotated[
    str | int | tuple[str | int, ...],
    _Meta(description="Name of the column, or its number from 1; of several the first one that is there."),
]


UNMAPPED = "raw_"
"""How the names of columns that a map does not name begin in a recording."""


_FOR_ALL = ("unit", "scale")  # keys of a map that hold for each of its channels that has none of its own


class ColumnSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A column that holds a sensing axis or a reference: (number − offset) · scale, in a unit."""

    column: _Column
    unit: Annotated[str, _Meta(description="Unit of the numbers times scale, such as m/s^2, g, mg, deg/s, rpm.")]
    scale: Annotated[
        float, _Meta(description="Size of one step of the number, in that unit; negative to turn the axis.")
    ] = 1.0
    offset: Annotated[float, _Meta(description="Number at zero.")] = 0.0
    table: Annotated[str, _Meta(description="Table of the file; by default that of the channels.")] = ""
    time: Annotated[
        _Column | None, _Meta(description="Column of its own times, in the unit of the map's, where it has such.")
    ] = None
    rate_hz: Annotated[
        Annotated[float, _Meta(gt=0)] | None,
        _Meta(description="Its own sample rate, Hz, from the first row on, where it has no times."),
    ] = None

    @property
    def has_own_times(self) -> bool:
        """Whether it has a column of times or a sample rate of its own."""
        return self.time is not None or self.rate_hz is not None


class TimeSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """When the samples were taken: a column of times, a column that counts samples of a rate, or a rate alone."""

    column: Annotated[_Column | None, _Meta(description="Column of the times; none where only the rate is known.")] = (
        None
    )
    unit: Annotated[
        str, _Meta(description="s, ms, us, ns, min, h, d, or datetime for dates and times of day as texts.")
    ] = "s"
    scale: Annotated[float, _Meta(description="Size of one step of the number, in that unit.", gt=0)] = 1.0
    rate_hz: Annotated[
        _Positive | None, _Meta(description="Sample rate, Hz, where there is no column, or the column counts samples.")
    ] = None
    wrap: Annotated[_Positive | None, _Meta(description="Number at which the counter of times overflows.")] = None
    part: Annotated[
        Annotated[int, _Meta(ge=1)] | None,
        _Meta(description="Which part to take, from 1, where the clock starts anew as after a restart of the logger."),
    ] = None
    start_s: Annotated[
        Annotated[float, _Meta(ge=0)] | None, _Meta(description="Begin so many seconds after the first sample.")
    ] = None
    stop_s: Annotated[_Positive | None, _Meta(description="End so many seconds after the first sample.")] = None


class TextSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Layout of a text file, where it can't be found from the file itself."""

    separator: Annotated[str, _Meta(description="Between cells: , ; tab or space.")] = ""
    decimal: Annotated[str, _Meta(description="Decimal mark: . or ,")] = ""
    skip_lines: Annotated[
        Annotated[int, _Meta(ge=0)] | None, _Meta(description="Lines before the first line of numbers.")
    ] = None
    columns: Annotated[tuple[str, ...], _Meta(description="Names of the columns, where the file has none.")] = ()


class ColumnMap(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Meaning and unit of the columns of a file.

    Channels have the names of an array's sensing axes (a11, a12, a13, a21 …), references those of a recording
    (tacho_rad_s, angle_rad, gyro_x_rad_s …).

    Examples
    --------
    >>> import gfimu
    >>> gfimu.convert("log.csv", column_map="phyphox")  # doctest: +SKIP
    """

    name: Annotated[str, _Meta(description="Name of the map.")]
    channels: Annotated[dict[str, ColumnSpec], _Meta(description="Sensing axes by the array's channel names.")] = {}
    summary: Annotated[str, _Meta(description="Program or device that writes such files, one line.")] = ""
    format: Annotated[
        str, _Meta(description="text, parquet, zip, excel, json, matlab, hdf5, ulog, mcap, rosbag; else by content.")
    ] = ""
    table: Annotated[str, _Meta(description="Table of the file that holds the channels, where it has several.")] = ""
    split_by: Annotated[
        str, _Meta(description="Column that names the chip of each row; each of its values is a table, sensor=1 say.")
    ] = ""
    array: Annotated[str, _Meta(description="Array that is assumed where none is given.")] = ""
    time: Annotated[TimeSpec, _Meta(description="When the samples were taken.")] = TimeSpec()
    reference: Annotated[dict[str, ColumnSpec], _Meta(description="References by their name in a recording.")] = {}
    optional: Annotated[tuple[str, ...], _Meta(description="Channels or references that a file may lack.")] = ()
    missing: Annotated[tuple[float, ...], _Meta(description="Numbers that stand for a missing value.")] = ()
    skip_rows: Annotated[int, _Meta(description="Rows of samples to leave out at the start.", ge=0)] = 0
    drop: Annotated[
        tuple[DropKind, ...],
        _Meta(description="Rows to leave out; each kind is counted and reported."),
    ] = ()
    keep_other: Annotated[bool, _Meta(description="Keep other columns, as raw_<name>.")] = True
    text: Annotated[TextSpec, _Meta(description="Layout of a text file.")] = TextSpec()

    @property
    def is_own(self) -> bool:
        """Whether it names no columns: the file is a recording of gfimu's, of which rows are left out."""
        return not (self.channels or self.reference or self.time.column is not None or self.time.rate_hz is not None)

    def check(self, source: str) -> None:
        """Raise `InputError` for a unit or reference that is not known, or a map without times."""
        if self.time.start_s is not None and self.time.stop_s is not None and self.time.stop_s <= self.time.start_s:
            raise InputError(f"{source}: time.stop_s = {self.time.stop_s:g} must be later than time.start_s")
        if self.is_own:
            self._check_own(source)
            return
        if self.time.column is None and self.time.rate_hz is None:
            raise InputError(f"{source}: time has neither a column nor rate_hz; give one")
        if not self.channels and not self.reference:
            raise InputError(
                f"{source}: neither channels nor references; name one column at least, as channels.a11 = "
                '{ column = "ax", unit = "g" }'
            )
        if self.time.unit != "datetime":
            factor_of(self.time.unit, "time", where=f"{source}: time")
        for name, spec in self.channels.items():
            factor_of(spec.unit, "acceleration", where=f"{source}: channel {name}")
            if not name[-1:].isdigit():
                raise InputError(f"{source}: channel {name!r} does not end in the number of its axis; name it as a11")
        for name, spec in {**self.channels, **self.reference}.items():
            if spec.time is not None and spec.rate_hz is not None:
                raise InputError(f"{source}: {name} has both a time and rate_hz of its own; keep one")
        for name, spec in self.reference.items():
            if name not in REFERENCE_KINDS:
                raise InputError(
                    f"{source}: unknown reference {name!r}; valid: {', '.join(REFERENCE_KINDS)}"
                    f"{did_you_mean(name, REFERENCE_KINDS)}"
                )
            factor_of(spec.unit, REFERENCE_KINDS[name], where=f"{source}: reference {name}")
        if self.array:
            from gfimu.array.array import AccelerometerArray

            AccelerometerArray.load(self.array, beside=Path(source).parent)

    def _check_own(self, source: str) -> None:
        """Raise `InputError` for keys that say nothing without columns."""
        kept = ColumnMap(self.name, summary=self.summary, skip_rows=self.skip_rows, drop=self.drop)
        time = TimeSpec(start_s=self.time.start_s, stop_s=self.time.stop_s)
        if self != msgspec.structs.replace(kept, time=time) or (kept == ColumnMap(self.name) and time == TimeSpec()):
            raise InputError(
                f'{source}: no columns; add time.column (or time.rate_hz) and channels, as a11 = {{column = "ax", '
                'unit = "g"}; gfimu inspect prints a map to start from'
            )

    def is_required(self, name: str) -> bool:
        """Whether a file must have a channel or reference."""
        return name not in self.optional

    def to_dict(self) -> dict[str, Any]:
        """Return the map as its TOML file holds it, without what is as by default."""
        found = msgspec.to_builtins(self)
        plain = msgspec.to_builtins(ColumnMap(""))
        short = {key: value for key, value in found.items() if value != plain[key] or key == "name"}
        for group in ("channels", "reference"):
            for key, spec in short.get(group, {}).items():
                short[group][key] = {
                    item: value
                    for item, value in spec.items()
                    if item in {"column", "unit"} or value not in (1.0, 0.0, "", None)
                }
        for group in ("time", "text"):
            if group in short:
                short[group] = {key: value for key, value in short[group].items() if value != plain[group][key]}
        return short


def map_toml(column_map: ColumnMap) -> str:
    """Return the text of a map's TOML file, a column per line."""
    content = column_map.to_dict()
    lines = [f"{key} = {_toml(value)}" for key, value in content.items() if not isinstance(value, dict)]
    for group in ("time", "text", "channels", "reference"):
        if group in content:
            lines += ["", f"[{group}]", *(f"{_key(key)} = {_toml(value)}" for key, value in content[group].items())]
    return "\n".join(lines) + "\n"


def _toml(value: Any) -> str:
    """Return a value as TOML, a table in one line."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_toml(one) for one in value) + "]"
    if isinstance(value, float):
        return repr(float(f"{value:.12g}"))
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _key(name: str) -> str:
    return name if re.fullmatch("[A-Za-z0-9_-]+", name) else _toml(name)


def list_maps() -> list[str]:
    """Names of the maps that come with gfimu."""
    return list_models("maps")


def load_map(name: str | Path | ColumnMap | None, changes: Sequence[str] = ()) -> ColumnMap:
    """Return a map given as such, by the name of one that comes with gfimu, or as a TOML file, with changed keys.

    Parameters
    ----------
    name : str, Path, ColumnMap or None
        The map; None begins with an empty one.
    changes : sequence of str
        Keys to set, such as ``"time.unit=ms"``. A channel may be given by its column alone, where the map has a
        ``unit`` (and ``scale``) for all: ``unit=g``, ``channels.a11=ax``. Kinds of rows to drop may be one text:
        ``drop=corrupt,duplicates``.

    Raises
    ------
    InputError
        If there is no such map, or it has an unknown key, unit or reference; the message names it.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.load_map("phyphox", ["time.unit=ms"]).time.unit
    'ms'
    """
    if isinstance(name, ColumnMap) and not changes:
        return name
    if name is None or isinstance(name, ColumnMap):
        source, beside, data = "the column map", None, {"name": "options"} if name is None else name.to_dict()
    else:
        path = find_model("maps", name)
        source, beside, data = str(path), path.parent, {"name": path.stem, **read_toml(path)}
    for change in changes:
        set_key(data, change, option="--map-set", example="time.unit=ms", as_table=_as_column)
    if changes and not isinstance(name, ColumnMap):
        source = "--map-set" if name is None else f"{source} with --map-set"
    try:
        found = msgspec.convert(complete(data), ColumnMap)
    except msgspec.ValidationError as error:
        raise InputError(f"{source}: {_plain_words(str(error))}; correct the map") from None
    if beside is not None and found.array.endswith(".toml") and is_ordinary(beside / found.array):
        found = msgspec.structs.replace(found, array=str(beside / found.array))
    found.check(source)
    return found


def _as_column(value: Any, names: list[str]) -> Any:
    """Return the short form of a column, its name or number alone, as the table that gets a further key."""
    short = isinstance(value, str | int) and len(names) == 2 and names[0] in {"channels", "reference"}
    return {"column": value} if short else value


def complete(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of a map with its short forms written out: columns alone, a unit for all channels, one text."""
    whole = {key: value for key, value in data.items() if key not in _FOR_ALL}
    usual = {key: data[key] for key in _FOR_ALL if key in data}
    channels = whole.get("channels")
    if isinstance(channels, Mapping):
        whole["channels"] = {name: _column(spec, usual) for name, spec in channels.items()}
    elif usual and channels is None:
        raise InputError(f'{" and ".join(usual)} of the column map: no channels; add channels.a11 = "ax"')
    reference = whole.get("reference")
    if isinstance(reference, Mapping):
        whole["reference"] = {name: _column(spec, {}) for name, spec in reference.items()}
    if isinstance(whole.get("drop"), str):
        whole["drop"] = [kind.strip() for kind in whole["drop"].split(",") if kind.strip()]
    return whole


def _column(spec: Any, usual: Mapping[str, Any]) -> Any:
    if isinstance(spec, Mapping):
        return {**usual, **spec}
    return {"column": spec, **usual} if isinstance(spec, str | int | list) else spec


def _plain_words(text: str) -> str:
    """Return a message of the schema with the place in the file instead of a JSON path, and the keys valid there."""
    reason, _, place = text.partition(" - at ")
    where = place.strip("`").removeprefix("$").removeprefix(".").replace("[...]", " of a column")
    words = reason.replace("`object`", "a table of keys").replace("Object", "the table" if where else "the map")
    if "unknown field" in words:
        table = {"time": TimeSpec, "text": TextSpec, "": ColumnMap}.get(where, ColumnSpec)
        keys = (*table.__struct_fields__, *(_FOR_ALL if table is ColumnMap else ()))
        near = did_you_mean(_quoted(words), keys)
        words = words.replace("contains unknown field", "has no key") + f"; valid: {', '.join(keys)}{near}"
    elif "Invalid enum value" in words and where.startswith("drop"):
        words += f"; valid: {', '.join(get_args(DropKind))}{did_you_mean(_quoted(words), get_args(DropKind))}"
    elif where.startswith("drop"):
        words += f"; give one or more of {', '.join(get_args(DropKind))}"
    return f"{where}: {words}" if where else words


def _quoted(words: str) -> str:
    """Return the first word in quotes."""
    found = re.search("[`'](.*?)[`']", words)
    return found[1] if found else ""
