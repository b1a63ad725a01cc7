"""Mutations of valid files: bits, pieces, numbers, nesting, lengths, characters, and files that are none."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

import numpy as np

__all__ = ["BRACKETS", "NUMBERS", "mutated"]

NUMBERS = (
    b"1e308", b"-1e308", b"1e-320", b"nan", b"inf", b"-inf", b"0", b"-1", b"-0.0", b"9" * 5000, b"1e999999",
    b"9223372036854775808", b"-9223372036854775809", b"0x10", b"1_000", b"1,5", b"1e9", b"100000", b"true", b"null",
    b"", b"\xd9\xa3", b"18446744073709551616", b"4294967295", b"1e-9",
)  # fmt: skip
BRACKETS = (
    b"[red]x[/red]",
    b"[/]",
    b"[blink]",
    b"<script>alert(1)</script>",
    b"{0}",
    b"%s%n",
    b"$(id)",
    b"../../x",
    b"'\"",
)
_NUMBER = re.compile(rb"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_WORD = re.compile(rb"[A-Za-z_][A-Za-z0-9_]*")
_LONG = 200_000
_DEEP = 20_000

Mutation = Callable[[bytes, np.random.Generator, Sequence[bytes]], bytes]


def _place(data: bytes, rng: np.random.Generator) -> int:
    """Return a place in the data, half of the time near its begin, where formats keep their structure."""
    end = len(data) + 1
    return int(rng.integers(min(end, 300) if rng.random() < 0.5 else end))


def _insert(data: bytes, rng: np.random.Generator, piece: bytes) -> bytes:
    at = _place(data, rng)
    return data[:at] + piece + data[at:]


def _bits(data: bytes, rng: np.random.Generator, others: Sequence[bytes]) -> bytes:
    changed = bytearray(data)
    for _ in range(int(rng.integers(1, 9))):
        if changed:
            at = min(_place(data, rng), len(changed) - 1)
            changed[at] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def _bytes(data: bytes, rng: np.random.Generator, others: Sequence[bytes]) -> bytes:
    changed = bytearray(data)
    for _ in range(int(rng.integers(1, 9))):
        if changed:
            at = min(_place(data, rng), len(changed) - 1)
            changed[at] = int(rng.choice([0, 0xFF, 0x7F, 0x80, rng.integers(256)]))
    return bytes(changed)


def _cut(data: bytes, rng: np.random.Generator, others: Sequence[bytes]) -> bytes:
    return data[: _place(data, rng)] if rng.random() < 0.7 else data[_place(data, rng) :]


def _splice(data: bytes, rng: np.random.Generator, others: Sequence[bytes]) -> bytes:
    other = others[int(rng.integers(len(others)))]
    return data[: _place(data, rng)] + other[_place(other, rng) :]


def _repeat(data: bytes, rng: np.random.Generator, others: Sequence[bytes]) -> bytes:
    start, stop = sorted((_place(data, rng), _place(data, rng)))
    return data[:stop] + data[start:stop] * int(rng.integers(1, 20)) + data[stop:]


def _remove(data: bytes, rng: np.random.Generator, others: Sequence[bytes]) -> bytes:
    start, stop = sorted((_place(data, rng), _place(data, rng)))
    return data[:start] + data[stop:]


def _replace_match(pattern: re.Pattern[bytes], data: bytes, rng: np.random.Generator, piece: bytes) -> bytes:
    found = list(pattern.finditer(data[:20_000]))
    if not found:
        return _insert(data, rng, piece)
    one = found[int(rng.integers(len(found)))]
    return data[: one.start()] + piece + data[one.end() :]


def _number(data: bytes, rng: np.random.Generator, others: Sequence[bytes]) -> bytes:
    for _ in range(int(rng.integers(1, 4))):
        data = _replace_match(_NUMBER, data, rng, NUMBERS[int(rng.integers(len(NUMBERS)))])
    return data


def _word(data: bytes, rng: np.random.Generator, others: Sequence[bytes]) -> bytes:
    pieces = (
        *BRACKETS,
        b"a" * 5000,
        b"\xff\xfe",
        b"\x00",
        "ß".encode(),
        b"\xed\xa0\x80",
        b"e\xcc\x81" * 50,
        b"\x1b[2J",
    )
    return _replace_match(_WORD, data, rng, pieces[int(rng.integers(len(pieces)))])


def _lines(data: bytes, rng: np.random.Generator, others: Sequence[bytes]) -> bytes:
    rows = data.split(b"\n")
    if len(rows) > 2:
        one, two = rng.integers(len(rows), size=2)
        rows[one], rows[two] = rows[two], rows[one]
        if rng.random() < 0.5:
            rows.insert(int(one), rows[int(two)])
    return b"\n".join(rows)


def _blank(data: bytes, rng: np.random.Generator, others: Sequence[bytes]) -> bytes:
    return _insert(data, rng, (b"\n", b"\r\n", b" \n", b"#\n", b"\r")[int(rng.integers(5))] * _LONG)


def _long(data: bytes, rng: np.random.Generator, others: Sequence[bytes]) -> bytes:
    piece = (b"a", b"9", b" ", b'"', b",", b"\t", b"-", b"\x00", b"\xc3")[int(rng.integers(9))]
    return _insert(data, rng, piece * _LONG)


def _deep(data: bytes, rng: np.random.Generator, others: Sequence[bytes]) -> bytes:
    deep = (b"[" * _DEEP, b'{"a":' * _DEEP, b"[" * _DEEP + b"]" * _DEEP, b"a." * _DEEP, b"<body>" * _DEEP, b"(" * _DEEP)
    piece = deep[int(rng.integers(len(deep)))]
    return _replace_match(_NUMBER, data, rng, piece) if rng.random() < 0.5 else _insert(data, rng, piece)


def _wide(data: bytes, rng: np.random.Generator, others: Sequence[bytes]) -> bytes:
    """Make the first line that of 300,000 columns."""
    names = b",".join(b"c%d" % number for number in range(300_000))
    first, _, rest = data.partition(b"\n")
    return (first + b"," if rng.random() < 0.5 else b"") + names + b"\n" + rest[:20_000]


def _encoded(data: bytes, rng: np.random.Generator, others: Sequence[bytes]) -> bytes:
    text = data.decode("latin-1")
    return text.encode(("utf-16", "utf-8-sig", "utf-32", "utf-8")[int(rng.integers(4))])


def _nothing(data: bytes, rng: np.random.Generator, others: Sequence[bytes]) -> bytes:
    return (b"", b"\n", b"\x00" * 4096, b" " * 4096, b"#", b"[]", b"{}", b"\xff" * 100, b"null")[int(rng.integers(9))]


_USUAL: tuple[Mutation, ...] = (_bits, _bytes, _cut, _splice, _repeat, _remove, _number, _number, _word, _lines)
_RARE: tuple[Mutation, ...] = (_blank, _long, _deep, _encoded, _nothing)


def mutated(data: bytes, rng: np.random.Generator, others: Sequence[bytes]) -> tuple[bytes, str]:
    """Return a mutation of a valid file, and its name; ``others`` are files to splice with."""
    chance = rng.random()
    if chance < 0.002:
        return _wide(data, rng, others), "wide"
    kinds = _RARE if chance < 0.08 else _USUAL
    names = []
    for _ in range(int(rng.integers(1, 4)) if kinds is _USUAL else 1):
        one = kinds[int(rng.integers(len(kinds)))]
        data = one(data, rng, others)
        names.append(one.__name__.strip("_"))
    return data, "+".join(names)
