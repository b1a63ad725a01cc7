"""Atomic files: flushed to the disk, what killed processes left is removed, two writers in one folder stay whole."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from gfimu import WriteError
from gfimu.base.files.atomic_file import _own_prefix, atomic_folder, atomic_path, write_text

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="processes can't be asked for there")


def test_content_and_folder_are_flushed(tmp_path, monkeypatch):
    flushed = []
    usual = os.fsync
    monkeypatch.setattr(
        os, "fsync", lambda number: (flushed.append(str(Path(f"/proc/self/fd/{number}").readlink())), usual(number))
    )
    write_text(tmp_path / "file.txt", "text")
    assert Path(flushed[0]).name.startswith(_own_prefix())
    assert flushed[1] == str(tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == ["file.txt"]


def test_a_disk_that_fills_while_flushing_is_one_line(tmp_path, monkeypatch):
    def full(number):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    (tmp_path / "file.txt").write_text("of yesterday")
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(WriteError, match="not written: No space left on device"):
        write_text(tmp_path / "file.txt", "text")
    assert (tmp_path / "file.txt").read_text() == "of yesterday"
    assert [file.name for file in tmp_path.iterdir()] == ["file.txt"]


KILLED = """
import os, signal, sys
from gfimu.base.files.atomic_file import atomic_path
with atomic_path(sys.argv[1]) as temporary:
    temporary.write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_a_killed_process_left_is_removed_by_the_next_write(tmp_path):
    subprocess.run([sys.executable, "-c", KILLED, str(tmp_path / "file.csv")], check=False)
    (left,) = tmp_path.iterdir()
    assert left.name.startswith(_own_prefix())
    kept = [f"{_own_prefix()}{os.getpid()}-x.csv", ".gfimu-0-1-x.csv", f"{_own_prefix()}mine.csv", ".file-abc.csv"]
    for name in kept:  # of a process that runs, of another machine, and of nobody known
        (tmp_path / name).write_text("kept")
    write_text(tmp_path / "other.txt", "whole")
    assert sorted(file.name for file in tmp_path.iterdir()) == sorted([*kept, "other.txt"])


WRITER = """
import sys
from gfimu.base.files.atomic_file import write_text
for _ in range(40):
    write_text(sys.argv[1], sys.argv[2] * 200_000)
"""


def test_two_processes_in_one_folder_leave_whole_files(tmp_path):
    shared = tmp_path / "shared.txt"
    both = [subprocess.Popen([sys.executable, "-c", WRITER, str(shared), mark]) for mark in "ab"]
    seen = set()
    while any(one.poll() is None for one in both):
        if shared.exists():
            text = shared.read_text()
            assert len(text) == 200_000
            seen |= set(text[0])
            assert len(set(text)) == 1
    assert [one.returncode for one in both] == [0, 0]
    assert seen
    assert [file.name for file in tmp_path.iterdir()] == ["shared.txt"]


FOLDER_WRITER = """
import sys
from gfimu.base.files.atomic_file import atomic_folder
for _ in range(40):
    with atomic_folder(sys.argv[1]) as made:
        for name in ("one.txt", "two.txt"):
            (made / name).write_text(sys.argv[2] * 1000)
"""


def test_two_processes_that_write_the_same_folder_leave_the_files_of_one(tmp_path):
    folder = tmp_path / "made"
    both = [subprocess.Popen([sys.executable, "-c", FOLDER_WRITER, str(folder), mark]) for mark in "ab"]
    assert [one.wait() for one in both] == [0, 0]
    assert sorted(file.name for file in folder.iterdir()) == ["one.txt", "two.txt"]
    assert (folder / "one.txt").read_text() == (folder / "two.txt").read_text()


def test_a_block_that_fails_leaves_nothing(tmp_path):
    with pytest.raises(ZeroDivisionError), atomic_path(tmp_path / "file.txt") as temporary:
        temporary.write_text(str(1 / 0))
    with pytest.raises(ZeroDivisionError), atomic_folder(tmp_path / "folder") as made:
        (made / "half.txt").write_text(str(1 / 0))
    assert not list((tmp_path / "folder").iterdir())
    (tmp_path / "folder").rmdir()
    assert list(tmp_path.iterdir()) == []
