"""The committed images: what they were built from, and that building gives them again."""

from __future__ import annotations

import shutil
import struct
import sys
import tomllib

import pytest

from firmware_bridge import ElfImage, build, image_path
from firmware_bridge.lpc1768 import build as firmware
from firmware_bridge.lpc1768.build import IMAGES, check_image, compiler_version, named_image, source_hash
from gfimu import GfimuError, InputError


@pytest.mark.parametrize("name", IMAGES)
def test_committed_image_is_the_recorded_one_from_these_sources(name: str) -> None:
    found = check_image(name)
    assert found["image_as_recorded"]
    assert found["sources_as_recorded"]


@pytest.mark.parametrize("name", IMAGES)
def test_rebuilding_gives_the_same_bytes(name: str, tmp_path) -> None:
    pytest.importorskip("ziglang", reason="the C compiler is in the extra 'firmware'")
    recorded = tomllib.loads(image_path(name).with_suffix(".toml").read_text())["compiler"]
    if compiler_version() != recorded:
        pytest.skip(
            f"the image was built by {recorded}, here is {compiler_version()}: other bytes from the same source"
        )
    report = build(name, tmp_path)
    assert report.elf.read_bytes() == image_path(name).read_bytes()
    assert report.binary.read_bytes() == image_path(name).with_suffix(".bin").read_bytes()


def test_boot_checksum_and_flash_image() -> None:
    words = struct.unpack("<8I", image_path().with_suffix(".bin").read_bytes()[:32])
    assert sum(words) & 0xFFFFFFFF == 0  # the boot ROM's test (UM10360 32.3.1.1)
    assert words[0] == 0x10008000
    image = ElfImage.load(image_path())
    assert image.symbol_at(words[1] & ~1) == "Reset_Handler"
    assert image.symbol_at((words[1] & ~1) + 2) == "Reset_Handler+0x2"


@pytest.mark.parametrize("name", IMAGES)
def test_the_code_protection_word_is_reserved(name: str) -> None:
    flash = image_path(name).with_suffix(".bin").read_bytes()
    assert flash[0x2FC:0x300] == b"\xff" * 4  # the boot ROM reads it (UM10360 32.6); no instruction may stand there
    assert all(not 0xCC <= address < 0x300 for address in ElfImage.load(image_path(name)).symbols.values())


def test_an_image_with_code_in_the_code_protection_word_is_not_built(tmp_path, monkeypatch) -> None:
    pytest.importorskip("ziglang", reason="the C compiler is in the extra 'firmware'")
    sources = tmp_path / "src"
    shutil.copytree(firmware.SOURCES, sources)
    script = (sources / "lpc1768.ld").read_text(encoding="utf-8")
    for line in ("        . = 0x2FC;\n", "        LONG(0xFFFFFFFF)\n"):
        assert line in script
        script = script.replace(line, "")
    (sources / "lpc1768.ld").write_text(script, encoding="utf-8")
    monkeypatch.setattr(firmware, "SOURCES", sources)
    with pytest.raises(GfimuError, match=r"code-protection word at 0x2fc"):
        build("gfimu", tmp_path / "image")
    assert not (tmp_path / "image").exists()


def test_definitions_change_image_and_source_hash(tmp_path) -> None:
    pytest.importorskip("ziglang", reason="the C compiler is in the extra 'firmware'")
    defines = {"GFIMU_SPI_HZ": "1000000U"}
    assert source_hash("gfimu", defines) != source_hash("gfimu")
    assert build("gfimu", tmp_path, defines=defines).sha256 != build("gfimu", tmp_path).sha256


def test_errors_name_the_remedy(tmp_path, monkeypatch) -> None:
    with pytest.raises(InputError, match="gfimu, selfcheck"):
        image_path("blink")
    with pytest.raises(InputError, match="not a 32-bit"):
        ElfImage.parse(b"\x7fELF\x02\x01" + bytes(60), "wide.elf")
    with pytest.raises(InputError, match="damaged"):
        ElfImage.parse(image_path().read_bytes()[:60], "cut.elf")
    with pytest.raises(InputError, match=r"missing\.elf"):
        ElfImage.load(tmp_path / "missing.elf")
    monkeypatch.setitem(sys.modules, "ziglang", None)  # as if it were not installed
    with pytest.raises(InputError, match=r"pip install 'gfimu\[firmware\]'"):
        build("gfimu", tmp_path)


def test_compiler_errors_are_shown(tmp_path) -> None:
    pytest.importorskip("ziglang", reason="the C compiler is in the extra 'firmware'")
    with pytest.raises(GfimuError, match="out of the SSP's reach"):
        build("gfimu", tmp_path, defines={"GFIMU_SPI_HZ": "1000U"})
    assert not list(tmp_path.iterdir())


def test_an_array_is_built_in_or_written_into_a_finished_image(tmp_path) -> None:
    pytest.importorskip("ziglang", reason="the C compiler is in the extra 'firmware'")
    built = ElfImage.load(build("gfimu", tmp_path, array="cube12_as_built").elf)
    written = named_image(ElfImage.load(image_path()), "cube12_as_built")
    place = built.symbols["gfimu_array"]
    for image in (built, written):
        assert image.read(image.symbols["gfimu_array"], 25) == b"cube12_as_built".ljust(25, b"\0")
    assert ElfImage.load(image_path()).read(place, 25) == b"\0" * 25
    selfcheck = ElfImage.load(image_path("selfcheck"))
    assert named_image(selfcheck, "cube12") is selfcheck  # it states none


@pytest.mark.parametrize("name", ["x" * 25, 'a"b', "two words", "würfel"])
def test_a_name_that_no_frame_can_hold_is_refused(name: str, tmp_path) -> None:
    with pytest.raises(InputError, match="at most 24 plain characters"):
        build("gfimu", tmp_path, array=name)
    assert not list(tmp_path.iterdir())
