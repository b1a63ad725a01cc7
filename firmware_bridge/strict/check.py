"""Check an image against the rules of the strict board, in a process of its own."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.loop.board_process import require_emulator
from firmware_bridge.strict.findings import Finding
from firmware_bridge.strict.image import load_image
from gfimu.base.child_process import run_module
from gfimu.base.declared import Declared, Line, Table, figure
from gfimu.base.errors import GfimuError, InputError
from gfimu.base.results import TableResult, text_column

__all__ = ["CheckOptions", "CheckReport", "check_image"]

_CHIPS = 4
_CHILD = "firmware_bridge.strict.worker"


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
class CheckReport(Declared, TableResult):
    """An image on the strict board."""

    image: Annotated[str, figure("The image.")]
    virtual_s: Annotated[float, figure("Virtual time.", "s")]
    ended: Annotated[str, figure("Why the run ended before its time; empty if it did not.")]
    accesses: Annotated[int, figure("Register accesses.")]
    exceptions: Annotated[int, figure("Exceptions handled.")]
    resets: Annotated[int, figure("Resets after the first start.")]
    sent: Annotated[tuple[int, ...], figure("Bytes that each UART sent.", "bytes")]
    baud: Annotated[tuple[float, ...], figure("Speed of each UART at the end.", "bit/s")]
    character: Annotated[tuple[str, ...], figure("Bits, parity and stop bits of each UART, as in 8N1.")]
    stack_bytes: Annotated[int | None, figure("Main stack that was used; null if not known.", "bytes")]
    stack_room: Annotated[int | None, figure("Room of the main stack; null if not known.", "bytes")]
    started_at: Annotated[int, figure("Address of the vector table; not 0 for an image that a boot loader starts.")]
    findings: Annotated[tuple[Finding, ...], figure("Rules broken: faults first, then in the order of their times.")]

    @property
    def faults(self) -> Annotated[int, figure("Findings that are faults.")]:
        """Findings that are faults."""
        return sum(finding.severity == "fault" for finding in self.findings)

    def shown(self) -> Iterator[Table | Line | str]:
        """Yield the tables and sentences that people read."""
        yield Table(self._heading(), ("quantity", "value"), self._facts())
        by_rule: dict[str, list[Finding]] = {}
        for finding in self.findings:
            by_rule.setdefault(finding.rule.replace("_", " "), []).append(finding)
        if by_rule:
            header = ("rule", "severity", "count", "first at", "what")
            yield Table("findings", header, [_row(rule, places) for rule, places in by_rule.items()], left=5)
            for rule, places in by_rule.items():
                yield f"{rule}: {places[0].remedy} ({places[0].source})"
        else:
            yield Line("no rule broken", "green")
        if self.ended:
            yield Line(f"the run ended early: {self.ended}", "yellow")

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per finding: rule, severity, where, how often, what to do, and the document that says so."""
        texts = {
            key: text_column(getattr(finding, key) for finding in self.findings)
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
        started = [("started", f"at {self.started_at:#x}, as by a boot loader")] if self.started_at else []
        counts = {"register accesses": self.accesses, "exceptions": self.exceptions, "resets": self.resets}
        sent = [
            (f"sent by UART{n}", f"{count} bytes, {self.baud[n]:.0f} baud {self.character[n]}")
            for n, count in enumerate(self.sent)
            if count
        ]
        stack = f"{self.stack_bytes} of {self.stack_room} bytes used"
        return [
            ("virtual time", f"{self.virtual_s:.4g} s"),
            *started,
            *((name, str(count)) for name, count in counts.items()),
            *(sent or [("sent", "nothing")]),
            *([] if self.stack_room is None else [("main stack", stack)]),
        ]

    def _notes(self) -> tuple[str, ...]:
        rules = () if self.findings else ("No rule is broken.",)
        return (*rules, *((f"The run ended early: {self.ended}.",) if self.ended else ()))


def _row(rule: str, places: Sequence[Finding]) -> tuple[str, ...]:
    """Return the row of a rule: its first place, and how often it was broken."""
    first = min(places, key=lambda finding: finding.time_s)
    where = f"{first.pc:#x} {first.symbol}".rstrip()
    count = sum(finding.count for finding in places)
    return rule, first.severity, str(count), f"{where}, {first.time_s:.6f} s", first.what


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
    run = run_module(_CHILD, input=json.dumps(request), text=True)
    if run.returncode:
        last = (run.stderr.strip().splitlines() or ["no message"])[-1]
        raise GfimuError(f"{image}: the strict board has ended: {last}")
    answer = json.loads(run.stdout)
    findings = tuple(Finding(**finding) for finding in answer.pop("findings"))
    per_uart: dict[str, Any] = {name: tuple(answer.pop(name)) for name in ("sent", "baud", "character")}
    return CheckReport(**answer, **per_uart, findings=findings)
