"""Files in the shape of public formats are read right, or marked; what is wrong in silence must not be."""

import corpus_blind  # noqa: F401 - adds its shapes
import corpus_boards  # noqa: F401
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
LESS = {
    "gopro_accl": "silent",  # "Accelerometer [m/s2],1,2": a vector whose further columns are numbered
    "umafall": "silent",  # two keys of a row, kind and sensor; the first alone parts the rows
    "core_motion_iso": "silent",  # °F
    "altos_csv": "marked",  # the speed of a rocket
    "dji_datcon": "marked",  # ticks of 4.5 MHz are taken as µs beside a column of seconds
    "torque_pro": "marked",  # 17-May-2024
    "px4_vehicle_imu": "marked",  # increments of velocity
    "novatel_rawimu": "marked",  # a line "%RAWIMUSA,...;...*crc" is a comment
    "mvn_workbook": "marked",  # the title of the sheet states free acceleration
}
"""Shapes that are not read right: at least so. Blind, before anything was mended, 41 of 68 were right, 12 silent."""
BLIND = frozenset(name for name, one in SHAPES.items() if one.write.__module__ == "corpus_blind")


@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_is_read_right(name, tmp_path):
    verdict = judge(SHAPES[name].write(tmp_path))
    assert RANK.index(verdict.kind) >= RANK.index(LESS.get(name, "right")), verdict.why


@pytest.mark.parametrize(
    "names",
    [
        pytest.param(frozenset(SHAPES) - BLIND, id="known"),
        pytest.param(BLIND, id="blind", marks=pytest.mark.xfail(strict=True, reason="3 of 68 are silent")),
    ],
)
def test_nine_of_ten_are_right_and_hardly_one_wrong_in_silence(names):
    less = [LESS[name] for name in names if name in LESS]
    assert len(names) >= 60
    assert set(LESS) <= set(SHAPES)
    assert 1.0 - len(less) / len(names) >= LEAST_RIGHT
    assert less.count("silent") / len(names) <= MOST_SILENT


def test_the_page_lists_each_shape_with_its_source(project_root):
    page = (project_root / "docs" / "reference" / "foreign-formats.md").read_text(encoding="utf-8")
    assert set(SHAPES) >= SEEN
    for one in SHAPES.values():
        assert one.source.startswith(("http", "own: "))
        (row,) = [line for line in page.splitlines() if line.startswith(f"| `{one.name}` |")]
        assert one.source.split()[0].removeprefix("own:") in row
        assert row.endswith("| yes |") == (one.name in SEEN)
