"""Tap, activity, inactivity, free fall, link and sleep of the register-level ADXL345 (data sheet Rev. E)."""

from __future__ import annotations

import numpy as np
import pytest

from firmware_bridge import RAW_PER_COUNT, TICKS_PER_SECOND, Adxl345, Adxl345Options

MS = TICKS_PER_SECOND // 1000
SINGLE, DOUBLE, ACTIVITY, INACTIVITY, FREE_FALL, DATA_READY = 0x40, 0x20, 0x10, 0x08, 0x04, 0x80
REST = (0.6, 0.0, 0.8)


class Moved:
    """A chip whose specific force (g) follows a list of (from ms, to ms, x, y, z), at rest in between."""

    def __init__(self, *pushes, **options) -> None:
        self.now = 0
        self.pushes = pushes
        self.chip = Adxl345(self.convert, Adxl345Options(**options))

    def convert(self, first, period, count, bw_rate):
        t = (first + period * np.arange(count)) / MS
        g = np.tile(REST, (count, 1))
        for begin, end, *force in self.pushes:
            g[(t >= begin) & (t < end)] = force
        return np.round(g * 256 * RAW_PER_COUNT).astype(int)

    def setup(self, **registers: int) -> None:
        for name, value in registers.items():
            self.chip.write_register(ADDRESS[name], value, self.now)
        self.chip.write_register(0x2D, self.power | 8, self.now)

    power = 0

    def until(self, milliseconds: float) -> int:
        """Let time pass and read INT_SOURCE, which clears the events."""
        self.now = round(milliseconds * MS)
        self.chip.select(self.now)
        self.chip.transfer(0x80 | 0x30, self.now)
        source = self.chip.transfer(0, self.now)
        self.chip.deselect(self.now)
        return source

    def first(self, event: int, end: float, step: float = 0.25) -> float:
        """Time of an event, ms."""
        at = self.now / MS
        while at < end:
            at += step
            if self.until(at) & event:
                return at
        return np.inf


ADDRESS = {
    "tap": 0x1D, "dur": 0x21, "latent": 0x22, "window": 0x23, "act": 0x24, "inact": 0x25, "time_inact": 0x26,
    "control": 0x27, "ff": 0x28, "time_ff": 0x29, "axes": 0x2A, "rate": 0x2C, "enable": 0x2E, "map": 0x2F,
}  # fmt: skip
TAPS = {"tap": 48, "dur": 16, "latent": 16, "window": 64, "axes": 7, "enable": SINGLE | DOUBLE}  # 3 g, 10, 20, 80 ms
HIT = (0.6, 0.0, 6.0)


def tap(at: float, length: float = 4.0, force=HIT):
    return (at, at + length, *force)


@pytest.mark.parametrize("rate", [0x07, 0x0A, 0x0F])  # 12.5, 100, 3200 Hz: taps are found in undecimated data
@pytest.mark.parametrize(("length", "found"), [(4.0, True), (9.5, True), (10.9, False)])
def test_a_tap_is_shorter_than_dur(rate: int, length: float, found: bool) -> None:
    chip = Moved(tap(100, length))
    chip.setup(**TAPS | {"enable": SINGLE, "rate": rate})
    at = chip.first(SINGLE, 200)
    assert (at < 200) is found
    if found:  # when the acceleration goes below the threshold
        assert at == pytest.approx(100 + length, abs=0.6)


def test_axes_and_threshold_of_a_tap() -> None:
    sideways = (4.0, 0.0, 0.8)
    for axes, force, found in ((4, sideways, 4), (3, sideways, None), (7, sideways, 4), (7, (2.9, 2.9, 2.9), None)):
        chip = Moved(tap(50, 4, force))
        chip.setup(**TAPS | {"enable": SINGLE, "axes": axes})
        assert (chip.first(SINGLE, 150) < 150) is (found is not None)
        assert chip.chip.registers[0x2B] == (found or 0)


DOUBLES = {
    "within the window": ((tap(100), tap(150)), DOUBLE, 0, (154, 155)),
    "too late": ((tap(100), tap(210)), 0, 0, (204, 205)),
    "above at the start of the window": ((tap(100), tap(120, 7)), 0, 0, (124, 125)),
    "the second too long": ((tap(100), tap(150, 15)), 0, 0, (160, 161)),
    "a spike during latency": ((tap(100), tap(110, 2), tap(150)), DOUBLE, 0, (154, 155)),
    "a spike during latency, suppressed": ((tap(100), tap(110, 2), tap(150, 15)), 0, 8, (110, 111)),
}


@pytest.mark.parametrize("name", DOUBLES)
def test_a_double_tap_and_what_invalidates_it(name: str) -> None:
    pushes, expected, suppress, (early, late) = DOUBLES[name]
    chip = Moved(*pushes)
    chip.setup(**TAPS | {"axes": 7 | suppress})
    while not (found := chip.until(chip.now / MS + 0.25) & (SINGLE | DOUBLE)):
        assert chip.now < 300 * MS
    assert found == SINGLE | expected  # the single tap is reported when the double tap is decided
    assert early <= chip.now / MS <= late


def test_a_tap_needs_a_duration_and_a_double_tap_latency_and_window() -> None:
    chip = Moved(tap(50))
    chip.setup(**TAPS | {"dur": 0})
    assert not chip.until(300) & (SINGLE | DOUBLE)
    for without in ("latent", "window"):
        chip = Moved(tap(50), tap(100))
        chip.setup(**TAPS | {without: 0})
        assert chip.until(300) & (SINGLE | DOUBLE) == SINGLE


