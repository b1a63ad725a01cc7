"""Figures of the report: what they draw, read back from the picture."""

from __future__ import annotations

import base64
import io
import re
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from made_runs import PERIOD, made_view
from PIL import Image

from gfimu import AccelerometerArray, Chip
from gfimu.base import chip_colour, css
from gfimu.base.results.colours import AFTER_ON_PAPER, BEFORE_ON_PAPER
from gfimu.diagnosis import DrawnRig
from gfimu.diagnosis.criticism.views.residuals import residual_views
from gfimu.diagnosis.report import figures
from gfimu.visual.page.svg import themed
from gfimu.visual.rig.figure import Marked

CHANNELS = ("a11", "a12", "a13", "a21")
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
    return residual_views(view, CHANNELS)


def texts(svg):
    return [one.text for one in ET.fromstring(svg).iter("{http://www.w3.org/2000/svg}text") if one.text]


def drawn(views, view):
    seen_from = DrawnRig().seen_from(ARRAY, view)
    return {
        "trace": figures.trace_figure(view, views.size),
        "channels": figures.channels_figure(view, views.size, ARRAY),
        "measured": figures.measured_figure(view, views.size),
        "form": figures.form_figure(views.form),
        "marked": figures.marked_figure(ARRAY, *seen_from, Marked(frozenset({1}), True, True)),
        "spectrum": figures.spectrum_figure(views.spectrum),
        "whiteness": figures.whiteness_figure(views.whiteness),
        **dict(zip(("rig", "rig above"), figures.rig_figures(ARRAY, *seen_from), strict=True)),
    }


def test_every_figure_is_well_formed_labelled_and_the_same_each_time(views, view):
    first = drawn(views, view)
    assert first["spectrum"] == figures.spectrum_figure(views.spectrum)
    labels = {
        "trace": {"measured − predicted, channel a11", "time, s", "m/s²"},
        "channels": {*CHANNELS, "time, s"},
        "measured": {"a11, m/s²", "time, s", "measured", "as given", "extended"},
        "form": {"ω, rad/s", "a11, m/s²", "extended simulation", "measured − given simulation, ±2σ"},
        "marked": {*CHANNELS, "a1", "a2", "gravity", "axis of rotation"},
        "spectrum": {"frequency, Hz", "amplitude density, m/s²/√Hz", "before", "after", "noise"},
        "whiteness": {"frequency, Hz", "share of the power below"},
        "rig": {*CHANNELS, "a1", "a2", "gravity", "axis of rotation", "x", "y", "z"},
        "rig above": {"a1", "a2", "axis of rotation", "body x, mm"},
    }
    for name, svg in first.items():
        assert labels[name] <= set(texts(svg)), name
        assert not re.search(r"<svg [^>]* (width|height)=", svg)
    names = [set(re.findall(r'\bid="([^"]+)"', svg)) for svg in first.values()]
    assert len(set().union(*names)) == sum(len(one) for one in names)  # on one page none takes another's place


def test_before_after_and_the_chips_have_their_colours_in_every_figure(views, view):
    found = drawn(views, view)
    for name in ("trace", "form", "spectrum"):
        assert css(BEFORE_ON_PAPER) in found[name]
        assert css(AFTER_ON_PAPER) in found[name]
    for name in ("channels", "marked", "rig"):
        for chip in range(2):
            assert css(chip_colour(chip, on_paper=True)) in found[name], name


def test_a_figure_takes_the_colours_of_the_page(views, view):
    svg = themed(drawn(views, view)["channels"], 2)
    assert {"var(--chip-0)", "var(--chip-1)", "var(--ink)", "var(--noise)", "var(--card)"} <= set(
        re.findall(r"var\([^)]+\)", svg)
    )
    assert not re.search(r"#[0-9a-f]{6}\b", svg)
    ET.fromstring(svg)


def test_a_name_with_signs_of_formulas_and_letters_without_a_font_is_drawn_as_it_is(recwarn):
    names = ("left $x$", "<b>$", "板四$^2$")
    array = AccelerometerArray("odd", tuple(Chip(name, np.eye(3)[k], np.eye(3)) for k, name in enumerate(names)))
    side, above = figures.rig_figures(array, None, None, "")
    for svg in (side, above):
        assert set(names) <= set(texts(svg))
    assert list(recwarn) == []


