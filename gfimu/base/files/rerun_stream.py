"""Rerun streams into a file, whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.base.errors import printable
from gfimu.base.files.atomic_file import atomic_path

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

__all__ = ["markdown", "rrd_stream"]


@contextmanager
def rrd_stream(
    path: str | Path, application: str, *, blueprint: rrb.Blueprint | None = None
) -> Iterator[rr.RecordingStream]:
    """Yield a stream whose content becomes a ``.rrd`` file when the block ends well.

    The bytes are collected in memory and written here, as the SDK's own file sink hangs on a full disk (0.41).

    Parameters
    ----------
    path : str or Path
        File to write.
    application : str
        Name of the application in the recording.
    blueprint : rerun.blueprint.Blueprint, optional
        Layout in which the viewer opens the recording.

    Raises
    ------
    InputError
        If the folder does not exist or can't be written to.
    WriteError
        If the file can't be written.
    """
    import rerun as rr

    stream = rr.RecordingStream(application)
    content = stream.binary_stream()
    if blueprint is not None:
        # Active at once: a viewer that is slow, or keeps the layout of another recording, would show its own instead.
        stream.send_blueprint(blueprint, make_active=True, make_default=True)
    try:
        yield stream
    finally:
        data = content.read(flush=True) or b""  # also where the block failed: the SDK complains of what nobody read
        stream.disconnect()
    with atomic_path(path) as temporary:
        temporary.write_bytes(data)


def markdown(text: str) -> rr.TextDocument:
    """Return Markdown in which names from files make no links, pictures or HTML."""
    import rerun as rr

    inert = printable(text).replace("[", "\\[").replace("<", "\\<")
    return rr.TextDocument(inert, media_type=rr.MediaType.MARKDOWN)
