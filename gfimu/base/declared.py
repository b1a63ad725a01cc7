"""Results that are declared once: JSON, its schema, tables and the rows of a notebook follow from annotated fields.

A field is one line, ``gdop: Annotated[float, figure("√tr((JᵀJ)⁻¹).", head="GDOP", form=".4f")]``. A field without
`figure` is for Python alone. A property may be declared too, by its return annotation.
"""

from __future__ import annotations

import functools
import math
import types
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Union, get_args, get_origin, get_type_hints

import msgspec

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "Declared",
    "FileText",
    "Key",
    "Line",
    "Matrix",
    "Number",
    "Numbers",
    "Table",
    "Written",
    "cell",
    "figure",
    "figures",
    "plain",
    "struct_of",
    "structs_of",
    "table",
]

Number = float | None
"""A number of JSON; null where it is not finite or not known."""

Numbers = list[Number]
Matrix = list[list[Number]]


_IN_NAMES = str.maketrans("/²³⁴⁵", "_2345")

NEVER = "—"
"""What a table shows for a number that is not finite."""


@dataclass(frozen=True)
class Key:
    """What is known of a field of a result, for ``Annotated[type, figure(...)]``.

    Parameters
    ----------
    meaning : str
        What it says, a sentence.
    unit : str
        Its unit as people read it.
    head : str
        Its heading in tables; without one `figures` leaves it out.
    form : str
        Format of its numbers in tables, by default four digits; or a text with ``{}`` in their place.
    key : str
        Its name in JSON, by default the field's.
    absent : bool
        Whether JSON leaves it out where it is None; otherwise it is null.
    flat : bool
        Whether the keys of a nested result stand beside the others in JSON.
    in_json : bool
        Whether JSON has it; otherwise only tables do.
    parts : sequence of str
        Names of the components of a vector, for the columns of a notebook's table.
    before : str
        Field before which JSON has it; otherwise fields stand in their order, properties behind them.
    digits : str
        Format whose digits JSON keeps of a number or of several; by default all.
    json : type, optional
        Its type in JSON where the field's own doesn't say it, such as `Matrix`.
    """

    meaning: str
    unit: str = ""
    _: KW_ONLY
    head: str = ""
    form: str = ""
    key: str = ""
    absent: bool = False
    flat: bool = False
    in_json: bool = True
    parts: Sequence[str] = ("x", "y", "z")
    before: str = ""
    digits: str = ""
    json: Any = None

    def column(self, part: str) -> str:
        """Return the name of the column of a component: it stands before the unit."""
        unit = self.unit.translate(_IN_NAMES)
        return (
            f"{self.key.removesuffix(unit)}{part}_{unit}" if unit and self.key.endswith(unit) else f"{self.key}_{part}"
        )


figure = Key
"""The name by which results declare a key, because it reads as what it describes: ``Annotated[float, figure(…)]``."""


@dataclass(frozen=True)
class Table:
    """A table for people.

    Parameters
    ----------
    title : str
        What it shows.
    header : sequence of str
        Names of the columns, with units.
    rows : sequence of sequences
        The cells.
    note : str
        What has to be known to read it.
    left : int
        How many columns hold words; numbers of the others go to the right.
    """

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[object]]
    note: str = ""
    left: int = 1


@dataclass(frozen=True)
class Line:
    """A sentence for people in a style of its own."""

    text: str
    style: str = ""


@dataclass(frozen=True)
class FileText:
    """The text of a file, which is printed as it is."""

    text: str


@dataclass(frozen=True)
class Written:
    """A file that was written, and what it is."""

    what: str
    path: Path


