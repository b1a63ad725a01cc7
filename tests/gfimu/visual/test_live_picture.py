"""The picture of a recording while it is made: what is in it, at which pace it is sent, and what the layout shows."""

from __future__ import annotations

import numpy as np
import pytest
import rerun.blueprint as rrb
from numpy.testing import assert_allclose
from rerun.chunk import RrdReader
from scipy.spatial.transform import Rotation

from firmware_bridge.frames.decoder import StreamCounts
from firmware_bridge.host import live
from firmware_bridge.host.live import LiveView
from firmware_bridge.host.recorder import Batch
from gfimu import AccelerometerArray, specific_force
from gfimu.base import STANDARD_GRAVITY, chip_colour
from gfimu.rate import HealthCode
from gfimu.rate.health.live.block import Event, Health, LiveBlock, StreamState
from gfimu.visual.colours import HEALTH
from gfimu.visual.live import LivePicture
from gfimu.visual.live_drawing import LiveDrawing

COUNTS = StreamCounts(0, 0, 0, 0, 0, 0)
CUBE = AccelerometerArray.load("cube12")


def content(file) -> dict[str, dict[str, list]]:
    """Columns of every entity of a rerun recording; ``chunks``: the number of pieces in which they came."""
    found: dict[str, dict[str, list]] = {}
    for chunk in RrdReader(str(file)).stream().to_chunks():
        batch = chunk.to_record_batch()
        columns = found.setdefault(chunk.entity_path, {"chunks": []})
        columns["chunks"].append(len(batch))
        for column, values in zip(batch.schema.names, batch.columns, strict=True):
            if column not in ("rerun.controls.RowId", "log_time", "log_tick"):
                columns.setdefault(column.split(":")[-1], []).extend(values.to_pylist())
    return found


def batches(array: AccelerometerArray, rate: int, seconds: float, readings, size: int = 10):
    """Batches of a stream of constant readings (c,), in counts of 1 m/s²."""
    t = np.arange(round(rate * seconds)) / rate
    for first in range(0, len(t), size):
        part = t[first : first + size]
        yield Batch(part, np.tile(readings, (len(part), 1)), np.zeros(len(part), dtype=np.uint16))


def recorded(tmp_path, name: str, texts: list[str]) -> dict[str, dict[str, list]]:
    """Columns of every entity of the live picture of an array for a second, with channels that read 1 m/s² and more."""
    array = AccelerometerArray.load(name)
    view = LiveView(array, 1.0, on_text=texts.append, rrd=tmp_path / "live.rrd", picture=LivePicture(array))
    for batch in batches(array, 100, 1.0, 1.0 + np.arange(array.n_channels)):
        view(batch, COUNTS)
    view.close()
    return content(tmp_path / "live.rrd")


@pytest.mark.parametrize("name", ["cube12", "mimu4444", "one_chip"])
def test_the_array_of_the_board_is_drawn_with_its_channels(tmp_path, name):
    found = recorded(tmp_path, name, [])
    array = AccelerometerArray.load(name)
    arrows = found["/scene/array/specific_force"]
    assert_allclose(arrows["origins"][0], array.chip_positions, atol=1e-7)
    vectors = np.array(arrows["vectors"][0])[array.chip_of_channel]
    lengths = np.einsum("ck,ck->c", vectors, array.axes)  # along each sensing axis
    assert_allclose(lengths / lengths[0], 1.0 + np.arange(array.n_channels), rtol=1e-5)
    number = 0
    for axis in range(3):
        line = found[f"/readings/axis_{axis + 1}"]
        assert line["names"][0] == [chip.channels[axis] for chip in array.chips]
        assert len(line["scalars"]) == 100 + line["scalars"].count(None)
        for chip, colour in enumerate(line["colors"][0]):
            red, green, blue = chip_colour(chip)
            assert colour == (red << 24) | (green << 16) | (blue << 8) | 255
            number += 1
    assert number == array.n_channels
    assert all(f"| {chip.name} |" in str(found["/notes"]["text"]) for chip in array.chips)


