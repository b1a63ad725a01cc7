"""Opening a .rrd file in the rerun viewer."""

from __future__ import annotations

import subprocess
from pathlib import Path

from gfimu.base.errors import GfimuError, InputError
from gfimu.base.files.rerun_stream import WEB_VIEWER, has_display, viewer_command

__all__ = ["open_viewer"]


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
    try:
        with file.open("rb") as stream:
            if stream.read(3) != b"RRF":
                raise InputError(f"{file}: not a rerun recording; give a .rrd file that gfimu wrote")
    except OSError as error:
        raise InputError(f"{file}: {error.strerror or error}; check the path") from None
    if not has_display():
        raise GfimuError(
            f"no display here to open {file}; run `{WEB_VIEWER} {file}` and open the address it prints in a "
            "browser, or copy the file to a machine with a display and run `rerun` on it there"
        )
    done = subprocess.run(viewer_command(file), check=False)
    if done.returncode:
        raise GfimuError(f"the rerun viewer ended with code {done.returncode}; try `{WEB_VIEWER} {file}` in a browser")
