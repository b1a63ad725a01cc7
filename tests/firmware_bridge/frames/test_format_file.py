"""Formats described in a file: packets behind nothing, COBS or SLIP, lines of text, and what a wrong file answers."""

from __future__ import annotations

import binascii
import re
import struct
import threading
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_bridge import SampleDecoder, Samples, TcpPort, frame_format, record
from firmware_bridge.frames.checksum import CHECKSUMS
from firmware_bridge.frames.delimited import decode_cobs, decode_slip
from firmware_bridge.frames.format_file import load_format
from gfimu import InputError
from gfimu.recording import Recording

CHECK = {  # of "123456789", from the CRC catalogue; sums by hand: 9 · 0x35, and 1 xor … xor 9
    "crc8": 0xF4, "crc16_ccitt_false": 0x29B1, "crc16_modbus": 0x4B37, "crc32": 0xCBF43926,
    "sum8": 0xDD, "sum16": 0x01DD, "xor8": 0x31,
}  # fmt: skip


def test_checksums_have_the_catalogues_check_values() -> None:
    rows = np.frombuffer(b"123456789", np.uint8)[None]
    assert {name: int(rule.of_rows(rows)[0]) for name, rule in CHECKSUMS.items() if rule.of_rows} == CHECK


def encode_cobs(data: bytes) -> bytes:
    """Put the distance to the next zero before each stretch without one, at most 254 bytes long."""
    out = bytearray()
    for stretch in data.split(b"\x00"):
        full = len(stretch) // 254
        for k in range(full):
            out += b"\xff" + stretch[254 * k : 254 * (k + 1)]
        rest = stretch[254 * full :]
        out += bytes([len(rest) + 1]) + rest
    return bytes(out)


@given(st.binary(max_size=600))
@settings(max_examples=200, deadline=None)
def test_cobs_and_slip_decode_what_was_encoded(data: bytes) -> None:
    encoded = encode_cobs(data)
    assert 0 not in encoded
    assert decode_cobs(encoded) == data
    slip = data.replace(b"\xdb", b"\xdb\xdd").replace(b"\xc0", b"\xdb\xdc")
    assert decode_slip(slip) == data


def test_what_is_no_cobs_and_no_slip() -> None:
    assert decode_cobs(b"\x05\x01") is None  # a stretch of four bytes, and one is there
    assert decode_slip(b"\xdb\x01") is None
    assert decode_slip(b"\xdb") is None


COUNTS = np.arange(50)[:, None] * 7 - np.arange(12) * 20


def cobs_stream() -> bytes:
    out = b""
    for k, row in enumerate(COUNTS):
        body = struct.pack("<HI12h", k, 4_294_960_000 + 1250 * k & 0xFFFFFFFF, *row)
        out += encode_cobs(body + struct.pack("<I", binascii.crc32(body))) + b"\x00"
    return out


def decoded(name, stream: bytes, step: int = 97) -> tuple[Samples, SampleDecoder]:
    decoder = SampleDecoder(frame_format(str(name)))
    parts = [decoder.feed(stream[at : at + step]) for at in range(0, len(stream), step)]
    decoder.finish()
    return Samples.join(parts), decoder


def test_cobs_packets_by_a_shipped_file() -> None:
    stream = cobs_stream()
    samples, decoder = decoded("cobs_binary", stream)
    assert np.array_equal(samples.counts, COUNTS)
    assert np.array_equal(np.diff(samples.ticks), np.full(49, 1250))  # over the wrap of 32 bits
    assert decoder.counts.skipped_bytes == 0
    packets = stream.split(b"\x00")
    packets[10] = packets[10][:5] + bytes([packets[10][5] ^ 0x40]) + packets[10][6:]
    samples, decoder = decoded("cobs_binary", b"\x00".join(packets))
    assert np.array_equal(samples.counts, np.delete(COUNTS, 10, axis=0))
    assert (decoder.counts.corrupt, decoder.counts.lost) == (1, 1)


def test_lines_by_a_shipped_file() -> None:
    times = [(4_294_960_000 + 1250 * k) % 2**32 for k in range(50)]  # micros() of an Arduino starts over
    lines = [f"{t}, {', '.join(map(str, row))}\r\n" for t, row in zip(times, COUNTS, strict=True)]
    stream = "booting…\r\nus,a11,a12\r\n".encode() + "".join([*lines[:20], "12,34\n", *lines[20:]]).encode()
    samples, decoder = decoded("arduino_csv", stream)
    assert np.array_equal(samples.counts, COUNTS)
    assert np.allclose(np.diff(samples.ticks) / decoder.format.clock_hz, 1.25e-3)
    assert decoder.counts.restarts == 0


