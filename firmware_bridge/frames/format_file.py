"""A frame format as a TOML file: a binary packet or a line of text, without code (docs/reference/frames.md)."""

from __future__ import annotations

import re
from collections.abc import Collection
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from firmware_bridge.frames.checksum import CHECKSUMS
from firmware_bridge.frames.delimited import DelimitedLayout
from firmware_bridge.frames.frame_format import FrameFormat, TemperatureField
from firmware_bridge.frames.packets import PacketLayout, StreamLayout
from firmware_bridge.frames.text_lines import TextLayout
from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.part_file import PartFile
from gfimu.base.errors import InputError, check_name
from gfimu.base.files.model_files import find_model, read_toml
from gfimu.base.files.schema import Positive, Table, about, read

__all__ = ["FormatFile", "load_format"]

_STANDARD_GRAVITY = 9.80665  # m/s²
_TEXT_CLOCK_HZ = 1e9  # ticks of a time that is written out
_FINE_M_S2 = 1e-4  # size of a stored count of readings that come in physical units
_UNITS_M_S2 = {"m_s2": 1.0, "g": _STANDARD_GRAVITY, "mg": 1e-3 * _STANDARD_GRAVITY}
_NUMBER = rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"

Type = Literal["u8", "i8", "u16", "i16", "u32", "i32", "u64", "i64"]
Unit = Literal["lsb", "m_s2", "g", "mg"]


class Field(Table, frozen=True):
    """A field of a packet, in the order of the bytes."""

    name: Annotated[
        str, about("`counts` (readings), `time`, `sequence`, `temperature`; any other name is not looked at.")
    ]
    type: Annotated[Type, about("unsigned or signed integer and its bits.")]
    count: Annotated[int, about("how many of them follow each other.", ge=1, le=4096)] = 1
    value: Annotated[list[int] | None, about("values that the field has in every packet, such as sync bytes.")] = None


class Packet(Table, frozen=True, tag="packet", tag_field="kind"):
    """A binary packet of one length."""

    fields: Annotated[list[Field], about("the fields in the order of the bytes.", min_length=1)]
    byte_order: Annotated[Literal["little", "big"], about("order of the bytes of a number.")] = "little"
    checksum: Annotated[str, about("over all bytes before it, at the end of the packet; `none` if there is none.")] = (
        "crc16_ccitt_false"
    )
    framing: Annotated[
        Literal["none", "cobs", "slip"], about("how a packet's end is marked on the wire; `none`: by nothing.")
    ] = "none"


class Text(Table, frozen=True, tag="text", tag_field="kind"):
    """A line of text."""

    columns: Annotated[
        tuple[str, ...],
        about("names between separators: `time`, `sequence`, `temperature`, channels; an empty name is skipped."),
    ] = ()
    optional: Annotated[
        tuple[str, ...], about("columns, the last ones, that a line may lack, such as `temperature`.")
    ] = ()
    separator: Annotated[str, about("between the columns; blanks beside it do not count.", min_length=1)] = ","
    pattern: Annotated[
        str,
        about(
            "instead of columns: regular expression of a line, with groups `time`, `sequence`, `temperature` and the "
            "channels."
        ),
    ] = ""
    wraps_at: Annotated[
        Positive | None, about("value at which the time overflows, such as 4294967296 of micros().", default="never")
    ] = None


class FormatFile(Table, frozen=True):
    """What a board sends."""

    name: Annotated[str, about("name of the format.")]
    array: Annotated[str, about("array of the board: a name or a file.", example="cube12")]
    clock_hz: Annotated[Positive, about("units of the board's time in a second: 1e6 for µs.", "Hz", example=1e6)]
    stream: Annotated[Packet | Text, about("a packet or a line of text.")]
    description: Annotated[str, about("description, one line.")] = ""
    unit: Annotated[Unit, about("unit of the readings; `lsb`: raw counts.")] = "lsb"
    lsb_m_s2: Annotated[Positive | None, about("size of a count.", "m/s²", default="the part's")] = None
    channels: Annotated[
        list[int] | None, about("which of the counts are the array's channels, from 0.", default="the first ones")
    ] = None
    no_reading: Annotated[int | None, about("count that stands for a missing reading.")] = None
    slowest_hz: Annotated[Positive, about("lowest sample rate of the board.", "Hz")] = 1.0
    temperature_lsb_K: Annotated[
        float | None,
        about("size of a count of the temperature.", "K", default="the part's; 1 where `unit` is not `lsb`"),
    ] = None
    temperature_zero_degC: Annotated[
        float | None,
        about("temperature of the count zero.", "°C", default="the part's; 0 where `unit` is not `lsb`"),
    ] = None
    no_temperature: Annotated[int | None, about("count that stands for no temperature.", default="none")] = None


def load_format(path: str | Path) -> FrameFormat:
    """Load a frame format from a TOML file, or by its name in ``models/frames``.

    Raises
    ------
    InputError
        If the file is no format: one line with the file, the key and what is valid.
    """
    file = find_model("frames", path)
    source = str(path)
    spec = read(read_toml(file), FormatFile, source)
    array = AccelerometerArray.load(spec.array, beside=file.parent)
    beside = file.parent / spec.array
    layout, extra, number = (
        _text(spec, spec.stream, array.channels, source)
        if isinstance(spec.stream, Text)
        else _packet(spec.stream, source)
    )
    channels = tuple(range(array.n_channels) if spec.channels is None else spec.channels)
    if len(channels) != array.n_channels or not all(0 <= place < number for place in channels):
        raise InputError(
            f"{source}: channels {list(channels)}: array {array.name!r} has {array.n_channels} channels and a sample "
            f"{number} counts; give the place of each channel among the counts, from 0"
        )
    is_text = isinstance(spec.stream, Text)
    size = _UNITS_M_S2.get(spec.unit)
    return FrameFormat(
        spec.name,
        layout,
        clock_field="time",
        clock_hz=_TEXT_CLOCK_HZ if is_text else spec.clock_hz,
        array=str(beside) if beside.is_file() else spec.array,
        channels=channels,
        sequence_field="sequence" if "sequence" in extra else "",
        no_reading=spec.no_reading,
        count_m_s2=spec.lsb_m_s2 if size is None else _FINE_M_S2 if is_text else size,
        slowest_hz=spec.slowest_hz,
        temperature=_temperature(spec, array, source) if "temperature" in extra else None,
    )


