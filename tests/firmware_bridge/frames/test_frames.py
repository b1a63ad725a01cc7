"""Frame formats: nothing invented, nothing whole lost, the same samples however the stream is cut."""

from __future__ import annotations

import gzip
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_bridge import (
    FORMATS,
    LPC1768_DTYPE,
    FrameType,
    SampleDecoder,
    Samples,
    Status,
    crc16,
    crc16_rows,
    encode_samples,
    frame_format,
    parse_message,
)
from gfimu import InputError, read_mimu4444
from tests.firmware_bridge.made_frames import encode_message

FRAME = LPC1768_DTYPE.itemsize


def stream_of(n: int, *, seed: int = 0, start: int = 0, period: int = 1250) -> tuple[bytes, np.ndarray]:
    counts = np.random.default_rng(seed).integers(-4096, 4096, (n, 12))
    number = np.arange(start, start + n)
    return encode_samples(number, number * period, counts), counts


def byte_loop(stream: bytes) -> tuple[list[bytes], int, int]:
    """The rule of the format, one byte at a time: accepted frames, corrupt places, skipped bytes."""
    frames, corrupt, skipped, i = [], 0, 0, 0
    while i < len(stream):
        window = stream[i : i + FRAME]
        if len(window) == FRAME and window[:3] == b"\xa5\x5a\x01":
            if crc16(window[:-2]) == int.from_bytes(window[-2:], "little"):
                frames.append(window)
                i += FRAME
                continue
            corrupt += 1
        skipped += 1
        i += 1
    return frames, corrupt, skipped


def follows(earlier: bytes, later: bytes) -> bool:
    step = (int.from_bytes(later[4:6], "little") - int.from_bytes(earlier[4:6], "little")) % 2**16
    span = (int.from_bytes(later[6:10], "little") - int.from_bytes(earlier[6:10], "little")) % 2**32
    return 1 <= step <= 16 and 0 < span <= step * 110_000  # 10 Hz at the slowest, and a tenth more


def confirmed(frames: list[bytes], *, at_start: bool) -> list[bytes]:
    """The rule beside the checksum: a sample passes if it follows the last that passed, or the next follows it."""
    passed = []
    for k, frame in enumerate(frames):
        goes_on = bool(passed) and follows(passed[-1], frame)
        is_followed = k + 1 < len(frames) and follows(frame, frames[k + 1])
        is_following = k > 0 and follows(frames[k - 1], frame) and (k == 1 or frames[k - 1] in passed)
        if goes_on or is_followed or is_following or (k == 0 and at_start):
            passed.append(frame)
    return passed


def decode_in_chunks(stream: bytes, cuts: list[int]) -> tuple[Samples, SampleDecoder]:
    decoder = SampleDecoder()
    edges = [0, *sorted(cut % (len(stream) + 1) for cut in cuts), len(stream)]
    parts = [decoder.feed(stream[a:b]) for a, b in itertools.pairwise(edges)]
    decoder.finish()
    return Samples.join(parts), decoder


def test_frame_has_the_documented_bytes() -> None:
    frame = encode_samples([0x0102], [0x03040506], [list(range(1, 13))], [0x1001], [25])
    body = "a55a 01 01 0201 06050403" + "".join(f"{k:02x}00" for k in range(1, 13)) + "0110 1900"
    assert frame[:-2] == bytes.fromhex(body)
    assert len(frame) == 40
    assert frame[-2:] == crc16(frame[:-2]).to_bytes(2, "little")


def test_crc_is_ccitt_false() -> None:
    assert crc16(b"123456789") == 0x29B1  # check value of CRC-16/CCITT-FALSE (CRC catalogue, IBM-3740)
    rows = np.random.default_rng(5).integers(0, 256, (3000, 38), dtype=np.uint8)
    assert crc16_rows(rows).tolist() == [crc16(row.tobytes()) for row in rows]


def test_bandwidth_at_3200_hz_fits_the_line() -> None:
    assert FRAME * 10 * 3200 < 1_562_500


@settings(max_examples=60, deadline=None)
@given(
    pieces=st.lists(
        st.one_of(
            st.binary(max_size=60),
            st.integers(1, 4).map(lambda n: stream_of(n, seed=n)[0]),
            st.integers(0, 39).map(lambda n: stream_of(1)[0][:n]),
            st.integers(0, 39).map(lambda n: stream_of(1)[0][n:]),
            st.just(b"\xa5\x5a\x01\x01"),
        ),
        max_size=8,
    ),
    cuts=st.lists(st.integers(0, 1000), max_size=12),
)
def test_decoder_equals_the_byte_loop_for_any_chunking(pieces: list[bytes], cuts: list[int]) -> None:
    stream = b"".join(pieces)
    frames, corrupt, skipped = byte_loop(stream)
    whole, decoder = decode_in_chunks(stream, cuts)
    passed = confirmed(frames, at_start=bool(frames) and stream.startswith(frames[0]))
    assert np.array_equal(whole.counts, np.frombuffer(b"".join(passed), LPC1768_DTYPE)["counts"])
    assert decoder.counts.samples + decoder.counts.unconfirmed == len(frames)
    assert (decoder.counts.corrupt, decoder.counts.skipped_bytes) == (corrupt, skipped)
    at_once, other = decode_in_chunks(stream, [])
    for name in ("ticks", "lost_before", "segment", "status", "sequence"):
        assert np.array_equal(getattr(whole, name), getattr(at_once, name)), name
    assert other.counts == decoder.counts


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), flips=st.integers(0, 40), removals=st.integers(0, 3))
def test_damage_never_invents_a_sample_and_loses_nothing_whole(seed: int, flips: int, removals: int) -> None:
    rng = np.random.default_rng(seed)
    stream, counts = stream_of(200, seed=seed)
    damaged = np.frombuffer(stream, np.uint8).copy()
    flipped = rng.integers(0, len(damaged), flips)
    damaged[flipped] ^= (1 << rng.integers(0, 8, flips)).astype(np.uint8)
    keep = np.ones(len(damaged), dtype=bool)
    for start in rng.integers(0, len(damaged), removals):
        keep[start : start + rng.integers(1, 100)] = False
    changed = (damaged != np.frombuffer(stream, np.uint8)) | ~keep
    whole = ~changed.reshape(200, FRAME).any(axis=1)
    samples, decoder = decode_in_chunks(damaged[keep].tobytes(), rng.integers(0, 8000, 9).tolist())
    assert np.array_equal(samples.counts, counts[whole])
    gaps_inside = np.diff(np.flatnonzero(whole)) - 1
    assert decoder.counts.lost == gaps_inside.sum()


