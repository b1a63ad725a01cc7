"""Whether what a board sent fits the array that it is taken to carry, and if nobody stated one, which one fits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.frames.decoder import FrameFormat, StreamCounts
from firmware_bridge.host.mounting.on_board import candidate_arrays, mounting_words
from firmware_bridge.host.record_report import RecordReport
from firmware_bridge.host.record_session import Batch
from gfimu.array.array import AccelerometerArray
from gfimu.recording import Recording
from gfimu.recording.doubts.doubt import Doubt
from gfimu.recording.doubts.judge import doubts_of

__all__ = ["FirstSamples", "array_doubts"]

_KEPT = 120_000  # samples: twenty minutes at 100 Hz; the check of more takes as long and shows no more


class FirstSamples:
    """Keeps the first samples of a recording, so that they can be compared with an array."""

    def __init__(self) -> None:
        self._batches: list[Batch] = []
        self._count = 0

    def __call__(self, batch: Batch, counts: StreamCounts) -> None:
        """Take a batch."""
        if self._count < _KEPT:
            self._batches.append(batch)
            self._count += len(batch.t_s)

    def findings(self, array: AccelerometerArray, lsb: float) -> tuple[Doubt, ...]:
        """Return what contradicts an array (`gfimu.recording.doubts`); ``lsb``: size of a count, m/s²."""
        if not self._batches:
            return ()
        t: NDArray[np.float64] = np.concatenate([batch.t_s for batch in self._batches])[:_KEPT]
        counts = np.concatenate([batch.counts for batch in self._batches])[:_KEPT]
        return doubts_of(Recording(t, lsb * counts, array.channels), array)


def array_doubts(
    report: RecordReport, samples: FirstSamples, form: FrameFormat, known: AccelerometerArray | None
) -> list[str]:
    """Say where the array of a recording is open, or contradicted by the board or by what it sent.

    Parameters
    ----------
    report : RecordReport
        What was recorded.
    samples : FirstSamples
        Its first samples.
    form : FrameFormat
        Format of the board.
    known : AccelerometerArray, optional
        The array as it was settled before the first sample.
    """
    if not report.array:
        lsb = form.count_size(AccelerometerArray.load(form.array))
        return [_open_array_text(candidate_arrays(form), samples, lsb, str(report.path))]
    array = known or AccelerometerArray.load(report.array)  # one that was stated late is a shipped one
    texts = [finding.text for finding in samples.findings(array, form.count_size(array)) if not finding.is_minor]
    if not report.board_array or report.board_array == array.name:
        return texts
    other = (
        f"the board states array {report.board_array!r}, and {array.name!r} was given: the recording carries "
        f"{array.name!r}; leave --array out, or build the firmware for the array that is on the board "
        "(gfimu firmware build --array)"
    )
    return [other, *texts]


def _open_array_text(candidates: tuple[AccelerometerArray, ...], fit: FirstSamples, lsb: float, out: str) -> str:
    """Say that nobody stated the array, which ones have these channels, and what the samples say of them."""
    named = [f"{array.name} ({mounting_words(array)})" for array in candidates]
    fitting = [array.name for array in candidates if not any(one.refused for one in fit.findings(array, lsb))]
    shown = "the samples do not show which"
    if len(fitting) == 1:
        shown = f"the samples fit {fitting[0]} alone"
    elif not fitting:
        shown = "the samples fit none of them"
    return (
        f"neither the board nor --array states the array, so the recording carries none: {' or '.join(named)}? "
        f"{shown}; record with --array NAME, or settle it with gfimu convert {out} NEW --array NAME "
        "(docs/how_to/bench.md)"
    )
