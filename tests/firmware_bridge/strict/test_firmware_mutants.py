"""The strict board against mistakes that people make: each mutant of the firmware must break the rule meant for it."""

from __future__ import annotations

import shutil
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("unicorn", reason="the emulator is in the extra 'firmware'")
pytest.importorskip("ziglang", reason="the C compiler is in the extra 'firmware'")

from firmware_bridge import Adxl345, ElfImage, StrictBoard
from firmware_bridge.lpc1768 import build as firmware
from firmware_bridge.strict.watch import Policy
from firmware_bridge.strict.worker import run_with_commands, run_with_input

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


class UntilConvicted(StrictBoard):
    """A board that ends its run with the first of some rules that is broken."""

    awaited: frozenset[str] = frozenset()

    def run_slice(self, end: int) -> bool:
        return super().run_slice(end) and self.awaited.isdisjoint(one.rule for one in self.ledger.findings())


def rules_broken(image: ElfImage, entry: dict[str, Any]) -> set[str]:
    board = UntilConvicted(image, [Adxl345(resting) for _ in range(4)], policy=Policy(baud=entry.get("baud")))
    board.awaited = frozenset(entry["expected"])
    if entry.get("commands"):
        run_with_commands(board, LIMIT_S)
    else:
        run_with_input(board, entry["seconds"], LIMIT_S)
    return {finding.rule for finding in board.findings()}


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("mutants")


@pytest.fixture
def mutant(folder, monkeypatch):
    """Build the firmware with a patch: in one place and file by file, so only the patched file is compiled anew."""

    def make(entry: dict[str, Any]) -> ElfImage:
        sources = folder / "src"
        shutil.rmtree(sources, ignore_errors=True)
        shutil.copytree(firmware.SOURCES, sources)
        apply_patch((FOLDER / entry["patch"]).read_text(encoding="utf-8"), sources)
        monkeypatch.setattr(firmware, "SOURCES", sources)
        monkeypatch.setattr(firmware, "source_hash", lambda *_: "0" * 64)
        if not entry.get("whole_program"):
            monkeypatch.setattr(firmware, "_FLAGS", tuple(flag for flag in firmware._FLAGS if flag != "-flto"))
        return ElfImage.load(firmware.build("gfimu", folder / "image").elf)

    return make


CAUGHT = [entry for entry in MUTANTS if "expected" in entry]


@pytest.mark.study(
    but=[
        "pins_not_selected",
        "flash_reset_value",
        "pclksel_late",
        "spi_mode_0",
        "select_left_low",
        "uart_dlab_left",
        "priority_not_shifted",
        "systick_misnamed",
        "spi_loop_back",
        "received_twice",
        "cause_not_read",
    ]
)
@pytest.mark.parametrize("entry", CAUGHT, ids=[entry["patch"].removesuffix(".patch") for entry in CAUGHT])
def test_the_mistake_is_found(entry, mutant) -> None:
    broken = rules_broken(mutant(entry), entry)
    assert broken & set(entry["expected"])


def test_nine_of_ten_mistakes_are_found_in_every_round() -> None:
    for designed in ("before", "first round", "second round", "third round"):
        rows = [entry for entry in MUTANTS if entry["designed"] == designed]
        assert sum("expected" in entry for entry in rows) >= 0.9 * len(rows) > 9


def test_every_patch_is_in_the_table_once() -> None:
    assert sorted(entry["patch"] for entry in MUTANTS) == sorted(path.name for path in FOLDER.glob("*.patch"))
