"""What the pages show below a command is what the command prints."""

import importlib.util
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "docs" / "scripts" / "excerpts.py"
specification = importlib.util.spec_from_file_location("excerpts", SCRIPT)
excerpts = importlib.util.module_from_spec(specification)
specification.loader.exec_module(excerpts)

PAGES = {str(page.relative_to(excerpts.DOCS)): page for page in excerpts.pages()}
REMEDY = "run: python docs/scripts/excerpts.py"


@pytest.mark.parametrize("name", PAGES)
def test_the_output_in_a_page_is_the_present_one(name):
    stored = PAGES[name].read_text(encoding="utf-8")
    assert not excerpts.difference(stored, excerpts.present(PAGES[name])), REMEDY


@pytest.mark.study
@pytest.mark.parametrize("name", [name for name, page in PAGES.items() if excerpts.has_study(page)])
def test_the_output_of_long_commands_is_the_present_one(name, tmp_path):
    stored = PAGES[name].read_text(encoding="utf-8")
    made = excerpts.present(PAGES[name], study=True, pictures=tmp_path)
    assert not excerpts.difference(stored, made), REMEDY
    assert all((excerpts.DOCS / "figures" / drawn.name).is_file() for drawn in tmp_path.iterdir())


def test_commands_run_in_one_folder_from_top_to_bottom(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "<!-- file: two.txt -->\n```\na\nb\n```\n\n```console\n$ cat two.txt | wc -l\n$ echo c >> two.txt\n```\n"
        "<!-- run: exit 3 -->\n```console\n$ tail -1 two.txt; exit 3\nold\n```\n"
        "<!-- run: study -->\n```console\n$ false\nas it was\n```\n"
        "<!-- run: needs json -->\n```console\n$ echo present\n```\n"
        "<!-- run: needs no_such_module -->\n```console\n$ echo absent\n```\n",
        encoding="utf-8",
    )
    made = excerpts.present(page)
    assert "wc -l\n2\n$ echo" in made
    assert "exit 3\nc\n```" in made
    assert "$ false\nas it was" in made
    assert "$ echo present\npresent\n" in made
    assert "$ echo absent\n```" in made
    with pytest.raises(RuntimeError, match="exit code 1 instead of 0"):
        excerpts.present(page, study=True)


@pytest.mark.parametrize(
    ("stored", "made", "same"),
    [
        ("σ 0.0323 rad/s", "σ 0.0324 rad/s", True),
        ("σ 0.0323 rad/s", "σ 0.0326 rad/s", False),
        ("−1.44 rad", "−1.43 rad", True),
        ("12 axes", "12 chips", False),
        ("done in 3 s", "done in 27.1 s", True),
        ("one\ntwo", "one", False),
    ],
)
def test_numbers_agree_to_their_last_digit(stored, made, same):
    assert (not excerpts.difference(stored, made)) is same


@pytest.mark.study
def test_the_picture_of_the_report_is_drawn(tmp_path):
    location = importlib.util.spec_from_file_location("make_report_picture", SCRIPT.with_name("make_report_picture.py"))
    script = importlib.util.module_from_spec(location)
    location.loader.exec_module(script)
    if script.browser() is None:
        pytest.skip("no Chromium here")
    drawn, stored = script.main(tmp_path), excerpts.DOCS / "figures" / "diagnosis_report.png"
    assert drawn.read_bytes()[16:24] == stored.read_bytes()[16:24]  # of the same size
    assert drawn.stat().st_size > 30_000
