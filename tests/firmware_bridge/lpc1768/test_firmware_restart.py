"""What the firmware finds at a start: a connected PLL0, chips that kept their registers, the code-protection word."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

pytest.importorskip("unicorn", reason="the emulator is in the extra 'firmware'")

from firmware_bridge import (
    FIRST_IRQ,
    TICKS_PER_SECOND,
    BoardProcess,
    Command,
    ElfImage,
    Identity,
    SampleDecoder,
    Ssp,
    Status,
    encode_command,
    parse_message,
    record_virtual,
)
from firmware_bridge.lpc1768 import build as firmware
from sim.ride import Ride

KINDS = ("python", "fast")
PLL0CON, PLL0CFG, PLL0FEED = 0x400FC080, 0x400FC084, 0x400FC08C
CCLKCFG, CLKSRCSEL, PCLKSEL0 = 0x400FC104, 0x400FC10C, 0x400FC1A8
OFSX, TAP_AXES = 0x1E, 0x2A
BW_RATE, POWER_CTL, INT_ENABLE, INT_MAP, DATA_FORMAT, FIFO_CTL = 0x2C, 0x2D, 0x2E, 0x2F, 0x31, 0x38
CONFIGURED = {DATA_FORMAT: 0x0B, BW_RATE: 0x0A, POWER_CTL: 0x08, FIFO_CTL: 0x82}
LEFT_BEHIND = {
    "offsets": {OFSX: 0x7F, OFSX + 1: 0x80, OFSX + 2: 33},
    "3-wire": {DATA_FORMAT: 0x40},
    "justified, self-test, 2 g": {DATA_FORMAT: 0x84},
    "interrupts": {INT_ENABLE: 0xFF, INT_MAP: 0xF0},
    "tap, activity, free fall": dict.fromkeys([0x1D, *range(0x21, TAP_AXES + 1)], 0x55),
    "stream FIFO": {FIFO_CTL: 0x9F},
    "low power, sleep": {BW_RATE: 0x17, POWER_CTL: 0x3F},
}


def connect_pll0(board) -> None:
    """Do what a boot loader does: PLL0 at 100 MHz, connected."""
    for address, value in (
        (CLKSRCSEL, 1), (PLL0CFG, 5 << 16 | 99), (PLL0CON, 1), (PLL0FEED, 0xAA), (PLL0FEED, 0x55),
        (CCLKCFG, 3), (PLL0CON, 3), (PLL0FEED, 0xAA), (PLL0FEED, 0x55),
    ):  # fmt: skip
        board.write_bus(address, value)


def collect(board, seconds: float):
    decoder = SampleDecoder()
    board.run_for(seconds)
    return decoder.feed(board.uarts[0].take_sent()[0]), decoder


@pytest.mark.parametrize("kind", KINDS)
def test_peripheral_clocks_keep_their_value_while_pll0_is_connected(make_board, kind: str) -> None:
    board = make_board(kind)
    board.write_bus(PCLKSEL0, 1 << 2)
    assert board.system_control.peripheral_divider(2) == 1
    connect_pll0(board)
    board.write_bus(PCLKSEL0, 1 << 2)
    assert not board.warnings  # nothing would change
    for _ in range(2):
        board.write_bus(PCLKSEL0, 0)
    assert board.system_control.peripheral_divider(2) == 1
    assert board.read_bus(PCLKSEL0) == 1 << 2
    (warning,) = board.warnings
    assert "PCLKSEL0" in warning
    assert "while PLL0 is connected" in warning


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("boot_loader", [False, True])
def test_the_clocks_are_right_whatever_ran_before(make_board, kind: str, boot_loader: bool) -> None:
    board = make_board(kind)
    if boot_loader:
        connect_pll0(board)
    samples, decoder = collect(board, 1.0)
    assert board.uarts[0].baud == pytest.approx(115_200, rel=0.01)
    assert len(samples) in {97, 98, 99}  # the chips need 11.1 ms, the clock one or two samples to find their pace
    assert set(np.diff(samples.ticks).tolist()) == {10_000}
    assert decoder.counts.corrupt == 0
    assert not board.warnings


def test_firmware_that_selects_the_clocks_too_late_is_four_times_too_slow(make_board, tmp_path, monkeypatch) -> None:
    pytest.importorskip("ziglang", reason="the C compiler is in the extra 'firmware'")
    sources = tmp_path / "src"
    shutil.copytree(firmware.SOURCES, sources)
    text = (sources / "board.c").read_text(encoding="utf-8")
    start = text.index("    PCLKSEL0 = ")
    line = text[start : text.index("\n", start) + 1]
    text = text.replace(line, "")
    after = text.index("    PCONP |= ")
    (sources / "board.c").write_text(text[:after] + line + text[after:], encoding="utf-8")
    monkeypatch.setattr(firmware, "SOURCES", sources)
    image = ElfImage.load(firmware.build("gfimu", tmp_path / "image").elf)
    for kind in KINDS:
        board = make_board(kind, image)
        board.run_for(1.0)
        assert board.uarts[0].baud == pytest.approx(115_200 / 4, rel=0.01)
        assert len(board.uarts[0].take_sent()[0]) // 40 in {24, 25}
        assert len(board.warnings) == 1
    run = record_virtual(Ride("rest"), 0.5, image=tmp_path / "image" / "gfimu.elf")
    assert "PCLKSEL0" in run.warnings[0]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", LEFT_BEHIND)
def test_chips_that_kept_their_registers_are_set_up_anew(make_board, kind: str, name: str) -> None:
    untouched, _ = collect(make_board(kind), 0.25)
    board = make_board(kind)
    for sensor in range(4):
        for address, value in LEFT_BEHIND[name].items():
            board.write_chip(sensor, address, value)
    samples, decoder = collect(board, 0.25)
    for sensor in range(4):
        for address in [*range(0x1D, TAP_AXES + 1), *range(BW_RATE, INT_MAP + 1), DATA_FORMAT, FIFO_CTL]:
            assert board.read_chip(sensor, address) == CONFIGURED.get(address, 0)
    rows = min(len(samples), len(untouched))
    assert rows > 20
    # The chips' phases differ by when they began to measure: the second and third axis move slowly or not at all.
    assert np.abs(samples.counts[:rows, 1::3].astype(int) - untouched.counts[:rows, 1::3]).max() <= 1
    assert not samples.status[1:].any()
    assert decoder.counts.corrupt == decoder.counts.lost == 0


@pytest.mark.parametrize("kind", KINDS)
def test_a_reset_of_the_processor_leaves_the_chips_as_they_are(make_board, kind: str) -> None:
    board = make_board(kind)
    board.run_for(0.1)
    board.write_chip(0, OFSX, 0x7F)
    board.write_chip(1, DATA_FORMAT, 0x40)
    board.write_chip(2, INT_ENABLE, 0xFF)
    board.uarts[0].take_sent()
    board.press_reset()
    board.run_for(0.0)
    assert board.read_chip(0, OFSX) == 0x7F
    samples, decoder = collect(board, 0.25)
    assert board.resets == 1
    assert [board.read_chip(*place) for place in ((0, OFSX), (1, DATA_FORMAT), (2, INT_ENABLE))] == [0, 0x0B, 0]
    assert len(samples) > 20
    assert not (samples.counts == -32768).any()
    assert np.all(samples.counts[:, 4] == round(0.1 * 256))
    identity = parse_message(decoder.messages[0])
    assert isinstance(identity, Identity)
    assert identity.present == (True,) * 4
    assert identity.reset_cause == "external"


@pytest.mark.parametrize("kind", KINDS)
def test_without_its_crystal_the_board_runs_on_the_internal_oscillator_and_says_so(make_board, kind: str) -> None:
    board = make_board(kind)
    board.system_control.crystal = False
    samples, decoder = collect(board, 0.5)
    assert board.resets == 0
    assert board.uarts[0].baud == pytest.approx(115_200, rel=0.01)
    assert len(samples) > 30
    identity = parse_message(decoder.messages[0])
    assert isinstance(identity, Identity)
    assert identity.reset_cause == "power-on, no crystal"


@pytest.mark.parametrize("kind", KINDS)
def test_a_pll_that_does_not_lock_ends_in_another_try(make_board, kind: str) -> None:
    board = make_board(kind)
    board.system_control.pll_locks = False
    board.run_for(2.0)
    assert board.resets == 0
    board.run_for(0.5)
    assert board.resets == 1  # by the watchdog, which runs before any clock is waited for
    board.system_control.pll_locks = True
    board.run_for(2.0)
    samples, decoder = collect(board, 0.5)
    assert len(samples) > 40
    identity = parse_message(decoder.messages[0])
    assert isinstance(identity, Identity)
    assert "watchdog" in identity.reset_cause


def test_an_spi_that_never_gets_done_is_given_up(make_board, monkeypatch) -> None:
    read = Ssp.read
    stuck = [False]

    def busy(ssp: Ssp, offset: int, size: int) -> int:
        return read(ssp, offset, size) | (0x10 if stuck[0] and offset == 0x0C else 0)

    monkeypatch.setattr(Ssp, "read", busy)
    board = make_board("python")
    stuck[0] = True
    samples, _ = collect(board, 0.3)
    assert len(samples) > 20
    assert Status(int(samples.status[-1])).missing_sensors == (1, 2, 3, 4)
    assert board.resets == 0
    stuck[0] = False
    samples, _ = collect(board, 0.3)
    assert samples.status[-1] == 0
    assert (samples.counts[-1] != -32768).all()


def test_the_process_hands_all_of_it_on() -> None:
    with BoardProcess() as board:
        board.run_for(0.05)
        board.write_chip(3, OFSX, 9)
        assert board.read_chip(3, OFSX) == 9
        board.press_reset()
        board.receive(encode_command(Command.IDENTIFY))
        board.run_for(0.05)
        assert board.read_chip(3, OFSX) == 0
        assert board.counters()["resets"] == 1
        assert board.warnings() == []


def test_a_chip_that_does_not_hold_its_registers_is_reported(make_board) -> None:
    board = make_board("python")
    board.run_for(0.1)
    chip = board.sensors[2]
    write = chip._write

    def stuck(address: int, value: int, now: int) -> None:
        write(address, 0x10 if address == OFSX else value, now)

    chip._write = stuck
    board.uarts[0].take_sent()
    board.press_reset()
    samples, decoder = collect(board, 0.3)
    assert np.all(samples.counts[:, 6:9] == -32768)
    assert np.all(samples.status & Status.CHIP_FAULT)
    assert Status(int(samples.status[-1])).missing_sensors == (3,)
    identity = parse_message(decoder.messages[0])
    assert isinstance(identity, Identity)
    assert identity.present == (True, True, False, True)
    assert identity.faulty == (False, False, True, False)
    del chip._write
    after, _ = collect(board, 0.2)
    assert after.status[-1] == 0
    assert not (after.counts[-1] == -32768).any()


def test_faulty_chips_do_not_delay_the_samples_of_the_others(make_board) -> None:
    board = make_board("python", rate=3200)
    for number, chip in enumerate(board.sensors[1:]):
        write = chip._write
        chip._write = lambda address, value, now, write=write: write(address, 1 if address == OFSX else value, now)
        board.write_chip(number + 1, DATA_FORMAT, 0)  # so that the firmware sets it up again
    collect(board, 0.1)
    samples, decoder = collect(board, 0.2)
    assert Status(int(samples.status[-1])).missing_sensors == (2, 3, 4)
    assert np.all(samples.status & Status.CHIP_FAULT)
    assert set(np.diff(samples.ticks).tolist()) <= {312, 313}
    assert decoder.counts.lost == 0


def test_a_chip_is_let_go_for_150_ns_between_two_accesses(make_board) -> None:
    board = make_board("python")
    pins_changed, since, rests = board.gpio.on_change, {}, []

    def watch(port: int, changed: int, levels: int) -> None:
        for bit in range(4):
            if port == 2 and changed >> bit & 1:
                if levels >> bit & 1:
                    since[bit] = board.now
                elif bit in since:
                    rests.append((board.now - since[bit]) / TICKS_PER_SECOND)
        pins_changed(port, changed, levels)

    board.gpio.on_change = watch
    board.run_for(0.05)
    assert len(rests) > 60
    assert min(rests) >= 150e-9  # ADXL345 data sheet, table 10


def test_the_watchdog_still_resets_a_board_that_should_sample_and_does_not(make_board) -> None:
    board = make_board("python")
    board.run_for(0.5)
    board.lose_interrupts(FIRST_IRQ + 1, 1)  # TIMER0, every one: the main loop wakes all the same
    board.run_for(1.9)
    assert board.resets == 0
    board.run_for(0.5)
    assert board.resets == 1
