"""The firmware's core compiled for this computer, with the hardware of `firmware_bridge/lpc1768/host` below it."""

from __future__ import annotations

import ctypes
import subprocess
import sys
from pathlib import Path

from firmware_bridge import SOURCES

_FLAGS = ("-std=c11", "-O1", "-g0", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror")
_SANITIZE = ("-fsanitize=undefined", "-fsanitize-trap=undefined")
_FILES = ("host/hal_host.c", "src/core.c", "src/adxl345.c")


def host_library(out: Path, *, array: str = "") -> ctypes.CDLL:
    """Compile the core into a folder and load it; it states ``array``, if that is given."""
    library = out / f"firmware_host{ {'win32': '.dll', 'darwin': '.dylib'}.get(sys.platform, '.so') }"
    defines = [f'-DGFIMU_ARRAY="{array}"'] if array else []
    command = [sys.executable, "-m", "ziglang", "cc", *_FLAGS, *_SANITIZE, *defines, *_FILES, "-o", str(library)]
    subprocess.run(command, check=True, capture_output=True, cwd=SOURCES.parent)
    return ctypes.CDLL(str(library))
