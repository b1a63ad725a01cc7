"""The picture of a campaign: labels with units, axes as the plan's scales, and what there is too much of is said."""

import numpy as np
import pyarrow as pa
import pytest
from matplotlib.figure import Figure

from gfimu import InputError
from sim.trials import Design, campaign_picture, load_plan
from sim.trials.sweep.panels import draw_over, label
from sim.trials.sweep.summary import numbers

PLAN = """
design = "random"
points = 60
[factors]
method = ["filter", "smoother"]
"sensor.range_g" = [2, 16]
[factors."noise.std_m_s2"]
low = 1e-3
high = 1.0
scale = "log"
"""


@pytest.fixture
def drawn(tmp_path):
    """Text of the SVG of a campaign with some results."""

    def draw(results, chosen=()):
        (tmp_path / "plan.toml").write_text(PLAN)
        design = Design(load_plan(tmp_path / "plan.toml"))
        rng = np.random.default_rng(1)
        cases = [design[number] for number in range(len(design))]
        rows = [
            {"case": case.number, "seed": case.seed, **case.values, "failure": "", **results(case.values, rng)}
            for case in cases
        ]
        out = tmp_path / "picture.svg"
        campaign_picture(out, tmp_path / "mine", pa.Table.from_pylist(rows), design, chosen)
        return out.read_text()

    return draw


def texts(svg):
    """Texts of an SVG, which are comments beside their outlines."""
    return [line.strip()[5:-4] for line in svg.splitlines() if line.strip().startswith("<!-- ")]


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("alpha_rms_rad_s2", "alpha rms (rad/s²)"),
        ("omega_end_rad_s", "omega end (rad/s)"),
        ("sensor_position.std_m", "sensor position std (m)"),
        ("bias_instability_mg", "bias instability (mg)"),
        ("sample_rate_hz", "sample rate (Hz)"),
        ("method", "method"),
    ],
)
def test_names_are_shown_with_their_units(name, shown):
    assert label(name) == shown


def test_every_factor_has_a_panel_and_every_result_a_row(drawn):
    shown = texts(drawn(lambda values, rng: {"y_m": 1.0 + rng.random(), "right": bool(rng.random() < 0.5)}))
    names = (
        "method",
        "sensor range (g)",
        "noise std (m/s²)",
        "y (m)",
        "share of cases: right",
        "share of the variance",
    )
    for text in ("mine: 60 of 60 cases", "filter", "smoother", *names):
        assert text in shown, text
    assert any("10^{-2}" in text for text in shown)  # the range is logarithmic


def test_the_name_of_an_axis_leaves_room_for_its_power_of_ten(tmp_path):
    (tmp_path / "plan.toml").write_text('design = "random"\npoints = 8\n[factors.a_m]\nlow = 0\nhigh = 1e-3\n'
                                        "[factors.b_m]\nlow = 0\nhigh = 1.0\n")  # fmt: skip
    design = Design(load_plan(tmp_path / "plan.toml"))
    cases = [design[number] for number in range(len(design))]
    table = pa.Table.from_pylist([{"case": case.number, **case.values, "y_m": 1.0 + case.number} for case in cases])
    small, large = Figure().subplots(1, 2)
    for axes, name in ((small, "a_m"), (large, "b_m")):
        draw_over(axes, table, design, name, numbers(table, "y_m"), truth=False)
    assert small.xaxis.label.get_horizontalalignment() == "left"
    assert large.xaxis.label.get_horizontalalignment() == "center"
    assert (small.get_xlabel(), large.get_xlabel()) == ("a (m)", "b (m)")


def test_what_is_not_drawn_is_said(drawn):
    shown = texts(drawn(lambda values, rng: {f"y{k}_m": rng.random() for k in range(6)}))
    assert "mine: 60 of 60 cases (not drawn: 2 more results)" in shown
    shown = texts(drawn(lambda values, rng: {f"y{k}_m": rng.random() for k in range(6)}, ["y5_m"]))
    assert "y5 (m)" in shown
    assert "y0 (m)" not in shown


def test_nothing_to_draw_is_one_line(drawn):
    with pytest.raises(InputError, match="no results to draw yet"):
        drawn(lambda values, rng: {})
