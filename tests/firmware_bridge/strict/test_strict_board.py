"""The strict board: its rules one by one, programs that break none, images of others, and the report."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

pytest.importorskip("unicorn", reason="the emulator is in the extra 'firmware'")

from firmware_bridge import Adxl345, Command, ElfImage, StrictBoard, encode_command, image_path, set_range, set_rate
from firmware_bridge.lpc1768.elf import Segment
from firmware_bridge.strict import rules
from firmware_bridge.strict.board import STUCK
from firmware_bridge.strict.check import CheckOptions, check_image
from firmware_bridge.strict.findings import Rule
from firmware_bridge.strict.image import load_image
from firmware_bridge.strict.watch import Policy
from firmware_bridge.strict.worker import run_board
from gfimu import InputError

IMAGES = Path(__file__).parents[1] / "images"
DOCS = Path(__file__).parents[3] / "docs" / "reference" / "firmware.md"
LIMIT_S = 30.0
FLASH_ONLY = {"boot_checksum"}  # the tests' compiler writes none


def resting(first, period, count, bw_rate):
    return np.zeros((count, 3), np.int32)


def strict_board(image: ElfImage, chips: int = 4, **options) -> StrictBoard:
    return StrictBoard(image, [Adxl345(resting) for _ in range(chips)], **options)


def rules_broken(board: StrictBoard, seconds: float) -> set[str]:
    run_board(board, seconds, LIMIT_S)
    return {finding.rule for finding in board.findings()} - FLASH_ONLY


@pytest.fixture(scope="module")
def start_at(compile_image):
    """Return the image of the mistakes, started at one of its functions."""
    image = compile_image(IMAGES / "mistakes.c")

    def start(name: str) -> ElfImage:
        code, *others = image.segments
        data = code.data[:4] + struct.pack("<I", image.symbols[name] | 1) + code.data[8:]
        return replace(image, segments=(replace(code, data=data), *others))

    return start


MISTAKES = (
    "reserved_bits", "flash_wait_late", "input_pin_not_selected", "partial_register", "ssp_disabled",
    "ssp_changed_while_busy", "ssp_overrun", "torn_sample", "spi_too_slow", "chip_fifo_rest", "watchdog_late",
    "dead_handler", "stack_low", "watchdog_without_reset", "uart_parity",
    "deep_sleep",
)  # fmt: skip


@pytest.mark.parametrize("name", MISTAKES)
def test_a_rule_is_broken_alone_and_at_its_place(start_at, name: str) -> None:
    board = strict_board(start_at(name))
    run_board(board, 0.1, LIMIT_S)
    findings = [finding for finding in board.findings() if finding.rule not in FLASH_ONLY]
    assert {finding.rule for finding in findings} == {name}
    place = findings[0].symbol.split("+")[0]
    assert place in ({"SysTick_Handler"} if name == "dead_handler" else {name, "exchange", "spi", "feed"})


def test_a_pin_that_nobody_drives_is_waited_for_outside(start_at) -> None:
    assert rules_broken(strict_board(start_at("wait_for_outside")), 1.0) == {"wait_for_outside"}


@pytest.mark.parametrize(
    "name", ["bounded_wait", "bounded_by_memory", "waits_for_a_character", "waits_for_time", "drains_first"]
)
def test_what_ends_by_itself_breaks_no_rule(start_at, name: str) -> None:
    assert rules_broken(strict_board(start_at(name), policy=Policy(wait_s=0.01)), 0.12) == set()


def test_a_count_of_tries_is_seen_in_registers_and_in_memory(start_at) -> None:
    for name in ("bounded_wait", "bounded_by_memory"):
        assert rules_broken(strict_board(start_at(name), stuck="crystal", policy=Policy(wait_s=0.01)), 0.1) == set()


def test_the_firmware_breaks_no_rule_whatever_the_host_asks() -> None:
    board = strict_board(ElfImage.load(image_path()))
    run_board(board, 0.03, LIMIT_S)
    commands = (
        set_range(4, full_resolution=False), set_rate(800), encode_command(Command.IDENTIFY),
        encode_command(Command.SELF_TEST, 1), encode_command(Command.STOP), encode_command(Command.START),
        set_rate(10), set_rate(100), encode_command(Command.SET_BAUD, 115_200), b"\xc3\x3cgarbage",
    )  # fmt: skip
    for command in commands:
        board.uarts[0].receive(command)
        assert run_board(board, 0.05, LIMIT_S) == ""
    assert board.findings() == ()
    assert board.uarts[0].baud == pytest.approx(115_200, rel=0.01)


@pytest.mark.parametrize("part", STUCK)
def test_the_firmware_waits_for_no_part_for_ever(part: str) -> None:
    assert rules_broken(strict_board(ElfImage.load(image_path()), stuck=part), 1.0) == set()


def test_the_strict_board_sends_what_the_board_sends(make_board) -> None:
    plain, strict = make_board(), StrictBoard(ElfImage.load(image_path()), make_board().sensors)
    streams = []
    for board in (plain, strict):
        board.run_for(0.2)
        streams.append(board.uarts[0].take_sent()[0])
    assert streams[0] == streams[1]
    assert len(streams[0]) > 700


def test_a_speed_that_is_not_the_expected_one_is_named() -> None:
    board = strict_board(ElfImage.load(image_path()), policy=Policy(baud=460_800))
    assert rules_broken(board, 0.02) == {"uart_speed"}


def vectors(stack: int, reset: int, *, size: int = 0x400, at: dict[int, int] | None = None) -> ElfImage:
    """Build a raw image: a vector table with a right checksum, and an endless loop at 0x200."""
    words = [stack, reset, 0, 0, 0, 0, 0]
    data = bytearray(struct.pack("<8I", *words, -sum(words) & 0xFFFFFFFF).ljust(size, b"\xff"))
    data[0x200:0x202] = b"\xfe\xe7"
    for address, value in (at or {}).items():
        data[address : address + 4] = struct.pack("<I", value)
    return ElfImage("raw", (Segment(0, bytes(data), 0),), {}, (size, 0, 0))


@pytest.mark.parametrize(
    ("image", "expected"),
    [
        (vectors(0x10008000, 0x201), set()),
        (vectors(0x10010000, 0x201), {"vector_table"}),
        (vectors(0x10008000, 0x200), {"vector_table"}),
        (vectors(0x10008000, 0x201, at={0x1C: 0}), {"boot_checksum"}),
        (vectors(0x10008000, 0x201, at={0x2FC: 0x43218765}), {"code_protection"}),
    ],
)
def test_what_the_boot_rom_reads(image: ElfImage, expected: set[str]) -> None:
    board = strict_board(image, 0)
    run_board(board, 0.01, LIMIT_S)
    assert {finding.rule for finding in board.findings()} == expected


def test_an_image_for_a_boot_loader_is_started_as_one(tmp_path) -> None:
    image = vectors(0x10008000, 0x4201)
    moved = replace(image, segments=(Segment(0x4000, image.segments[0].data, 0),))
    board = strict_board(moved, 0)
    assert run_board(board, 0.01, LIMIT_S) == ""
    assert board.started_at == 0x4000
    assert board.findings() == ()


def test_an_image_that_does_not_fit_is_refused(tmp_path) -> None:
    file = tmp_path / "large.bin"
    file.write_bytes(bytes(600 << 10))
    with pytest.raises(InputError, match="no memory"):
        load_image(file)


def test_junk_ends_in_a_finding(tmp_path) -> None:
    file = tmp_path / "junk.bin"
    file.write_bytes(np.random.default_rng(1).bytes(4096))
    report = check_image(file, CheckOptions(seconds=0.05, broken_parts=False))
    assert {"vector_table", "processor_fault"} <= {finding.rule for finding in report.findings}
    assert report.faults


def test_a_report_holds_what_ran() -> None:
    report = check_image("gfimu", CheckOptions(seconds=0.1, broken_parts=False))
    assert report.findings == ()
    assert report.ended == ""
    assert report.virtual_s == pytest.approx(0.1, abs=1e-4)
    assert report.sent[0] > 300
    assert 100 < report.stack_bytes < report.stack_room


def test_the_time_limit_ends_a_run() -> None:
    report = check_image("gfimu", CheckOptions(seconds=100.0, limit_s=0.2, broken_parts=False))
    assert "longer than 0.2 s" in report.ended
    assert report.virtual_s < 100.0


@pytest.mark.parametrize("options", [{"seconds": 0.0}, {"chips": 5}, {"baud": 0}, {"seconds": float("nan")}])
def test_options_are_checked(options) -> None:
    with pytest.raises(InputError):
        CheckOptions(**options)


def test_every_rule_is_in_the_documentation_with_its_source() -> None:
    text = DOCS.read_text(encoding="utf-8")
    parts = [part for part in vars(rules).values() if isinstance(part, ModuleType)]
    every = {rule for part in parts for rule in vars(part).values() if isinstance(rule, Rule)}
    missing = [rule.name for rule in every if f"| `{rule.name}` | {rule.severity.value} |" not in text]
    assert missing == []
    assert len({rule.name for rule in every}) == len(every) == 63
