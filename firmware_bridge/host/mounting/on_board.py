"""Which array is on the board: as given, as the board states it, as somebody answers, or not known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from firmware_bridge.frames.decoder import FrameFormat
from firmware_bridge.host.finder import Listener, has_speed
from firmware_bridge.host.line_up import line_up
from firmware_bridge.host.link import Chunk, Link
from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.base.files.model_files import list_models

__all__ = [
    "ArrayOnBoard",
    "BoardAnswer",
    "ask_board",
    "candidate_arrays",
    "load_stated",
    "mounting_words",
    "take_waiting",
]

_SAME_PLACE_M = 1e-9  # numerical


@dataclass(frozen=True)
class ArrayOnBoard:
    """The array of a recording.

    Parameters
    ----------
    array : AccelerometerArray
        The array; where nobody stated it, one that has the right channels.
    stated_by : str
        ``host`` (named at the host), ``format``, ``board``, ``answer``; empty if nobody stated it.
    """

    array: AccelerometerArray
    stated_by: str

    @property
    def known(self) -> AccelerometerArray | None:
        """The array, or None if nobody stated it."""
        return self.array if self.stated_by else None

    @property
    def name(self) -> str:
        """Name of the array; empty if nobody stated it."""
        return self.array.name if self.stated_by else ""


@dataclass(frozen=True)
class BoardAnswer:
    """What became of the question to a board: the array that it states, the speed agreed on, what came meanwhile."""

    array: str
    baud: int | None
    chunks: list[Chunk]
    answers: bool


def ask_board(
    link: Link, form: FrameFormat, baud: int | None, least_baud: int, stop: Callable[[], bool], *, has_setup: bool
) -> BoardAnswer:
    """Ask a board on an open port for its array, at its own speed.

    What it sends meanwhile belongs to the recording, unless it is set up first or spoke at another speed.
    """
    if has_speed(link.port):
        result = line_up(link, form, baud, least_baud=least_baud, stop=stop)
        if result is None:
            return BoardAnswer("", None, [], answers=False)
        found, chunks = result
        return BoardAnswer(found.array, found.baud, [] if has_setup else chunks, answers=found.identity is not None)
    early = take_waiting(link)
    listener = Listener([form])
    understood = listener.listen(link)
    answers = understood is not None and understood[1] is not None
    return BoardAnswer(listener.array, None, early + listener.chunks, answers=answers)


def take_waiting(link: Link) -> list[Chunk]:
    """Take what waits to be read."""
    waiting: list[Chunk] = []
    while link.backlog and (chunk := link.read(0.0)) is not None:
        waiting.append(chunk)
    return waiting


def load_stated(name: str, port: str) -> AccelerometerArray:
    """Load the array that a board states.

    Raises
    ------
    InputError
        If this computer has no array of that name.
    """
    if name not in list_models("arrays"):
        raise InputError(
            f"{port}: the board states array {name!r}, which is not known here; give its file with --array"
        )
    return AccelerometerArray.load(name)


def candidate_arrays(form: FrameFormat) -> tuple[AccelerometerArray, ...]:
    """List the shipped arrays that have channels and places of a format that leaves open how its chips are turned."""
    assumed = AccelerometerArray.load(form.array)
    arrays = (AccelerometerArray.load(name) for name in list_models("arrays"))
    return tuple(
        array
        for array in arrays
        if array.channels == assumed.channels and np.allclose(array.positions, assumed.positions, atol=_SAME_PLACE_M)
    )


def mounting_words(array: AccelerometerArray) -> str:
    """Say along which body axes the sensing axes of all chips point, as ``axes 1, 2, 3 along +y, +x, -z``."""
    first = array.chips[0].axes
    alike = all(np.array_equal(chip.axes, first) for chip in array.chips)
    if not alike or not all(np.count_nonzero(axis) == 1 for axis in first):
        return array.description
    return f"axes {', '.join(str(k + 1) for k in range(len(first)))} along {', '.join(map(_direction, first))}"


def _direction(axis: Sequence[float]) -> str:
    place = int(np.argmax(np.abs(axis)))
    return f"{'+' if axis[place] > 0 else '-'}{'xyz'[place]}"
