"""The page of the three papers: each row is complete and names commands, tests and scripts that exist."""

import re
import shlex

import pytest

import gfimu
from gfimu.commands import CommandGroup

ROW_CELLS = 6  # item, as printed, as derived, as run, agreement, difference


@pytest.fixture(scope="module")
def page(project_root):
    return (project_root / "docs" / "theory" / "papers.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def rows(page):
    """Cells of every row of the papers' tables; a bar within a cell is written with a backslash."""
    found = []
    for part in page.split("\n## ")[2:]:
        table = [line for line in part.splitlines() if line.startswith("|")]
        found += [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in table[2:]]
    return found


@pytest.fixture(scope="module")
def tests_by_name(project_root):
    files = (project_root / "tests").rglob("test_*.py")
    texts = (file.read_text(encoding="utf-8") for file in files)
    return {name for text in texts for name in re.findall(r"^def (test_\w+)", text, re.MULTILINE)}


def options_of(words):
    """Options of the command that ``words`` (after ``gfimu``) name, or None where there is no such command."""
    command = CommandGroup(name="gfimu").commands.get(words[0])
    return None if command is None else {option for parameter in command.params for option in parameter.opts}


def test_the_papers_are_all_there_and_each_row_is_complete(page, rows):
    assert re.findall(r"^## (.+ paper)$", page, re.MULTILINE) == ["GF-IMU paper", "Chinese paper", "Persian paper"]
    assert len(rows) > 60
    for cells in rows:
        assert len(cells) == ROW_CELLS, cells
        assert all(cells), cells


def test_what_a_row_runs_exists(rows, tests_by_name, project_root):
    for cells in rows:
        references = re.findall(r"`([^`]+)`", cells[3])
        assert references, f"{cells[:2]}: runs nothing"
        for reference in [*references, *re.findall(r"`(test_\w+)`", cells[5])]:
            assert exists(reference, tests_by_name, project_root), f"{cells[:2]}: {reference}"


def exists(reference, tests_by_name, project_root):
    """Whether a test, a call of the program with its options, a public function or a script is there."""
    if reference.startswith("test_"):
        return reference in tests_by_name
    if reference.startswith("gfimu "):
        words = shlex.split(reference)[1:]
        options = options_of(words)
        return options is not None and {word for word in words if word.startswith("--")} <= options
    if reference.startswith("gfimu."):
        return hasattr(gfimu, reference.removeprefix("gfimu."))
    return (project_root / reference).is_file()


@pytest.mark.parametrize("reference", ["test_nothing", "gfimu nothing", "gfimu score --nothing", "gfimu.nothing", "no"])
def test_what_is_not_there_is_seen(reference, tests_by_name, project_root):
    assert not exists(reference, tests_by_name, project_root)


def test_no_shipped_file_calls_itself_the_printed_matrix(project_root):
    """The printed J has one column twice; the arrays are the derived one."""
    shipped = [*(project_root / "models").rglob("*.toml"), *(project_root / "gfimu").rglob("*.py")]
    pages = [page for page in (project_root / "docs").rglob("*.md") if page.name not in {"papers.md", "geometry.md"}]
    for file in [*shipped, *pages, project_root / "README.md"]:
        assert not re.search(r"printed J\b|matrix printed", file.read_text(encoding="utf-8")), file.name


CITED = re.compile(
    r"(?:(GF-IMU|Persian) (?:calibration )?)?paper[^.;\n]{0,40}?\beqs?\.? (\d+)(?:[-–](\d+))?"
    r"|(?<![\w-])eqs (28)[-–](29)"
)


def numbers(text):
    """Numbers of equations that a text names, ranges filled in."""
    return {
        number
        for first, last in re.findall(r"\beqs?\.? (\d+)(?:[-–](\d+))?", text)
        for number in range(int(first), int(last or first) + 1)
    }


def test_equations_that_the_code_cites_are_in_the_theory(page, project_root):
    """A number that a comment cites leads to a row of the papers, or to a derivation."""
    theory = project_root / "docs" / "theory"
    sections = {name: page.split(f"## {name} paper")[1].split("\n## ")[0] for name in ("GF-IMU", "Persian")}
    derived = "".join((theory / name).read_text(encoding="utf-8") for name in ("geometry.md", "drift.md"))
    known = {"GF-IMU": numbers(sections["GF-IMU"]) | numbers(derived), "Persian": numbers(sections["Persian"])}
    cited = [
        (match[1] or "GF-IMU", number, file.name)
        for folder in ("gfimu", "sim", "firmware_bridge")
        for file in (project_root / folder).rglob("*.py")
        for match in CITED.finditer(file.read_text(encoding="utf-8"))
        for number in numbers(match[0])
    ]
    assert {number for paper, number, _ in cited if paper == "GF-IMU"} >= {2, 22, 28, 29, 30}
    assert not [where for where in cited if where[1] not in known[where[0]]]
