"""The strict board against mistakes that people make: each mutant of the firmware must break the rule meant for it."""

from __future__ import annotations

import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("unicorn", reason="the emulator is in the extra 'firmware'")
pytest.importorskip("ziglang", reason="the C compiler is in the extra 'firmware'")

from firmware_bridge.adxl345.device import Adxl345
from firmware_bridge.lpc1768 import build as firmware
from firmware_bridge.lpc1768.elf import ElfImage
from firmware_bridge.strict.board import StrictBoard
from firmware_bridge.strict.watch import Policy
from firmware_bridge.strict.worker import run_with_input

LIMIT_S = 30.0
FOLDER = Path(__file__).parent / "mutants"
MUTANTS = tomllib.loads((FOLDER / "mutants.toml").read_text(encoding="utf-8"))["mutant"]


def apply_patch(patch: str, folder: Path) -> None:
    """Apply a unified diff of one file by its lines, wherever they stand: the sources around them may move."""
    name = next(line for line in patch.splitlines() if line.startswith("+++ ")).removeprefix("+++ b/")
    text = (folder / name).read_text(encoding="utf-8")
    for hunk in patch.split("\n@@ ")[1:]:
        lines = hunk.rstrip("\n").split("\n")[1:]
        old = "".join(f"{line[1:]}\n" for line in lines if line[:1] in {" ", "-"})
        new = "".join(f"{line[1:]}\n" for line in lines if line[:1] in {" ", "+"})
        assert text.count(f"\n{old}") == 1, f"{name} has these lines not once; write the patch anew:\n{old}"
        text = text.replace(f"\n{old}", f"\n{new}")
    (folder / name).write_text(text, encoding="utf-8")


def resting(first, period, count, bw_rate):
    return np.zeros((count, 3), np.int32)


def rules_broken(image: ElfImage, seconds: float, baud: int | None = None) -> set[str]:
    board = StrictBoard(image, [Adxl345(resting) for _ in range(4)], policy=Policy(baud=baud))
    run_with_input(board, seconds, LIMIT_S)
    return {finding.rule for finding in board.findings()}


@pytest.fixture
def mutant(tmp_path, monkeypatch):
    """Build the firmware with a patch."""

    def make(patch: str) -> ElfImage:
        sources = tmp_path / "src"
        shutil.copytree(firmware.SOURCES, sources)
        apply_patch((FOLDER / patch).read_text(encoding="utf-8"), sources)
        monkeypatch.setattr(firmware, "SOURCES", sources)
        return ElfImage.load(firmware.build("gfimu", tmp_path / "image").elf)

    return make


CAUGHT = [entry for entry in MUTANTS if "expected" in entry]


@pytest.mark.parametrize("entry", CAUGHT, ids=[entry["patch"].removesuffix(".patch") for entry in CAUGHT])
def test_the_mistake_is_found(entry, mutant) -> None:
    broken = rules_broken(mutant(entry["patch"]), entry["seconds"], entry.get("baud"))
    assert broken & set(entry["expected"])


def test_nine_of_ten_mistakes_are_found_in_every_round() -> None:
    for designed in ("before", "first round", "second round", "third round"):
        rows = [entry for entry in MUTANTS if entry["designed"] == designed]
        assert sum("expected" in entry for entry in rows) >= 0.9 * len(rows) > 9


def test_every_patch_is_in_the_table_once() -> None:
    assert sorted(entry["patch"] for entry in MUTANTS) == sorted(path.name for path in FOLDER.glob("*.patch"))
