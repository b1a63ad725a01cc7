"""Files that are read: ordinary ones, unpacked to a bounded size; TOML with bounded keys; servers on loopback."""

from __future__ import annotations

import gzip
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gfimu import InputError
from gfimu.base import MemoryLimit
from gfimu.base.files.input_file import check_input, is_ordinary
from gfimu.base.files.model_files import parse_toml
from gfimu.recording import read_bytes
from gfimu.recording.reading import parsing, unpacked


def test_ordinary_files_only(tmp_path):
    (tmp_path / "file").write_bytes(b"text")
    assert check_input(tmp_path / "file").name == "file"
    assert is_ordinary(tmp_path / "file")
    for name, words in {"": "is a directory", "no": "no such file", "n" * 5000: "too long", "a\x00b": "null"}.items():
        assert not is_ordinary(tmp_path / name)
        with pytest.raises(InputError, match=words) as caught:
            check_input(tmp_path / name)
        assert len(str(caught.value)) < 2100


@pytest.mark.skipif(sys.platform == "win32", reason="no pipes in folders there")
def test_a_pipe_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="no ordinary file"):
        read_bytes(tmp_path / "pipe")


def test_gzip_files_unpack_to_a_bounded_size(tmp_path):
    text = b"0.01,1.25\n" * 1000
    two = gzip.compress(text) + gzip.compress(text)
    (tmp_path / "run.gz").write_bytes(two)
    assert read_bytes(tmp_path / "run.gz") == 2 * text
    limit = MemoryLimit("run.gz", 3 * len(text))
    assert unpacked(two, limit) == 2 * text
    with pytest.raises(InputError, match=r"run.gz: needs more memory than the limit of .*; --max-memory allows more"):
        unpacked(two, limit, grows=2.0)
    for damaged in (two[:100], two[:50] + b"x" * 40 + two[90:], two[:-6]):
        with pytest.raises(InputError, match="damaged gzip file"):
            unpacked(damaged, limit)


@pytest.mark.parametrize(
    "error", [ValueError("two\nlines"), RecursionError(), MemoryError(), RuntimeError(), SystemError("x")]
)
def test_whatever_a_parser_raises_is_one_line(error):
    with (
        pytest.raises(InputError, match=r"^file: .*; (save it again|--max-memory allows more)$") as caught,
        parsing("file", "log", "save it again"),
    ):
        raise error
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a." * 20_000 + "b = 1", "a key of more than 100 parts"),
        ("a = " + "[" * 20_000, "nested too deeply"),
        ("a = " + "9" * 5000, "not valid TOML"),
        ("a = [\n", "not valid TOML"),
    ],
)
def test_toml_without_end_is_one_line(text, words):
    with pytest.raises(InputError, match=words) as caught:
        parse_toml(text, "file.toml")
    assert len(str(caught.value)) < 300


def test_many_points_in_values_are_no_long_key():
    numbers = ", ".join(["0.5"] * 300)
    assert parse_toml(f'a = [{numbers}]\nb = "{"." * 300}"', "file.toml")["b"] == "." * 300


def link_of(file: Path) -> str:
    try:
        return os.readlink(file)  # noqa: PTH115
    except OSError:  # closed meanwhile
        return ""


def listening(session: int) -> list[str]:
    """Addresses (hexadecimal) on which the processes of a session listen."""
    sockets = set()
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if process.joinpath("stat").read_text().rpartition(")")[2].split()[3] != str(session):
                continue
            links = [link_of(one) for one in (process / "fd").iterdir()]
        except OSError:
            continue
        sockets |= {found[1] for link in links if (found := re.fullmatch(r"socket:\[(\d+)\]", link))}
    rows = [row.split() for name in ("tcp", "tcp6") for row in Path(f"/proc/net/{name}").read_text().splitlines()[1:]]
    return [row[1] for row in rows if row[9] in sockets and row[3] == "0A"]


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize("mode", [["--serve-grpc"], ["--web-viewer", "--web-viewer-port", "19881"]])
def test_the_viewer_listens_on_this_machine_only(mode):
    pytest.importorskip("rerun")
    from gfimu.visual.viewer import viewer_command

    wanted = len(mode) // 2 + 1
    command = viewer_command(*mode, "--port", "19880")
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    viewer = subprocess.Popen(command, start_new_session=True, env={**os.environ, "BROWSER": "true"}, **quiet)
    try:
        end = time.monotonic() + 60.0
        while len(found := listening(viewer.pid)) < wanted and time.monotonic() < end:
            time.sleep(0.2)
    finally:
        os.killpg(viewer.pid, 9)
        viewer.wait()
    assert len(found) == wanted
    assert {address.partition(":")[0] for address in found} == {"0100007F"}  # 127.0.0.1


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_the_virtual_port_listens_on_this_machine_only():
    from firmware_bridge import TcpPort

    before = set(listening(os.getsid(0)))
    port = TcpPort(0)
    try:
        assert {one.partition(":")[0] for one in set(listening(os.getsid(0))) - before} == {"0100007F"}
    finally:
        port.close()
