"""What a release states agrees: version, date, changelog, citation, deprecated names; no address that is invented."""

from __future__ import annotations

import re
import subprocess
import tomllib

import pytest

import gfimu


def text(root, name: str) -> str:
    return (root / name).read_text(encoding="utf-8")


def test_changelog_has_versions_by_date_and_the_present_one_first(project_root):
    heads = re.findall(r"^## (.+)$", text(project_root, "CHANGELOG.md"), re.MULTILINE)
    assert heads[0] == "Unreleased"
    released = [re.fullmatch(r"(\d+\.\d+\.\d+) - (\d{4}-\d\d-\d\d)", head) for head in heads[1:]]
    assert all(released), heads
    assert released[0][1] == gfimu.__version__
    assert [one[2] for one in released] == sorted((one[2] for one in released), reverse=True)


def test_changelog_uses_the_headings_of_its_form(project_root):
    headings = set(re.findall(r"^### (.+)$", text(project_root, "CHANGELOG.md"), re.MULTILINE))
    assert headings <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}


def test_citation_is_of_the_present_version(project_root):
    citation = text(project_root, "CITATION.cff")
    (date,) = re.findall(
        rf"^## {re.escape(gfimu.__version__)} - (.+)$", text(project_root, "CHANGELOG.md"), re.MULTILINE
    )
    assert f"\nversion: {gfimu.__version__}\n" in citation
    assert f"\ndate-released: {date}\n" in citation


def test_the_version_stands_in_one_place(project_root):
    project = tomllib.loads(text(project_root, "pyproject.toml"))
    assert project["project"]["dynamic"] == ["version"]
    assert project["tool"]["hatch"]["version"]["path"] == "gfimu/base/version.py"


@pytest.mark.parametrize(
    "name",
    [
        "CONTRIBUTING.md",
        "CODE_OF_CONDUCT.md",
        "CHANGELOG.md",
        "docs/development/stability.md",
        "docs/reference/installation.md",
        "docs/paper/paper.md",
    ],
)
def test_links_between_files_lead_somewhere(name, project_root):
    folder = (project_root / name).parent
    links = re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", text(project_root, name))
    assert [link for link in links if not (folder / link).exists()] == []


PLACEHOLDER = re.compile(
    r"example\.(invalid|com|org)|\bTODO\b|\bFIXME\b|your-(org|name)|github\.com/(gfimu|user|owner)\b", re.IGNORECASE
)


def test_no_address_is_a_placeholder(project_root):
    listed = subprocess.run(["git", "ls-files"], cwd=project_root, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("no checkout")
    found = [
        f"{name}: {match.group()}"
        for name in listed.stdout.splitlines()
        if name.endswith((".md", ".toml", ".cff", ".yml", ".yaml", ".bib")) or name == "Containerfile"
        if (project_root / name).is_file() and (match := PLACEHOLDER.search(text(project_root, name)))
    ]
    assert found == []


def test_hooks_and_continuous_integration_run_the_same_tools(project_root):
    hooks, run = text(project_root, ".pre-commit-config.yaml"), text(project_root, ".ci/run")
    for tool in ("ruff format", "ruff check", "mypy"):
        assert f"entry: {tool}" in hooks
        assert f".venv/bin/{tool}" in run
    assert "repo: local" in hooks
    assert "http" not in hooks


def cited(root) -> set[str]:
    return set(re.findall(r"[\[ ]@([A-Za-z]+\d*)", text(root, "docs/paper/paper.md")))


def test_the_paper_cites_what_its_bibliography_holds(project_root):
    held = set(re.findall(r"^@\w+\{(\w+),", text(project_root, "docs/paper/paper.bib"), re.MULTILINE))
    assert cited(project_root) == held
    assert len(held) > 5


def test_every_reference_of_the_paper_can_be_found(project_root):
    entries = text(project_root, "docs/paper/paper.bib").split("\n@")
    assert len(entries) > 5
    for entry in entries:
        assert re.search(r"^  doi +=  *\{10\.\d{4,}/\S+\}|^  note +=", entry, re.MULTILINE), entry


STUDY_COLUMNS = (0, 1, 2, 3, 4, 6, 7)
"""Of the study's table: list, worlds, hidden, runs, right alone, right in any set, wrong name."""


def test_figures_of_the_paper_are_the_stored_ones(project_root):
    study = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in text(project_root, "docs/accuracy/diagnosis-study.md").splitlines()
        if line.startswith("| ")
    ]
    stored = {tuple(row[column] for column in STUDY_COLUMNS) for row in study if len(row) > 7}
    paper = text(project_root, "docs/paper/paper.md")
    table = paper.split("| list | worlds from |")[1].split("\n\n")[0].splitlines()[2:]
    shown = [tuple(cell.strip() for cell in line.strip("|").split("|")) for line in table]
    assert len(shown) == 8
    assert [row for row in shown if row not in stored] == []
    (left_out,) = (row for row in study if row[0] == "left_out")
    assert f"given in {left_out[10].split()[0]} % of these runs" in " ".join(paper.split())


def test_the_paper_counts_the_effects_that_there_are(project_root):
    from sim.effects import EFFECTS, FURTHER_EFFECTS

    counts = re.search(
        r"with (\d+) usual and (\d+) further", " ".join(text(project_root, "docs/paper/paper.md").split())
    )
    assert [int(one) for one in counts.groups()] == [len(EFFECTS), len(FURTHER_EFFECTS)]


def test_the_paper_counts_foreign_worlds_as_their_page(project_root):
    rows = dict(
        re.findall(
            r"^\| `?(right|near|unknown|wrong|refused)`?[^|]*\| (\d+) \|$",
            text(project_root, "docs/accuracy/diagnosis-outside.md"),
            re.MULTILINE,
        )
    )
    words = " ".join(text(project_root, "docs/paper/paper.md").split())
    total = sum(map(int, rows.values()))
    assert (
        f"of {total} recordings {rows['right']} were named by place and dependence, {rows['near']} nearly, "
        f"{rows['unknown']} were `unknown`, {rows['wrong']} were named wrongly and {rows['refused']} refused" in words
    )
