"""Rerun streams: into a file, whole or not at all, and to a viewer that listens to this machine only."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gfimu.base.errors import GfimuError, printable
from gfimu.base.files.atomic_file import atomic_path

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

__all__ = [
    "LOOPBACK",
    "WEB_VIEWER",
    "check_display",
    "has_display",
    "markdown",
    "quiet_sdk",
    "rrd_stream",
    "viewer_command",
    "viewer_listens",
    "viewer_stream",
]

LOOPBACK = "127.0.0.1"
"""The viewer's own default is 0.0.0.0: every machine on the network could read along and send."""

WEB_VIEWER = f"rerun --web-viewer --bind {LOOPBACK}"
"""What to type where there is no display."""

_PORT = 9876  # the viewer's usual one
_START_S = 20.0
_LOOK_AGAIN_S = 0.1


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


def quiet_sdk() -> None:
    """Keep the SDK's own log off standard error: a viewer that is closed would be lines of it. Before its import."""
    os.environ.setdefault("RUST_LOG", "off")


def has_display() -> bool:
    """Whether a window can be opened here."""
    return not sys.platform.startswith("linux") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))


def viewer_command(*arguments: str | Path) -> list[str]:
    """Return the command line of the viewer, bound to this machine."""
    return [sys.executable, "-P", "-m", "rerun", "--bind", LOOPBACK, *map(str, arguments)]


def check_display() -> None:
    """Raise `GfimuError` where a viewer neither runs nor could show anything; the message says what to do instead."""
    if not (viewer_listens() or has_display()):
        raise GfimuError(
            f"no display here for the rerun viewer; run `{WEB_VIEWER}` first and open the address it prints in a "
            "browser, or write a file with --rrd and look at it later"
        )


def viewer_stream(application: str) -> Any:
    """Return a stream to a viewer on this machine; one is started unless one listens already.

    Raises
    ------
    GfimuError
        If there is no display, or the viewer does not start; the message says what to do instead.
    """
    import rerun as rr

    check_display()
    if not viewer_listens():
        viewer = subprocess.Popen(
            viewer_command("--port", str(_PORT), "--expect-data-soon"),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C ends the recording and leaves the picture
        )
        end = time.monotonic() + _START_S
        while not viewer_listens():
            if viewer.poll() is not None or time.monotonic() > end:
                _end(viewer)
                raise GfimuError("the rerun viewer does not start here; write a file with --rrd and look at it later")
            time.sleep(_LOOK_AGAIN_S)
    stream = rr.RecordingStream(application)
    stream.connect_grpc(f"rerun+http://{LOOPBACK}:{_PORT}/proxy")
    return stream


def _end(viewer: subprocess.Popen[bytes]) -> None:
    """End a viewer and what it has started: ``python -m rerun`` runs the program as its child."""
    if hasattr(os, "killpg"):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(viewer.pid, signal.SIGTERM)  # a session of its own, so no group of ours
    else:
        viewer.kill()
    viewer.wait()


def viewer_listens() -> bool:
    """Whether a viewer listens on this machine."""
    with socket.socket() as probe:
        probe.settimeout(1.0)
        return probe.connect_ex((LOOPBACK, _PORT)) == 0
