"""A look at a recording while it is made: it never delays the recording, follows gaps, and survives its viewer."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest
from numpy.testing import assert_allclose

from firmware_bridge.frames.decoder import StreamCounts
from firmware_bridge.host import live
from firmware_bridge.host.live import LiveView
from firmware_bridge.host.recorder import Batch
from firmware_bridge.host.stream_meter import GroupMeans, StreamMeter
from gfimu import AccelerometerArray, LiveRateFilter, SensorErrors
from gfimu.rate import HealthCode
from gfimu.rate.health.live import background
from gfimu.rate.health.live.background import BackgroundFilter

CUBE = AccelerometerArray.load("cube12")
COUNTS = StreamCounts(0, 0, 2, 1, 0, 0)


def rest(count: int, rate: float, seed: int = 0):
    """Times (n,) and readings (n, 12), m/s², of a body at rest with noise of 0.04 m/s²."""
    chance = np.random.default_rng(seed)
    t = np.arange(count) / rate
    return t, 9.81 * CUBE.axes[:, 2] + chance.normal(0.0, 0.04, (count, 12))


def batches(t, readings, size: int):
    for first in range(0, len(t), size):
        part = slice(first, first + size)
        yield Batch(t[part], readings[part], np.zeros(len(t[part]), dtype=np.uint16))


class Picture:
    """Keeps the blocks that it is given."""

    def __init__(self):
        self.blocks = []

    def open(self, _stream):
        return self

    def add(self, block):
        self.blocks.append(block)


@pytest.fixture
def viewer(monkeypatch):
    """A viewer that is there until ``viewer.closed`` is set."""

    class Closed:
        def flush(self, timeout_sec):
            raise RuntimeError

    class Viewer:
        closed = threading.Event()

        def viewer_stream(self, _application):
            return Closed()

        def viewer_listens(self):
            return not self.closed.is_set()

    monkeypatch.setattr(live, "_VIEWER_EVERY_S", 0.0)
    return Viewer()


def test_a_viewer_that_is_closed_is_one_sentence_and_the_file_goes_on(viewer, tmp_path):
    notes, picture = [], Picture()
    view = LiveView(CUBE, 1.0, on_note=notes.append, rrd=tmp_path / "x.rrd", viewer=viewer, picture=picture)
    parts = list(batches(*rest(200, 100.0), 10))
    for batch in parts[:10]:
        view(batch, COUNTS)
    time.sleep(3 * live._LOOK_EVERY_S)
    viewer.closed.set()
    for batch in parts[10:]:
        view(batch, COUNTS)
        time.sleep(0.02)
    view.close()
    assert [note for note in notes if "viewer" in note] == ["the viewer was closed; the recording goes on"]
    newest = max(float(block.t_s[-1]) for block in picture.blocks if len(block.t_s))
    assert newest == pytest.approx(1.99)
    assert (tmp_path / "x.rrd").read_bytes()[:3] == b"RRF"


def test_what_is_shown_is_what_the_filter_gives(viewer):
    picture = Picture()
    t, readings = rest(300, 100.0)
    view = LiveView(CUBE, 1.0, viewer=viewer, picture=picture)
    for batch in batches(t, readings, 7):
        view(batch, COUNTS)
    view.close()
    joined = type(picture.blocks[0]).join(picture.blocks)
    assert_allclose(joined.t_s, t)
    expected = LiveRateFilter(CUBE, SensorErrors.from_parts(CUBE, 100.0), 0.01).push(t, readings)
    assert_allclose(joined.omega, expected.omega[: len(joined.omega)], atol=1e-9)
    assert len(joined.omega) >= len(t) - 2
    assert (joined.states[-1].lost, joined.states[-1].corrupt) == (2, 1)
    assert all(len(health.codes) == 12 for health in joined.health)


def test_a_recording_does_not_wait_for_the_compiler(viewer, monkeypatch):
    """The filter stands still as if it were compiled; readings are shown meanwhile, and the rate follows."""
    go = threading.Event()
    push = background.WatchedRateFilter.push

    def waits(self, *arguments):
        go.wait(30.0)
        return push(self, *arguments)

    monkeypatch.setattr(background.WatchedRateFilter, "push", waits)
    monkeypatch.setattr(background, "must_compile", lambda: True)
    monkeypatch.setattr(live, "_TEXT_EVERY_S", 0.0)
    notes, texts, picture = [], [], Picture()
    t, readings = rest(300, 100.0)
    view = LiveView(CUBE, 1.0, on_note=notes.append, on_text=texts.append, viewer=viewer, picture=picture)
    began = time.monotonic()
    for batch in batches(t, readings, 10):
        view(batch, COUNTS)
    assert time.monotonic() - began < 1.0
    end = time.monotonic() + 20.0
    while not (texts and texts[-1].lstrip().startswith("3.0 s")) and time.monotonic() < end:
        view(Batch(t[-1:] + 0.01, readings[-1:], np.zeros(1, dtype=np.uint16)), COUNTS)
        t = t + 0.01
        time.sleep(0.05)
    assert "compiled on first use" in notes[0]
    assert "s behind, being compiled" in texts[-1]
    assert sum(len(block.t_s) for block in picture.blocks) > 250
    assert not sum(len(block.omega) for block in picture.blocks)
    go.set()
    view.close()
    assert sum(len(block.omega) for block in picture.blocks) > 250


def test_a_full_disk_under_the_filter_ends_the_view_and_not_the_recording(viewer, monkeypatch):
    def fails(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(background.WatchedRateFilter, "push", fails)
    said = []
    view = LiveView(CUBE, 1.0, on_fault=said.append, viewer=viewer, picture=Picture())
    for batch in batches(*rest(300, 100.0), 10):
        view(batch, COUNTS)
        time.sleep(0.02)
    view.close()
    assert len(said) == 1
    assert said[0].startswith("the live view ended after")
    assert "No space left" in said[0]


def test_means_are_over_whole_groups_without_gaps():
    means = GroupMeans(4, 0.01, np.full(2, 10.0))
    numbers = np.delete(np.arange(30), [9, 10])  # two are lost within a group
    t, readings = numbers * 0.01, np.column_stack([numbers, -numbers]).astype(float)
    readings[numbers == 17] = np.nan
    found = [means.add(t[part], readings[part]) for part in (slice(0, 3), slice(3, 12), slice(12, 28))]
    times, values = (np.concatenate(parts) for parts in zip(*found, strict=True))
    groups = [range(4), range(4, 8), range(11, 15), range(15, 19), range(19, 23), range(23, 27)]
    assert_allclose(times, [np.mean(group) * 0.01 for group in groups])
    expected = [np.nan if 17 in group else np.mean(group) for group in groups]
    assert_allclose(values, np.column_stack([expected, np.negative(expected)]))
    assert means.saturated.tolist() == [[True, True]] * 4  # of the last block: readings beyond 10


def test_the_meter_counts_by_the_hosts_clock_and_sees_delays():
    meter = StreamMeter()
    for number in range(300):
        late = 0.2 if number == 299 else 0.0
        meter.add(np.array([5.0 + number * 0.01]), COUNTS, 100.0 + number * 0.02 + late)  # half as fast as it should
    state = meter.state(0.5)
    assert state.rate_hz == pytest.approx(50.0, rel=0.2)
    assert state.delay_s == pytest.approx(0.2 + 299 * 0.01, abs=0.02)  # the clocks part by 10 ms per sample
    assert (state.t_s, state.lost, state.corrupt, state.behind_s) == (pytest.approx(7.99), 2, 1, 0.5)
    assert meter.elapsed_s == pytest.approx(2.99)


def test_missing_and_saturated_channels_say_so_and_are_not_used():
    t, readings = rest(60, 100.0)
    saturated = np.zeros(readings.shape, dtype=np.bool_)
    readings[10:, 3] = np.nan
    saturated[:, 5] = True
    readings[:, 5] = 1e4
    work = BackgroundFilter(CUBE, 100.0)
    work.push(t, readings, saturated)
    work.finish()
    codes = work.take()[0].health.codes
    assert codes[3] is HealthCode.MISSING
    assert codes[5] is HealthCode.SATURATED
    assert codes[0] is None  # nothing is watched yet
    assert work.behind_s == 0.0


def test_an_abandoned_filter_lets_go_at_once(monkeypatch):
    stopped = threading.Event()
    monkeypatch.setattr(background.WatchedRateFilter, "push", lambda *_: stopped.wait(30.0))
    work = BackgroundFilter(CUBE, 100.0)
    work.push(*rest(10, 100.0), np.zeros((10, 12), dtype=np.bool_))
    threading.Timer(0.2, work.abandon).start()
    began = time.monotonic()
    work.finish()
    assert time.monotonic() - began < 5.0
    stopped.set()