class Declared:
    """A result whose annotations say all that JSON, its schema and tables need."""

    __slots__ = ()

    @classmethod
    def keys(cls) -> Mapping[str, Key]:
        """Return what is known of the declared fields and properties, by attribute."""
        return _keys(cls)

    def to_dict(self) -> dict[str, Any]:
        """Return the result as JSON holds it, units in the keys."""
        found: dict[str, Any] = {}
        for name, key in self.keys().items():
            value = getattr(self, name)
            if not key.in_json or (value is None and key.absent):
                continue
            if key.flat:
                found |= value.to_dict()
            else:
                found[key.key] = plain(_rounded(value, key.digits) if key.digits else value)
        return found

    def row(self) -> dict[str, NDArray[Any]]:
        """Return the numbers as columns of one row, vectors by component, units in the names."""
        import numpy as np

        found: dict[str, Any] = {}
        for name, key in self.keys().items():
            value = getattr(self, name)
            if isinstance(value, int | float):
                found[key.key] = np.array([value])
            elif isinstance(value, np.ndarray) and value.shape == (len(key.parts),):
                found |= {key.column(part): np.array([float(one)]) for part, one in zip(key.parts, value, strict=True)}
        return found

    def facts(self) -> list[tuple[str, str]]:
        """Return the fields that have a heading: the heading, and the value with its unit."""
        values = ((key, cell(getattr(self, name), key.form)) for name, key in self.keys().items() if key.head)
        return [(key.head, f"{text} {key.unit}".rstrip()) for key, text in values if text]


def _keys_of(cls: Any) -> Mapping[str, Key]:
    hints = get_type_hints(cls, include_extras=True)
    for base in reversed(cls.__mro__):
        for name, value in vars(base).items():
            if isinstance(value, property) and value.fget is not None:
                hints[name] = get_type_hints(value.fget, include_extras=True).get("return")
    found = {}
    for name, hint in hints.items():
        key = next((mark for mark in getattr(hint, "__metadata__", ()) if isinstance(mark, Key)), None)
        if key is not None:
            found[name] = replace(key, key=key.key or name, json=key.json or get_args(hint)[0])
    order = list(found)
    for name, key in found.items():
        if key.before:
            order.remove(name)
            order.insert(order.index(key.before), name)
    return {name: found[name] for name in order}


_keys: Callable[[Any], Mapping[str, Key]] = functools.cache(_keys_of)


def _is_array(value: Any) -> bool:
    """Whether it is an array or a number of NumPy, which results without any must not wait for."""
    return hasattr(value, "tolist") and hasattr(value, "shape")


def _rounded(value: Any, digits: str) -> Any:
    """Return a number, or several, with the digits that a format keeps."""
    if isinstance(value, tuple):
        return [_rounded(one, digits) for one in value]
    return float(format(value, digits))


def plain(value: Any) -> Any:
    """Turn results, arrays, paths and NaN into what JSON can hold (NaN and infinity become null)."""
    if hasattr(value, "to_dict"):
        return plain(value.to_dict())
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if _is_array(value):
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value


def table(title: str, rows: Iterable[Declared], columns: str, *, note: str = "", left: int = 1) -> Table:
    """Return a table of results: a row each, and of their fields the ``columns``, by name, between spaces."""
    listed, names = list(rows), columns.split()
    keys = [listed[0].keys()[name] for name in names] if listed else []
    header = [f"{key.head}, {key.unit}" if key.unit and key.unit not in key.head else key.head for key in keys]
    cells = [[cell(getattr(row, name), key.form) for name, key in zip(names, keys, strict=True)] for row in listed]
    return Table(title, header, cells, note, left)


def figures(title: str, result: Declared, *, note: str = "") -> Table:
    """Return the table of one result: a row for each field that has a heading and is not None."""
    values = ((key, getattr(result, name)) for name, key in result.keys().items() if key.head)
    rows = [(key.head, cell(value, key.form), key.unit) for key, value in values if value is not None]
    return Table(title, ("quantity", "value", "unit"), rows, note)


