"""The firmware's core, compiled for this computer, against the register-level chips."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

pytest.importorskip("ziglang", reason="the C compiler is in the extra 'firmware'")

from firmware_bridge import (
    RAW_PER_COUNT,
    TICKS_PER_SECOND,
    Adxl345,
    Adxl345Options,
    ArrayName,
    Command,
    Identity,
    LineFault,
    Reply,
    Result,
    SampleDecoder,
    Samples,
    Status,
    crc16,
    encode_command,
    parse_message,
    set_range,
    set_rate,
)
from tests.firmware_bridge.host_library import host_library

US = TICKS_PER_SECOND // 1_000_000
EXCHANGE = ctypes.CFUNCTYPE(None, ctypes.c_uint32, ctypes.POINTER(ctypes.c_uint16), ctypes.c_uint32)


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return host_library(tmp_path_factory.mktemp("host"))


class Host:
    """The core with four chips on its SPI; time moves when told to."""

    def __init__(self, library, *, cause: int = 1, baud: int = 1_562_500) -> None:
        self.library = library
        self.now = 0
        self.chips = [
            Adxl345(lambda first, period, n, bw, k=k: np.tile([256 * (k + 1), -512, 65536], (n, 1))) for k in range(4)
        ]
        self.decoder = SampleDecoder()
        self._callback = EXCHANGE(self._exchange)
        library.host_set_exchange(self._callback)
        self.advance(0)
        library.host_init(cause, baud)

    def _exchange(self, sensor, words, count) -> None:
        chip = self.chips[sensor]
        self.now = max(self.now, self.library.host_time_us() * US)  # the core may have waited
        chip.select(self.now)
        for k in range(count):
            high = chip.transfer(words[k] >> 8, self.now)
            low = chip.transfer(words[k] & 0xFF, self.now)
            words[k] = high << 8 | low
            self.now += 3 * US
        chip.deselect(self.now)
        self.library.host_set_time_us(self.now // US)

    def advance(self, microseconds: int) -> None:
        self.now += microseconds * US
        self.library.host_set_time_us(self.now // US)

    def send(self, data: bytes) -> None:
        for byte in data:
            self.library.host_receive(byte)
        self.library.host_poll()

    def sample(self, count: int, period_us: int = 10_000, *, drain: bool = True) -> Samples:
        for _ in range(count):
            self.advance(period_us)
            self.library.host_sample()
            if drain:
                self.drain()
        return self.collected()

    def drain(self) -> bytes:
        taken = b""
        place = ctypes.POINTER(ctypes.c_uint8)()
        while count := self.library.host_peek(ctypes.byref(place)):
            taken += ctypes.string_at(place, count)
            self.library.host_taken(count)
        self.parts = [*getattr(self, "parts", []), self.decoder.feed(taken)]
        return taken

    def collected(self) -> Samples:
        self.drain()
        parts, self.parts = self.parts, []
        return Samples.join(parts)

    def messages(self) -> list[Reply | Identity]:
        self.drain()
        found = [parse_message(packet) for packet in self.decoder.messages]
        self.decoder.messages.clear()
        return found


@pytest.fixture
def host(library) -> Host:
    return Host(library)


def test_crc_agrees_with_the_hosts(library) -> None:
    for data in (b"", b"1", b"123456789", bytes(range(38))):
        assert library.host_crc16(data, len(data)) == crc16(data)


def test_rate_codes(library) -> None:
    codes = {10: 10, 100: 10, 101: 11, 200: 11, 400: 12, 800: 13, 1000: 14, 1600: 14, 1601: 15, 3200: 15}
    assert {rate: library.host_rate_code(rate) for rate in codes} == codes


@pytest.fixture(scope="module")
def named_library(tmp_path_factory):
    return host_library(tmp_path_factory.mktemp("named"), array="cube12_as_built")


def test_it_states_its_array_before_each_identity(named_library) -> None:
    host = Host(named_library)
    host.library.host_poll()
    name, identity = host.messages()
    assert name == ArrayName("cube12_as_built")
    assert isinstance(identity, Identity)
    host.send(encode_command(Command.IDENTIFY))
    assert [type(message) for message in host.messages()] == [Reply, ArrayName, Identity]


def test_a_line_that_is_full_delays_the_statement_and_loses_none(named_library) -> None:
    host = Host(named_library)
    host.library.host_poll()
    host.messages()
    host.library.host_start()
    host.sample(60, drain=False)  # more than the queue holds: one place is left to messages
    host.send(encode_command(Command.IDENTIFY))
    for _ in range(3):
        host.drain()
        host.library.host_poll()
    assert [type(message) for message in host.messages()] == [Reply, ArrayName, Identity]


def test_the_temperature_goes_with_every_sample(host: Host) -> None:
    host.library.host_poll()
    host.library.host_start()
    assert np.isnan(host.sample(5).temperature_degC).all()
    host.library.host_set_temperature(-1234)
    np.testing.assert_allclose(host.sample(3).temperature_degC, -12.34)
    host.library.host_set_temperature(-(1 << 15))
    host.send(encode_command(Command.IDENTIFY))
    assert host.messages()


def test_it_announces_itself_and_configures_the_chips(host: Host) -> None:
    host.library.host_poll()
    (identity,) = host.messages()
    assert identity.present == (True,) * 4
    assert (identity.rate_hz, identity.baud, identity.range_g, identity.full_resolution) == (100, 1_562_500, 16, True)
    assert identity.reset_cause == "power-on"
    assert all(chip.registers[0x31] == 0x0B and chip.registers[0x2D] == 8 for chip in host.chips)


DIRTY = {0x1D: 9, 0x1E: 0x7F, 0x2A: 7, 0x2C: 0x17, 0x2D: 0x3F, 0x2E: 0xFF, 0x2F: 0xF0, 0x31: 0xC4, 0x38: 0x9F}


def test_chips_that_kept_their_registers_are_set_up_anew(host: Host) -> None:
    for chip in host.chips:
        for address, value in DIRTY.items():
            chip.write_register(address, value, host.now)
    host.library.host_init(2, 1_562_500)
    for chip in host.chips:
        assert {address: chip.registers[address] for address in DIRTY if chip.registers[address]} == {
            0x2C: 0x0A,
            0x2D: 0x08,
            0x31: 0x0B,
            0x38: 0x82,
        }
    host.library.host_start()
    assert host.sample(8).counts[-1].tolist() == [1, -2, 256, 2, -2, 256, 3, -2, 256, 4, -2, 256]


@pytest.mark.parametrize("address", [0x1D, 0x1F, 0x2A, 0x2C, 0x2D, 0x2E, 0x2F, 0x31, 0x38])
def test_a_register_that_does_not_read_back_is_a_fault_of_its_chip(host: Host, address: int, monkeypatch) -> None:
    write = host.chips[1]._write

    def stuck(at: int, value: int, now: int) -> None:
        write(at, value ^ 0x10 if at == address else value, now)

    monkeypatch.setattr(host.chips[1], "_write", stuck)
    host.library.host_init(2, 1_562_500)
    host.library.host_start()
    samples = host.sample(3)
    host.library.host_poll()
    identity = host.messages()[-1]
    assert identity.faulty == (False, True, False, False)
    assert identity.present == (True, False, True, True)
    assert np.all(samples.status & Status.CHIP_FAULT)
    assert np.all(samples.counts[:, 3:6] == -32768)


def test_samples_carry_the_chips_counts_time_and_sequence(host: Host) -> None:
    host.library.host_start()
    assert host.library.host_timer_hz() == 100
    samples = host.sample(8)
    assert samples.counts[-1].tolist() == [1, -2, 256, 2, -2, 256, 3, -2, 256, 4, -2, 256]
    assert samples.sequence.tolist() == list(range(len(samples)))
    assert samples.status[0] & Status.FIRST
    assert not samples.status[1:].any()
    assert host.decoder.counts.corrupt == 0


def test_no_frame_before_every_chip_has_converted(host: Host) -> None:
    host.library.host_start()
    assert len(host.sample(1, 5_000)) == 0  # 11.1 ms after the start the first conversion is there
    first = host.sample(3)
    assert first.sequence[0] == 0
    assert first.counts[0, 2] == 256


@pytest.mark.parametrize("fault", [LineFault.SILENT, LineFault.STUCK_LOW, LineFault.STUCK_HIGH])
def test_a_sensor_that_fails_is_reported_and_taken_back(host: Host, fault: LineFault) -> None:
    host.library.host_start()
    host.sample(5)
    host.messages()
    host.chips[1].line_fault = fault
    bad = host.sample(3)
    assert all(Status(int(status)).missing_sensors == (2,) for status in bad.status)
    assert (bad.counts[:, 3:6] == -32768).all()
    host.library.host_poll()
    assert host.messages()[-1].present == (True, False, True, True)
    host.chips[1].line_fault = LineFault.NONE
    good = host.sample(8)
    assert good.counts[-1, 3:6].tolist() == [2, -2, 256]
    host.library.host_poll()
    assert host.messages()[-1].present == (True,) * 4


def test_overrun_stale_and_late_are_reported(host: Host) -> None:
    host.library.host_start()
    host.sample(5)
    late = host.sample(1, 35_000)
    assert late.status[0] & Status.LATE
    assert late.status[0] & Status.SENSOR_1_OVERRUN
    stale = host.sample(1, 1_000)
    assert stale.status[0] & Status.STALE


def test_a_full_queue_drops_whole_frames_and_says_so(host: Host) -> None:
    host.library.host_start()
    host.sample(60, drain=False)
    assert host.decoder.counts.corrupt == 0
    after = host.sample(2)
    assert after.status[0] & Status.FRAMES_DROPPED
    assert host.decoder.counts.lost > 20
    host.send(encode_command(Command.IDENTIFY))
    assert host.messages()[-1].dropped == host.decoder.counts.lost


COMMANDS = [
    (set_rate(3200), Result.DONE),
    (encode_command(Command.SET_RATE, 3201, 0xFF), Result.BAD_VALUE),  # set_rate refuses these before they are sent
    (encode_command(Command.SET_RATE, 9, 0xFF), Result.BAD_VALUE),
    (encode_command(Command.SET_RATE, 0, 0xFF), Result.BAD_VALUE),
    (encode_command(Command.SET_RATE, 65535, 0xFF), Result.BAD_VALUE),
    (encode_command(Command.SET_RATE, 400, 16), Result.BAD_VALUE),
    (encode_command(Command.SET_RANGE, 4, 1), Result.BAD_VALUE),
    (set_range(2, full_resolution=False), Result.DONE),
    (encode_command(Command.SELF_TEST, 2), Result.BAD_VALUE),
    (encode_command(Command.SELF_TEST, 1), Result.DONE),
    (encode_command(Command.SET_BAUD, 115_200), Result.DONE),
    (encode_command(Command.SET_BAUD, 100), Result.BAD_VALUE),
    (encode_command(Command.START), Result.DONE),
    (encode_command(Command.STOP), Result.DONE),
    (encode_command(99), Result.UNKNOWN_COMMAND),
]


@pytest.mark.parametrize(("command", "result"), COMMANDS)
def test_every_command_is_answered(host: Host, command: bytes, result: Result) -> None:
    host.library.host_start()
    host.library.host_poll()
    host.messages()
    host.send(command)
    replies = [message for message in host.messages() if isinstance(message, Reply)]
    assert replies == [Reply(command[2], result)]


@pytest.mark.parametrize(
    "command",
    [
        encode_command(Command.START),
        encode_command(Command.STOP),
        set_rate(800),
        set_rate(100, 15),
        set_range(4),
        encode_command(Command.SELF_TEST, 1),
        encode_command(Command.IDENTIFY),
        encode_command(Command.SET_BAUD, 921_600),
    ],
)
def test_no_command_uses_the_chips_while_the_sample_timer_runs(host: Host, command: bytes) -> None:
    host.library.host_start()
    host.sample(5)
    exchange, running = host._exchange, []
    host._callback = EXCHANGE(lambda *words: (running.append(host.library.host_timer_hz()), exchange(*words))[1])
    host.library.host_set_exchange(host._callback)
    host.send(command)
    host.drain()
    host.library.host_poll()
    assert not any(running)
    stopped = command == encode_command(Command.STOP)
    assert bool(host.library.host_timer_hz()) is not stopped


def test_wrong_length_is_refused(host: Host) -> None:
    body = b"\xc3\x3c" + bytes((Command.SELF_TEST, 2, 1, 1))
    host.send(body + crc16(body).to_bytes(2, "little"))
    assert Reply(Command.SELF_TEST, Result.BAD_LENGTH) in host.messages()


def test_a_rate_the_line_cannot_carry_is_refused(library) -> None:
    host = Host(library, baud=115_200)
    host.send(set_rate(400))
    assert Reply(Command.SET_RATE, Result.LINE_TOO_SLOW) in host.messages()
    host.send(set_rate(200))
    assert Reply(Command.SET_RATE, Result.DONE) in host.messages()


def test_rate_and_range_reach_the_chips(host: Host) -> None:
    host.library.host_start()
    host.send(set_rate(800) + set_range(4))
    assert all(chip.registers[0x2C] == 0x0D and chip.registers[0x31] == 0x09 for chip in host.chips)
    assert host.library.host_timer_hz() == 800


def test_baud_changes_only_after_the_reply_has_left(host: Host) -> None:
    host.send(encode_command(Command.SET_BAUD, 115_200))
    assert host.library.host_baud() == 1_562_500
    assert Reply(Command.SET_BAUD, Result.DONE) in host.messages()
    host.library.host_poll()
    assert host.library.host_baud() == 115_200


def test_commands_survive_garbage_and_damage(host: Host) -> None:
    rng = np.random.default_rng(3)
    good = encode_command(Command.IDENTIFY)
    for _ in range(200):
        host.send(rng.integers(0, 256, rng.integers(0, 30), dtype=np.uint8).tobytes())
        host.messages()
    host.send(bytes(20))
    host.send(good)
    host.library.host_poll()
    assert any(isinstance(message, Identity) for message in host.messages())
    damaged = bytearray(set_rate(3200))
    damaged[5] ^= 1
    host.send(bytes(damaged) + good)
    replies = [m for m in host.messages() if isinstance(m, Reply)]
    assert [reply.command for reply in replies] == [Command.IDENTIFY]


def test_locks_are_released(host: Host) -> None:
    host.library.host_start()
    host.sample(3)
    host.send(set_rate(200) + b"\xc3\x3c\xff")
    assert host.library.host_lock_depth() == 0


def test_watchdog_reset_is_told(library) -> None:
    host = Host(library, cause=4)
    host.library.host_start()
    assert host.sample(4).status[0] & Status.WATCHDOG_RESET


def fill_the_line(host: Host) -> None:
    for _ in range(60):
        host.advance(10_000)
        host.library.host_sample()


def test_no_reply_is_lost_while_the_line_is_full(host: Host) -> None:
    host.library.host_start()
    host.library.host_poll()
    host.messages()
    fill_the_line(host)
    commands = [encode_command(Command.SELF_TEST, k % 2) for k in range(6)]
    for command in commands:
        host.send(command)  # the place that samples leave free holds one reply
    assert host.library.host_has_work()
    replies = []
    for _ in range(8):
        replies += [message for message in host.messages() if isinstance(message, Reply)]
        host.library.host_poll()
    assert replies == [Reply(Command.SELF_TEST, Result.DONE)] * len(commands)


def test_bytes_that_find_no_place_to_wait_are_reported(host: Host) -> None:
    host.library.host_start()
    fill_the_line(host)
    for _ in range(20):
        host.send(encode_command(Command.IDENTIFY))
    host.collected()
    assert (host.sample(2).status & Status.RECEIVE_ERROR).any()


SETTLED = 20  # samples until the chips convert
CLOCKS = (0.02, 0.0, -0.01, -0.03)


def conversion_numbers(first: int, period: int, count: int, bw_rate: int) -> np.ndarray:
    """Yield conversions whose x counts up by 4."""
    number = round(first / period) + np.arange(count)
    return np.outer(4 * RAW_PER_COUNT * number, [1, -1, 0])


def run_at_own_clocks(host: Host, rate_hz: int, count: int) -> Samples:
    """Sample with chips whose clocks differ from the board's, and a sample timer that can be delayed."""
    for chip, clock in zip(host.chips, CLOCKS, strict=True):
        chip.options = Adxl345Options(clock_error=clock)
        chip.source = conversion_numbers
    host.library.host_start()
    host.send(set_rate(rate_hz))
    tick, parts = host.now, []
    for _ in range(count + SETTLED):
        before = host.library.host_delayed_us()
        host.library.host_sample()
        parts.append(host.collected())
        tick += (1_000_000 // rate_hz + host.library.host_delayed_us() - before) * US
        host.advance((tick - host.now) // US)
    return Samples.join(parts[SETTLED:])


@pytest.mark.parametrize("rate_hz", [100, 400])
def test_the_slowest_chip_sets_the_pace_and_faster_ones_send_means(host: Host, rate_hz: int) -> None:
    samples = run_at_own_clocks(host, rate_hz, 800)
    assert not (samples.status & (Status.STALE | Status.LATE)).any()
    slowest = 1.0 + min(CLOCKS)
    assert np.diff(samples.ticks).mean() == pytest.approx(1e6 / (rate_hz * slowest), rel=1e-3)
    for chip, clock in enumerate(CLOCKS):
        merged = (samples.status >> (4 + chip) & 1).astype(float)
        # A mean of two conversions stands half a conversion behind the newer one: each is counted exactly once.
        newest = samples.counts[:, 3 * chip] / 4 + merged / 2
        assert np.all(np.diff(newest) == 1 + merged[1:])
        assert merged.mean() == pytest.approx((1.0 + clock) / slowest - 1.0, abs=2.0 / len(merged))
        assert np.all(samples.counts[:, 3 * chip + 1] == -samples.counts[:, 3 * chip])


def test_faster_output_is_read_newest_only(host: Host) -> None:
    host.library.host_start()
    host.send(set_rate(250))  # 400 Hz output: between two rates
    assert all(chip.registers[0x38] == 0 for chip in host.chips)
    host.send(set_rate(390))
    assert all(chip.registers[0x38] == 0x82 for chip in host.chips)
    host.send(set_rate(200, 12))
    assert all(chip.registers[0x38] == 0 for chip in host.chips)
