"""Reading a TOML file by its schema: one struct per table, from which types, bounds, messages and pages follow.

A file kind is a `Table` whose annotations carry all that is known of a key: type, bounds, unit and meaning (`about`).
`read` turns the content of a file into that struct. Its errors are one line with the file, the table, the key, the
value and what is valid. The reference page, the JSON schema for editors (`gfimu.base.files.schema_keys`) and the checks
of the templates come from the same struct, so a new key is one annotated line.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, TypeVar

import msgspec
from msgspec import inspect as types

from gfimu.base.errors import InputError, did_you_mean, nearest_name
from gfimu.base.units import SIZES, is_usable

__all__ = ["NotNegative", "Positive", "Table", "Triple", "about", "read", "tagged", "without_none"]

Triple = tuple[float, float, float]
"""Three finite numbers, one per axis."""

Positive = Annotated[float, msgspec.Meta(gt=0)]
NotNegative = Annotated[float, msgspec.Meta(ge=0)]

_ALIKE = 0.9  # numerical: of difflib; a key of a part file so like a known one is a slip, not a note of its author
_ROUGHLY = 0.6  # numerical: of difflib; a word of a list that is wrong in any case
_LONGEST_VALUE = 60  # characters of a value in a message


class Table(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One table of a TOML file; a key that is not a field is refused."""


_Table = TypeVar("_Table", bound=Table)


def about(
    meaning: str,
    unit: str = "",
    *,
    default: str = "",
    example: Any = None,
    must_be: str = "",
    **limits: Any,
) -> msgspec.Meta:
    """Return what is known of a key, for ``Annotated[type, about(...)]``.

    Parameters
    ----------
    meaning : str
        What the key says, for the reference page and the editor.
    unit : str
        Unit as people read it; the key ends in it.
    default : str
        What holds without the key, where no constant does.
    example : object, optional
        A value for the message that the key is missing.
    must_be : str
        What the value must be, for messages, where the type does not say it well.
    **limits
        Bounds of `msgspec.Meta`: ``gt``, ``ge``, ``lt``, ``le``, ``min_length``, ``max_length``, ``pattern``.
    """
    notes = {"unit": unit, "default": default, "must_be": must_be, "meaning": meaning}
    return msgspec.Meta(
        description=f"{meaning} ({unit})" if unit else meaning,
        examples=None if example is None else [example],
        extra={key: value for key, value in notes.items() if value},
        **limits,
    )


def read(data: Any, kind: type[_Table], source: str) -> _Table:
    """Return a table of a file as its struct.

    Parameters
    ----------
    data : mapping
        Content of the file, as TOML gives it.
    kind : type
        The struct.
    source : str
        File, for messages.

    Raises
    ------
    InputError
        For a key that is missing or unknown (the message has the valid keys and the nearest one), or a value of
        another type or out of its bounds.
    """
    data = _with_default_tags(data, kind)
    try:
        found = msgspec.convert(data, kind)
    except msgspec.ValidationError as error:
        raise _explained(str(error), data, kind, source) from None
    for path in _unusable(data):
        raise _explained(f"size - at `${path}`", data, kind, source)
    for key in data.keys() - set(kind.__struct_fields__):  # of a table that takes notes of its author
        if near := nearest_name(key, kind.__struct_fields__, _ALIKE):
            raise InputError(f"{source}: unknown key {key!r}; did you mean {near!r}?")
    return found


def without_none(info: types.Type) -> tuple[types.Type, dict[str, Any]]:
    """Return the type of a key without ``None`` and its wrappers, and what `about` says of it."""
    notes: dict[str, Any] = {}
    while True:
        if isinstance(info, types.Metadata):
            notes = {"examples": (info.extra_json_schema or {}).get("examples"), **(info.extra or {}), **notes}
            info = info.type
        elif isinstance(info, types.UnionType) and any(isinstance(one, types.NoneType) for one in info.types):
            kept = tuple(one for one in info.types if not isinstance(one, types.NoneType))
            info = kept[0] if len(kept) == 1 else types.UnionType(kept)
        else:
            return info, notes


def tagged(info: types.Type) -> dict[Any, types.StructType]:
    """Return the structs of a union by their tag; empty for another type."""
    members = info.types if isinstance(info, types.UnionType) else ()
    structs = [one for one in members if isinstance(one, types.StructType) and one.tag is not None]
    return {one.tag: one for one in structs} if len(structs) == len(members) else {}


