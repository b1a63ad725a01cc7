"""What the plots that zoom hold: every sample of a usual run, every peak of a long one, and columns that exist."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from made_runs import PERIOD, made_view

from gfimu import AccelerometerArray, Chip
from gfimu.diagnosis.criticism.views.residuals import residual_views
from gfimu.diagnosis.report import zooming
from gfimu.visual import Packed
from gfimu.visual.page import PlotLimits

ARRAY = AccelerometerArray(
    "four", (Chip("a1", np.zeros(3), np.eye(3)), Chip("a2", np.array([0.1, 0.0, 0.0]), np.eye(3)[:1]))
)
T = PERIOD * np.arange(3000)
RATE = 5.0 + 2.0 * np.sin(0.6 * T)


@pytest.fixture(scope="module")
def view():
    return made_view(RATE, np.column_stack([3e-3 * RATE**2, np.zeros((len(T), 3))]))


@pytest.fixture(scope="module")
def views(view):
    return residual_views(view, ARRAY.channels)


class Kept(Packed):
    """Keeps the values of the columns as they were given."""

    def __init__(self):
        super().__init__()
        self.values = []

    def add(self, values, step, *, order=0):
        self.values.append(np.asarray(values))
        return super().add(values, step, order=order)


def test_a_usual_run_is_stored_sample_by_sample(view, views):
    data = Kept()
    plot = zooming.residual_plot(view, views.size, ARRAY, data)
    assert plot["grouped"] == 0
    assert plot["shown"][0] == 0  # the channel with the error is among those shown first
    for column, channel in enumerate(plot["channels"]):
        before = view.measured[:, column] - view.before[:, column]
        np.testing.assert_allclose(data.values[channel["before"]], before)
        change = data.values[channel["change"]]
        np.testing.assert_allclose(before + change, view.measured[:, column] - view.after[:, column], atol=1e-12)
        assert data.columns[channel["before"]]["step"] == pytest.approx(views.size.floor[column] / 8)
        assert data.columns[channel["before"]]["n"] == data.columns[plot["x"]["column"]]["n"]


def test_lost_samples_break_the_lines(view, views):
    keep = np.r_[0:1000, 1500:3000]
    short = {
        one.name: value[keep]
        for one in fields(view)
        if isinstance(value := getattr(view, one.name), np.ndarray) and one.name != "white"
    }
    data = Kept()
    plot = zooming.residual_plot(replace(view, **short), views.size, ARRAY, data)
    assert np.isnan(data.values[plot["channels"][0]["before"]]).tolist().index(True) == 1000
    assert len(data.values[plot["x"]["column"]]) == 2501


def test_of_a_long_run_every_peak_is_stored(view, views, monkeypatch):
    monkeypatch.setattr(zooming, "_LIMITS", PlotLimits(most_samples=1000, most_groups=600))
    measured = view.measured.copy()
    measured[1234, 2] += 9.0
    data = Kept()
    plot = zooming.residual_plot(replace(view, measured=measured), views.size, ARRAY, data)
    assert plot["grouped"] == 20  # 3000 samples of 4 channels in 600 groups
    stored = data.values[plot["channels"][2]["before"]]
    assert stored.max() == (measured - view.before)[:, 2].max() > 8.0
    assert len(stored) == 2 * 150
    time = data.values[plot["x"]["column"]]
    assert abs(time[int(np.argmax(stored))] - T[1234]) < 20 * PERIOD


def test_a_spectrum_is_stored_by_its_logarithm(views):
    data = Kept()
    plot = zooming.spectrum_plot(views.spectrum, data)
    assert plot["unit"] == "m/s²/√Hz"
    np.testing.assert_allclose(10 ** data.values[plot["lines"]["before"]], views.spectrum.before)
    assert plot["x"]["logarithmic"]
