"""Self-test of the emulated board and the firmware: interrupts, chips, image, both ways of running."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

from numpy.typing import NDArray

from firmware_bridge.frames.commands import Command, encode_command, sample_at, set_rate
from firmware_bridge.frames.decoder import SampleDecoder, Status
from firmware_bridge.host.chip_selftest import judge
from firmware_bridge.loop.board_process import BoardProcess, require_emulator
from firmware_bridge.lpc1768.build import check_image
from gfimu.base.declared import Declared, Table, figure, table
from gfimu.base.optional_packages import missing
from gfimu.base.results import TableResult, columns_of

__all__ = ["SelfTestReport", "SelfTestRow", "run_selftest"]

_INTERRUPTS = 10_000
_SELFCHECK_S = 20.0
_COUNTS_PER_G = 256
_CHANNELS = tuple(f"a{chip}{axis}" for chip in range(1, 5) for axis in range(1, 4))
_BOOT_S = 0.05


@dataclass(frozen=True)
class SelfTestRow(Declared):
    """One check of the self-test."""

    check: Annotated[str, figure("What was checked.", head="check")]
    passed: Annotated[bool, figure("Whether it passed.", head="passed")]
    measured: Annotated[str, figure("What was measured.", head="measured")]


@dataclass(frozen=True)
class SelfTestReport(Declared, TableResult):
    """Self-test of the emulator and the firmware; counts and iterates like a list of `SelfTestRow`."""

    rows: Annotated[tuple[SelfTestRow, ...], figure("The checks.", key="checks")]

    @property
    def passed(self) -> Annotated[bool, figure("Whether every check passed.", before="rows")]:
        """Whether every check passed."""
        return all(row.passed for row in self)

    def shown(self) -> Iterator[Table]:
        """Yield the table that people read."""
        yield table(self._heading(), self.rows, "check passed measured", left=3)

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[SelfTestRow]:
        return iter(self.rows)

    def __getitem__(self, place: int) -> SelfTestRow:
        return self.rows[place]

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per check: whether it passed, and what was measured."""
        return columns_of(self, "check passed measured")

    def _heading(self) -> str:
        return "Self-test of the emulator and the firmware"


def run_selftest() -> SelfTestReport:
    """Run all checks.

    Raises
    ------
    InputError
        If the emulator is not installed.
    """
    require_emulator()
    rows = [_image("gfimu"), _image("selfcheck"), _interrupts(), _chips()]
    if not missing("ziglang"):
        rows.append(_fast_path())
    return SelfTestReport(tuple(rows))


def _image(name: str) -> SelfTestRow:
    found = check_image(name)
    passed = bool(found["image_as_recorded"] and found["sources_as_recorded"])
    text = f"built by {found['compiler']}; hash as recorded: {found['image_as_recorded']}"
    return SelfTestRow(f"image {name}", passed, f"{text}; from these sources: {found['sources_as_recorded']}")


def _interrupts() -> SelfTestRow:
    with BoardProcess(image="selfcheck") as board:
        board.run_for(_SELFCHECK_S)
        names = ("good", "bad", "timer0", "systick", "nested", "wrong_ipsr")
        count = {name: board.word(f"selfcheck_{name}") for name in names}
    taken = count["timer0"] + count["systick"]
    passed = taken >= _INTERRUPTS and count["nested"] > 0 and count["good"] > 0
    passed = passed and count["bad"] == count["wrong_ipsr"] == 0
    text = f"{taken} interrupts, {count['nested']} nested, {count['bad']} corrupted of {count['good']} computations"
    return SelfTestRow("interrupts", passed, text)


def _chips() -> SelfTestRow:
    """Switch the chips' self-test on through the firmware and look at the shift."""
    decoder = SampleDecoder()
    with BoardProcess() as board:
        board.run_for(_BOOT_S)
        board.receive(set_rate(100))
        board.run_for(0.2)
        decoder.feed(board.take_sent()[0])
        board.run_for(0.5)
        off = decoder.feed(board.take_sent()[0])
        board.receive(encode_command(Command.SELF_TEST, 1))
        board.run_for(0.7)
        on = decoder.feed(board.take_sent()[0])
    shifted = on.counts[(on.status & Status.SELF_TEST) != 0]
    rows = judge(off.counts / _COUNTS_PER_G, shifted / _COUNTS_PER_G, _CHANNELS, at_3v3=False)
    text = ", ".join(f"{row.channel} {row.shift_g:+.2f} g" for row in rows[:3])
    return SelfTestRow("chips' self-test", all(row.verdict == "passed" for row in rows), text)


def _fast_path() -> SelfTestRow:
    streams = []
    for fast in (False, True):
        with BoardProcess(fast=fast) as board:
            board.run_for(_BOOT_S)
            board.receive(sample_at(800))
            board.run_for(0.3)
            streams.append(board.take_sent()[0])
    return SelfTestRow(
        "fast path", streams[0] == streams[1], f"{len(streams[0])} bytes, the same as with Python peripherals"
    )
