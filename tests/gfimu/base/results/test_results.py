"""What every result offers a notebook: HTML, tables, pictures, rerun; by one mechanism."""

import dataclasses
import sys
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pyarrow as pa
import pytest

import gfimu
from gfimu import Estimate, GfimuError
from gfimu.base.results import Panel, PlottedResult, Series, TableResult, result_html, text_column
from gfimu.base.results.figure import drawn
from gfimu.base.results.html import MOST_ROWS
from gfimu.base.results.panels import axis_series


class Checker(HTMLParser):
    """Tags that are open, and all text."""

    def __init__(self) -> None:
        super().__init__()
        self.open, self.text = [], ""

    def handle_starttag(self, tag, attributes):
        self.open.append(tag)
        style = dict(attributes).get("style") or ""
        assert "#" not in style, "a colour of its own is lost in the dark"

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def checked(html: str) -> str:
    """Return the text of HTML that is well formed and sets no colours of ink."""
    checker = Checker()
    checker.feed(html)
    assert checker.open == []
    assert "<script" not in html
    return checker.text


@pytest.fixture(scope="module")
def run():
    return gfimu.simulate("paper_run", seed=1)


@pytest.fixture(scope="module")
def results(run):
    poses = gfimu.simulate("calibration_poses", seed=2)
    rest = gfimu.simulate("rest", seed=3, changes=["duration_s=30"])
    cube = gfimu.AccelerometerArray.load("cube12")
    short = run.slice(0, 400)
    rate = gfimu.estimate_rate(cube, short.t_s, short.readings, gfimu.SensorErrors.from_parts(cube, 100.0))
    return {
        "Recording": run,
        "Estimate": gfimu.estimate(run, rest_bias=True),
        "RateEstimate": rate,
        "Score": gfimu.score("cube12").best,
        "Scores": gfimu.score(["cube12", "wheel_pair"]),
        "AxisBounds": gfimu.score("wheel_pair").about_axis[0],
        "Calibration": gfimu.calibrate("array", poses),
        "RecordingNoise": gfimu.noise(rest),
        "Drift": gfimu.drift("cube12", duration=5.0, noise_ug=290.0, monte_carlo=20),
        "DriftBudget": gfimu.drift("cube12", duration=5.0, noise_ug=290.0).budget,
        "AxisDrift": gfimu.axis_drift("wheel_pair", duration=5.0, noise_ug=290.0, speed_rad_s=5.0),
        "RestDrift": gfimu.drift_of_rest(rest, duration=2.0),
        "RunCheck": gfimu.check(run, "cube12_turntable"),
        "ToleranceResult": gfimu.tolerance("cube12", closed_form=True),
        "SearchResult": gfimu.optimize(4, restarts=2, seed=1),
    }


NAMES = [
    "Recording", "Estimate", "RateEstimate", "Score", "Scores", "AxisBounds", "Calibration", "RecordingNoise", "Drift",
    "DriftBudget", "AxisDrift", "RestDrift", "RunCheck", "ToleranceResult", "SearchResult",
]  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_a_result_shows_and_hands_over(name, results, tmp_path):
    result = results[name]
    assert type(result).__name__ == name
    assert isinstance(result, PlottedResult)
    assert len(checked(result._repr_html_())) > 40
    columns = result.to_columns()
    assert len({len(values) for values in columns.values()}) == 1
    for table in (result.to_pandas(), result.to_polars()):
        assert list(table.columns) == list(columns)
    assert result.to_arrow().column_names == list(columns)
    assert pa.table(result).num_rows == len(result.to_pandas())
    figure = result.plot()
    assert all(axes.get_ylabel() for axes in figure.axes)
    figure.savefig(tmp_path / "picture.png")
    path = result.to_rerun(tmp_path / "result.rrd")
    assert path.read_bytes()[:4] in {b"RRF2", b"RRF0", b"RRIO"}