def _with_default_tags(data: Any, kind: type[Table]) -> Any:
    """Return the data with the tag of a table that has a default and does not say which of its kinds it is."""
    if not isinstance(data, Mapping):
        return data
    filled = dict(data)
    for one in msgspec.structs.fields(kind):
        value = data.get(one.name)
        if isinstance(value, Mapping) and isinstance(one.default, Table):
            config = one.default.__struct_config__
            if config.tag is not None:
                filled[one.name] = {config.tag_field: config.tag, **value}
    return filled


def _unusable(value: Any, path: str = "") -> Iterator[str]:
    """Yield where in a TOML value a number can't be used."""
    if isinstance(value, float | int) and not is_usable(value):
        yield path
    elif isinstance(value, Mapping):
        for key, one in value.items():
            yield from _unusable(one, f"{path}.{key}")
    elif isinstance(value, list | tuple):
        for place, one in enumerate(value):
            yield from _unusable(one, f"{path}[{place}]")


_STEP = re.compile(r"\.([^.\[]+)|\[(\d+)\]")
_FIELD = re.compile(r"Object (contains unknown|missing required) field `(.*?)`")


@dataclass
class _Place:
    """A place in a file: the table it is in, and the key there with its value and type."""

    value: Any
    info: types.Type
    where: str
    key: str = ""
    key_value: Any = None
    key_info: types.Type = field(default_factory=types.AnyType)

    def step(self, name: str, index: str, enter: bool) -> None:
        """Go on to a key, or to an item of a list; ``enter`` the table that is there."""
        if name:
            self.info = self.of_key(name)
            self.value = self.value.get(name) if isinstance(self.value, Mapping) else None
            self.key, self.key_value, self.key_info = name, self.value, self.info
        else:
            self.info = _item(self.info, int(index))
            self.value = self.value[int(index)]
        if enter and isinstance(self.value, Mapping):
            self.where += f": [{self.key}]" if name else f": [[{self.key}]] {int(index) + 1}"

    def table(self) -> types.StructType | None:
        """Return the struct of the table that is here, by its tag where there are several."""
        info, _ = without_none(self.info)
        if isinstance(info, types.StructType):
            return info
        kinds = tagged(info)
        return kinds.get(_tag(kinds, self.value)) if kinds else None

    def of_key(self, name: str) -> types.Type:
        """Return the type of a key of the table that is here; that of the tag are the tags."""
        kinds = tagged(without_none(self.info)[0])
        if kinds and name == next(iter(kinds.values())).tag_field:
            return types.LiteralType(tuple(kinds))
        plain = without_none(self.info)[0]
        if isinstance(plain, types.DictType):
            return plain.value_type
        struct = self.table()
        return next((one.type for one in struct.fields if one.name == name), types.AnyType()) if struct else self.info


def _tag(kinds: Mapping[Any, types.StructType], value: Any) -> Any:
    """Return the tag that a table has, or the first one where it has none."""
    field_name = next(iter(kinds.values())).tag_field or ""
    return value.get(field_name, next(iter(kinds))) if isinstance(value, Mapping) else None


def _item(info: types.Type, index: int) -> types.Type:
    info, _ = without_none(info)
    if isinstance(info, types.TupleType):
        return info.item_types[index] if index < len(info.item_types) else types.AnyType()
    return info.item_type if isinstance(info, types.VarTupleType | types.ListType) else types.AnyType()


def _explained(message: str, data: Any, kind: type[Table], source: str) -> InputError:
    """Return the error for a message of msgspec, in the words of a TOML file."""
    if not isinstance(data, Mapping):
        return InputError(f"{source}: must be a table of keys and values, not {_short(data)}")
    reason, _, path = message.partition(" - at `$")
    path, _, _ = path.partition("[...]")  # an entry of a table with keys of the user's, which msgspec does not name
    at = _Place(data, types.type_info(kind), source)
    steps = list(_STEP.finditer(path.rstrip("`")))
    of_table = _FIELD.match(reason)
    for number, step in enumerate(steps, start=1):
        at.step(step[1] or "", step[2] or "", bool(of_table) or number < len(steps))
    if of_table and of_table[1] == "contains unknown":
        return InputError(f"{at.where}: {_unknown(of_table[2], _valid_keys(at.table()))}")
    if of_table:
        return InputError(f"{at.where}: {_missing(of_table[2], at.of_key(of_table[2]))}")
    if isinstance(at.key_value, Sequence) and not at.key_value and _is_list_of_tables(at.key_info):
        return InputError(f"{at.where}: {_no_table(at.key)}")
    finite = isinstance(at.key_value, int) or (isinstance(at.key_value, float) and math.isfinite(at.key_value))
    must_be = SIZES if reason == "size" and finite else _must_be(at)
    return InputError(f"{at.where}: {at.key} = {_short(at.key_value)} must be {must_be}")


