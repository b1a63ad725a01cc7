"""Boards, images and physics that several tests of the wire share."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from firmware_bridge import SOURCES, TICKS_PER_SECOND, Adxl345, Adxl345Options, ElfImage, image_path, sample_at

_FLAGS = (
    "-target", "thumb-freestanding-eabi", "-mcpu=cortex_m3", "-mthumb", "-std=gnu11", "-O2", "-g0", "-ffreestanding",
    "-fno-builtin", "-fno-sanitize=undefined", "-fno-unwind-tables", "-fno-asynchronous-unwind-tables", "-nostdlib",
    "-Wl,--gc-sections", "-Wl,-e,Reset_Handler",
)  # fmt: skip


def moving_source(chip: int):
    """Conversions of a chip that swings: a different signal on every axis of every chip."""

    def source(first, period, count, bw_rate):
        t = (first + period * np.arange(count)) / TICKS_PER_SECOND
        g = np.stack([np.sin(31.4 * t + chip), 0.1 * chip + 0 * t, 1 + 0.5 * np.cos(18.8 * t)], axis=1)
        return np.round(g * 256 * 256).astype(np.int32)

    return source


@pytest.fixture(scope="session")
def compile_image(tmp_path_factory):
    """Compile a C source of the tests into an image for the board."""
    pytest.importorskip("ziglang", reason="the C compiler is in the extra 'firmware'")

    def compile_one(source: Path) -> ElfImage:
        out = tmp_path_factory.mktemp("image") / f"{source.stem}.elf"
        script = f"-Wl,-T,{SOURCES / 'lpc1768.ld'}"
        command = [sys.executable, "-m", "ziglang", "cc", *_FLAGS, script, str(source), "-o", str(out)]
        subprocess.run(command, check=True, capture_output=True)
        return ElfImage.load(out)

    return compile_one


@pytest.fixture
def make_board():
    """Build a board in this process: `Board` or `FastBoard`, our image unless told otherwise."""
    pytest.importorskip("unicorn", reason="the emulator is in the extra 'firmware'")
    from firmware_bridge import Board, FastBoard

    def make(kind: str = "python", image: ElfImage | str = "gfimu", rate: int | None = None, **options):
        loaded = ElfImage.load(image_path(image)) if isinstance(image, str) else image
        sensors = [
            Adxl345(moving_source(k), Adxl345Options(clock_error=0.004 * k, phase=0.2 * k, **options)) for k in range(4)
        ]
        board = (Board if kind == "python" else FastBoard)(loaded, sensors)
        if rate is not None:
            board.run_for(0.01)
            board.uarts[0].receive(sample_at(rate))
        return board

    return make
