"""The picture of a recording while it is made: the array, its channels by chip, and no rate where there is none."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rerun.chunk import RrdReader

from firmware_bridge.frames.decoder import StreamCounts
from firmware_bridge.host.live import LiveView
from firmware_bridge.host.recorder import Batch
from gfimu import AccelerometerArray
from gfimu.visual.colours import chip_colour
from gfimu.visual.live import LivePicture

COUNTS = StreamCounts(0, 0, 0, 0, 0, 0)


def recorded(tmp_path, name: str, texts: list[str]) -> dict[str, dict[str, list]]:
    """Columns of every entity of the live picture of an array at rest for a second, chips reading 1 m/s² and more."""
    array = AccelerometerArray.load(name)
    file = tmp_path / "live.rrd"
    view = LiveView(array, 1.0, on_text=texts.append, rrd=file, picture=LivePicture(array))
    readings = np.tile(1.0 + np.arange(array.n_channels), (100, 1))
    view(Batch(0.01 * np.arange(100), readings, np.zeros(100, dtype=np.uint16)), COUNTS)
    view.close()
    found: dict[str, dict[str, list]] = {}
    for chunk in RrdReader(str(file)).stream().to_chunks():
        batch = chunk.to_record_batch()
        columns = found.setdefault(chunk.entity_path, {})
        for column, values in zip(batch.schema.names, batch.columns, strict=True):
            if column not in ("rerun.controls.RowId", "t", "log_time", "log_tick"):
                columns[column.split(":")[-1]] = values.to_pylist()
    return found


@pytest.mark.parametrize("name", ["cube12", "mimu4444", "one_chip"])
def test_the_array_of_the_board_is_drawn_with_its_channels(tmp_path, name):
    found = recorded(tmp_path, name, [])
    array = AccelerometerArray.load(name)
    arrows = found["/scene/array/readings"]
    assert_allclose(arrows["origins"][0], array.positions, atol=1e-7)
    vectors = np.array(arrows["vectors"][0])
    lengths = np.einsum("ck,ck->c", vectors, array.axes)
    assert_allclose(lengths / lengths[0], 1.0 + np.arange(array.n_channels), rtol=1e-5)
    for number, chip in enumerate(array.chips):
        red, green, blue = chip_colour(number)
        for channel in chip.channels:
            line = found[f"/readings/{channel}"]
            assert line["names"][0] == [channel]
            assert line["colors"][0] == [(red << 24) | (green << 16) | (blue << 8) | 255]
    assert all(f"| {chip.name} |" in str(found["/notes"]["text"]) for chip in array.chips)


def test_an_array_that_sees_no_rate_is_shown_and_said_so(tmp_path):
    texts: list[str] = []
    found = recorded(tmp_path, "one_chip", texts)
    assert "/omega/x" not in {name for name, columns in found.items() if "scalars" in columns}
    assert "no rate: array 'one_chip'" in texts[0]
