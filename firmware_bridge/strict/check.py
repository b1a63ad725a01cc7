"""Check an image against the rules of the strict board, in a process of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.loop.board_process import require_emulator
from firmware_bridge.strict.findings import Finding
from firmware_bridge.strict.image import load_image
from gfimu.errors import GfimuError, InputError
from gfimu.results import TableResult, text_column

__all__ = ["CheckOptions", "CheckReport", "check_image"]

_CHIPS = 4
_CHILD = ("-P", "-m", "firmware_bridge.strict.worker")


@dataclass(frozen=True)
class CheckOptions:
    """How an image is run.

    Parameters
    ----------
    seconds : float
        Virtual time, s.
    chips : int
        ADXL345s on SSP1, 0 to 4, selected by P2.0 and so on.
    baud : int or None
        Speed that every UART is meant to send at, baud; None: any usual one.
    limit_s : float
        Real time after which the run ends, s.
    broken_parts : bool
        Whether the image is also run with parts that never become ready.
    """

    seconds: float = 3.0
    chips: int = _CHIPS
    baud: int | None = None
    limit_s: float = 60.0
    broken_parts: bool = True

    def __post_init__(self) -> None:
        if not 0.0 < self.seconds < float("inf"):
            raise InputError(f"--seconds {self.seconds:g}: give a time above 0 s")
        if not 0 <= self.chips <= _CHIPS:
            raise InputError(f"--chips {self.chips}: 0 to {_CHIPS} can be attached")
        if self.baud is not None and self.baud <= 0:
            raise InputError(f"--baud {self.baud}: give a speed above 0 baud")


@dataclass(frozen=True)
class CheckReport(TableResult):
    """What came of a check.

    Parameters
    ----------
    image : str
        The image.
    virtual_s : float
        Virtual time that was run, s.
    ended : str
        Why the run ended before its time; empty if it did not.
    accesses, exceptions, resets : int
        Register accesses, exceptions handled, resets after the first start.
    sent : tuple of int
        Bytes that each UART sent.
    baud : tuple of float
        Speed of each UART at the end, baud.
    character : tuple of str
        Bits, parity and stop bits of each UART at the end, as in ``8N1``.
    stack_bytes : int or None
        Bytes of the main stack that were used; None if the image does not say where it ends.
    stack_room : int or None
        Bytes between the top of the main stack and the data below it.
    started_at : int
        Address of the vector table; not 0 for an image that a boot loader starts.
    findings : tuple of Finding
        Rules broken: faults first, then in the order of their times.
    """

    image: str
    virtual_s: float
    ended: str
    accesses: int
    exceptions: int
    resets: int
    sent: tuple[int, ...]
    baud: tuple[float, ...]
    character: tuple[str, ...]
    stack_bytes: int | None
    stack_room: int | None
    started_at: int
    findings: tuple[Finding, ...]

    @property
    def faults(self) -> int:
        """Findings that are faults."""
        return sum(finding.severity == "fault" for finding in self.findings)

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per finding: rule, severity, where, how often, what to do, and the document that says so."""
        texts = {
            key: text_column(getattr(one, key) for one in self.findings)
            for key in ("rule", "severity", "what", "symbol", "remedy", "source")
        }
        return {
            **{key: texts.pop(key) for key in ("rule", "severity")},
            "count": np.array([one.count for one in self.findings], dtype=int),
            "time_s": np.array([one.time_s for one in self.findings], dtype=float),
            "pc": text_column(f"{one.pc:#x}" for one in self.findings),
            **texts,
        }

    def _heading(self) -> str:
        return f"{self.image} on the strict board"

    def _facts(self) -> list[tuple[str, str]]:
        counts = [(name, str(getattr(self, name))) for name in ("accesses", "exceptions", "resets")]
        sent = [
            (f"sent by UART{n}", f"{count} bytes, {self.baud[n]:.0f} baud {self.character[n]}")
            for n, count in enumerate(self.sent)
            if count
        ]
        stack = f"{self.stack_bytes} of {self.stack_room} bytes used"
        return [
            ("virtual time", f"{self.virtual_s:.4g} s"),
            *counts,
            *sent,
            *([] if self.stack_room is None else [("main stack", stack)]),
        ]

    def _notes(self) -> tuple[str, ...]:
        rules = () if self.findings else ("No rule is broken.",)
        return (*rules, *((f"The run ended early: {self.ended}.",) if self.ended else ()))


def check_image(image: str | Path = "gfimu", options: CheckOptions | None = None) -> CheckReport:
    """Run an image on the strict board and return which rules it breaks.

    Parameters
    ----------
    image : str or Path
        Name of an image (``gfimu``, ``selfcheck``), or an ELF or .bin file.
    options : CheckOptions, optional
        How it is run.

    Raises
    ------
    InputError
        If the emulator is not installed, or the image can't be read or does not fit the LPC1768.
    """
    require_emulator()
    load_image(image)  # so that a wrong image is refused here, in one line
    request: dict[str, Any] = {"image": str(image), **asdict(options or CheckOptions())}
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    run = subprocess.run(
        [sys.executable, *_CHILD],
        input=json.dumps(request), capture_output=True, text=True, check=False, env=environment,
    )  # fmt: skip
    if run.returncode:
        last = (run.stderr.strip().splitlines() or ["no message"])[-1]
        raise GfimuError(f"{image}: the strict board has ended: {last}")
    answer = json.loads(run.stdout)
    findings = tuple(Finding(**finding) for finding in answer.pop("findings"))
    per_uart: dict[str, Any] = {name: tuple(answer.pop(name)) for name in ("sent", "baud", "character")}
    return CheckReport(**answer, **per_uart, findings=findings)
