"""The project that a user gets, and the sender built from it."""

from __future__ import annotations

import ctypes
import subprocess
import sys
from pathlib import Path

import pytest

from firmware_bridge import write_project

STRICT = ("-std=c11", "-O2", "-Wall", "-Wextra", "-Wconversion", "-Werror")
BARE = ("-ffreestanding", "-fno-builtin", "-fno-sanitize=undefined", "-fno-unwind-tables",
        "-fno-asynchronous-unwind-tables", "-ffunction-sections", "-fdata-sections")  # fmt: skip
CORE = ("sender.c", "core.c", "adxl345.c")


@pytest.fixture(scope="session")
def project(tmp_path_factory) -> Path:
    """The folder of `gfimu new sender`."""
    folder = tmp_path_factory.mktemp("sender") / "my_sender"
    write_project(folder)
    return folder


@pytest.fixture(scope="session")
def compile_sender(project, tmp_path_factory):
    """Compile files of the project; return the result."""
    pytest.importorskip("ziglang", reason="the C compiler is in the extra 'firmware'")

    def compile_files(*words: str, compiler: str = "cc") -> Path:
        out = tmp_path_factory.mktemp("built") / "sender"
        command = [sys.executable, "-m", "ziglang", compiler, "-I.", *words, "-o", str(out)]
        done = subprocess.run(command, cwd=project, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return out

    return compile_files


@pytest.fixture(scope="session")
def sender_library(compile_sender) -> ctypes.CDLL:
    """The sender on a port that the test moves."""
    port = Path(__file__).with_name("virtual_port.c")
    flags = ("-std=c11", "-O1", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror")
    return ctypes.CDLL(
        str(compile_sender(*flags, "-fsanitize=undefined", "-fsanitize-trap=undefined", str(port), *CORE))
    )
