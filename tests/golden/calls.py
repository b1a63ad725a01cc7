"""The calls, and how one is run: through ``python -m gfimu``, in a folder of its own that holds the inputs."""

from __future__ import annotations

import contextlib
import io
import re
import runpy
import shutil
import socket
import subprocess
import sys
import threading
import time
import tomllib
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

__all__ = ["CALLS", "EXPECTED", "INPUTS", "Call", "Outcome", "run"]

HERE = Path(__file__).parent
INPUTS, EXPECTED = HERE / "inputs", HERE / "expected"

INTERRUPTED = {130, 143}
"""Exit codes after Ctrl-C and SIGTERM, which a command takes for itself and which are meant for the whole run."""

NO_READER = " | true"
"""End of a line whose standard output nobody reads: it runs as a process of its own, into a closed pipe."""

BOARD = re.compile(r"\{(\S+)\}")
"""Part of a line that stands for a TCP port, behind which a board sends the bytes of that input and hangs up."""


@dataclass(frozen=True)
class Call:
    """Command lines that run after each other in one folder, and the tolerance of their numbers by name."""

    name: str
    tolerance: str
    lines: tuple[str, ...]

    @property
    def expected(self) -> Path:
        """File of the stored outcome."""
        return EXPECTED / f"{self.name}.json"


@dataclass(frozen=True)
class Outcome:
    """What one command line gave: exit code, standard output and error, and the files that it wrote or changed."""

    code: int
    stdout: str
    stderr: str
    files: tuple[Path, ...] = ()


def _calls() -> Iterator[Call]:
    for tolerance, calls in tomllib.loads((HERE / "calls.toml").read_text(encoding="utf-8")).items():
        for name, lines in calls.items():
            yield Call(name, tolerance, (lines,) if isinstance(lines, str) else tuple(lines))


CALLS = {call.name: call for call in _calls()}


def run(call: Call, folder: Path) -> Iterator[tuple[str, Outcome]]:
    """Yield each line of a call with its outcome; the inputs are copied to the folder first."""
    shutil.copytree(INPUTS, folder, dirs_exist_ok=True)
    for line in call.lines:
        before = _times(folder)
        board = BOARD.search(line)
        with _served(INPUTS / board[1]) if board else contextlib.nullcontext() as port:
            words = [*BOARD.sub(str(port), line.removesuffix(NO_READER)).split(), "--json"]
            code, stdout, stderr = (_process if line.endswith(NO_READER) else _main)(words, folder)
        changed = tuple(file for file, written in _times(folder).items() if before.get(file) != written)
        yield line, Outcome(code, stdout, stderr, changed)


def _times(folder: Path) -> dict[Path, int]:
    return {file: file.stat().st_mtime_ns for file in sorted(folder.rglob("*")) if file.is_file()}


def _main(words: list[str], folder: Path) -> tuple[int, str, str]:
    stdout, stderr, code = io.StringIO(), io.StringIO(), 0
    with (
        mock.patch.object(sys, "argv", ["gfimu", *words]),
        contextlib.chdir(folder),
        contextlib.redirect_stdout(stdout),
        contextlib.redirect_stderr(stderr),
        warnings.catch_warnings(),
    ):
        try:
            runpy.run_module("gfimu", run_name="__main__")
        except SystemExit as stop:
            code = int(stop.code or 0)
    if code in INTERRUPTED:
        raise KeyboardInterrupt
    return code, stdout.getvalue(), stderr.getvalue()


def _process(words: list[str], folder: Path) -> tuple[int, str, str]:
    command = [sys.executable, "-m", "gfimu", *words]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as started:
        assert started.stdout is not None
        assert started.stderr is not None
        started.stdout.close()
        stderr = started.stderr.read()
    return started.returncode, "", stderr


@contextlib.contextmanager
def _served(file: Path) -> Iterator[int]:
    content = file.read_bytes()
    with socket.create_server(("127.0.0.1", 0)) as server:

        def send() -> None:
            host, _ = server.accept()
            with host:
                time.sleep(1.0)  # a recorder empties its input when it opens a port
                host.sendall(content)
                time.sleep(1.0)  # and reads once more before it finds that the board is gone

        threading.Thread(target=send, daemon=True).start()
        yield server.getsockname()[1]
