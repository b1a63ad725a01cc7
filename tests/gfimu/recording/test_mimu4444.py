"""The MIMU4444 importer against packets built here, byte by byte, and against the measured streams."""

import gzip
import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gfimu import AccelerometerArray, InputError, open_recording, read_mimu4444
from gfimu.base import STANDARD_GRAVITY
from gfimu.recording import is_mimu4444

ACKNOWLEDGE = bytes.fromhex("A02800C8")
PERIOD = 1_024_000  # ticks of 64 MHz: 16 ms


def packet(number, ticks, counts):
    body = struct.pack(">BHBI48h", 0xAA, number % 65536, 0x64, ticks % 2**32, *np.ravel(counts))
    return body + struct.pack(">H", sum(body) % 65536)


def counts(n, seed=0):
    return np.random.default_rng(seed).integers(-9000, 9000, size=(n, 8, 6))


def packets(values, *, first_number=0, first_tick=0):
    return [packet(first_number + k, first_tick + k * PERIOD, value) for k, value in enumerate(values)]


def write(folder, content, name="run.bin"):
    file = folder / name
    file.write_bytes(gzip.compress(content) if name.endswith(".gz") else content)
    return file


@pytest.mark.parametrize("name", ["run.bin", "run.bin.gz"])
@pytest.mark.parametrize("acknowledge", [ACKNOWLEDGE, b""])
def test_fields(tmp_path, name, acknowledge):
    values = counts(20)
    file = write(tmp_path, acknowledge + b"".join(packets(values)), name)
    assert is_mimu4444(file)
    run = read_mimu4444(file)
    np.testing.assert_allclose(run.t_s, np.arange(20) * 0.016, rtol=1e-12)
    np.testing.assert_allclose(
        run.for_array(AccelerometerArray.load("mimu4444")),
        values[:, :, :3].reshape(20, 24) / 2048 * STANDARD_GRAVITY,
        rtol=1e-9,
    )
    assert {key: run.metadata[key] for key in ("packets", "packets_missing", "packets_corrupt", "bytes_skipped")} == {
        "packets": 20,
        "packets_missing": 0,
        "packets_corrupt": 0,
        "bytes_skipped": 0,
    }
    assert run.metadata["array_toml"] == run.array.to_toml() == AccelerometerArray.load("mimu4444").to_toml()


def test_gyros_in_board_axes(tmp_path):
    # v_board = C v_chip for the chips turned over, and v_chip = v_board for the others (the data set's description).
    turned_over = np.array([[0, -1, 0], [-1, 0, 0], [0, 0, -1]])
    board = np.array([100.0, -200.0, 300.0])
    value = np.zeros((8, 6))
    value[0::2, 3:] = board
    value[1::2, 3:] = turned_over.T @ board
    run = read_mimu4444(write(tmp_path, b"".join(packets([value.astype(int)] * 3))))
    expected = np.radians(board / 16.4)
    for place, axis in enumerate("xyz"):
        np.testing.assert_allclose(run.reference[f"gyro_{axis}_rad_s"], expected[place])
        for chip in range(1, 9):
            np.testing.assert_allclose(run.extra[f"m{chip}_gyro_{axis}_rad_s"], expected[place])


@pytest.mark.parametrize("limit", [32767, -32768])
def test_gyro_at_full_scale_is_missing(tmp_path, limit):
    values = counts(3)
    values[1, 1, 3] = limit  # chip 2, its x-axis: along −y of the board
    run = read_mimu4444(write(tmp_path, b"".join(packets(values))))
    assert np.isnan(run.reference["gyro_y_rad_s"]).tolist() == [False, True, False]
    assert np.isnan(run.extra["m2_gyro_y_rad_s"]).tolist() == [False, True, False]
    others = [name for name in (*run.extra, *run.reference) if name not in {"gyro_y_rad_s", "m2_gyro_y_rad_s"}]
    assert all(np.isfinite((run.extra | run.reference)[name]).all() for name in others)


def test_clock_and_number_wrap(tmp_path):
    stream = b"".join(packets(counts(50), first_number=65530, first_tick=2**32 - 10 * PERIOD))
    run = read_mimu4444(write(tmp_path, stream))
    np.testing.assert_allclose(np.diff(run.t_s), 0.016, rtol=1e-9)
    assert run.metadata["packets_missing"] == 0


def test_lost_packets_leave_a_gap(tmp_path):
    sent = packets(counts(40))
    run = read_mimu4444(write(tmp_path, ACKNOWLEDGE + b"".join(sent[:10] + sent[14:])))
    assert run.gaps.tolist() == [9]
    assert run.metadata["packets_missing"] == 4
    assert run.metadata["packets_corrupt"] == 0


@pytest.mark.parametrize("place", [0, 1, 3, 5, 50, 104, 105])
def test_a_corrupt_byte_costs_one_packet(tmp_path, place):
    sent = packets(counts(10))
    damaged = bytearray(sent[4])
    damaged[place] ^= 0x15
    run = read_mimu4444(write(tmp_path, ACKNOWLEDGE + b"".join([*sent[:4], bytes(damaged), *sent[5:]])))
    assert len(run) == 9
    np.testing.assert_allclose(run.t_s, np.delete(np.arange(10) * 0.016, 4), rtol=1e-12)
    assert (run.metadata["packets_corrupt"], run.metadata["bytes_skipped"]) == (1, 106)
    assert run.metadata["packets_missing"] == 1