def test_junk_with_a_right_checksum_is_no_sample() -> None:
    rng = np.random.default_rng(3)
    real = np.frombuffer(stream_of(2000)[0], np.uint8).reshape(-1, FRAME)
    junk = np.frombuffer(
        encode_samples(
            rng.integers(0, 2**16, 2000), rng.integers(0, 2**32, 2000), rng.integers(-4096, 4096, (2000, 12))
        ),
        np.uint8,
    ).reshape(-1, FRAME)  # each of them passed the checksum: 10^8 candidates give as many
    mixed = real[:2].tobytes() + np.stack([real[2:], junk[2:]], axis=1).tobytes()
    for stream, samples, refused in ((junk.tobytes(), 0, 2000), (mixed, 2000, 1998)):
        _, decoder = decode_in_chunks(b"\x00" + stream, [1001, 40_007])
        counts = decoder.counts
        assert (counts.samples, counts.unconfirmed, counts.restarts, counts.lost) == (samples, refused, 0, 0)


def test_junk_with_a_right_checksum_is_no_message() -> None:
    rng = np.random.default_rng(4)
    for kind in (FrameType.IDENTITY, FrameType.REPLY):
        for _ in range(2000):
            frame = encode_message(kind, int(rng.integers(2**16)), int(rng.integers(2**32)), rng.bytes(24))
            packet = np.frombuffer(frame, LPC1768_DTYPE)[0].copy()
            assert parse_message(packet) is None  # whatever the bytes below are
            packet["status"], packet["temperature"] = rng.integers(0, 2**16), rng.integers(-(2**15), 2**15)
            assert parse_message(packet) is None


def test_time_and_sequence_unwrap() -> None:
    n = 70_000  # the sequence number wraps after 65,536, the time stamp after 71.6 min
    number = np.arange(n)
    time = 4_294_000_000 + number * 10_000
    samples, decoder = decode_in_chunks(encode_samples(number, time, np.zeros((n, 12))), [77, 4001])
    assert decoder.counts.lost == 0
    assert decoder.counts.restarts == 0
    assert np.array_equal(np.diff(samples.ticks), np.full(n - 1, 10_000))


def test_gap_longer_than_the_sequence_number_is_counted_by_the_clock() -> None:
    number = np.concatenate([np.arange(100), np.arange(200_100, 200_200)])
    _, decoder = decode_in_chunks(encode_samples(number, number * 312, np.zeros((200, 12))), [])
    assert decoder.counts.lost == 200_000


@pytest.mark.parametrize("flag", [0, Status.FIRST])
def test_restart_of_the_board_begins_a_segment_and_invents_no_loss(flag: int) -> None:
    one, _ = stream_of(500, start=30_000)
    status = np.zeros(300, dtype=int)
    status[0] = flag
    two = encode_samples(np.arange(300), np.arange(300) * 1250, np.zeros((300, 12)), status)
    samples, decoder = decode_in_chunks(one + two, [40 * 499 + 3])
    assert decoder.counts.restarts == 1
    assert decoder.counts.lost == 0
    assert samples.segment.tolist() == [0] * 500 + [1] * 300
    assert samples.ticks[500] == 0


def test_messages_are_kept_apart_from_samples() -> None:
    one, _ = stream_of(3)
    decoder = SampleDecoder()
    samples = decoder.feed(one + encode_message(FrameType.REPLY, 0, 5, b"hello") + stream_of(2, start=3)[0])
    assert len(samples) == 5
    assert decoder.counts.messages == 1
    assert decoder.messages[0]["counts"].tobytes().startswith(b"hello")


def test_mimu4444_format_agrees_with_the_importer(shared_data) -> None:
    path = shared_data / "mimu4444" / "exp_1.bin.gz"
    decoder = SampleDecoder("mimu4444")
    stream = gzip.decompress(path.read_bytes())
    parts = [decoder.feed(stream[a : a + 65_537]) for a in range(0, len(stream), 65_537)]
    samples = Samples.join(parts)
    recording = read_mimu4444(path)
    assert decoder.counts.lost == decoder.counts.corrupt == 0
    assert decoder.counts.skipped_bytes == 4  # the acknowledge
    assert np.allclose((samples.ticks - samples.ticks[0]) / FORMATS["mimu4444"].clock_hz, recording.t_s, atol=1e-9)
    scale = recording.readings[:, 0][samples.counts[:, 0] != 0] / samples.counts[:, 0][samples.counts[:, 0] != 0]
    assert np.allclose(recording.readings, samples.counts * np.median(scale))


def test_unknown_format_lists_the_formats() -> None:
    with pytest.raises(InputError, match="lpc1768, mimu4444"):
        frame_format("mavlink")
