"""The sender compiles for the processors it is written for, without a warning and small; nothing here runs on them."""

from __future__ import annotations

from pathlib import Path

import pytest

from firmware_bridge import SOURCES, ElfImage, write_project
from gfimu import InputError
from tests.firmware_bridge.sender.conftest import BARE, CORE, STRICT

ARM = ("-target", "thumb-freestanding-eabi", "-mthumb", *STRICT, *BARE)
LINKED = ("-Wl,--gc-sections", "-Wl,-T,ports/stm32f4.ld")
STUBS = Path(__file__).with_name("arduino")


def test_the_core_is_the_firmwares_own(project: Path) -> None:
    for name in ("core.c", "core.h", "adxl345.c", "adxl345.h", "hal.h"):
        assert (project / name).read_bytes() == (SOURCES / name).read_bytes()
    text = (project / "README.md").read_text(encoding="utf-8")
    assert "my_sender.ino" in text
    assert len(text.splitlines()) <= 10


def test_a_folder_that_holds_something_is_not_touched(tmp_path) -> None:
    (tmp_path / "mine.c").write_text("kept")
    with pytest.raises(InputError, match="not empty; choose another name"):
        write_project(tmp_path)
    assert [one.name for one in tmp_path.iterdir()] == ["mine.c"]
    empty = tmp_path / "empty"
    empty.mkdir()
    assert all(path.is_file() for path in write_project(empty))
    assert (empty / "empty.ino").is_file()


def test_stm32f4_image(compile_sender) -> None:
    image = ElfImage.load(compile_sender("-mcpu=cortex_m4", *ARM, *LINKED, "ports/stm32f4.c", *CORE))
    text, data, bss = image.section_sizes()
    assert (text < 12_000, data + bss < 2_000) == (True, True), (text, data, bss)
    assert image.symbols["vectors"] == 0x0800_0000


def test_rp2040_program(compile_sender) -> None:
    """Without what the pico-sdk adds, clocks and startup; linked to places of another chip, for its size."""
    image = ElfImage.load(compile_sender("-mcpu=cortex_m0plus", *ARM, *LINKED, "-Wl,-e,main", "ports/rp2040.c", *CORE))
    text, data, bss = image.section_sizes()
    assert (text < 12_000, data + bss < 2_000) == (True, True), (text, data, bss)


@pytest.mark.parametrize("file", CORE)
def test_processors_with_integers_of_16_bits(compile_sender, file: str) -> None:
    words = ("-target", "avr-freestanding", "-mcpu=atmega328p", "-Wno-avr-rtlib-linking-quirks", *STRICT, *BARE)
    assert compile_sender(*words, "-c", file).is_file()


@pytest.mark.parametrize("chips", [0, 5])
def test_another_number_of_chips_does_not_compile(compile_sender, chips: int) -> None:
    with pytest.raises(AssertionError, match="one to four chips"):
        compile_sender("-c", f"-DGFIMU_CHIPS={chips}", "sender.c")


def test_the_sketch(compile_sender, project: Path) -> None:
    words = ("-c", "-x", "c++", "-std=c++11", "-Wall", "-Wextra", "-Werror", f"-I{STUBS}", "-include", "Arduino.h")
    assert compile_sender(*words, str(project / "my_sender.ino"), compiler="c++").is_file()
