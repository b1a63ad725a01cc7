"""Firmware in the loop: real-time factors, decode rate, latency.

Run: python benchmarks/firmware.py [--quick]

Real-time factor: virtual seconds per second of processor time, board and physics together. Figures are the best of a
few runs, so that another program's load does not count.
"""

from __future__ import annotations

import argparse
import resource
import threading
import time

import numpy as np

from firmware_bridge.adxl345.registers import TICKS_PER_SECOND
from firmware_bridge.frames.checksum import crc16
from firmware_bridge.frames.commands import sample_at
from firmware_bridge.frames.decoder import SampleDecoder, encode_samples
from firmware_bridge.host.link import Link
from firmware_bridge.loop.board_process import BoardProcess
from firmware_bridge.loop.physics import RidePhysics
from firmware_bridge.loop.virtual_port import PseudoTerminal
from sim.ride import Ride

RATES = (100, 800, 3200)


def processor_time() -> float:
    """Processor time of this process and of its ended children, s."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


def run_cost(rate: int, virtual_s: float, *, fast: bool) -> float:
    """Processor time of a run, with the start of the process, s."""
    before = processor_time()
    with BoardProcess(RidePhysics(Ride("paper_run")), fast=fast) as board:
        board.run_for(0.02)
        board.receive(sample_at(rate))
        done = 0.0
        while done < virtual_s:
            board.run_for(0.5)
            board.take_sent()
            done += 0.5
    return processor_time() - before


def real_time_factor(rate: int, virtual_s: float, *, fast: bool, repeats: int) -> float:
    """Virtual seconds per second of processor time; the start of the process is taken off."""
    start = min(run_cost(rate, 0.5, fast=fast) for _ in range(repeats))
    whole = min(run_cost(rate, 0.5 + virtual_s, fast=fast) for _ in range(repeats))
    return virtual_s / (whole - start)


def byte_loop(stream: bytes) -> int:
    """Decode a byte at a time with a bitwise checksum, as a first program for such frames would."""
    count = 0
    buffer = bytearray()
    for byte in stream:
        buffer.append(byte)
        if len(buffer) == 1 and byte != 0xA5:
            buffer.clear()
        elif len(buffer) == 40:
            crc = 0xFFFF
            for item in buffer[:38]:
                crc ^= item << 8
                for _ in range(8):
                    crc = (crc << 1 ^ 0x1021) & 0xFFFF if crc & 0x8000 else crc << 1
            count += crc == buffer[38] | buffer[39] << 8
            buffer.clear()
    return count


def decode_rates(repeats: int) -> tuple[float, float]:
    """Frames per second of the decoder and of the byte loop, measured in turn."""
    rng = np.random.default_rng(0)
    n = 200_000
    stream = encode_samples(np.arange(n), np.arange(n) * 312, rng.integers(-4096, 4096, (n, 12)))
    assert crc16(stream[:38]) == int.from_bytes(stream[38:40], "little")
    fast = slow = np.inf
    for _ in range(repeats):
        decoder = SampleDecoder()
        began = time.perf_counter()
        assert len(decoder.feed(stream)) == n
        fast = min(fast, time.perf_counter() - began)
        began = time.perf_counter()
        assert byte_loop(stream[: 40 * 2000]) == 2000
        slow = min(slow, time.perf_counter() - began)
    return n / fast, 2000 / slow


def latency(samples: int) -> tuple[float, float]:
    """Median and 99th percentile from the last bit of a frame on the line to its decoded sample on the host, s."""
    port = PseudoTerminal()
    delays = []
    sent_at: dict[int, float] = {}
    done = threading.Event()

    def play() -> None:
        counts = np.zeros((1, 12))
        for number in range(samples):
            frame = encode_samples([number], [number * 1250], counts)
            sent_at[number] = time.perf_counter()
            port.write(frame, 1.0)
            time.sleep(1.25e-3)
        done.set()

    decoder = SampleDecoder()
    with Link(port.name) as link:
        time.sleep(0.2)
        thread = threading.Thread(target=play)
        thread.start()
        while not done.is_set() or link.backlog:
            chunk = link.read(0.05)
            if chunk is None:
                continue
            found = decoder.feed(chunk.data)
            now = time.perf_counter()
            delays += [now - sent_at[int(number)] for number in found.sequence]
        thread.join()
    port.close()
    return float(np.median(delays)), float(np.quantile(delays, 0.99))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="shorter runs")
    quick = parser.parse_args().quick
    repeats = 2 if quick else 4
    print("real-time factor, end to end with MuJoCo (virtual s per processor s)")
    for fast in (False, True):
        cells = []
        for rate in RATES:
            virtual_s = (3200 if quick else 9600) / rate * (5 if fast else 1)
            cells.append(f"{rate} Hz {real_time_factor(rate, virtual_s, fast=fast, repeats=repeats):7.1f}")
        print(f"  peripherals in {'C     ' if fast else 'Python'}  " + "   ".join(cells), flush=True)
    fast_rate, slow_rate = decode_rates(repeats)
    print(
        f"decoder: {fast_rate / 1e6:.2f} M frames/s, {fast_rate / slow_rate:.0f} times a byte loop ({slow_rate:.0f}/s)"
    )
    median, late = latency(400 if quick else 2000)
    print(f"latency, pseudo-terminal to decoded sample: median {median * 1e3:.2f} ms, 99 % {late * 1e3:.2f} ms")
    print(f"one tick of virtual time: {1e12 / TICKS_PER_SECOND:.1f} ps")


if __name__ == "__main__":
    main()