@pytest.mark.parametrize(("length", "found"), [(48, False), (53, True)])
def test_free_fall_lasts_its_time_on_all_axes(length: float, found: bool) -> None:
    chip = Moved((100, 100 + length, 0.1, -0.1, 0.2), (300, 400, 0.1, 0.5, 0.1))
    chip.setup(ff=6, time_ff=10, enable=FREE_FALL)  # 375 mg, 50 ms
    at = chip.first(FREE_FALL, 250)
    assert at == pytest.approx(150, abs=0.6) if found else at == np.inf
    assert not chip.until(500) & FREE_FALL


@pytest.mark.parametrize(("control", "found"), [(0x20, False), (0x40, True), (0x70, True), (0xC0, True), (0xA0, False)])
def test_activity_on_its_axes_dc_and_ac(control: int, found: bool) -> None:
    chip = Moved((100, 101, 2.3, 0.0, 0.8))
    chip.setup(act=26, control=control, enable=ACTIVITY)  # 1.625 g: 2.3 is beyond, as is 2.3 − 0.6
    at = chip.first(ACTIVITY, 200)
    assert (at < 102) is found
    assert chip.chip.registers[0x2B] >> 4 == (4 if found else 0)


def test_ac_coupling_takes_the_start_as_reference() -> None:
    for control, found in ((0x70, True), (0xF0, False)):
        chip = Moved()
        chip.setup(act=12, control=control, enable=ACTIVITY)  # 0.75 g: z is beyond, but did not change
        assert (chip.first(ACTIVITY, 100) < 100) is found


@pytest.mark.parametrize("clock_error", [0.0, 0.02])
def test_inactivity_takes_its_time_below_the_threshold(clock_error: float) -> None:
    chip = Moved((500, 520, 2.0, 0.0, 0.8), clock_error=clock_error)
    chip.setup(inact=16, time_inact=2, control=0x07, enable=INACTIVITY)
    at = chip.first(INACTIVITY, 4000, 2.0)
    assert at == pytest.approx(520 + 2000 / (1.0 + clock_error), abs=15)  # output data at 100 Hz
    for control, inact, found in ((0x07, 12, False), (0x0F, 12, True), (0x04, 12, True)):
        chip = Moved()
        chip.setup(inact=inact, time_inact=1, control=control, enable=INACTIVITY)
        assert bool(chip.until(1500) & INACTIVITY) is found


def test_events_need_their_enable_bit_and_are_cleared_by_reading_int_source() -> None:
    chip = Moved(tap(50), tap(250))
    chip.setup(**TAPS | {"enable": 0})
    assert not chip.until(200) & SINGLE
    chip.setup(enable=SINGLE)
    assert chip.until(300) & SINGLE
    assert not chip.until(301) & SINGLE


def test_link_makes_activity_and_inactivity_take_turns() -> None:
    chip = Moved((500, 510, 3, 0, 0), (2500, 2510, 3, 0, 0), (2600, 2610, 3, 0, 0))
    chip.power = 0x20
    chip.setup(act=32, inact=16, time_inact=1, control=0x77, enable=ACTIVITY | INACTIVITY)
    assert not chip.until(600) & ACTIVITY  # activity waits for inactivity
    assert chip.first(INACTIVITY, 2000, 5.0) == pytest.approx(1520, abs=25)
    assert chip.first(ACTIVITY, 3000, 1.0) == pytest.approx(2500, abs=2)
    assert not chip.until(2650) & ACTIVITY
    assert chip.first(INACTIVITY, 4000, 5.0) == pytest.approx(3620, abs=25)


@pytest.mark.parametrize(("wake_up", "period"), [(0, 125), (1, 250), (3, 1000)])
def test_auto_sleep_falls_asleep_and_wakes_up(wake_up: int, period: float) -> None:
    chip = Moved((4200, 5400, 3, 0, 0))
    chip.power = 0x30 | wake_up
    chip.setup(act=32, inact=16, time_inact=2, control=0x77, enable=ACTIVITY | INACTIVITY)
    assert not chip.chip.registers[0x2B] & 8
    asleep = chip.first(INACTIVITY, 3000, 5.0)
    assert asleep == pytest.approx(2015, abs=20)
    assert chip.chip.registers[0x2B] & 8
    awake = chip.first(ACTIVITY, 6000, 1.0)
    assert 4200 <= awake <= 4200 + period + 2
    assert chip.chip.registers[0x2B] == 0x40
    assert chip.until(awake + 25) & DATA_READY
    assert chip.chip._period == TICKS_PER_SECOND // 100


def test_sleep_suppresses_data_ready_and_the_fifo_but_updates_the_data() -> None:
    chip = Moved((500, 2000, 1.0, 0.0, 0.0))
    chip.chip.write_register(0x38, 0x80, 0)
    chip.power = 0x04
    chip.setup()
    source = chip.until(1500)
    assert not source & DATA_READY
    assert not chip.chip.fifo
    chip.chip.select(chip.now)
    data = [chip.chip.transfer(value, chip.now) for value in (0xF2, 0, 0)]
    assert data[1] | data[2] << 8 == 256


def test_pins_carry_enabled_events_and_inverted_levels() -> None:
    chip = Moved(tap(50))
    chip.setup(**TAPS | {"enable": SINGLE, "map": SINGLE})
    assert not chip.chip.interrupt_pin(2, 40 * MS)
    assert chip.chip.interrupt_pin(2, 60 * MS)
    assert not chip.chip.interrupt_pin(1, 60 * MS)
    chip.chip.write_register(0x31, 0x20, 60 * MS)
    assert not chip.chip.interrupt_pin(2, 61 * MS)