def test_pictures_open_no_window_and_stay_in_no_register(results):
    import matplotlib.pyplot as plt

    before = plt.get_fignums()
    results["Score"].plot()
    assert plt.get_fignums() == before
    assert plt.get_backend().lower() == "agg"


def test_a_picture_is_written_below_the_heading(results, tmp_path):
    results["RecordingNoise"].to_picture(tmp_path / "noise.svg")
    assert "<!-- Noise at rest" in (tmp_path / "noise.svg").read_text(encoding="utf-8")
    assert [file.name for file in tmp_path.iterdir()] == ["noise.svg"]


def test_a_library_picture_leaves_the_backend_alone(tmp_path):
    import subprocess

    code = (
        "import os; os.environ['MPLBACKEND'] = 'svg'; import matplotlib as mpl; import gfimu.base.results.figure; "
        "import gfimu.calibration.pictures; import gfimu.budget.tolerances.picture; "
        "assert mpl.get_backend().lower() == 'svg'"
    )
    subprocess.run([sys.executable, "-c", code], check=True, env={**__import__("os").environ, "MPLBACKEND": "svg"})


def test_uncertainty_is_a_band_of_two_standard_deviations():
    t = np.arange(3.0)
    std = np.full((3, 3), 0.5)
    panel = Panel("rate", "ω, rad/s", axis_series(np.zeros((3, 3)), std), t)
    figure = drawn([panel])
    (axes,) = figure.axes
    low, high = (
        axes.collections[0].get_paths()[0].vertices[:, 1].min(),
        axes.collections[0].get_datalim(axes.transData).y1,
    )
    assert (low, high) == (-1.0, 1.0)
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["x ± 2σ", "y ± 2σ", "z ± 2σ"]


def test_dollar_signs_in_names_are_no_formula(tmp_path):
    values = np.zeros(2)
    named = Panel("of $\\frac$", "$y_$", (Series("$a_$", values), Series("b", values)), ("$c_$", "$"), "$x_$")
    lines = Panel("$t_$", "y", (Series("$s_$", values), Series("b", values)), np.arange(2.0))
    figure = drawn([named, lines])
    figure.savefig(tmp_path / "named.svg", metadata={"Date": None})
    cube = gfimu.AccelerometerArray.load("cube12")
    renamed = replace(cube, name="$n_$", chips=tuple(replace(one, name=f"${one.name}_$") for one in cube.chips))
    renamed.plot().savefig(tmp_path / "chips.svg")


def test_bars_over_names_are_of_two_standard_deviations():
    panel = Panel("biases", "bias, m/s²", (Series("", np.array([1.0, 2.0]), np.array([0.1, 0.2])),), ("a11", "a12"))
    (axes,) = drawn([panel]).axes
    segments = axes.collections[0].get_segments()
    np.testing.assert_allclose([segment[:, 1] for segment in segments], [[0.8, 1.2], [1.6, 2.4]])
    assert [label.get_text() for label in axes.get_xticklabels()] == ["a11", "a12"]


def test_a_figure_of_the_caller_is_drawn_into(results):
    from matplotlib.figure import Figure

    mine = Figure()
    assert results["Score"].plot(mine) is mine
    assert mine.axes


def test_texts_are_escaped():
    html = result_html("<b>&", [("<i>", "a<b")], {"<u>": text_column(["<script>"])}, ["<img>"])
    assert checked(html).count("<") == 6
    assert "<script>" not in html
    assert "&lt;script&gt;" in html


def test_a_name_in_the_metadata_is_escaped(run):
    from dataclasses import replace

    odd = replace(run, metadata={**run.metadata, "scenario": "<script>alert(1)</script>"})
    assert "<script>" not in odd._repr_html_()


def test_a_long_table_is_cut_and_says_so():
    html = result_html("long", [], {"value": np.arange(MOST_ROWS + 7.0)})
    assert "7 more rows" in html
    assert html.count("<tr>") == MOST_ROWS + 2