def _temperature(spec: FormatFile, array: AccelerometerArray, source: str) -> TemperatureField:
    """Return what the number of the temperature means: by the file, the part, or °C beside readings in a unit."""
    lsb, zero = spec.temperature_lsb_K, spec.temperature_zero_degC
    if spec.unit != "lsb":
        lsb, zero = 1.0 if lsb is None else lsb, 0.0 if zero is None else zero
    part = array.chips[0].part
    sheet = PartFile.load(part, array.part_files)
    lsb = sheet.temperature_lsb_K if lsb is None else lsb
    zero = sheet.temperature_zero_degC if zero is None else zero
    if not lsb or zero is None:
        raise InputError(
            f"{source}: temperature_lsb_K and temperature_zero_degC: part {part!r} states none; give the size of a "
            "count and the temperature of the count zero (1.0 and 0.0 for degrees)"
        )
    return TemperatureField("temperature", lsb, zero, spec.no_temperature)


def _packet(spec: Packet, source: str) -> tuple[StreamLayout, Collection[str], int]:
    """Return the layout of a packet, the names of its fields, and its number of counts."""
    order = "<" if spec.byte_order == "little" else ">"
    names = [field.name for field in spec.fields]
    for name in ("time", "counts"):
        if names.count(name) != 1:
            raise InputError(f"{source}: [stream]: fields {', '.join(names)}: give one with name = {name!r}")
    if any(one.name == "temperature" and one.count != 1 for one in spec.fields):
        raise InputError(f"{source}: [stream]: field 'temperature': one number for the board; leave its count out")
    if len(set(names)) != len(names):
        raise InputError(f"{source}: [stream]: fields {', '.join(names)}: two have the same name")
    check_name("checksum", spec.checksum, CHECKSUMS)
    rule = CHECKSUMS[spec.checksum]
    kinds: list[Any] = [
        (one.name, _numpy_type(one.type, order), (one.count,)) if one.count > 1 or one.name == "counts"
        else (one.name, _numpy_type(one.type, order))
        for one in spec.fields
    ]  # fmt: skip
    if rule.of_rows is not None:
        kinds.append(("checksum", f"{order}u{rule.bytes}"))
    dtype = np.dtype(kinds)
    offsets = {name: int(place[1]) for name, place in (dtype.fields or {}).items()}
    signature: list[tuple[int, int]] = []
    for one in spec.fields:
        if one.value is None:
            continue
        if len(one.value) != one.count:
            raise InputError(
                f"{source}: [stream]: field {one.name!r}: value has {len(one.value)} numbers, count is {one.count}"
            )
        bytes_of = np.array(one.value, dtype=_numpy_type(one.type, order)).tobytes()
        start = offsets[one.name]
        signature += [(start + index, byte) for index, byte in enumerate(bytes_of)]
    if not signature and spec.framing == "none":
        raise InputError(
            f"{source}: [stream]: nothing marks a packet; give a field a value (sync bytes), or framing cobs or slip"
        )
    packet = PacketLayout(dtype, tuple(signature), rule.of_rows)
    number = next(one.count for one in spec.fields if one.name == "counts")
    return (packet if spec.framing == "none" else DelimitedLayout(packet, spec.framing)), names, number


def _numpy_type(name: Type, order: str) -> str:
    return f"{order}{name[0]}{int(name[1:]) // 8}"


def _text(
    spec: FormatFile, text: Text, channels: tuple[str, ...], source: str
) -> tuple[StreamLayout, Collection[str], int]:
    """Return the layout of a line, the names of its groups, and its number of counts."""
    if bool(text.columns) == bool(text.pattern):
        raise InputError(f"{source}: [stream]: give either columns or pattern")
    try:
        pattern = re.compile(text.pattern.encode() if text.pattern else _pattern_of(text))
    except re.error as error:
        raise InputError(f"{source}: [stream]: pattern: no regular expression ({error})") from None
    if text.optional and text.columns[-len(text.optional) :] != text.optional:
        raise InputError(
            f"{source}: [stream]: optional {', '.join(text.optional)}: name the last of the columns, in order"
        )
    missing = [name for name in ("time", *channels) if name not in pattern.groupindex]
    if missing:
        raise InputError(f"{source}: [stream]: a line has no {', '.join(missing)}; name the array's channels and time")
    per_unit = 1.0 if spec.unit == "lsb" else _UNITS_M_S2[spec.unit] / _FINE_M_S2
    layout = TextLayout(pattern, channels, _TEXT_CLOCK_HZ / spec.clock_hz, per_unit, text.wraps_at)
    return layout, pattern.groupindex, len(channels)


def _pattern_of(text: Text) -> bytes:
    """Return the regular expression of columns between separators."""
    separator = re.escape(text.separator.encode())
    groups = [b"(?P<%b>%b)" % (name.encode(), _NUMBER) if name else b"[^%b]*" % separator for name in text.columns]
    between = rb"[ \t]*" + separator + rb"[ \t]*"
    needed = len(groups) - len(text.optional)
    return between.join(groups[:needed]) + b"".join(b"(?:%b%b)?" % (between, group) for group in groups[needed:])