def test_repeated_packet_counts_once(tmp_path):
    sent = packets(counts(5))
    run = read_mimu4444(write(tmp_path, b"".join([*sent[:3], sent[2], *sent[3:]])))
    assert len(run) == 5
    assert run.metadata["packets_missing"] == 0


def test_packet_inside_a_packet_is_data(tmp_path):
    # A whole valid packet hidden across two true ones: its start lies in the first one's readings.
    outer = counts(3)
    first, second, third = packets(outer)
    inner = bytearray(packet(7, 0, counts(1, seed=5)[0]))
    hidden = bytearray(first)
    hidden[60:104] = inner[:44]
    hidden[104:] = struct.pack(">H", sum(hidden[:104]) % 65536)
    tail = bytearray(inner[44:])
    tail[0:2] = hidden[104:]
    tail[2 : len(tail) - 2] = second[: len(tail) - 4]
    inner = hidden[60:104] + tail
    inner[104:] = struct.pack(">H", sum(inner[:104]) % 65536)
    second = bytearray(second)
    overlap = 106 - 46  # bytes of the hidden packet that lie in the second true one
    second[overlap - 2 : overlap] = inner[104:]
    second[104:] = struct.pack(">H", sum(second[:104]) % 65536)
    stream = bytes(hidden) + bytes(second) + third
    assert sum(stream[60:164]) % 65536 == struct.unpack(">H", stream[164:166])[0], "the hidden packet is not valid"
    run = read_mimu4444(write(tmp_path, stream))
    np.testing.assert_allclose(run.t_s, [0.0, 0.016, 0.032])
    assert run.metadata["bytes_skipped"] == 0


@given(
    junk=st.lists(st.binary(max_size=80), min_size=6, max_size=6),
    cut=st.integers(0, 105),
)
def test_every_whole_packet_is_found_among_junk(tmp_path_factory, junk, cut):
    sent = packets(counts(5, seed=2))
    stream = ACKNOWLEDGE + b"".join(noise + whole for noise, whole in zip(junk, sent, strict=False)) + junk[5]
    stream += packet(99, 99 * PERIOD, counts(1)[0])[:cut]
    run = read_mimu4444(write(tmp_path_factory.mktemp("junk"), stream))
    np.testing.assert_allclose(run.t_s, np.arange(5) * 0.016, rtol=1e-12)
    assert run.metadata["bytes_skipped"] == sum(map(len, junk)) + cut


@pytest.mark.parametrize(
    ("content", "name", "message"),
    [
        (b"", "run.bin", "no valid MIMU4444 packet"),
        (ACKNOWLEDGE, "run.bin", "no valid MIMU4444 packet"),
        (bytes(5000), "run.bin", "no valid MIMU4444 packet"),
        (packet(0, 0, counts(1)[0])[:-1], "run.bin", "no valid MIMU4444 packet"),
    ],
)
def test_streams_without_a_packet(tmp_path, content, name, message):
    with pytest.raises(InputError, match=message):
        read_mimu4444(write(tmp_path, content, name))


def test_cut_off_gzip_and_missing_file(tmp_path):
    file = write(tmp_path, ACKNOWLEDGE + b"".join(packets(counts(200))), "run.bin.gz")
    file.write_bytes(file.read_bytes()[:3000])
    assert is_mimu4444(file)
    with pytest.raises(InputError, match="damaged gzip file"):
        open_recording(file)
    with pytest.raises(InputError, match="no such file"):
        read_mimu4444(tmp_path / "nothing.bin")


@pytest.mark.parametrize(
    ("number", "samples", "skipped"),
    [(1, 37439, 83), (2, 39301, 0)],  # the first stream ends inside a packet
)
def test_measured_stream(shared_data, number, samples, skipped):
    run = open_recording(shared_data / "mimu4444" / f"exp_{number}.bin.gz")
    assert len(run) == samples
    assert run.metadata["packets_missing"] == 0
    assert run.metadata["bytes_skipped"] == skipped
    assert run.sample_rate == pytest.approx(62.5, rel=1e-9)
    assert len(run.gaps) == 0
    still = run.readings[:60].reshape(60, 8, 3).mean(axis=0)
    # Each chip reads 1 g at rest within its zero-g and sensitivity tolerance (150 mg and 3 %).
    np.testing.assert_allclose(np.linalg.norm(still, axis=1), STANDARD_GRAVITY, rtol=0.15)
    gyro = np.column_stack([run.reference[f"gyro_{axis}_rad_s"] for axis in "xyz"])
    moving = np.linalg.norm(gyro, axis=1) > math.radians(100)
    # The data set's description: the fastest per cent is at about 2600 °/s, 3 % of the samples saturate.
    assert 0.02 < np.isnan(gyro).any(axis=1).mean() < 0.04
    assert 1000 < np.degrees(np.median(np.linalg.norm(gyro[moving], axis=1))) < 2000