def test_missing_values_and_empty_columns_take_no_room():
    html = result_html("x", [], {"a": np.array([np.nan, np.inf]), "blank": text_column(["", ""])})
    assert "nan" not in html
    assert "∞" in html
    assert "blank" not in html


@pytest.mark.parametrize(("library", "extra"), [("pandas", "tables"), ("polars", "tables"), ("matplotlib", "plot")])
def test_a_library_that_is_missing_is_named_with_its_extra(results, monkeypatch, library, extra):
    monkeypatch.setitem(sys.modules, library, None)
    call = {"pandas": "to_pandas", "polars": "to_polars", "matplotlib": "plot"}[library]
    with pytest.raises(GfimuError, match=rf"{call} needs {library}.*gfimu\[{extra}\]"):
        getattr(results["Score"], call)()


def test_a_recording_there_and_back_is_exact(run):
    for table in (run.to_pandas(), run.to_arrow()):
        back = gfimu.Recording.from_table(table)
        np.testing.assert_array_equal(back.readings, run.readings)
        assert back.metadata == run.metadata
        assert list(back.to_columns()) == list(run.to_columns())
    back = gfimu.Recording.from_table(run.to_polars(), array="cube12")  # polars keeps no metadata
    np.testing.assert_array_equal(back.readings, run.readings)
    assert back.array is not None


def test_an_estimate_there_and_back_is_exact(results):
    estimate = results["Estimate"]
    back = Estimate.read(estimate.to_pandas())
    for name, values in estimate.to_columns().items():
        np.testing.assert_array_equal(back.to_columns()[name], values)


def test_a_table_has_the_columns_of_the_file(run, results, tmp_path):
    import pyarrow.parquet as pq

    for name in ("Recording", "Estimate"):
        results[name].write(tmp_path / "file.parquet")
        assert pq.read_table(tmp_path / "file.parquet").column_names == results[name].to_arrow().column_names


def test_scores_are_a_list_that_knows_the_best():
    scores = gfimu.score(["cube12", "corners8", "wheel_pair"])
    assert [type(one).__name__ for one in scores] == ["Score", "Score", "AxisBounds"]
    assert scores.best.name == "corners8"
    assert len(scores.rigid) == 2
    assert len(scores.about_axis) == 1
    with pytest.raises(GfimuError, match="no array here sees all six motions"):
        _ = gfimu.score("wheel_pair").best


def test_an_array_draws_its_chips():
    cube = gfimu.AccelerometerArray.load("cube12")
    assert isinstance(cube, TableResult)
    assert "Array cube12" in checked(cube._repr_html_())
    assert cube.to_pandas().shape == (12, 9)
    (axes,) = cube.plot().axes
    assert [axes.get_xlabel(), axes.get_zlabel()] == ["x, mm", "z, mm"]


def test_a_result_logs_to_a_stream_of_the_caller(results):
    rr = pytest.importorskip("rerun")
    stream = rr.RecordingStream("test")
    content = stream.binary_stream()
    results["RateEstimate"].log(stream)
    results["Score"].log(stream, "mine")
    data = content.read(flush=True)
    stream.disconnect()
    assert b"rateestimate/angular_rate" in data
    assert b"mine/facts" in data


def test_a_name_with_dollar_signs_is_drawn_as_it_is():
    """Matplotlib reads what stands between two of them as a formula, and refuses some."""
    name = "left $^$"
    chip = gfimu.AccelerometerArray.load("one_chip").chips[0]
    array = gfimu.AccelerometerArray("$_$", (dataclasses.replace(chip, name=name),))
    array.plot().canvas.draw()
    over_names = Panel("$_$", "m/s²", (Series(name, np.ones(2)),), (name, "a2"))
    over_time = Panel("t", "$^$", (Series(name, np.ones(3)),), np.arange(3.0))
    figure = drawn([over_names, over_time])
    figure.canvas.draw()
    assert figure.axes[0].get_xticklabels()[0].get_text() == r"left \$^\$"
