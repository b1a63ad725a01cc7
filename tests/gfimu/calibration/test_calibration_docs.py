"""The scripts behind both pages calibration.md and docs/theory/noise.md, and that the pages quote what they find."""

import importlib.util
import re
import sys

import numpy as np
import pytest


def load(project_root, name):
    specification = importlib.util.spec_from_file_location(name, project_root / "docs" / "scripts" / f"{name}.py")
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module
    specification.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def page(project_root):
    """The how-to page and the page of its measurements."""
    pages = (project_root / "docs" / room / "calibration.md" for room in ("how_to", "accuracy"))
    return "\n".join(page.read_text(encoding="utf-8") for page in pages)


@pytest.mark.study
def test_what_holds_of_the_persian_papers_ranking(project_root, tmp_path):
    """The statements of the page, on a few triads."""
    script = load(project_root, "compare_calibrations")
    comparison = script.compare(4, seed=2, levelling=(0.0, 0.5))
    sps, rls, mp = (
        {kind: np.median(comparison.rms(0.5, name, kind)) for kind in script.INPUTS} for name in script.METHODS
    )
    assert mp["averaged"] < 0.2 * sps["averaged"]
    assert sps["averaged"] == pytest.approx(rls["averaged"], rel=0.03)
    for result in (sps, mp):
        assert result["raw"] == pytest.approx(result["averaged"], rel=0.05)
        assert result["wavelet"] == pytest.approx(result["averaged"], rel=0.05)
    level = [np.median(comparison.rms(0.0, name, "averaged")) for name in script.METHODS]
    assert max(level) < 0.003
    assert script.table(comparison).count("\n") == 7
    script.draw(comparison, tmp_path / "histograms.png")
    assert (tmp_path / "histograms.png").stat().st_size > 5000


def test_the_wavelet_input_is_compared_with_averages(project_root, page):
    script = load(project_root, "compare_calibrations")
    ratios = script.compare_wavelets(1, levels=(2,))
    for name in ("six-position (SPS)", "multi-position (MP)"):
        found = [ratios[name, 2, threshold] for threshold in script.THRESHOLDS]
        assert found == pytest.approx([1.0] * 3, abs=0.05)
    rows = script.wavelet_table(ratios).splitlines()
    assert len(rows) == 4
    assert rows[0] in page


def test_figures_and_the_numbers_quoted(project_root, page, tmp_path):
    script = load(project_root, "make_calibration_figures")
    found = script.main(tmp_path)
    for name in ("calibration_correlation", "calibration_coarse_fine", "noise_allan"):
        assert (tmp_path / f"{name}.png").stat().st_size > 5000
        assert (project_root / "docs" / "figures" / f"{name}.png").is_file()
    quoted = dict(re.findall(r"(X[YZ]|YZ)/[A-Z]{2} −(0\.\d+)", page))
    for pair, value in found["correlation"].items():
        assert value == pytest.approx(-float(quoted[pair]), abs=6e-5)
        assert value < -0.99
    coarse, fine = found["coarse_and_fine"]
    assert round(1e3 * coarse) == 30
    assert round(1e3 * fine) == 1
    for symbol, value in {"N": 0.003, "B": 0.0008, "K": 0.0001}.items():
        assert found["noise"][symbol] == pytest.approx(value, rel=0.15)