TEXT = """
name = "own"
array = "cube12"
clock_hz = 1.0
unit = "g"
[stream]
kind = "text"
"""


def test_a_regular_expression_in_units_of_g(tmp_path) -> None:
    path = tmp_path / "own.toml"
    axes = [f"a{chip}{axis}" for chip in range(1, 5) for axis in range(1, 4)]
    groups = " ".join(rf"(?P<{name}>\S+)" for name in axes)
    path.write_text(TEXT + f"pattern = '''t=(?P<time>[\\d.]+) {groups}'''\n", encoding="utf-8")
    stream = "".join(f"t={0.01 * k:.2f} {' '.join(f'{0.5 + 0.001 * k:.3f}' for _ in axes)}\n" for k in range(20))
    samples, decoder = decoded(path, stream.encode())
    assert decoder.format.count_m_s2 is not None
    readings = samples.counts * decoder.format.count_m_s2
    assert readings[7] == pytest.approx(np.full(12, 0.507 * 9.80665), abs=1e-4)
    assert np.allclose(np.diff(samples.ticks), 1e7)


FIELDS = "fields = [{name='time', type='u32'}, {name='counts', type='i16', count=12}]\n"
WRONG = {
    "no array": ("name='own'\nclock_hz=1\n[stream]\nkind='text'\ncolumns=['time']\n", "key 'array' is missing"),
    "no channels": (TEXT + "columns = ['time', 'a11']\n", "a line has no a12"),
    "both": (TEXT + "columns = ['time']\npattern = 'x'\n", "either columns or pattern"),
    "pattern": (TEXT + "pattern = '('\n", "no regular expression"),
    "unknown key": (TEXT + "columns = ['time']\nwrap = 3\n", "wrap"),
    "no mark": (
        TEXT.replace("text", "packet")
        + "fields = [{name='time', type='u32'}, {name='counts', type='i16', count=12}]\n",
        "nothing marks a packet",
    ),
    "too few counts": (
        TEXT.replace("text", "packet")
        + "framing='cobs'\nfields = [{name='time', type='u32'}, {name='counts', type='i16', count=3}]\n",
        "a sample 3 counts",
    ),
    "checksum": (
        TEXT.replace("text", "packet") + "framing='cobs'\nchecksum='crc7'\n" + FIELDS,
        "unknown checksum 'crc7'",
    ),
    "sync": (
        TEXT.replace("text", "packet")
        + "fields = [{name='s', type='u8', count=2, value=[1]}, {name='time', type='u32'}, "
        "{name='counts', type='i16', count=12}]\n",
        "value has 1 numbers, count is 2",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_file_is_one_line(tmp_path, case: str) -> None:
    text, words = WRONG[case]
    path = tmp_path / "own.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(words)) as caught:
        load_format(path)
    assert "\n" not in str(caught.value)


def test_an_unknown_name_lists_the_formats() -> None:
    with pytest.raises(InputError, match="arduino_csv"):
        frame_format("arduino")


def test_a_board_that_a_file_describes_is_recorded(tmp_path) -> None:
    port, done = TcpPort(0), threading.Event()

    def play() -> None:
        for k in range(10_000):
            if done.is_set():
                return
            port.read()
            port.write(f"{1000 * k},{','.join(map(str, COUNTS[k % 50]))}\n".encode(), 0.1)
            time.sleep(0.001)

    thread = threading.Thread(target=play)
    thread.start()
    try:
        report = record(port.name, tmp_path / "run.parquet", form="arduino_csv", duration_s=0.5)
    finally:
        done.set()
        thread.join()
        port.close()
    recording = Recording.read(tmp_path / "run.parquet", unit="lsb")
    assert report.stream.lost == 0
    assert recording.sample_rate == pytest.approx(1000)
    place = np.flatnonzero((recording.readings[0] == COUNTS).all(axis=1))[0]
    assert np.array_equal(recording.readings[:20], np.roll(COUNTS, -place, axis=0)[:20])


MPU_PART = """name = "warm_chip"
lsb_m_s2 = 0.0048
noise_lsb_rms_100_hz = [1.0, 1.0, 1.0]
temperature_lsb_K = -0.5
temperature_zero_degC = 100.0
"""
ONE_WARM_CHIP = """name = "one_warm_chip"
[[chip]]
name = "a1"
part = "warm_chip.toml"
position_m = [0.0, 0.0, 0.0]
axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
"""
WARM_PACKET = """name = "warm"
array = "one_warm_chip.toml"
clock_hz = 1e6
no_temperature = -999
[stream]
kind = "packet"
checksum = "sum8"
[[stream.fields]]
name = "sync"
type = "u8"
value = [170]
[[stream.fields]]
name = "time"
type = "u32"
[[stream.fields]]
name = "counts"
type = "i16"
count = 3
[[stream.fields]]
name = "temperature"
type = "i16"
"""


@pytest.fixture
def warm_files(tmp_path):
    (tmp_path / "warm_chip.toml").write_text(MPU_PART)
    (tmp_path / "one_warm_chip.toml").write_text(ONE_WARM_CHIP)
    return tmp_path


def test_a_packet_s_temperature_is_scaled_by_the_part(warm_files) -> None:
    (warm_files / "warm.toml").write_text(WARM_PACKET)
    raw = [150, -999, 148]
    stream = b""
    for k, count in enumerate(raw):
        body = struct.pack("<BI3hh", 170, 1000 * k, 1, 2, 3, count)
        stream += body + bytes([sum(body) & 0xFF])
    samples, _ = decoded(warm_files / "warm.toml", stream, step=5)
    np.testing.assert_allclose(samples.temperature_degC, [25.0, np.nan, 26.0])  # 100 - 0.5 per count


def test_a_temperature_in_degrees_or_in_counts_of_the_part_on_a_line(warm_files) -> None:
    head = 'name = "l"\narray = "one_warm_chip.toml"\nclock_hz = 1e6\n'
    stream = (
        '[stream]\nkind = "text"\ncolumns = ["time", "a11", "a12", "a13", "temperature"]\noptional = ["temperature"]\n'
    )
    lines = b"1000,1,2,3,150\n2000,1,2,3\n3000,1,2,3,148\n"
    (warm_files / "raw.toml").write_text(head + stream)
    (warm_files / "si.toml").write_text(head + 'unit = "m_s2"\n' + stream)
    np.testing.assert_allclose(decoded(warm_files / "raw.toml", lines)[0].temperature_degC, [25.0, np.nan, 26.0])
    np.testing.assert_allclose(decoded(warm_files / "si.toml", lines)[0].temperature_degC, [150.0, np.nan, 148.0])


def test_a_part_without_a_temperature_needs_its_figures_in_the_format(tmp_path) -> None:
    text = WARM_PACKET.replace("one_warm_chip.toml", "one_adxl345")
    (tmp_path / "warm.toml").write_text(text)
    with pytest.raises(InputError, match="temperature_lsb_K and temperature_zero_degC: part 'adxl345' states none"):
        load_format(tmp_path / "warm.toml")
    (tmp_path / "warm.toml").write_text(
        text.replace("no_temp", "temperature_lsb_K = 1.0\ntemperature_zero_degC = 0.0\nno_temp")
    )
    assert load_format(tmp_path / "warm.toml").temperature is not None


def test_a_sketch_of_twelve_counts_may_add_the_temperature() -> None:
    counts = ",".join(map(str, range(12)))
    stream = f"1000,{counts}\r\n2250,{counts},24.81\r\n".encode()
    samples, decoder = decoded("arduino_csv", stream)
    assert decoder.counts.samples == 2
    np.testing.assert_allclose(samples.temperature_degC, [np.nan, 24.81])


def test_optional_columns_are_the_last_ones(tmp_path) -> None:
    (tmp_path / "f.toml").write_text(
        'name = "f"\narray = "one_adxl345"\nclock_hz = 1e6\n[stream]\nkind = "text"\n'
        'columns = ["time", "temperature", "a11", "a12", "a13"]\noptional = ["temperature"]\n'
    )
    with pytest.raises(InputError, match="optional temperature: name the last of the columns"):
        load_format(tmp_path / "f.toml")


def test_a_format_with_an_array_file_of_its_own_is_recorded_with_it(warm_files) -> None:
    from gfimu import BoardSettings
    from gfimu import record as record_command

    (warm_files / "warm.toml").write_text(WARM_PACKET)
    port = TcpPort(0)
    stream = b""
    for k in range(100):
        body = struct.pack("<BI3hh", 170, 10_000 * k, 1, 2, 2048 + k % 3, 150)
        stream += body + bytes([sum(body) & 0xFF])

    def send() -> None:
        while port._host is None:
            port.read()
            time.sleep(0.01)
        time.sleep(0.3)  # pyserial empties its input when it opens a port
        port.write(stream, 5.0)

    thread = threading.Thread(target=send)
    thread.start()
    report = record_command(
        port.name, warm_files / "run.csv", duration=0.9, board=BoardSettings(form=str(warm_files / "warm.toml"))
    )
    thread.join()
    port.close()
    assert (report.array, report.array_stated_by) == ("one_warm_chip", "format")
    assert report.temperature_degC == (25.0, 25.0)
