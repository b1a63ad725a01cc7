"""Run the `gfimu` program inside the test process."""

import sys
from dataclasses import dataclass

import pytest

from gfimu.commands import main


@dataclass(frozen=True)
class Result:
    """What one call of the program left behind."""

    code: int
    stdout: str
    stderr: str


@pytest.fixture
def gfimu_command(capsys, monkeypatch):
    """Call the program with arguments; returns exit code, standard output and standard error."""

    def call(*arguments: object) -> Result:
        monkeypatch.setattr(sys, "argv", ["gfimu", *map(str, arguments)])
        capsys.readouterr()
        try:
            main()
            code = 0
        except SystemExit as stop:
            code = int(stop.code or 0)
        captured = capsys.readouterr()
        return Result(code, captured.out, captured.err)

    return call
