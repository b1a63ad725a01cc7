"""The README and the docs say what is true: links lead somewhere, every example runs."""

from __future__ import annotations

import re
import shlex

import pytest


def blocks(text: str, language: str) -> list[str]:
    """Fenced blocks of a page in one language; a bare fence is the language ''."""
    fenced = re.findall(r"^```(\w*)\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    return [content for name, content in fenced if name == language]


@pytest.fixture
def readme(project_root):
    return (project_root / "README.md").read_text(encoding="utf-8")


def test_run_and_test_are_one_line_each(readme):
    run, test = blocks(readme, "sh")[:2]
    assert len(run.strip().splitlines()) == len(test.strip().splitlines()) == 1
    assert "gfimu demo" in run
    assert "pytest" in test


def test_links_lead_to_files_and_headings(project_root):
    pages = [project_root / "README.md", project_root / "CHANGELOG.md", *(project_root / "docs").rglob("*.md")]
    for page in pages:
        for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
            if "://" in target:
                continue
            path, _, anchor = target.partition("#")
            linked = (page.parent / path).resolve() if path else page
            assert linked.exists(), f"{page.name}: {target}"
            if anchor:
                headings = re.findall(r"^#+ (.+)$", linked.read_text(encoding="utf-8"), re.MULTILINE)
                slugs = {re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-") for heading in headings}
                assert anchor in slugs, f"{page.name}: {target}"


def test_the_readmes_commands_run(readme, gfimu_command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    commands = [line for block in blocks(readme, "") for line in block.splitlines() if line.startswith("gfimu ")]
    assert len(commands) >= 5
    for line in commands:
        arguments = shlex.split(line)[1:]
        if arguments[0] == "view":
            arguments += ["--out", "look.rrd"]  # the same without a window
        done = gfimu_command(*arguments)
        assert done.code == 0, f"{line}: {done.stderr}"


def test_the_readmes_python_runs(readme, gfimu_command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert gfimu_command("simulate", "paper_run", "--out", "run.parquet", "--seed", "1").code == 0
    (example,) = blocks(readme, "python")
    exec(compile(example, "README.md", "exec"), {})


def test_the_documented_csv_is_read(project_root, gfimu_command, tmp_path):
    """The format page's own example, with its ellipses filled in."""
    text = (project_root / "docs" / "reference" / "recording-format.md").read_text(encoding="utf-8")
    (example,) = (block for block in blocks(text, "") if block.startswith("# array"))
    names = [f"a{chip}{axis}_mg" for chip in range(1, 5) for axis in range(1, 4)]
    lines = example.splitlines()
    header = lines[2].replace(" … ,", ",".join(names[3:11]) + ",")
    rows = [line.replace(" … ,", "0.0," * 8) for line in lines[3:]]
    file = tmp_path / "example.csv"
    file.write_text("\n".join([*lines[:2], header, *rows]) + "\n", encoding="utf-8")
    done = gfimu_command("estimate", file, "--out", tmp_path / "estimate.csv")
    assert done.code == 0, done.stderr