def test_a_long_name_is_shortened_in_a_drawing():
    names = ("acceleration_of_the_left_wheel", "a2")
    array = AccelerometerArray("long", tuple(Chip(name, np.eye(3)[k], np.eye(3)) for k, name in enumerate(names)))
    side, _ = figures.rig_figures(array, None, None, "")
    assert max(map(len, texts(side))) <= 24
    assert {"accelerat…heel", "a2"} <= set(texts(side))


def test_samples_are_one_picture_of_few_colours(views, view):
    pictures = re.findall(r"base64,([^\"]+)", figures.trace_figure(view, views.size))
    assert len(pictures) == 1
    image = Image.open(io.BytesIO(base64.b64decode(pictures[0])))
    assert image.mode == "P"


def test_gravity_and_axis_follow_the_mounting_and_a_free_body_has_no_table(view):
    lying = DrawnRig(np.array([np.pi / 2, 0.0, 0.0]), np.array([0.02, 0.0, 0.06]))  # y of the body is up
    axis, gravity, name = lying.seen_from(ARRAY, view)
    np.testing.assert_allclose(gravity, [0.0, -1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(axis.direction, [0.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(np.cross(axis.point - [-0.02, 0.0, 0.0], axis.direction), 0.0, atol=1e-12)
    assert name == "gravity"
    turned = np.tile([np.cos(0.5), np.sin(0.5), 0.0, 0.0], (len(T), 1))
    axis, gravity, name = lying.seen_from(ARRAY, replace(view, attitude=turned))
    assert axis is None
    np.testing.assert_allclose(gravity, [0.0, -np.sin(1.0), -np.cos(1.0)], atol=1e-12)
    assert name == "gravity at the start"


def test_a_long_run_keeps_its_extremes():
    t = np.arange(100_000.0)
    values = np.sin(1e-3 * t)
    values[54_321], values[77] = 9.0, -7.0
    times, shown = figures._thinned(t, values)
    assert len(shown) <= figures._MOST_POINTS
    assert (shown.max(), shown.min()) == (9.0, -7.0)
    assert abs(times[int(np.argmax(shown))] - 54_321) < 100
    assert figures._thinned(t[:100], values[:100])[1] is not None
    assert np.array_equal(figures._thinned(t[:100], values[:100])[1], values[:100])


def test_a_moving_mean_is_over_valid_samples():
    values = np.array([1.0, np.nan, 3.0, 5.0, np.nan, np.nan, np.nan, 2.0])
    expected = [1.0, 2.0, 4.0, 4.0, 5.0, np.nan, 2.0, 2.0]
    np.testing.assert_allclose(figures._moving_mean(values, 3), expected)


def points(svg, colour):
    """Vertices (m, 2) of the longest line of a colour."""
    paths = re.findall(rf'<path d="([^"]+)"[^>]*style="[^"]*stroke: {colour}', svg)
    longest = max(paths, key=len)
    return np.array([[float(x), float(y)] for x, y in re.findall(r"[ML] ([-\d.]+) ([-\d.]+)", longest)])


def test_a_line_does_not_vanish_between_the_points_drawn(views):
    at = np.linspace(0.1, 50.0, 12_000)
    before = np.full(len(at), 1e-3)
    before[6_543] = 1.0
    level = np.full(len(at), 2e-3)
    svg = figures.spectrum_figure(replace(views.spectrum, at=at, before=before, after=level, noise=level))
    line = points(svg, figures._BEFORE)
    top = int(np.argmin(line[:, 1]))  # downwards in a picture
    usual = np.median(line[:, 1])
    assert usual - line[top, 1] > 0.8 * (line[:, 1].max() - line[:, 1].min())
    # On a logarithmic axis of frequency.
    place = np.log(at[6_543] / at[0]) / np.log(at[-1] / at[0])
    across = (line[top, 0] - line[0, 0]) / (line[-1, 0] - line[0, 0])
    assert across == pytest.approx(place, abs=0.01)
