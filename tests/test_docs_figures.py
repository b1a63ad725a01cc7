"""The script that draws the documentation's figures, and that the pages quote what it finds."""

import importlib.util
import re
import struct
import sys

import matplotlib.image
import numpy as np
import pytest


def loaded(project_root, name):
    path = project_root / "docs" / "scripts" / f"{name}.py"
    specification = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module  # dataclasses look their module up
    specification.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def script(project_root):
    return loaded(project_root, "make_figures")


@pytest.fixture(scope="module")
def experiment(script):
    return script.Experiment.run()


@pytest.fixture(scope="module")
def drawn(script, tmp_path_factory):
    return script.main(tmp_path_factory.mktemp("figures"))


def test_every_figure_is_drawn_small_and_not_empty(drawn):
    assert len(drawn) == 7
    for path in drawn:
        assert path.stat().st_size < 150_000
        picture = matplotlib.image.imread(path)
        assert np.ptp(picture[..., :3]) == 1.0
        assert np.mean(picture[..., :3].min(axis=-1) < 0.9) > 0.01  # share of pixels with ink


def test_the_pages_show_exactly_these_figures(drawn, project_root):
    names = {path.name for path in drawn}
    shown = set()
    for page in ("cases/paper_experiment.md", "theory/drift.md"):
        shown |= set(re.findall(r"\(\.\./figures/(\S+?)\)", (project_root / "docs" / page).read_text()))
    assert shown == names
    for path in drawn:
        same_size(path, project_root / "docs" / "figures" / path.name)


def same_size(drawn, stored):
    """The stored picture is of the drawn one's size: nobody forgot to draw it again after a change."""
    assert struct.unpack(">II", stored.read_bytes()[16:24]) == struct.unpack(">II", drawn.read_bytes()[16:24])


@pytest.mark.parametrize(
    ("name", "page"),
    [
        ("make_bench_figure", "how_to/bench.md"),
        ("make_motor_figure", "how_to/rigs.md"),
        pytest.param("make_design_figure", "how_to/design.md", marks=pytest.mark.study),
    ],
)
def test_a_figure_of_one_page_is_drawn(project_root, tmp_path, capsys, name, page):
    path = loaded(project_root, name).main(tmp_path)
    text = (project_root / "docs" / page).read_text(encoding="utf-8")
    assert f"figures/{path.name})" in text
    same_size(path, project_root / "docs" / "figures" / path.name)
    for rate, ripple in re.findall(r"(\d+) rad/s: ([\d.]+) mrad/s", capsys.readouterr().out):
        assert re.search(rf"{float(ripple):.1f} (?:mrad/s )?at {rate} rad/s", text)


def test_what_the_page_says_of_the_run(experiment, script):
    numbers = script.figures_in_numbers(experiment)
    assert 300 < numbers["free_m"] < 3000  # "about a kilometre"
    assert 10 < numbers["held_m"] < 100  # "some tens of metres"
    assert 1000 < numbers["free_deg_h"] < 10_000
    assert 75 < numbers["held_deg_h"] < 300
    assert 2 * np.pi < abs(numbers["angle_error_rad"]) < 4 * np.pi + 2
    # Gravity on z; on x and y the tilt turns with the cube, amplitude g · |tilt|.
    p = experiment.estimate.p
    assert p[:, 2].mean() == pytest.approx(9.807, abs=0.01)
    tilt = np.hypot(*script.TILT.values())
    turning = (experiment.recording.t_s > 4) & (experiment.recording.t_s < 13.5)
    for axis in range(2):
        assert np.ptp(p[turning, axis]) / 2 == pytest.approx(9.807 * tilt, rel=0.2)


@pytest.mark.parametrize(("rate", "metres"), [(0.0, 1300.0), (3.0, 50.0)])
def test_noise_alone_exceeds_the_papers_thirty_degrees_per_hour(rate, metres):
    from gfimu import AccelerometerArray, ErrorSources, drift_budget

    noise = ErrorSources(noise_density=290e-6 * 9.80665)
    budget = drift_budget(AccelerometerArray.load("cube12"), 30.0, noise, rate=rate)
    assert budget.total_std[0] == pytest.approx(metres, rel=0.1)
