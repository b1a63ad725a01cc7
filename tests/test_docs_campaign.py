"""The plans on the page of campaigns can be run as they stand, and its figures agree with each other."""

import re
import struct

import pytest

from sim.trials import Design, check_factors, load_plan


@pytest.fixture(scope="module")
def page(project_root):
    return (project_root / "docs" / "how_to" / "campaign.md").read_text(encoding="utf-8")


def test_the_plans_of_the_page_are_plans(page, tmp_path):
    plans = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    assert len(plans) == 5
    sizes = []
    for text in plans:
        (tmp_path / "plan.toml").write_text(text)
        plan = load_plan(tmp_path / "plan.toml")
        design = Design(plan)
        check_factors(plan, design[0], "plan.toml")
        sizes.append(len(design))
    assert sizes == [120, 240, 128 * 6 * 16, 100_000, 64 * 2]


def test_the_figure_of_the_page_is_there_and_small(page, project_root):
    (name,) = re.findall(r"\(\.\./figures/(\S+?)\)", page)
    picture = (project_root / "docs" / "figures" / name).read_bytes()
    assert len(picture) < 150_000
    assert struct.unpack(">II", picture[16:24])[0] > 1200


def test_the_plan_for_many_runs_follows_from_the_measured_run(page):
    """Milliseconds, seconds and bytes of the text above the table: its hours, days and bytes."""
    measured = (r"(\d\.\d+) ms per world with", r"took (\d+) s and", r"and (\d\.\d) MB in")
    cost, two, size = (float(re.search(one, page)[1]) for one in measured)
    rows = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| 10")]
    assert [row[0] for row in rows] == ["10⁵", "10⁶", "10⁹"]
    units = {"s": 1.0, "min": 60.0, "h": 3600.0, "days": 86400.0, "MB": 1e6, "GB": 1e9}
    for runs, row in zip((1e5, 1e6, 1e9), rows, strict=True):
        amounts = [float(cell.split()[0]) * units[cell.split()[1]] for cell in row[1:] if cell != "–"]
        assert amounts[0] == pytest.approx(1e-3 * cost * runs, rel=0.05)
        assert amounts[1] == pytest.approx(two / 1e5 * runs, rel=0.05)
        assert amounts[-1] == pytest.approx(size * 1e6 / 1e5 * runs, rel=0.05)
        if len(amounts) == 4:
            assert amounts[2] == pytest.approx(amounts[0] / 64, rel=0.05)
