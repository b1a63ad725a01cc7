"""The words of the documentation are the field's: the glossary's names exist, vague words are not used."""

import re

import pytest

from gfimu.commands import CommandGroup

VAGUE = re.compile(
    r"\b(wander\w*|told|tells?|felt|feels?|hears?|heard|loosen\w*|ringing|rings|rung|imitat\w*|gross|faint|honest\w*)\b"
    r"|\bleft over\b",
    re.IGNORECASE,
)
"""Each has an exact word: reported, estimated, modelled, confounded, random walk, large."""

OUTSIDE = {"diagnosis-study.md"}  # names the runs of the stored study, which are called so


def pages(root):
    return [root / "README.md", *(page for page in sorted((root / "docs").rglob("*.md")) if page.name not in OUTSIDE)]


def test_the_pages_use_exact_words(project_root):
    found = [
        f"{page.name}:{number}: {match.group()}"
        for page in pages(project_root)
        for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1)
        if (match := VAGUE.search(re.sub(r"`[^`]*`", "", line)))
    ]
    assert not found


@pytest.fixture(scope="module")
def glossary(project_root):
    return (project_root / "docs" / "reference" / "glossary.md").read_text(encoding="utf-8")


def test_each_term_names_a_standard_of_the_list(glossary):
    listed = set(re.findall(r"^\| ([^|]+?) \|", glossary.split("## What an")[0], re.MULTILINE))
    listed = {name for names in listed for name in names.split(", ")} | {"VIM", "GUM"}
    tables = [part for part in glossary.split("\n## ")[2:] if "| standard |" in part]
    assert len(tables) == 5
    for part in tables:
        head, _, *rows = [line.strip("| ").split(" | ") for line in part.splitlines() if line.startswith("|")]
        place = head.index("standard")
        for row in rows:
            for name in row[place].split(", "):
                field = re.sub(r" \(.*\)", "", name)
                assert field in listed or field in {"satellite navigation", "statistics", "detection theory"}, row


def test_names_of_the_glossary_exist(glossary, project_root):
    sources = "\n".join(
        file.read_text(encoding="utf-8")
        for folder in ("gfimu", "sim", "models")
        for file in (project_root / folder).rglob("*")
        if file.suffix in {".py", ".toml"}
    )
    commands = CommandGroup(name="gfimu").list_commands(None)
    for name in re.findall(r"`([^`]+)`", glossary):
        if name.startswith("gfimu "):
            assert name.split()[1] in commands, name
        elif re.match(r"a1_[a-z]_|a1_M_", name):
            assert f"_{name.split('_')[1]}_" in sources, name
        elif not re.fullmatch(r"a\d\d", name):
            assert name in sources, name
