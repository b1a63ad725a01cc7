"""The designer's page: each figure is what the command above it prints."""

import math
import re

import numpy as np
import pytest

import gfimu
from gfimu.array import PartFile
from gfimu.budget import room_for

EDGES = {"cube50": 0.05, "cube12": 0.1, "cube200": 0.2}


@pytest.fixture(scope="module")
def page(project_root):
    return (project_root / "docs" / "cases" / "which_cube.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder with the arrays that the page makes."""
    made = tmp_path_factory.mktemp("cubes")
    for name in ("cube50", "cube200"):
        gfimu.optimize(4, box_m=[EDGES[name]] * 3, out=made / f"{name}.toml")
    return made


def array(folder, name):
    return name if name == "cube12" else folder / f"{name}.toml"


def rows(page, head):
    """Cells of the table whose head begins so."""
    found = re.search(rf"^\| {re.escape(head)}.*?(?=\n\n|\Z)", page, re.MULTILINE | re.DOTALL)
    lines = found.group().splitlines()
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in (lines[0], *lines[2:])]


def test_places(page):
    found = gfimu.optimize(4)
    assert f"GDOP {found.score.gdop:.4f}, ten of ten starts agree, *certificate: optimal*" in page
    assert (found.agreeing, found.starts) == (10, 10)
    assert found.certificate.bound == pytest.approx(found.score.gdop, rel=1e-6)


def test_numbers_of_chips(page, tmp_path):
    chips, dilution, least = rows(page, "chips |")
    front = gfimu.optimize(4, most_chips=8, pareto=["chips", "gdop"], front=tmp_path / "front")
    assert [int(cell) for cell in chips[1:]] == [point.values[0] for point in front.points]
    assert dilution[1:] == [f"{point.values[1]:.4f}" for point in front.points]
    assert least[1:] == [f"{point.bounds[1]:.4f}" for point in front.points]


def test_sizes(page, folder):
    _, *found = rows(page, "edge, m")
    range_g = max(PartFile.load("adxl345").range_g)
    for (name, edge), (first, bounds, largest) in zip(EDGES.items(), found, strict=True):
        assert float(first) == edge
        (score,) = gfimu.score([array(folder, name)], speed_rad_s=5.0)
        across, _, along = score.rate_bound_rad_s
        assert bounds == f"{across:.4f}, {along:.4f}"
        assert float(largest) == pytest.approx(math.sqrt(range_g * 9.80665 / (edge / math.sqrt(2.0))), abs=0.5)


def test_parts_and_tolerances(page, folder):
    _, *found = rows(page, "array | part | ω, one")
    for name, part, sample, integrated, share, placement, angles in found:
        calculated = gfimu.tolerance(
            array(folder, name.strip("`")), closed_form=True, part=part.lower(), calibrated=["poses+rest"]
        )
        quantities = calculated.budgets["poses+rest"].quantities
        omega = quantities["omega"]
        assert sample == f"{quantities['omega_null_space'].rms:#.3g}"
        assert integrated == f"{omega.rms:#.3g}"
        cause = max(omega.shares, key=omega.shares.get)
        assert share == f"{cause} {100 * omega.shares[cause]:.0f} %"
        assert room_for(omega, calculated.tolerances) == f"a tenth more at placement {placement} or angles {angles}"


def campaign_plan(page, folder, **changes):
    (text,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    for name, value in changes.items():
        text = re.sub(rf"^{name} = .*$", f"{name} = {value}", text, flags=re.MULTILINE)
    plan = folder / "plan.toml"
    plan.write_text(text)
    return plan


def errors(folder, plan, monkeypatch):
    """Errors of ω in mrad/s by array, part and calibration."""
    from sim.trials import Dataset

    monkeypatch.chdir(folder)
    out = folder / f"out{len(list(folder.iterdir()))}"
    gfimu.campaign(plan, out=out)
    found = {}
    for row in Dataset.open(out).table().to_pylist():
        assert row["failure"] == ""
        key = row["array"].removesuffix(".toml"), row["part"].upper(), row["calibration"]
        found.setdefault(key, []).append(1e3 * row["omega_rms_rad_s"])
    return found


def test_two_of_the_runs(page, folder, monkeypatch):
    """The first unit of the small cube lies in the page's 90 %."""
    plan = campaign_plan(page, folder, repeats=1, array='["cube50.toml"]', part='["adxl345"]')
    found = errors(folder, plan, monkeypatch)
    _, first, *_ = rows(page, "array | part | biases")
    for calibration, cell in zip(("rest", "poses"), first[2:], strict=True):
        _, low, high = map(float, re.findall(r"[\d.]+", cell))
        (value,) = found["cube50", "ADXL345", calibration]
        assert low <= value <= high


@pytest.mark.study
def test_all_runs(page, folder, monkeypatch):
    found = errors(folder, campaign_plan(page, folder), monkeypatch)
    _, *table = rows(page, "array | part | biases")
    assert len(table) == len(EDGES) * 2
    for name, part, *cells in table:
        for calibration, cell in zip(("rest", "poses"), cells, strict=True):
            values = found[name.strip("`"), part, calibration]
            low, median, high = np.quantile(values, [0.05, 0.5, 0.95])
            assert cell == f"{median:.1f} ({low:.1f} to {high:.1f})"
