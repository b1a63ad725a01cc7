"""The register-level ADXL345 against its data sheet (Rev. E), line by line."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_bridge import RAW_PER_COUNT, TICKS_PER_SECOND, Adxl345, Adxl345Options, format_count
from sim import quantise

US = TICKS_PER_SECOND // 1_000_000
MS = 1000 * US
DATA_READY, ACTIVITY, WATERMARK, OVERRUN = 0x80, 0x10, 0x02, 0x01


class Bench:
    """A chip on a bench: SPI at 5 MHz, conversions that count up (x), stand still (y) and count down (z)."""

    def __init__(self, **options) -> None:
        self.now = 0
        self.origin = None
        self.requests = []
        self.chip = Adxl345(self.convert, Adxl345Options(**options))

    def convert(self, first, period, count, bw_rate):
        self.requests.append((first, period, bw_rate))
        if self.origin is None:
            self.origin = self.chip.next_conversion
        numbers = (first - self.origin) // period + np.arange(count)
        return np.column_stack([numbers, np.full(count, 7), -numbers]) * RAW_PER_COUNT

    def spi(self, *values: int, gap: int = 10 * US) -> list[int]:
        self.chip.select(self.now)
        answers = []
        for value in values:
            answers.append(self.chip.transfer(value, self.now))
            self.now += 8 * TICKS_PER_SECOND // 5_000_000
        self.chip.deselect(self.now)
        self.now += gap
        return answers

    def write(self, address: int, value: int) -> None:
        self.spi(address, value)

    def read(self, address: int) -> int:
        return self.spi(0x80 | address, 0)[1]

    def xyz(self, gap: int = 10 * US) -> list[int]:
        data = bytes(self.spi(0x80 | 0x40 | 0x32, *[0] * 6, gap=gap)[1:])
        return np.frombuffer(data, "<i2").tolist()

    def measure(self, *, rate: int = 0x0A, data_format: int = 0x0B, fifo: int = 0) -> None:
        self.write(0x31, data_format)
        self.write(0x2C, rate)
        self.write(0x38, fifo)
        self.write(0x2D, 0x08)

    def sense_activity(self) -> None:
        """Let x raise an activity event beyond 187.5 mg, 48 counts, which it reaches within half a second."""
        self.write(0x24, 3)
        self.write(0x27, 0x40)

    def wait(self, milliseconds: float) -> None:
        self.now += round(milliseconds * MS)


def test_reset_values() -> None:
    bench = Bench()
    expected = {0x00: 0xE5, 0x2C: 0x0A, 0x30: 0x02}  # table 19
    for address in [0x00, *range(0x1D, 0x3A)]:
        assert bench.read(address) == expected.get(address, 0), hex(address)


@pytest.mark.parametrize("address", [*range(0x1D, 0x2B), 0x2C, 0x2D, 0x2E, 0x2F, 0x31, 0x38])
def test_writable_registers_keep_what_is_written(address: int) -> None:
    bench = Bench()
    bench.write(address, 0x15)
    assert bench.read(address) == 0x15


@pytest.mark.parametrize("address", [0x00, 0x01, 0x1C, 0x2B, 0x30, 0x32, 0x37, 0x39])
def test_read_only_and_reserved_registers_ignore_writes(address: int) -> None:
    bench = Bench()
    before = bench.read(address)
    bench.write(address, 0x5A)
    assert bench.read(address) == before


def test_multiple_byte_write_and_read_count_up() -> None:
    bench = Bench()
    bench.spi(0x40 | 0x1E, 1, 2, 3)
    assert bench.spi(0x80 | 0x40 | 0x1E, 0, 0, 0)[1:] == [1, 2, 3]
    assert bench.spi(0x80 | 0x1E, 0, 0)[1:] == [1, 1]  # without the multiple-byte bit the address stays


def test_standby_at_power_up_then_turn_on_time() -> None:
    bench = Bench()
    bench.wait(500)
    assert not bench.read(0x30) & DATA_READY
    bench.measure(rate=0x0A)
    bench.wait(11.0)  # τ + 1.1 ms = 11.1 ms at 100 Hz
    assert not bench.read(0x30) & DATA_READY
    bench.wait(0.2)
    assert bench.read(0x30) & DATA_READY


@pytest.mark.parametrize("code", range(16))
def test_output_data_rate_by_the_chips_own_clock(code: int) -> None:
    bench = Bench(clock_error=0.01)
    bench.measure(rate=code)
    bench.wait(25_000)
    bench.read(0x30)
    period = bench.requests[0][1] / TICKS_PER_SECOND
    assert period * 1.01 == pytest.approx(1.0 / (0.09765625 * 2**code), abs=2.0 / TICKS_PER_SECOND)


def test_phase_moves_the_first_conversion() -> None:
    early, late = Bench(phase=0.5), Bench()
    for bench in (early, late):
        bench.measure()
        bench.wait(12)
        bench.read(0x30)
    assert late.requests[0][0] - early.requests[0][0] == pytest.approx(5 * MS)


def test_data_ready_clears_by_reading_data_and_overrun_tells_replaced_data() -> None:
    bench = Bench()
    bench.measure()
    bench.wait(12)
    assert bench.read(0x30) & (DATA_READY | OVERRUN) == DATA_READY
    assert bench.read(0x30) & DATA_READY  # reading INT_SOURCE does not clear it
    bench.xyz()
    assert not bench.read(0x30) & DATA_READY
    bench.wait(21)
    assert bench.read(0x30) & (DATA_READY | OVERRUN) == DATA_READY | OVERRUN
    bench.xyz()
    assert not bench.read(0x30) & OVERRUN


def test_a_burst_read_sees_one_sample_even_when_a_new_one_comes_in_between() -> None:
    bench = Bench()
    bench.measure(rate=0x0D)
    bench.wait(5)
    for _ in range(200):
        x, _, z = bench.xyz(gap=37 * US)
        assert x == -z


def test_data_are_formatted_when_read() -> None:
    bench = Bench()
    bench.chip.source = lambda first, period, count, bw: np.full((count, 3), 1000 * RAW_PER_COUNT)
    bench.measure(data_format=0x0B)
    bench.wait(12)
    assert bench.xyz()[0] == 1000
    bench.write(0x31, 0x03)  # 10 bits over ±16 g
    assert bench.xyz()[0] == 125
    bench.write(0x31, 0x00)  # ±2 g: clipped
    assert bench.xyz()[0] == 511
    bench.write(0x31, 0x04)  # left-justified
    assert bench.xyz()[0] == 511 << 6
    bench.write(0x31, 0x0F)
    assert bench.xyz()[0] == 1000 << 3


@given(st.integers(-(1 << 21), 1 << 21), st.integers(0, 15), st.integers(0, 15))
def test_formatting_is_the_quantisation_of_the_sensing_model(raw: int, data_format: int, code: int) -> None:
    data_format &= 0x0B
    full, rng = bool(data_format & 8), data_format & 3
    bits = 10 + rng if full else 10
    step = 1.0 if full else 2.0**rng
    zero = code >= 14 and (full or rng == 0)
    value = np.array([raw / RAW_PER_COUNT / step])
    expected = int(quantise(value, -(1 << (bits - 1)), (1 << (bits - 1)) - 1, zero)[0])
    word = format_count(raw, data_format, code)
    assert (word - 65536 if word > 32767 else word) == expected


def test_lsb_is_zero_at_1600_and_3200_hz() -> None:
    for code in (0x0E, 0x0F):
        assert format_count(1001 * RAW_PER_COUNT, 0x0B, code) == 1000
        assert format_count(301 * RAW_PER_COUNT, 0x00, code) == 300
        assert format_count(8 * 301 * RAW_PER_COUNT, 0x03, code) == 301  # 10 bits over ±16 g: not affected


def test_offset_registers_are_15_6_mg_in_every_range() -> None:
    for data_format, counts in ((0x0B, 4), (0x00, 4), (0x03, 0.5)):
        bench = Bench()
        bench.chip.source = lambda first, period, count, bw: np.zeros((count, 3), dtype=int)
        bench.write(0x1E, 10)
        bench.write(0x1F, 0x100 - 10)
        bench.measure(data_format=data_format)
        bench.wait(12)
        assert bench.xyz()[:2] == [10 * counts, -10 * counts]


def test_self_test_shifts_within_the_data_sheets_limits() -> None:
    bench = Bench()
    bench.chip.source = lambda first, period, count, bw: np.zeros((count, 3), dtype=int)
    bench.measure(data_format=0x8B)
    bench.wait(12)
    x, y, z = (counts / 256 for counts in bench.xyz())
    assert 0.2 <= x <= 2.1
    assert -2.1 <= y <= -0.2
    assert 0.3 <= z <= 3.4


def test_fifo_mode_stops_when_full_and_keeps_the_oldest() -> None:
    bench = Bench()
    bench.measure(fifo=0x40 | 16)
    bench.wait(100)
    assert bench.read(0x39) == 9
    assert not bench.read(0x30) & WATERMARK
    bench.wait(900)
    assert bench.read(0x39) == 32
    assert bench.read(0x30) & (WATERMARK | OVERRUN) == WATERMARK | OVERRUN
    assert [bench.xyz()[0] for _ in range(33)] == list(range(33))  # 32 in the FIFO and one at the output filter
    assert not bench.read(0x30) & (DATA_READY | WATERMARK)


def test_stream_mode_keeps_the_newest() -> None:
    bench = Bench()
    bench.measure(fifo=0x80)
    bench.wait(1000)
    assert [bench.xyz()[0] for _ in range(33)] == list(range(66, 99))


def test_trigger_mode_keeps_samples_before_the_trigger_and_fills_up_after_it() -> None:
    bench = Bench()
    bench.write(0x2E, ACTIVITY)  # on INT1
    bench.sense_activity()
    bench.measure(fifo=0xC0 | 5)
    bench.wait(500)
    assert bench.chip.interrupt_pin(1, bench.now)
    bench.wait(1000)
    assert bench.read(0x39) == 0x80 | 32
    numbers = [bench.xyz()[0] for _ in range(33)]
    assert np.diff(numbers).tolist() == [1] * 32
    assert numbers[5] - numbers[0] == 5
    bench.write(0x38, 0)  # bypass clears, and re-arms
    assert bench.read(0x39) == 0


def test_entering_bypass_clears_the_fifo() -> None:
    bench = Bench()
    bench.measure(fifo=0x80)
    bench.wait(200)
    bench.write(0x38, 0x00)
    bench.write(0x38, 0x80)
    assert bench.read(0x39) == 0


def test_next_fifo_read_needs_5_us() -> None:
    slow, fast = Bench(), Bench()
    for bench in (slow, fast):
        bench.measure(fifo=0x80)
        bench.wait(200)
    assert [slow.xyz(gap=5 * US)[0] for _ in range(4)] == [0, 1, 2, 3]
    assert [fast.xyz(gap=1 * US)[0] for _ in range(4)] != [0, 1, 2, 3]


def test_watermark_zero_is_set_at_once_and_a_status_read_within_5_us_shows_the_old_count() -> None:
    bench = Bench()
    assert bench.read(0x30) & WATERMARK
    bench.measure(fifo=0x80)
    bench.wait(200)
    before = bench.read(0x39)
    bench.xyz(gap=0)
    assert bench.read(0x39) == before
    bench.now += 5 * US
    assert bench.read(0x39) == before - 1


def test_a_single_byte_read_loses_the_rest_of_the_sample() -> None:
    bench = Bench()
    bench.measure(fifo=0x80)
    bench.wait(200)
    assert bench.read(0x32) == 0
    assert bench.xyz()[0] == 1


def test_reading_past_0x37_pops_before_cs_goes_high() -> None:
    bench = Bench()
    bench.measure(fifo=0x80)
    bench.wait(200)
    before = bench.read(0x39)
    bench.spi(0xC0 | 0x32, *[0] * 7)
    assert bench.read(0x39) == before - 1


def test_event_interrupts_clear_by_reading_int_source_and_follow_map_and_invert() -> None:
    bench = Bench()
    bench.sense_activity()
    bench.measure()
    bench.wait(500)
    assert not bench.read(0x30) & ACTIVITY  # not enabled: not raised
    bench.write(0x2E, ACTIVITY)
    bench.write(0x2F, ACTIVITY)  # to INT2
    bench.wait(20)
    assert not bench.chip.interrupt_pin(1, bench.now)
    assert bench.chip.interrupt_pin(2, bench.now)
    bench.write(0x31, 0x20)  # active low
    assert not bench.chip.interrupt_pin(2, bench.now)
    assert bench.read(0x30) & ACTIVITY
    assert not bench.read(0x30) & ACTIVITY


def test_sleep_samples_at_the_wake_up_rate() -> None:
    bench = Bench()
    bench.measure()
    bench.write(0x2D, 0x08 | 0x04 | 0x02)  # 2 Hz
    bench.wait(3000)
    bench.read(0x30)
    assert bench.requests[-1][1] == TICKS_PER_SECOND // 2


@pytest.mark.parametrize(("wires", "bit", "answers"), [(4, 0, True), (4, 0x40, False), (3, 0x40, True), (3, 0, False)])
def test_three_wire_mode_must_fit_the_wiring(wires: int, bit: int, answers: bool) -> None:
    bench = Bench(wires=wires)
    bench.write(0x31, bit)
    assert (bench.read(0x00) == 0xE5) is answers


@pytest.mark.parametrize(("alternate", "address"), [(False, 0x53), (True, 0x1D)])
def test_i2c_transactions(alternate: bool, address: int) -> None:
    chip = Bench(alternate_address=alternate).chip
    assert not chip.i2c_start(0x2A << 1, 0)
    assert chip.i2c_start(address << 1, 0)
    assert chip.i2c_write(0x1E, 0)
    for value in (1, 2, 3):
        assert chip.i2c_write(value, 0)
    chip.i2c_stop(0)
    chip.i2c_start(address << 1, 0)
    chip.i2c_write(0x1E, 0)
    chip.i2c_start(address << 1 | 1, 0)
    assert [chip.i2c_read(0) for _ in range(3)] == [1, 2, 3]
    chip.i2c_stop(0)


def test_i2c_burst_pops_one_fifo_entry() -> None:
    bench = Bench()
    bench.measure(fifo=0x80)
    bench.wait(200)
    chip, now = bench.chip, bench.now
    chip.i2c_start(0x53 << 1, now)
    chip.i2c_write(0x32, now)
    chip.i2c_start(0x53 << 1 | 1, now)
    assert bytes(chip.i2c_read(now) for _ in range(6))[:2] == b"\0\0"
    chip.i2c_stop(now)
    bench.now += 10 * US
    assert bench.xyz()[0] == 1


def test_power_on_forgets_everything() -> None:
    bench = Bench()
    bench.measure(fifo=0x80)
    bench.wait(100)
    bench.chip.power_on()
    assert bench.read(0x2D) == 0
    assert bench.read(0x39) == 0