def test_an_array_that_sees_no_rate_is_shown_and_said_so(tmp_path):
    texts: list[str] = []
    found = recorded(tmp_path, "one_chip", texts)
    assert not [name for name in found if name.startswith(("/rate", "/health"))]
    assert "no rate: array 'one_chip'" in texts[0]
    assert "no rate: array 'one_chip'" in str(found["/events"]["text"])


def test_everything_is_on_one_timeline_with_the_layout(tmp_path):
    found = recorded(tmp_path, "cube12", [])
    moving = {name: columns for name, columns in found.items() if "time" in columns}
    assert {name.split("/")[1] for name in moving} == {"rate", "health", "readings", "scene", "stream", "events"}
    axes = {f"/rate/omega_{axis}/{what}" for axis in "xyz" for what in ("band", "estimate")}
    assert axes | {"/rate/sign_probability", "/scene/array"} <= set(moving)
    assert {f"/health/{channel}" for channel in CUBE.channels} <= set(moving)
    assert {f"/stream/{name}" for name in ("sample_rate", "missing", "delay")} <= set(moving)
    assert "100 samples per second" in found["/events"]["text"][0][0]


def views(container) -> list[rrb.View]:
    """Views inside a container of a blueprint."""
    inside = getattr(container, "contents", [])
    if isinstance(container, rrb.View):
        return [container]
    return [view for one in inside for view in views(one)]


def test_the_layout_shows_what_is_sent_and_follows_it(tmp_path):
    found = recorded(tmp_path, "cube12", [])
    layout = LivePicture(CUBE).blueprint()
    shown = views(layout.root_container)
    for view in shown:
        inside = view.contents if isinstance(view.contents, list) else [f"{view.origin}/"]
        for path in inside:
            assert [name for name in found if f"{name}/".startswith(path.rstrip("/") + "/")], (view.name, path)
    lanes = [path for view in shown if isinstance(view, rrb.StateTimelineView) for path in view.contents]
    assert lanes == [f"/health/{channel}" for channel in CUBE.channels]
    names = " ".join(view.name for view in shown)
    for unit in ("ω x with ±2σ, rad/s", "m/s²", "sample rate, Hz", "delay, s", "sign of ω, probability"):
        assert unit in names
    plots = [view for view in shown if isinstance(view, rrb.TimeSeriesView)]
    for plot in plots:
        window = plot.properties["TimeAxis"].view_range.as_arrow_array().to_pylist()[0]
        assert (window["start"], window["end"]) == (-30_000_000_000, 0)
    assert len(plots) == 10


def test_pieces_are_few_however_small_the_batches(tmp_path, monkeypatch):
    """A file gets a piece a second per entity, though every sample came by itself."""
    clock = [0.0]
    monkeypatch.setattr(live.time, "monotonic", lambda: clock[0])
    drawn = []

    class Drawing:
        def add(self, block):
            drawn.append(block)

    sink = live._Sink(Drawing(), 1.0)
    for batch in batches(CUBE, 100, 10.0, np.zeros(12), size=1):
        clock[0] = float(batch.t_s[0])
        sink.add(LiveBlock.of(batch.t_s, batch.counts))
    sink.flush()
    assert len(drawn) <= 11
    assert_allclose(np.concatenate([block.t_s for block in drawn]), np.arange(1000) / 100)


def test_a_fast_stream_is_shown_as_means(tmp_path):
    view = LiveView(CUBE, 1.0, rrd=tmp_path / "live.rrd", picture=LivePicture(CUBE))
    for batch in batches(CUBE, 3200, 1.0, np.arange(12.0), size=64):
        view(batch, COUNTS)
    view.close()
    found = content(tmp_path / "live.rrd")
    rows = [row for row in found["/readings/axis_1"]["scalars"] if row and np.isfinite(row).all()]
    assert len(rows) == 100
    assert_allclose(rows[0], [0.0, 3.0, 6.0, 9.0])
    assert "means of 32" in str(found["/events"]["text"])


