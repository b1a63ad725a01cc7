"""`gfimu firmware check` as a user runs it."""

from __future__ import annotations

import json
import shutil

import pytest

pytest.importorskip("unicorn", reason="the emulator is in the extra 'firmware'")

from firmware_bridge import image_path


def test_a_clean_image_is_exit_code_0(gfimu_command) -> None:
    result = gfimu_command("firmware", "check", "--duration", "0.1", "--json")
    assert result.code == 0, result.output
    report = json.loads(result.stdout)
    assert report["faults"] == 0
    assert {finding["rule"] for finding in report["findings"]} <= {"no_time_out"}
    assert report["sent"][0] > 300


def test_faults_are_exit_code_1_with_rule_place_and_remedy(gfimu_command, tmp_path) -> None:
    image = tmp_path / "[red].bin"
    content = bytearray(image_path().with_suffix(".bin").read_bytes())
    content[0:4] = (0x10010000).to_bytes(4, "little")
    image.write_bytes(content)
    result = gfimu_command("firmware", "check", image, "--duration", "0.02")
    assert result.code == 1
    assert "[red].bin" in result.stdout
    assert "vector table" in result.stdout
    assert "ARMv7-M ARM B1.5.3" in result.stdout


def test_another_speed_than_the_expected_one_is_a_fault(gfimu_command) -> None:
    result = gfimu_command("firmware", "check", "--duration", "0.02", "--baud", "9600", "--json")
    assert result.code == 1
    (finding,) = [one for one in json.loads(result.stdout)["findings"] if one["severity"] == "fault"]
    assert finding["rule"] == "uart_speed"
    assert finding["symbol"]


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("nowhere.elf",), "give an ELF file"),
        (("--chips", "5"), "0 to 4"),
        (("--duration", "0"), "above 0 s"),
        (("--baud", "-1"), "above 0 baud"),
    ],
)
def test_bad_input_is_one_line(gfimu_command, tmp_path, monkeypatch, arguments, word: str) -> None:
    monkeypatch.chdir(tmp_path)
    result = gfimu_command("firmware", "check", *arguments)
    assert result.code == 2
    assert word in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def test_an_image_for_another_memory_is_refused(gfimu_command, tmp_path) -> None:
    image = tmp_path / "large.bin"
    image.write_bytes(bytes(600 << 10))
    result = gfimu_command("firmware", "check", image)
    assert result.code == 2
    assert "no memory" in result.stderr
    shutil.copy(image_path(), tmp_path / "gfimu.txt")
    assert gfimu_command("firmware", "check", tmp_path / "gfimu.txt", "--duration", "0.02").code == 0
