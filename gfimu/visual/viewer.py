"""The rerun viewer, which listens to this machine only: opened on a file, and started for a live stream."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from gfimu.base.errors import GfimuError, InputError, system_errors

__all__ = ["check_display", "open_viewer", "quiet_sdk", "viewer_command", "viewer_listens", "viewer_stream"]

LOOPBACK = "127.0.0.1"
"""The viewer's own default is 0.0.0.0: every machine on the network could read along and send."""

WEB_VIEWER = f"rerun --web-viewer --bind {LOOPBACK}"
"""What to type where there is no display."""

_PORT = 9876  # the viewer's usual one
_START_S = 20.0
_LOOK_AGAIN_S = 0.1


def open_viewer(path: str | Path) -> None:
    """Open a rerun recording in the viewer, which listens to this machine only, and wait until its window is closed.

    Raises
    ------
    InputError
        If the file does not exist or is not a rerun recording.
    GfimuError
        If this machine has no display, or the viewer fails; the message says what to do instead.
    """
    file = Path(path)
    with system_errors(file), file.open("rb") as stream:
        magic = stream.read(3)
    if magic != b"RRF":
        raise InputError(f"{file}: not a rerun recording; give a .rrd file that gfimu wrote")
    if not has_display():
        raise GfimuError(
            f"no display here to open {file}; run `{WEB_VIEWER} {file}` and open the address it prints in a "
            "browser, or copy the file to a machine with a display and run `rerun` on it there"
        )
    done = subprocess.run(viewer_command(file), check=False)
    if done.returncode:
        raise GfimuError(f"the rerun viewer ended with code {done.returncode}; try `{WEB_VIEWER} {file}` in a browser")


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