class Stream:
    """Keeps what would be sent."""

    def __init__(self):
        self.sent = {}

    def send_columns(self, entity, indexes, columns):
        t = [value.as_py().total_seconds() for value in indexes[0].as_arrow_array()]
        for column in columns:
            name = str(column.component_descriptor()).split(":")[-1]
            rows = self.sent.setdefault(entity, {}).setdefault(name, [])
            rows += list(zip(t, column.as_arrow_array().to_pylist(), strict=True))


def block(t, readings, rate_t=(), omega=(), **further) -> LiveBlock:
    """A block of a stream; the rate is known to 0.1 rad/s."""
    rate = np.reshape(omega, (-1, 3)).astype(float)
    return LiveBlock(
        np.asarray(t, float), np.asarray(readings, float), np.asarray(rate_t, float), rate, np.full(rate.shape, 0.1),
        np.ones(len(rate)), **further,
    )  # fmt: skip


def test_a_lane_names_each_change_of_health_once():
    stream = Stream()
    drawing = LiveDrawing(stream, CUBE, 0.01)
    used = (HealthCode.USED,) * 12
    bad = (*used[:6], HealthCode.EXCLUDED, *used[7:])
    missing = (*bad[:9], *[HealthCode.MISSING] * 3)
    steps = [(None,) * 12, used, used, bad, missing, bad]
    health = tuple(Health(float(second), codes) for second, codes in enumerate(steps))
    drawing.add(block([], np.empty((0, 12)), health=health))
    states = {channel: stream.sent[f"health/{channel}"]["state"] for channel in CUBE.channels}
    assert states["a11"] == [(0.0, ["not watched"]), (1.0, ["used"])]
    assert states["a31"] == [(0.0, ["not watched"]), (1.0, ["used"]), (3.0, ["excluded"])]
    assert states["a43"] == [(0.0, ["not watched"]), (1.0, ["used"]), (4.0, ["missing"]), (5.0, ["used"])]
    assert {word for lane in states.values() for _, (word,) in lane} <= set(HEALTH)
    arrows = stream.sent["scene/array/not_used"]["vectors"]
    assert [(t, len(vectors)) for t, vectors in arrows] == [(0.0, 0), (1.0, 0), (3.0, 1), (4.0, 4), (5.0, 1)]
    place = CUBE.index("a31")
    assert np.cross(arrows[2][1][0], CUBE.axes[place]) == pytest.approx(np.zeros(3), abs=1e-6)


def test_the_band_is_two_standard_deviations_and_starts_when_the_biases_are_there():
    stream = Stream()
    drawing = LiveDrawing(stream, CUBE, 0.01)
    t = np.arange(200) / 100.0
    drawing.add(block(t, np.zeros((200, 12)), t, np.tile([0.0, 0.0, 3.0], (200, 1))))
    lines = stream.sent["rate/omega_z/estimate"]["scalars"]
    edges = stream.sent["rate/omega_z/band"]["scalars"]
    drawn = [(at, value) for at, (value,) in lines if np.isfinite(value)]
    assert drawn[0][0] == pytest.approx(1.0, abs=0.011)
    assert_allclose([value for _, value in drawn], 3.0)
    assert_allclose(edges[-1][1], [3.2, 2.8])


def test_lines_break_where_samples_are_lost():
    stream = Stream()
    drawing = LiveDrawing(stream, CUBE, 0.01)
    t = np.arange(20) / 100.0
    for later in (0.0, 0.2, 1.0):
        drawing.add(block(t + later, np.ones((20, 12))))
    rows = stream.sent["readings/axis_1"]["scalars"]
    assert [at for at, row in rows if not np.isfinite(row).all()] == [pytest.approx(0.695)]
    assert len(rows) == 61


