"""The folder of C files with which a board of one's own sends frames."""

from __future__ import annotations

import tempfile
from pathlib import Path

from firmware_bridge.lpc1768.build import SOURCES
from gfimu.base.errors import InputError

__all__ = ["readme", "write_project"]

_FOLDER = Path(__file__).resolve().parent
_OWN = ("gfimu_port.h", "sender.c", "CMakeLists.txt", "ports/host.c", "ports/rp2040.c", "ports/stm32f4.c",
        "ports/stm32f4.ld")  # fmt: skip
_FIRMWARE = ("core.c", "core.h", "hal.h", "adxl345.c", "adxl345.h")
_SKETCH = "SKETCH"  # in the text of the README, stands for the name of the sketch


def readme(name: str) -> str:
    """Return what to do with the files, for a folder of that name."""
    return (_FOLDER / "README.md").read_text(encoding="utf-8").replace(_SKETCH, name)


def write_project(folder: str | Path) -> list[Path]:
    """Write the C files of a sender, whole or not at all; return their paths.

    Parameters
    ----------
    folder : str or Path
        Folder to make; the Arduino sketch in it has its name.

    Raises
    ------
    InputError
        If the folder is there and not empty.
    """
    target = Path(folder)
    if target.is_dir() and any(target.iterdir()):
        raise InputError(f"{target}: is there already and not empty; choose another name")
    texts = {name: (_FOLDER / name).read_text(encoding="utf-8") for name in _OWN}
    texts |= {name: (SOURCES / name).read_text(encoding="utf-8") for name in _FIRMWARE}
    texts["README.md"] = readme(target.resolve().name)
    texts[f"{target.resolve().name}.ino"] = (_FOLDER / "sender.ino").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory(dir=target.resolve().parent, prefix=f".{target.name}-") as scratch:
        for name, text in texts.items():
            path = Path(scratch, "new", name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        if target.is_dir():
            target.rmdir()  # empty; Windows replaces no folder
        Path(scratch, "new").replace(target)
    return [target / name for name in texts]