def _valid_keys(table: types.StructType | None) -> list[str]:
    if table is None:
        return []
    return sorted({one.name for one in table.fields} | ({table.tag_field} if table.tag_field else set()))


def _unknown(key: str, valid: Sequence[str]) -> str:
    return f"unknown key {key!r}; valid: {', '.join(valid)}{_nearest(key, valid)}"


def _nearest(word: Any, valid: Sequence[Any]) -> str:
    """Return the remedy for a slip of the pen; empty where no valid word is near."""
    return did_you_mean(str(word), [str(one) for one in valid], _ROUGHLY)


def _missing(key: str, info: types.Type) -> str:
    if _is_list_of_tables(info):
        return _no_table(key)
    plain, notes = without_none(info)
    remedy = f", such as {key} = {_short(notes['examples'][0], toml=True)}" if notes.get("examples") else ""
    if isinstance(plain, types.LiteralType):
        remedy = f", one of {', '.join(map(str, plain.values))}"
    return f"key {key!r} is missing; add it{remedy}"


def _no_table(key: str) -> str:
    return f"no [[{key}]] table; add at least one"


def _is_list_of_tables(info: types.Type) -> bool:
    info, _ = without_none(info)
    item = info.item_type if isinstance(info, types.VarTupleType) else None
    return isinstance(item, types.StructType) or bool(item is not None and tagged(item))


def _must_be(at: _Place) -> str:
    """Return what the value of a key must be."""
    info, notes = without_none(at.key_info)
    if "must_be" in notes:
        return str(notes["must_be"])
    if isinstance(info, types.LiteralType):
        return f"one of {', '.join(map(str, info.values))}{_nearest(at.key_value, info.values)}"
    if _is_list_of_tables(info):
        return f"an array of tables: [[{at.key}]]"
    if isinstance(info, types.StructType) or tagged(info):
        return f"a table: [{at.key}]"
    return _kind(info, at.key_value)


def _kind(info: types.Type, value: Any = None, *, many: bool = False) -> str:
    """Return a type in words; of a number of the right type, the bound that it does not keep."""
    a, s = ("", "s") if many else ("a ", "")
    if isinstance(info, types.IntType):
        return f"{a}whole number{s}" + _bound(info, " ")
    if isinstance(info, types.FloatType):
        good = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < math.inf
        return _bound(info) or f"{a}finite number{s}" if good else f"{a}finite number{s}"
    if isinstance(info, types.TupleType):
        return f"a list of {len(info.item_types)} {_kind(info.item_types[0], many=True)}"
    if isinstance(info, types.VarTupleType | types.ListType):
        return f"a list of {_kind(without_none(info.item_type)[0], many=True)}"
    if isinstance(info, types.BoolType):
        return "true or false"
    if isinstance(info, types.UnionType):
        return " or ".join(_kind(without_none(one)[0], many=many) for one in info.types)
    if isinstance(info, types.DictType):
        return "a table of keys and values"
    return f"{a}string{s}" if isinstance(info, types.StrType) else f"{a}finite number{s}"


def _bound(info: types.IntType | types.FloatType, before: str = "") -> str:
    words = {"gt": "greater than", "ge": "at least", "lt": "less than", "le": "at most"}
    found = [f"{text} {getattr(info, key):g}" for key, text in words.items() if getattr(info, key) is not None]
    of = "of " if before and info.ge is not None else ""
    return f"{before}{of}{' and '.join(found)}" if found else ""


def _short(value: Any, *, toml: bool = False) -> str:
    text = f'"{value}"' if toml and isinstance(value, str) else repr(value)
    return text if len(text) <= _LONGEST_VALUE else f"{text[: _LONGEST_VALUE - 2]} …"
