"""The script that draws the figures of docs/theory/rate.md."""

import importlib.util
import sys

import matplotlib.image
import numpy as np
import pytest


@pytest.fixture(scope="module")
def script(project_root):
    path = project_root / "docs" / "scripts" / "make_rate_figures.py"
    specification = importlib.util.spec_from_file_location("make_rate_figures", path)
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module
    specification.loader.exec_module(module)
    return module


def test_paper_run_is_drawn(script, tmp_path):
    picture = matplotlib.image.imread(script.draw_paper_run(tmp_path))
    assert np.mean(picture[..., :3].min(axis=-1) < 0.9) > 0.05


def test_drift_on_the_paper_run_beside_the_model(script):
    """Two runs of each method. At rest the model's position is an upper limit, turning all the time a lower one."""
    rows = script.drift_table(2)
    at_rest, turning, integrate, filtered, smoothed = rows.values()
    assert list(rows)[2:] == ["integrate", "filter", "smoother"]
    # Six components of two runs around the model's σ, and up to twice that by the scale factors the model is not told.
    assert 0.5 * at_rest[0] < integrate[0] < 3 * at_rest[0]
    assert turning[1] < integrate[1] < at_rest[1]
    assert filtered[0] < integrate[0] / 3
    assert filtered[1] < integrate[1] / 3
    # The path is in the state, so at the end the filter knows all that the smoother does.
    assert smoothed[1] == pytest.approx(filtered[1], rel=0.1)


def test_bounds_are_reached_in_steady_turning(script):
    found = script.steady_error(5.0, 0.03, 0)
    assert found["smoother"] < found["filter"] < found["ml"] <= 1.05 * found["algebraic"]
