"""Files of JSON lines: packed by their name, damage and bombs refused in one line."""

import lzma

import pytest

from gfimu import InputError
from sim import json_lines
from sim.json_lines import read_lines, six_digits, write_lines


@pytest.mark.parametrize("name", ["one.jsonl", "one.jsonl.xz"])
def test_lines_are_read_as_they_were_written(tmp_path, name):
    write_lines(tmp_path / name, ['{"a": 1}', '{"b": "°"}'])
    assert read_lines(tmp_path / name, "") == [b'{"a": 1}', '{"b": "°"}'.encode()]
    assert (tmp_path / name).read_bytes().startswith(b"\xfd7zXZ") == name.endswith(".xz")


def test_what_is_no_packed_file_is_one_line(tmp_path, monkeypatch):
    file = tmp_path / "one.jsonl.xz"
    with pytest.raises(InputError, match=r"one\.jsonl\.xz: no such file; give another"):
        read_lines(file, "give another")
    file.write_bytes(b"{}\n")
    with pytest.raises(InputError, match=r"one\.jsonl\.xz: not packed by xz; give another"):
        read_lines(file, "give another")
    packed = lzma.compress(b"{}\n" * 1000)
    file.write_bytes(packed[:-20])
    with pytest.raises(InputError, match="cut off"):
        read_lines(file, "give another")
    file.write_bytes(packed)
    assert len(read_lines(file, "")) == 1000
    monkeypatch.setattr(json_lines, "_MOST_BYTES", 2999)
    with pytest.raises(InputError, match="unpacks to more than"):
        read_lines(file, "give another")


def test_numbers_are_kept_to_six_digits():
    assert six_digits({"a": [1.23456789, 7], "b": "x"}) == {"a": [1.23457, 7], "b": "x"}