def cell(value: Any, form: str = "") -> str:
    """Return a value as a table shows it: a dash where it is not finite, numbers that agree once."""
    if value is None:
        return ""
    if "{}" in form:
        return form.format(cell(value))
    if _is_array(value):
        value = value.tolist()
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return format(value, form or ".4g") if math.isfinite(value) else NEVER
    if isinstance(value, int):
        return format(value, form)
    if isinstance(value, list | tuple):
        cells = [cell(one, form) for one in value]
        words = any(isinstance(one, str) for one in value)
        return ", ".join(cells) if words else cells[0] if len(set(cells)) == 1 else " ".join(cells)
    return str(value)


def _struct_of(cls: Any) -> type[msgspec.Struct]:
    """Return the struct of a result's JSON, of which `msgspec` makes the schema."""
    fields: list[Any] = []
    for key in cls.keys().values():
        if not key.in_json:
            continue
        if key.flat:
            known = {name for name, *_ in fields}
            inner = msgspec.structs.fields(struct_of(_without_none(key.json)))
            for one in (one for one in inner if one.name not in known):
                missing = (one.type | msgspec.UnsetType, msgspec.UNSET)
                fields.append((one.name, *(missing if key.absent else (one.type, one.default))))
            continue
        kind = _json_type(key.json)
        meta = msgspec.Meta(description=f"{key.meaning} ({key.unit})" if key.unit else key.meaning)
        if key.absent:
            fields.append((key.key, Annotated[_without_none(kind) | msgspec.UnsetType, meta], msgspec.UNSET))
        else:
            fields.append((key.key, Annotated[kind, meta]))
    summary = (cls.__doc__ or "").partition("\n")[0]
    return msgspec.defstruct(
        cls.__name__, fields, namespace={"__doc__": summary}, forbid_unknown_fields=True, kw_only=True
    )


struct_of: Callable[[Any], type[msgspec.Struct]] = functools.cache(_struct_of)


def structs_of(cls: type[Declared]) -> list[type[msgspec.Struct]]:
    """Return the struct of a result, and those that its schema names by reference only."""
    found = [struct_of(cls)]
    waiting: list[Any] = [key.json for key in cls.keys().values()]
    while waiting:
        kind = waiting.pop()
        if isinstance(kind, type) and issubclass(kind, Declared):
            waiting += [key.json for key in kind.keys().values()]
            continue
        if get_origin(kind) in (Union, types.UnionType) and len(several := _declared(get_args(kind))) > 1:
            found += [struct_of(one) for one in several]
        waiting += get_args(kind)
    return list(dict.fromkeys(found))


def _declared(kinds: Sequence[Any]) -> list[type[Declared]]:
    return [kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Declared)]


def _json_type(kind: Any) -> Any:
    """Return the type of a field's value in JSON."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return Annotated[_json_type(inner[0]), *kind.__metadata__]
    if origin in (Union, types.UnionType):
        if len(several := _declared(inner)) > 1:  # of which msgspec knows no union
            schema = {"anyOf": [{"$ref": f"#/$defs/{one.__name__}"} for one in several]}
            return Annotated[dict[str, Any], msgspec.Meta(extra_json_schema=schema)]
        return functools.reduce(lambda one, other: one | other, (_json_type(one) for one in inner))
    if kind is float:
        return Number
    if kind is Path:
        return str
    if getattr(origin, "__name__", "") == "ndarray":
        return Numbers
    if origin in (tuple, list, Sequence):
        return list[_json_type(inner[0])]  # type: ignore[misc]
    if origin in (dict, Mapping):
        return dict[str, _json_type(inner[1])]  # type: ignore[misc]
    if isinstance(kind, type) and issubclass(kind, Declared):
        return struct_of(kind)
    return kind


def _without_none(kind: Any) -> Any:
    """Return the type of a value that JSON leaves out where it is None; a number may still be null."""
    if get_origin(kind) not in (Union, types.UnionType) or kind == Number:
        return kind
    kept = (one for one in get_args(kind) if one is not type(None))
    return functools.reduce(lambda one, other: one | other, kept)