def test_the_body_turns_with_the_rate_and_its_tilt_follows_the_specific_force():
    """About a vertical axis, from an attitude tilted by 0.2 rad, with a rate that errs by 0.02 rad/s about x."""
    stream = Stream()
    drawing = LiveDrawing(stream, CUBE, 0.01)
    spin, tilt = 2.0, Rotation.from_rotvec([0.0, 0.2, 0.0])
    t = np.arange(1000) / 100.0
    axis = tilt.inv().apply([0.0, 0.0, 1.0])  # of rotation, body frame
    force = STANDARD_GRAVITY * axis
    readings = specific_force(CUBE, force[None], np.zeros((1, 3)), spin * axis[None])
    for first in range(0, 1000, 10):
        part = t[first : first + 10]
        rate = np.tile(spin * axis + [0.02, 0.0, 0.0], (10, 1))
        drawing.add(block(part, np.tile(readings, (10, 1)), part, rate))
    poses = stream.sent["scene/array"]["quaternion"]
    times = np.array([at for at, _ in poses])
    attitude = Rotation.from_quat([quaternion[0] for _, quaternion in poses])
    assert_allclose(attitude.apply(axis)[times > 0.1], np.tile([0, 0, 1.0], (np.sum(times > 0.1), 1)), atol=0.03)
    turned = (attitude[-1] * attitude[0].inv()).as_rotvec()
    about = (spin + 0.02 * axis[0]) * (times[-1] - times[0])  # with what the error has about the axis
    assert turned[2] == pytest.approx((about + np.pi) % (2 * np.pi) - np.pi, abs=0.01)


def test_a_rate_that_errs_does_not_tip_a_body_at_rest_over():
    """0.05 rad/s about x for 10 s would be 0.5 rad; with a tilt that follows gravity within a second it is 0.05 rad."""
    stream = Stream()
    drawing = LiveDrawing(stream, CUBE, 0.01)
    readings = specific_force(CUBE, [[0.0, 0.0, STANDARD_GRAVITY]], np.zeros((1, 3)), np.zeros((1, 3)))
    t = np.arange(1000) / 100.0
    for first in range(0, 1000, 10):
        part = t[first : first + 10]
        drawing.add(block(part, np.tile(readings, (10, 1)), part, np.tile([0.05, 0.0, 0.0], (10, 1))))
    last = Rotation.from_quat(stream.sent["scene/array"]["quaternion"][-1][1][0])
    assert last.magnitude() == pytest.approx(0.05, rel=0.2)


def test_a_body_on_its_head_is_drawn_so():
    stream = Stream()
    drawing = LiveDrawing(stream, CUBE, 0.01)
    readings = specific_force(CUBE, [[0.0, 0.0, -STANDARD_GRAVITY]], np.zeros((1, 3)), np.zeros((1, 3)))
    drawing.add(block([0.0, 0.01], np.tile(readings, (2, 1)), [0.0, 0.01], np.zeros((2, 3))))
    quaternion = stream.sent["scene/array"]["quaternion"][-1][1][0]
    assert_allclose(Rotation.from_quat(quaternion).apply([0.0, 0.0, -1.0]), [0.0, 0.0, 1.0], atol=1e-6)


def test_the_state_of_the_stream_and_what_happened():
    stream = Stream()
    state = StreamState(4.0, 99.5, 3, 1, 0.02, 0.1)
    events = (Event(1.0, "first sample"), Event(3.0, "a31: step", is_fault=True))
    LiveDrawing(stream, CUBE, 0.01).add(block([], np.empty((0, 12)), states=(state,), events=events))
    assert stream.sent["stream/sample_rate"]["scalars"] == [(4.0, [99.5])]
    assert stream.sent["stream/missing"]["scalars"] == [(4.0, [3.0, 1.0])]
    assert stream.sent["stream/delay"]["scalars"] == [(4.0, [0.02, 0.1])]
    assert stream.sent["events"]["text"] == [(1.0, ["first sample"]), (3.0, ["a31: step"])]
    assert [level for _, (level,) in stream.sent["events"]["level"]] == ["INFO", "WARN"]
