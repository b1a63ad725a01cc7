"""The sender's loop against the firmware's core on the same chips, byte by byte, and its own sample clock."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

pytest.importorskip("ziglang", reason="the C compiler is in the extra 'firmware'")

from firmware_bridge import (
    TICKS_PER_SECOND,
    Adxl345,
    Adxl345Options,
    Command,
    LineFault,
    SampleDecoder,
    Samples,
    Status,
    encode_command,
    set_range,
    set_rate,
)
from tests.firmware_bridge.conftest import moving_source
from tests.firmware_bridge.host_library import host_library

US = TICKS_PER_SECOND // 1_000_000
BAUD = 1_562_500
BYTES = ctypes.CFUNCTYPE(None, ctypes.c_uint32, ctypes.POINTER(ctypes.c_uint8), ctypes.c_uint32)
WORDS = ctypes.CFUNCTYPE(None, ctypes.c_uint32, ctypes.POINTER(ctypes.c_uint16), ctypes.c_uint32)


class Bus:
    """Four chips on a bus; every byte takes time."""

    def __init__(self) -> None:
        self.now = 0
        self.chips = [Adxl345(moving_source(k), Adxl345Options(clock_error=0.004 * k)) for k in range(4)]

    def transfer(self, chip: int, sent: list[int]) -> list[int]:
        self.chips[chip].select(self.now)
        answer = []
        for byte in sent:
            answer.append(self.chips[chip].transfer(byte, self.now))
            self.now += 2 * US
        self.chips[chip].deselect(self.now)
        self.now += 5 * US
        return answer


class Sender(Bus):
    """The sender on its port."""

    def __init__(self, library) -> None:
        super().__init__()
        self.library = library
        self._callback = BYTES(self._exchange)
        library.port_set_exchange(self._callback)
        self.at(0)
        library.port_sent(ctypes.byref(ctypes.POINTER(ctypes.c_uint8)()))  # what an earlier test left
        library.port_let(1 << 30)
        library.port_begin(1, BAUD)

    def _exchange(self, chip, values, count) -> None:
        for k, byte in enumerate(self.transfer(chip, values[:count])):
            values[k] = byte
        self.library.port_set_time_us(self.now // US)

    def at(self, time_us: int) -> None:
        self.now = max(self.now, time_us * US)
        self.library.port_set_time_us(self.now // US)

    def give(self, data: bytes) -> None:
        for byte in data:
            self.library.port_give(byte)

    def sent(self) -> bytes:
        place = ctypes.POINTER(ctypes.c_uint8)()
        count = self.library.port_sent(ctypes.byref(place))
        return ctypes.string_at(place, count)

    def run(self, stop_us: int, step_us: int = 10) -> bytes:
        """Look every few microseconds, as the loop of a board does."""
        sent = b""
        for time_us in range(self.now // US + step_us, stop_us, step_us):
            if time_us * US > self.now:
                self.at(time_us)
                self.library.port_step()
                sent += self.sent()
        return sent


class Firmware(Bus):
    """The core as the LPC1768 has it, with a timer whose interrupt comes at once."""

    def __init__(self, library) -> None:
        super().__init__()
        self.library = library
        self._callback = WORDS(self._exchange)
        library.host_set_exchange(self._callback)
        self.at(0)
        library.host_init(1, BAUD)
        library.host_start()

    def _exchange(self, chip, words, count) -> None:
        answer = self.transfer(chip, [half for word in words[:count] for half in (word >> 8, word & 0xFF)])
        for k in range(count):
            words[k] = answer[2 * k] << 8 | answer[2 * k + 1]
        self.library.host_set_time_us(self.now // US)

    def at(self, time_us: int) -> None:
        self.now = max(self.now, time_us * US)
        self.library.host_set_time_us(self.now // US)

    def sent(self) -> bytes:
        taken = b""
        place = ctypes.POINTER(ctypes.c_uint8)()
        while count := self.library.host_peek(ctypes.byref(place)):
            taken += ctypes.string_at(place, count)
            self.library.host_taken(count)
        return taken


@pytest.fixture(scope="module")
def core_library(tmp_path_factory):
    return host_library(tmp_path_factory.mktemp("core"))


def samples_of(data: bytes) -> Samples:
    return SampleDecoder().feed(data)


COMMANDS = {
    20_000: set_rate(1600),
    40_000: encode_command(Command.SELF_TEST, 1),
    50_000: encode_command(Command.STOP),
    60_000: set_range(4, full_resolution=False) + encode_command(Command.START),
    70_000: encode_command(Command.SET_BAUD, 460_800),
    80_000: b"junk\xc3\x3c" + encode_command(Command.IDENTIFY),
    85_000: encode_command(99),
    90_000: set_rate(1000, 14),
}
"""What the host sends, and when, µs."""


def test_frames_are_those_of_the_firmwares_core(sender_library, core_library) -> None:
    """The same chips at the same times: every byte is the same, of samples, identities and replies."""
    sender, firmware = Sender(sender_library), Firmware(core_library)
    ours, theirs, waiting, beat = b"", b"", dict(COMMANDS), sender_library.core_heartbeat()
    for time_us in range(10, 110_000, 10):
        if time_us * US <= sender.now:
            continue  # still busy
        given = b"".join(waiting.pop(due) for due in sorted(waiting) if due <= time_us)
        sender.at(time_us)
        sender.give(given)
        sender_library.port_step()
        ours += sender.sent()
        firmware.at(time_us)
        if sender_library.core_heartbeat() != beat:
            beat = sender_library.core_heartbeat()
            core_library.host_sample()
        for byte in given:
            core_library.host_receive(byte)
        core_library.host_poll()
        theirs += firmware.sent()
    assert ours == theirs
    decoder = SampleDecoder()
    samples = decoder.feed(ours)
    assert len(samples) > 80
    assert np.ptp(samples.counts[:, 0]) > 20
    assert len(decoder.messages) == 11  # two identities and nine replies
    assert not (samples.status & Status.LATE).any()


def test_commands_at_every_moment_of_a_period_cost_no_chip(sender_library) -> None:
    sender, rng = Sender(sender_library), np.random.default_rng(2)
    sender.give(set_rate(3200))
    decoder = SampleDecoder()
    decoder.feed(sender.run(50_000))
    others = (set_rate(3200), set_range(16), encode_command(Command.SELF_TEST, 0), encode_command(Command.IDENTIFY))
    parts = []
    for command in [encode_command(Command.START)] * 60 + [*others] * 10:
        sender.give(command)
        parts.append(decoder.feed(sender.run(sender.now // US + 3_000 + int(rng.integers(0, 313)))))
    samples = Samples.join(parts)
    first = (samples.status & Status.FIRST) != 0
    assert first.sum() == 90
    assert not np.any(samples.status & (0xF | Status.CHIP_FAULT))
    assert np.all(np.diff(samples.sequence.astype(int))[~first[1:]] == 1)
    assert (decoder.counts.lost, decoder.counts.corrupt, decoder.counts.skipped_bytes) == (0, 0, 0)


def test_the_sample_clock_keeps_the_rate_that_is_no_whole_number_of_microseconds(sender_library) -> None:
    sender = Sender(sender_library)
    sender.give(set_rate(300))
    samples = samples_of(sender.run(1_100_000, 20))
    late_us = (samples.ticks - samples.ticks[-1]) % (1_000_000 / 300)
    spans = np.diff(samples.ticks[samples.ticks > 100_000])
    assert abs(spans.mean() - 1_000_000 / 300) < 0.2  # a look every 20 µs over 300 samples
    assert np.minimum(late_us, 1_000_000 / 300 - late_us).max() <= 21


def test_the_first_sample_comes_a_period_after_the_start(sender_library) -> None:
    sender = Sender(sender_library)
    begun_us, beat = sender.now // US, sender_library.core_heartbeat()
    sender.run(begun_us + 9_900)
    assert sender_library.core_heartbeat() == beat
    sender.run(begun_us + 10_300)
    assert sender_library.core_heartbeat() == beat + 1


def test_periods_that_the_loop_missed_are_over_and_the_next_sample_is_late(sender_library) -> None:
    sender = Sender(sender_library)
    data = sender.run(200_000)
    sender.at(253_000)  # the loop did something else for five periods
    samples = samples_of(data + sender.run(400_000))
    late = np.flatnonzero(samples.status & Status.LATE)
    assert len(late) == 1
    assert samples.ticks[late[0]] == pytest.approx(253_010, abs=20)
    phase = (samples.ticks[late[0] + 1 :] - samples.ticks[late[0] - 1]) % 10_000
    assert np.minimum(phase, 10_000 - phase).max() <= 30  # on the grid of before


def test_time_may_wrap(sender_library) -> None:
    sender = Sender(sender_library)
    start = (1 << 32) - 100_000
    sender.at(start)
    sender_library.port_begin(1, BAUD)
    samples = samples_of(sender.run(start + 300_000, 20))
    assert len(samples) == pytest.approx(28, abs=2)
    assert np.abs(np.diff(samples.ticks) - 10_000).max() <= 40


def test_a_line_that_takes_nothing_costs_whole_frames_and_says_so(sender_library) -> None:
    sender = Sender(sender_library)
    data = sender.run(100_000)
    sender_library.port_let(55)  # a frame and a part of the next
    data += sender.run(1_000_000, 50)
    sender_library.port_let(1 << 30)
    decoder = SampleDecoder()
    samples = decoder.feed(data + sender.run(1_200_000, 50))
    decoder.finish()
    assert (decoder.counts.corrupt, decoder.counts.skipped_bytes) == (0, 0)
    assert decoder.counts.lost == pytest.approx(61, abs=3)  # of a hundred, thirty found room in the ring
    assert (samples.status & Status.FRAMES_DROPPED).any()


def test_damaged_bytes_are_reported(sender_library) -> None:
    sender = Sender(sender_library)
    data = sender.run(100_000)
    sender_library.port_give(-2)
    samples = samples_of(data + sender.run(200_000))
    assert np.count_nonzero(samples.status & Status.RECEIVE_ERROR) == 1


def test_a_chip_that_is_unplugged_is_missing_until_it_is_back(sender_library) -> None:
    sender = Sender(sender_library)
    data = sender.run(100_000)
    sender.chips[2].line_fault = LineFault.SILENT
    data += sender.run(200_000)
    sender.chips[2].line_fault = LineFault.NONE
    sender.chips[2].power_on()
    samples = samples_of(data + sender.run(400_000))
    missing = (samples.status & Status.SENSOR_3_MISSING) != 0
    assert np.array_equal(missing, (samples.counts[:, 6:9] == -32768).all(axis=1))
    assert 8 <= np.count_nonzero(missing) <= 20
    assert not missing[-1]


def test_a_watchdog_is_fed_while_samples_are_taken(sender_library) -> None:
    sender = Sender(sender_library)
    sender.run(100_000)
    fed = sender_library.port_shown()
    for _ in range(100):
        sender_library.port_step()  # time stands still: no sample
    assert sender_library.port_shown() == fed
    sender.run(200_000)
    assert sender_library.port_shown() > fed


def test_random_bytes_from_the_host_stop_nothing(sender_library) -> None:
    sender, rng = Sender(sender_library), np.random.default_rng(5)
    decoder = SampleDecoder()
    count = 0
    for stop_us in range(100_000, 1_000_000, 20_000):
        sender.give(rng.integers(0, 256, 60, dtype=np.uint8).tobytes())
        count += len(decoder.feed(sender.run(stop_us, 50)))
    assert (decoder.counts.corrupt, decoder.counts.skipped_bytes) == (0, 0)
    assert count == pytest.approx(95, abs=4)
