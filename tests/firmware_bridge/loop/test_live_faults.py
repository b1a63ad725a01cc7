"""A fault in a simulated chip is named while the recording is made, and the recording holds every sample."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field

import numpy as np
import pytest

from firmware_bridge import TICKS_PER_SECOND, open_port, serve
from gfimu import BoardSettings, RecordCallbacks, record
from gfimu.recording import Recording

needs_board = pytest.mark.skipif(
    not pytest.importorskip("importlib.util").find_spec("unicorn"), reason="the emulator is in the extra 'firmware'"
)
COUNT = 256  # of the chip's fraction per full-resolution count
ONSET_S = 8.0


@dataclass
class FaultyChip:
    """A board at rest with noise of one count; axis 1 of chip 3 is off by some counts from ONSET_S on."""

    counts: int
    chance: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))

    def __call__(self, sensor: int, first: int, period: int, count: int, bw_rate: int) -> np.ndarray:
        t = (first + period * np.arange(count)) / TICKS_PER_SECOND
        readings = np.tile([3.0, -2.0, 256.0], (count, 1)) + self.chance.normal(0.0, 0.75, (count, 3))
        if sensor == 2:
            readings[t >= ONSET_S, 0] += self.counts
        return np.round(readings * COUNT).astype(np.int32)


@needs_board
def test_a_chip_that_goes_wrong_is_named_while_recording(tmp_path) -> None:
    from firmware_bridge import BoardProcess

    port, done, sentences = open_port("tcp:0"), threading.Event(), []
    with BoardProcess(FaultyChip(20)) as board:
        board.run_for(0.02)
        thread = threading.Thread(target=serve, args=(board, port), kwargs={"stop": done.is_set, "realtime": False})
        thread.start()
        try:
            report = record(
                port.name,
                tmp_path / "run.csv",
                duration=14.0,
                board=BoardSettings(rate=100, array="cube12"),
                callbacks=RecordCallbacks(on_fault=sentences.append),
            )
        finally:
            done.set()
            thread.join()
            port.close()
    assert report.stream.lost == report.stream.corrupt == 0
    recording = Recording.read(tmp_path / "run.csv")
    assert len(recording) >= 1399
    assert not np.isnan(recording.readings).any()
    found, measured = sentences
    assert found.startswith("a31: step of")
    assert measured.startswith("a31: step of 0.7")  # 20 counts of 3.9 mg
    assert "not used" in found
