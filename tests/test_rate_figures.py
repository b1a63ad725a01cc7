"""The script that draws the figures of docs/rate.md."""

import importlib.util
import sys

import matplotlib.image
import numpy as np
import pytest


@pytest.fixture(scope="module")
def script(project_root):
    path = project_root / "docs" / "make_rate_figures.py"
    specification = importlib.util.spec_from_file_location("make_rate_figures", path)
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module
    specification.loader.exec_module(module)
    return module


def test_paper_run_is_drawn_and_the_filter_beats_the_integration(script, tmp_path, capsys):
    picture = matplotlib.image.imread(script.draw_paper_run(tmp_path))
    assert np.mean(picture[..., :3].min(axis=-1) < 0.9) > 0.05
    rows = {
        line.split()[0]: [float(cell) for cell in line.split()[1:]] for line in capsys.readouterr().out.splitlines()[1:]
    }
    assert rows["filter"][0] < rows["integrate"][0] / 3
    assert rows["smoother"][1] <= rows["filter"][1] < rows["integrate"][1] / 3


def test_bounds_are_reached_in_steady_turning(script):
    found = script.steady_error(5.0, 0.03, 0)
    assert found["smoother"] < found["filter"] < found["ml"] <= 1.05 * found["algebraic"]
