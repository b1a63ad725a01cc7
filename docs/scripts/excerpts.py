"""Run the commands in the pages and compare what they print, or write it into the pages.

A fenced block ``console`` holds commands behind ``$ `` and what each prints. The blocks of a page run from top to
bottom in one folder that holds the files of docs/examples. A comment on the line before a block or a picture says::

    <!-- run: study -->           it takes long: left out unless asked for, which the study `docs` does
    <!-- run: exit 2 -->          the command ends with this exit code instead of 0
    <!-- run: needs unicorn -->   left out where this Python module is not installed
    <!-- file: my_array.toml -->  the block below is a file in that folder
    <!-- picture: array.png -->   the picture below is the file that a command has drawn there

Run ``python docs/scripts/excerpts.py [PAGE ...]`` to write the present output into the pages, ``--check`` to compare.
Numbers agree if they differ by no more than one unit of the last digit that the page gives.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
from decimal import Decimal
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PART = re.compile(
    r"(?:^<!-- (?P<mark>run|file|picture): (?P<words>.+?) -->\n)?"
    r"(?:^```(?P<language>\w*)\n(?P<text>.*?)^```$|^!\[[^\]]*\]\((?P<link>\S+?)\)$)",
    re.DOTALL | re.MULTILINE,
)
NUMBER = re.compile(r"[-−+]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?")
PROGRESS = re.compile(r"^gfimu: .+: (?:\d+ %, )?\d+ s(?:: .*)?\n", re.MULTILINE)
"""A line of progress, which a slow machine prints and a fast one does not."""
TIME = re.compile(r"\b(?:done in|took) [\d.]+ (?:s|min)\b|(?<=│ processor s)[ │\d.]+")


def pages() -> list[Path]:
    """Return the pages that hold commands with their output."""
    found = (page for page in sorted(DOCS.rglob("*.md")) if "_build" not in page.parts)
    return [page for page in found if "\n```console\n" in page.read_text(encoding="utf-8")]


def has_study(page: Path) -> bool:
    """Whether a page has blocks that take long."""
    return "<!-- run: study" in page.read_text(encoding="utf-8")


def present(page: Path, *, study: bool = False, pictures: Path | None = None) -> str:
    """Return the text of a page with what its commands print now.

    Parameters
    ----------
    page : Path
        The page.
    study : bool
        Whether to run the blocks that take long as well; else their output stays as it is.
    pictures : Path, optional
        Folder to which the drawn pictures are copied, by their names in the page; by default they stay as they are.
    """
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for example in (DOCS / "examples").glob("*.py"):
            shutil.copy(example, folder)
        environment = _environment(folder / ".bin")

        def replaced(part: re.Match[str]) -> str:
            words, text = part["words"] or "", part["text"]
            if part["mark"] == "file":
                (folder / words).write_text(text, encoding="utf-8")
            elif part["mark"] == "picture" and (folder / words).is_file() and pictures is not None:
                shutil.copyfile(folder / words, pictures / Path(part["link"]).name)
            elif part["language"] == "console" and (study or "study" not in words) and _installed(words):
                code = re.search(r"exit (\d+)", words)
                printed = "".join(
                    _output(line, int(code[1]) if code else 0, folder, environment)
                    for line in text.splitlines()
                    if line.startswith("$ ")
                )
                return part[0].replace(text, printed)
            return part[0]

        return PART.sub(replaced, page.read_text(encoding="utf-8"))


def difference(stored: str, made: str) -> str:
    """Return the first lines that differ by more than the last digit of a number; an empty text if none do."""
    before, after = stored.splitlines(), made.splitlines()
    for old, new in zip(before, after, strict=False):
        if not _same(old, new):
            return f"page: {old}\nnow:  {new}"
    return "" if len(before) == len(after) else f"page: {len(before)} lines\nnow:  {len(after)} lines"


def _installed(words: str) -> bool:
    """Whether the module is there that a block needs according to its mark."""
    needed = re.search(r"needs (\w+)", words)
    return needed is None or importlib.util.find_spec(needed[1]) is not None


def _same(old: str, new: str) -> bool:
    old, new = TIME.sub("", old), TIME.sub("", new)
    if NUMBER.sub("0", old) != NUMBER.sub("0", new):
        return False
    pairs = zip(NUMBER.findall(old), NUMBER.findall(new), strict=True)
    return all(_close(*(Decimal(text.replace("−", "-").replace(",", "")) for text in pair)) for pair in pairs)


def _close(old: Decimal, new: Decimal) -> bool:
    exponent = old.as_tuple().exponent
    return abs(old - new) <= Decimal(1).scaleb(int(exponent))


def _environment(programs: Path) -> dict[str, str]:
    """Return the environment of a terminal of 80 columns in which `gfimu` and `python` are those of this process."""
    programs.mkdir()
    for name, call in (("gfimu", f'"{sys.executable}" -m gfimu'), ("python", f'"{sys.executable}"')):
        (programs / name).write_text(f'#!/bin/sh\nexec {call} "$@"\n', encoding="utf-8")
        (programs / name).chmod(0o755)
    own = {"COLUMNS": "80", "PYTHONPATH": str(ROOT), "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}
    return {**os.environ, **own, "NO_COLOR": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONIOENCODING": "utf-8"}


def _output(line: str, code: int, folder: Path, environment: dict[str, str]) -> str:
    """Run one command; return its line and what it prints, without spaces at the ends of lines."""
    call = ["bash", "-o", "pipefail", "-c", line.removeprefix("$ ")]
    done = subprocess.run(
        call, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False
    )
    text = PROGRESS.sub("", done.stdout.decode("utf-8").replace(f"{folder}/", ""))
    if done.returncode != code:
        raise RuntimeError(f"{line}\nended with exit code {done.returncode} instead of {code}:\n{text}")
    return "\n".join([line, *(row.rstrip() for row in text.rstrip().splitlines())]) + "\n"


def main() -> int:
    """Write the pages, or compare them; return the exit code."""
    parser = argparse.ArgumentParser(description="Commands in the pages and what they print.")
    parser.add_argument("pages", nargs="*", type=Path, help="pages; by default all")
    parser.add_argument("--check", action="store_true", help="compare and write nothing")
    parser.add_argument("--quick", action="store_true", help="leave out blocks that take long")
    options = parser.parse_args()
    differing = 0
    for page in options.pages or pages():
        stored = page.read_text(encoding="utf-8")
        made = present(page, study=not options.quick, pictures=None if options.check else DOCS / "figures")
        if found := difference(stored, made):
            differing += 1
            print(f"{page}\n{found}")
            if not options.check:
                page.write_text(made, encoding="utf-8")
    return 1 if options.check and differing else 0


if __name__ == "__main__":
    sys.exit(main())
