"""Plots on an HTML page: their data come back as they were, and the page holds all that they need."""

from __future__ import annotations

import base64
import json
import zlib
from itertools import combinations

import numpy as np
import pytest

from gfimu.base import chip_colour
from gfimu.visual import PAGE, Packed, page_plots
from gfimu.visual.colours import TONES
from gfimu.visual.page import enveloped


def unpacked(data: Packed) -> list[np.ndarray]:
    """Columns read back, as `plots.js` does."""
    found, place, content = [], 0, zlib.decompress(base64.b64decode(data.text()))
    for column in data.columns:
        n = column["n"]
        planes = np.frombuffer(content, np.uint8, 4 * n, place).reshape(4, n)
        whole = np.ascontiguousarray(planes.T).view("<i4").ravel().astype(np.int64)
        place += 4 * n
        for _ in range(column["order"]):
            whole = np.cumsum(whole)
        values = column["offset"] + column["step"] * whole
        if column["gaps"]:
            bits = np.frombuffer(content, np.uint8, -(-n // 8), place)
            values[np.unpackbits(bits, count=n, bitorder="little") == 0] = np.nan
            place += -(-n // 8)
        found.append(values)
    assert place == len(content)
    return found


@pytest.mark.parametrize("order", [0, 1, 2])
def test_columns_come_back_to_within_half_a_step(order):
    rng = np.random.default_rng(1)
    columns = [
        np.cumsum(rng.normal(size=1001)),
        np.where(rng.random(1001) < 0.2, np.nan, rng.normal(size=1001)),
        np.array([np.nan, np.nan, 3.0, np.inf, -2.0]),
        np.full(7, np.nan),
        np.zeros(0),
        np.array([12.5]),
        1e9 * rng.normal(size=50),
    ]
    data = Packed()
    numbers = [data.add(values, 1e-3, order=order) for values in columns]
    assert numbers == list(range(len(columns)))
    for values, back, column in zip(columns, unpacked(data), data.columns, strict=True):
        expected = np.where(np.isfinite(values), values, np.nan)
        np.testing.assert_allclose(back, expected, rtol=0, atol=0.5001 * column["step"])
        assert column["step"] == 1e-3 or np.nanmax(np.abs(values)) > 1e5
    json.dumps(data.columns, allow_nan=False)


def test_smooth_columns_and_even_times_are_short():
    t = np.arange(60_000) * 0.01
    data = Packed()
    data.add(t, 1e-5, order=2)
    data.add(0.03 * np.sin(2.0 * t), 0.004, order=1)
    assert len(data.text()) < 20_000


def test_an_envelope_keeps_every_peak_and_the_mean():
    rng = np.random.default_rng(2)
    t = np.arange(1003) * 0.01
    values = rng.normal(size=1003)
    values[500], values[40:60] = 50.0, np.nan
    found = enveloped(t, values, 10)
    assert np.nanmax(found.edges) == 50.0
    assert np.nanmin(found.edges) == np.nanmin(values)
    assert len(found.t) == len(found.edges) == len(found.mean) == 2 * 101
    assert (np.diff(found.t) >= 0).all()
    assert np.isnan(found.edges[8:12]).all()
    assert np.isnan(found.mean[8:12]).all()
    np.testing.assert_allclose(found.mean[::2][:4], values[:40].reshape(4, 10).mean(axis=1))
    assert found.edges[-2:].tolist() == [values[1000:].min(), values[1000:].max()]  # a last group of three


def test_names_can_not_end_the_script_that_holds_them():
    page = page_plots({"plots": {"</script><script>alert(1)": {}}}, Packed())
    assert "<" not in page["plots"]
    assert json.loads(page["plots"])["plots"] == {"</script><script>alert(1)": {}}


def test_the_scripts_load_nothing():
    ours = page_plots({}, Packed())["scripts"][1]
    for word in ("fetch(", "XMLHttpRequest", "import(", "WebSocket", "innerHTML", "eval("):
        assert word not in ours, word


def contrast(first, second) -> float:
    """Contrast ratio of two colours (WCAG 2.2, relative luminance)."""

    def luminance(colour):
        part = np.array(colour[:3]) / 255.0
        linear = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722])

    high, low = sorted([luminance(first), luminance(second)], reverse=True)
    return (high + 0.05) / (low + 0.05)


def test_the_ratio_is_that_of_the_guideline():
    assert contrast((0, 0, 0), (255, 255, 255)) == pytest.approx(21.0)
    assert contrast((119, 119, 119), (255, 255, 255)) == pytest.approx(4.48, abs=0.01)


@pytest.mark.parametrize("theme", PAGE)
def test_text_of_the_page_can_be_read(theme):
    """Level AA: text 4.5, lines of plots, edges of buttons and the focus 3."""
    colours = PAGE[theme]
    for text in ("ink", "quiet", *TONES):
        for ground in ("ground", "card"):
            assert contrast(colours[text], colours[ground]) >= 4.5, (text, ground)
    for ground in ("code", "pressed"):
        assert contrast(colours["ink"], colours[ground]) >= 4.5, ground
    for line in ("before", "after", "noise", "edge", "focus", "spin-axis"):
        assert contrast(colours[line], colours["card"]) >= 3.0, line
    for chip in range(12):
        assert contrast(chip_colour(chip, on_paper=theme == "light"), colours["card"]) >= 2.5, chip


def test_both_themes_have_the_same_names_and_no_colour_twice_for_lines():
    assert set(PAGE["light"]) == set(PAGE["dark"])
    for colours in PAGE.values():
        for first, second in combinations(("before", "after", "noise", "ink", "band"), 2):
            assert colours[first] != colours[second]
