"""Files in the shape of public formats are read right, or marked; what is wrong in silence must not be."""

import corpus_boards  # noqa: F401 - adds its shapes
import corpus_containers  # noqa: F401
import corpus_laboratory  # noqa: F401
import corpus_phones  # noqa: F401
import corpus_robots  # noqa: F401
import corpus_wearables  # noqa: F401
import pytest
from corpus_judge import judge
from corpus_motion import SEEN, SHAPES

LEAST_RIGHT, MOST_SILENT = 0.90, 0.02  # shares of the shapes
RANK = ("silent", "marked", "right")
LESS: dict[str, str] = {}
"""Shapes that are not read right: at least so."""


@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_is_read_right(name, tmp_path):
    verdict = judge(SHAPES[name].write(tmp_path))
    assert RANK.index(verdict.kind) >= RANK.index(LESS.get(name, "right")), verdict.why


def test_nine_of_ten_are_right_and_hardly_one_wrong_in_silence():
    assert len(SHAPES) >= 60
    assert set(LESS) <= set(SHAPES)
    assert 1.0 - len(LESS) / len(SHAPES) >= LEAST_RIGHT
    assert sum(kind == "silent" for kind in LESS.values()) / len(SHAPES) <= MOST_SILENT


def test_the_page_lists_each_shape_with_its_source(project_root):
    page = (project_root / "docs" / "reference" / "foreign-formats.md").read_text(encoding="utf-8")
    assert set(SHAPES) >= SEEN
    for one in SHAPES.values():
        assert one.source.startswith(("http", "own: "))
        (row,) = [line for line in page.splitlines() if line.startswith(f"| `{one.name}` |")]
        assert one.source.split()[0].removeprefix("own:") in row
        assert row.endswith("| yes |") == (one.name in SEEN)
