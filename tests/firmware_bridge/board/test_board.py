"""The emulated board: determinism, interrupts, peripherals, faults, and the fast path against the reference."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("unicorn", reason="the emulator is in the extra 'firmware'")

from firmware_bridge import (
    TICKS_PER_SECOND,
    BoardFault,
    Command,
    FaultKind,
    LineFault,
    SampleDecoder,
    Samples,
    Status,
    encode_command,
    set_range,
    set_rate,
)

KINDS = ("python", "fast")
IMAGES = Path(__file__).parents[1] / "images"


def run_slices(board, seconds: float, slices: int, seed: int = 0) -> bytes:
    start = board.now
    end = start + round(seconds * TICKS_PER_SECOND)
    stream = b""
    for cut in [*np.sort(np.random.default_rng(seed).integers(start, end, slices)).tolist(), end]:
        board.run_until(cut)
        stream += board.uarts[0].take_sent()[0]
    return stream


def decode(stream: bytes) -> tuple[Samples, SampleDecoder]:
    decoder = SampleDecoder()
    return decoder.feed(stream), decoder


@pytest.mark.parametrize("kind", KINDS)
def test_streams_do_not_depend_on_the_slices(make_board, kind: str) -> None:
    streams = {run_slices(make_board(kind, rate=800), 0.15, slices) for slices in (0, 3, 1500)}
    assert len(streams) == 1
    samples, decoder = decode(streams.pop())
    assert len(samples) > 90
    assert decoder.counts.corrupt == decoder.counts.lost == 0


@pytest.mark.parametrize("rate", [100, 800, 3200])
def test_fast_path_is_bit_identical(make_board, rate: int) -> None:
    boards = [make_board(kind, rate=rate) for kind in KINDS]
    streams = []
    for board in boards:
        stream = run_slices(board, 0.06, 2)
        board.set_line_fault(1, LineFault.STUCK_HIGH)
        board.uarts[0].receive(set_range(4, full_resolution=False) + encode_command(Command.SELF_TEST, 1))
        stream += run_slices(board, 0.05, 1)
        board.set_line_fault(1, LineFault.NONE)
        board.uarts[0].receive(b"\xc3\x3cgarbage" + encode_command(Command.SET_BAUD, 3_125_000), errors=0)
        stream += run_slices(board, 0.05, 1)
        board.brown_out()
        streams.append(stream + run_slices(board, 0.04, 1))
    assert streams[0] == streams[1]
    assert (boards[0].now, boards[0].accesses, boards[0].exceptions) == (
        boards[1].now, boards[1].accesses, boards[1].exceptions,
    )  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_selfcheck_proves_interrupt_handling(make_board, kind: str) -> None:
    board = make_board(kind, "selfcheck")
    board.run_for(20.0)
    count = {n: board.word(f"selfcheck_{n}") for n in ("good", "bad", "timer0", "systick", "nested", "wrong_ipsr")}
    assert count["timer0"] + count["systick"] >= 10_000
    assert count["nested"] > 50
    assert count["good"] > 10_000
    assert count["bad"] == count["wrong_ipsr"] == 0


def test_samples_are_what_the_chips_converted(make_board) -> None:
    board = make_board("python", rate=100)
    samples, _ = decode(run_slices(board, 1.0, 0))
    t = samples.ticks * 1e-6
    for chip in range(4):
        # Each chip's newest sample is at most one period of its own clock old: the signal moves less than its slope.
        truth = np.sin(31.4 * t + chip)
        assert np.abs(samples.counts[2:, 3 * chip] / 256 - truth[2:]).max() < 31.4 * 0.0101 + 1 / 256
    assert np.all(samples.counts[2:, 4] == round(0.1 * 256))
    assert set(np.diff(samples.ticks).tolist()) == {10_000}


@pytest.mark.parametrize("kind", KINDS)
def test_an_image_that_is_not_ours(make_board, compile_image, kind: str) -> None:
    board = make_board(kind, compile_image(IMAGES / "peripherals.c"))
    board.run_for(0.02)
    assert board.word("done") == 1
    board.uarts[1].receive(b"hello")
    board.run_for(0.01)
    assert board.word("done") == 2
    board.gpio.drive(2, 10, False)
    board.run_for(0.001)
    board.gpio.drive(2, 10, True)
    board.run_for(0.01)
    found = {name: board.word(name) for name in board.image.symbols if name.islower() and name != "main"}
    expected = {
        "done": 3, "pll_hz_ok": 1, "cycles_per_us": 96, "timer2_matches": 5, "icsr_active": 16 + 3,
        "capture_stop": 2399, "basepri_held": 2, "uart1_received": 5, "uart1_line": 0, "ssp0_echo": 0xA7,
        "i2c_devid": 0xE5, "i2c_missing": 0xFFFF, "gpio_rising": 1 << 10, "gpio_falling": 1 << 10, "bitband_pin": 1,
        "bitband_ram": 1 << 7, "ahb_word": 1, "level_count": 3, "svc_number": 42, "psp_used": 0x600D,
        "pendsv_order": 12, "dma_done": 2, "dma_sum": 8 * 0x1000 + 28,
    }  # fmt: skip
    assert {name: found[name] for name in expected} == expected
    assert board.cpu.peek(board.image.symbols["uart1_text"], 5) == b"hello"
    assert board.uarts[1].take_sent()[0] == b"world"


FAULTY = {
    "read": ("*(volatile unsigned *)0x90000000;", FaultKind.READ_UNMAPPED),
    "write": ("*(volatile unsigned *)0x90000000 = 1;", FaultKind.WRITE_UNMAPPED),
    "flash": ("*(volatile unsigned *)0x00001000 = 1;", FaultKind.WRITE_PROTECTED),
    "jump": ("((void (*)(void))0x90000001)();", FaultKind.FETCH_UNMAPPED),
    "undefined": ('__asm volatile(".short 0xDE00");', FaultKind.UNDEFINED),
    "dsp": ('__asm volatile(".short 0xfa80, 0xf040");', FaultKind.UNDEFINED),  # uadd8: a Cortex-M4 instruction
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", FAULTY)
def test_faults_are_typed_errors_with_place_registers_and_symbol(
    make_board, compile_image, tmp_path: Path, kind: str, name: str
) -> None:
    statement, expected = FAULTY[name]
    source = tmp_path / "faulty.c"
    source.write_text(
        "__attribute__((noinline)) void culprit(void) { " + statement + " }\n"
        "void Reset_Handler(void) { culprit(); for (;;) {} }\n"
        '__attribute__((section(".isr_vector"), used)) static void *const vectors[] = {(void *)0x10008000, '
        "(void *)Reset_Handler};\n"
    )
    board = make_board(kind, compile_image(source))
    with pytest.raises(BoardFault) as caught:
        board.run_for(0.01)
    fault = caught.value
    assert fault.kind is expected
    if name != "jump":
        assert fault.symbol.split("+")[0] in {"culprit", "Reset_Handler"}
        assert fault.registers["pc"] == fault.pc
    assert "xpsr" in fault.registers
    assert str(pickle.loads(pickle.dumps(fault))) == str(fault)


def test_stack_overflow_is_a_fault(make_board, compile_image, tmp_path: Path) -> None:
    source = tmp_path / "deep.c"
    source.write_text(
        "volatile int depth; __attribute__((noinline)) int fall(int n) { volatile int x[8]; x[0] = n; depth++;"
        " return fall(n + 1) + x[0]; }\n"
        "void Reset_Handler(void) { fall(0); for (;;) {} }\n"
        '__attribute__((section(".isr_vector"), used)) static void *const vectors[] = {(void *)0x10008000, '
        "(void *)Reset_Handler};\n"
    )
    with pytest.raises(BoardFault) as caught:
        make_board("python", compile_image(source)).run_for(1.0)
    assert caught.value.kind is FaultKind.WRITE_UNMAPPED


@pytest.mark.parametrize("kind", KINDS)
def test_watchdog_resets_a_board_that_hangs(make_board, compile_image, tmp_path: Path, kind: str) -> None:
    source = tmp_path / "hang.c"
    source.write_text(
        "#define R(a) (*(volatile unsigned *)(a))\n"
        "void Reset_Handler(void) { R(0x10000000) = R(0x400FC180); R(0x10000004) = R(0x10000004) + 1;\n"
        " R(0x40000004) = 100000; R(0x40000000) = 3; R(0x40000008) = 0xAA; R(0x40000008) = 0x55; for (;;) {} }\n"
        '__attribute__((section(".isr_vector"), used)) static void *const vectors[] = {(void *)0x10008000, '
        "(void *)Reset_Handler};\n"
    )
    board = make_board(kind, compile_image(source))
    board.run_for(0.35)
    assert int.from_bytes(board.cpu.peek(0x10000004, 4), "little") == 4
    assert int.from_bytes(board.cpu.peek(0x10000000, 4), "little") == 1 | 4  # power-on and watchdog
    assert board.resets == 3


def test_a_missing_sensor_is_reported_and_comes_back(make_board) -> None:
    board = make_board("python", rate=800)
    run_slices(board, 0.05, 0)
    board.set_line_fault(2, LineFault.SILENT)
    during, _ = decode(run_slices(board, 0.05, 0))
    board.set_line_fault(2, LineFault.NONE)
    after, _ = decode(run_slices(board, 0.1, 0))
    assert Status(int(during.status[-1])).missing_sensors == (3,)
    assert np.all(during.counts[-1, 6:9] == -32768)
    assert np.all(during.counts[-1, :6] != -32768)
    assert not Status(int(after.status[-1])).missing_sensors


def test_the_line_too_slow_drops_no_bytes_inside_frames(make_board) -> None:
    board = make_board("python", rate=800)
    board.uarts[0].receive(encode_command(Command.SET_BAUD, 115_200))
    replies, decoder = decode(run_slices(board, 0.05, 0))
    assert len(replies)
    assert decoder.messages[-1]["counts"].tobytes()[:2] == bytes((Command.SET_BAUD, 4))  # line too slow
    board.uarts[0].receive(set_rate(100) + encode_command(Command.SET_BAUD, 115_200))
    run_slices(board, 0.2, 0)
    assert board.uarts[0].baud == pytest.approx(115_200, rel=0.01)
    samples, decoder = decode(run_slices(board, 0.2, 0))
    assert decoder.counts.corrupt == 0
    assert len(samples) >= 19


def test_a_board_runs_in_a_plain_script(tmp_path) -> None:
    """Without the guard that multiprocessing asks for."""
    script = tmp_path / "plain.py"
    script.write_text(
        "from firmware_bridge.loop.board_process import BoardProcess\n"
        "with BoardProcess() as board:\n"
        "    board.run_for(0.1)\n"
        "    print(len(board.take_sent()[0]) > 100)\n",
        encoding="utf-8",
    )
    run = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=60, check=False)
    assert (run.stdout, run.stderr) == ("True\n", "")


@pytest.mark.parametrize("address", [0x40038000, 0x4003C000, 0x40040000, 0x40044000, 0x40048000])
def test_what_is_not_emulated_stores_what_is_written(make_board, address) -> None:
    """CAN: memory and registers of the filter, common registers, both controllers (UM10360 16.6)."""
    board = make_board()
    board.write_bus(address, 0x12345678)
    assert board.read_bus(address) == 0x12345678
