"""What the schema of a file says, for people: its tables key by key."""

from __future__ import annotations

import inspect
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import msgspec
from msgspec import inspect as types

from gfimu.base.files.schema import tagged, without_none

__all__ = ["KeyRow", "TableRows", "table_rows"]


@dataclass(frozen=True)
class KeyRow:
    """One key of a table.

    Parameters
    ----------
    name, kind, unit : str
        The key, its type in words, and its unit as people read it.
    default : str
        What holds without the key; ``required`` where nothing does.
    meaning : str
        What it says.
    """

    name: str
    kind: str
    unit: str
    default: str
    meaning: str


@dataclass(frozen=True)
class TableRows:
    """One table of a file.

    Parameters
    ----------
    heading : str
        The table as a file has it, such as ``[sensor]``; empty for the keys that are in no table.
    text : str
        What the table is.
    keys : tuple of KeyRow
        Its keys, those that are required first.
    """

    heading: str
    text: str
    keys: tuple[KeyRow, ...]


def table_rows(kind: type[msgspec.Struct]) -> list[TableRows]:
    """Return the tables of a kind of file key by key, the table of the file itself first."""
    info = types.type_info(kind)
    assert isinstance(info, types.StructType)
    return list(_tables(info, "", _Head()))


@dataclass(frozen=True)
class _Head:
    """How a page calls a table, and the tag that it has where a file does not say it."""

    text: str = ""
    default_tag: str = ""


def _tables(info: types.StructType, path: str, head: _Head) -> Iterator[TableRows]:
    fields = sorted(info.fields, key=lambda one: not one.required)
    tables = [one for one in fields if _inner(one.type)]
    properties = msgspec.json.schema(info.cls)["$defs"][info.cls.__name__]["properties"]
    keys = [_row(one, properties[one.name].get("description", "")) for one in fields if one not in tables]
    if info.tag is not None:
        default = f'"{info.tag}"' if head.default_tag == info.tag else "required"
        keys.insert(0, KeyRow(str(info.tag_field), f'`"{info.tag}"`', "", default, "Kind of this table."))
    yield TableRows(head.text, _unmarked((inspect.getdoc(info.cls) or "").split("\n\nExamples\n")[0]), tuple(keys))
    for one in tables:
        inner = f"{path}.{one.name}".lstrip(".")
        for struct in _inner(one.type):
            yield from _tables(struct, inner, _head(one, struct, inner))


def _head(field: types.Field, struct: types.StructType, path: str) -> _Head:
    plain, _ = without_none(field.type)
    listed = isinstance(plain, types.VarTupleType)
    title = f"`[[{path}]]`" if listed else f"`[{path}]`"
    kind = f' with `{struct.tag_field} = "{struct.tag}"`' if struct.tag is not None else ""
    note = ", at least one" if listed and field.required else ""
    if isinstance(plain, types.DictType):
        note = ", one entry per name"
    default = field.default.__struct_config__.tag if isinstance(field.default, msgspec.Struct) else None
    return _Head(f"{title}{kind}{note}", str(default or ""))


def _inner(info: types.Type) -> tuple[types.StructType, ...]:
    """Return the structs of a key that holds a table, a list of tables or tables by name; none for another key."""
    plain, _ = without_none(info)
    if isinstance(plain, types.VarTupleType):
        return _inner(plain.item_type)
    if isinstance(plain, types.DictType):
        return _inner(plain.value_type)
    return (plain,) if isinstance(plain, types.StructType) else tuple(tagged(plain).values())


def _row(field: types.Field, description: str) -> KeyRow:
    plain, notes = without_none(field.type)
    meaning = str(notes.get("meaning", description))
    return KeyRow(field.name, _words(plain), str(notes.get("unit", "")), _default(field, notes), meaning)


def _words(info: types.Type) -> str:
    info, _ = without_none(info)
    if isinstance(info, types.LiteralType):
        return ", ".join(f'`"{one}"`' for one in info.values)
    if isinstance(info, types.TupleType):
        return f"{len(info.item_types)} {_words(info.item_types[0])}s"
    if isinstance(info, types.VarTupleType | types.ListType):
        item, _ = without_none(info.item_type)
        if isinstance(item, types.UnionType):
            mixed = any(isinstance(one, types.StrType) for one in item.types)
            return "list of those" if mixed else "rows of numbers"
        return f"list of {_words(item)}s"
    if isinstance(info, types.UnionType):
        return " or ".join(_words(one) for one in info.types)
    if isinstance(info, types.FloatType | types.IntType):
        name = "number" if isinstance(info, types.FloatType) else "whole number"
        signs = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}
        return name + "".join(
            f" {sign} {getattr(info, key):g}" for key, sign in signs.items() if getattr(info, key) is not None
        )
    if isinstance(info, types.BoolType):
        return "true or false"
    return "text" if isinstance(info, types.StrType) else "table"


def _default(field: types.Field, notes: Mapping[str, Any]) -> str:
    if field.required:
        return "required"
    if notes.get("default"):
        return str(notes["default"])
    value = field.default
    if value is msgspec.NODEFAULT or value is None or value in ((), ""):
        return "none"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:.10g}"
    if isinstance(value, tuple):
        return "[" + ", ".join(f"{one:.10g}" for one in value) + "]"
    return json.dumps(value, ensure_ascii=False)


def _unmarked(text: str) -> str:
    """Return a docstring with its code marked as on a page."""
    return text.replace("``", "`")
