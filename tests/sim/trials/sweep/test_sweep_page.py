"""The page of a campaign in a real browser: in the colours of the report, legible on a telephone and on paper."""

from __future__ import annotations

import re

import numpy as np
import pyarrow as pa
import pytest
from headless_browser import headless_browser

from gfimu.visual import PAGE
from sim.trials import Design, campaign_picture, load_plan

PLAN = """
design = "random"
points = 60
[factors]
method = ["filter", "smoother"]
[factors."noise.std_m_s2"]
low = 1e-3
high = 1.0
scale = "log"
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A page of 60 cases with a number, a truth, and one failure, of a folder with a hostile name."""
    folder = tmp_path_factory.mktemp("campaign")
    (folder / "plan.toml").write_text(PLAN)
    design = Design(load_plan(folder / "plan.toml"))
    rng = np.random.default_rng(1)
    rows = []
    for case in (design[number] for number in range(len(design))):
        result = {
            "rate_rms_rad_s": 3.0 * case.values["noise.std_m_s2"] + rng.random(),
            "right": bool(rng.random() < 0.5),
        }
        failure = "no sample in <5 s>" if case.number == 7 else ""
        rows.append({"case": case.number, "seed": case.seed, **case.values, "failure": failure, **result})
    campaign_picture(folder / "page.html", folder / "<b>mine", pa.Table.from_pylist(rows), design)
    return folder / "page.html"


@pytest.fixture(scope="module")
def browser():
    with headless_browser() as one:
        yield one


@pytest.fixture
def page(browser, file):
    browser.open(file)
    browser.settle()
    yield browser
    assert browser.messages == []
    assert browser.requests == [file.as_uri()]


def style(of, what):
    return f"getComputedStyle(document.querySelector('{of}')).{what}"


def rgb(theme, name):
    return "rgb({}, {}, {})".format(*PAGE[theme][name][:3])


def test_every_result_has_its_panels_with_words_and_shares(page):
    assert page.run("document.querySelector('h1').textContent") == "Campaign <b>mine"
    assert page.run("[...document.querySelectorAll('h3')].map(one => one.textContent)") == [
        "rate rms (rad/s)",
        "right",
        "Failures",
    ]
    assert page.run("document.querySelectorAll('figure svg').length") == 6  # two factors and the shares, twice
    assert page.run("[...document.querySelectorAll('figcaption')].every(one => one.textContent.length > 10)")
    assert "1: no sample in <5 s>" in page.run("document.body.innerText")
    shares = page.run("[...document.querySelectorAll('td.number')].map(one => one.textContent)")
    assert all(re.fullmatch(r"−?\d\.\d\d \(−?\d\.\d\d to −?\d\.\d\d\)|–", one) for one in shares)


def test_no_script_runs_and_nothing_is_loaded(browser, file, tmp_path):
    hostile = tmp_path / "hostile.html"
    text = file.read_text(encoding="utf-8")
    hostile.write_text(text.replace("<main>", "<main><script>window.hostile = true</script>", 1), encoding="utf-8")
    browser.open(hostile)
    assert browser.run("window.hostile") is None
    assert "<script" not in text


def test_it_has_the_colours_of_the_report_by_day_and_by_night(page):
    for theme in ("light", "dark"):
        page.emulate(dark=theme == "dark")
        page.settle()
        assert page.run(style("body", "backgroundColor")) == rgb(theme, "ground")
        assert page.run(style("svg path", "fill")) == rgb(theme, "card")
        assert page.run(style("svg text", "fill")) == rgb(theme, "ink")


def test_it_fits_a_telephone(page):
    page.resize(400, 800)
    page.settle()
    assert page.run("document.documentElement.scrollWidth") <= 400
    right = "Math.max(...[...document.querySelectorAll('svg')].map(one => one.getBoundingClientRect().right))"
    assert page.run(right) <= 400
    heights = page.run("[...document.querySelectorAll('svg text')].map(one => one.getBoundingClientRect())"
                       ".map(box => Math.min(box.width, box.height)).filter(size => size > 0)")  # fmt: skip
    assert min(heights) >= 6  # of a one
    assert np.median(heights) >= 9


def test_keys_reach_the_tables_and_paper_is_light(page):
    page.press("Tab")
    assert page.run("document.activeElement.getAttribute('aria-label')") == "shares of the variance of rate rms (rad/s)"
    assert page.run("getComputedStyle(document.activeElement).outlineStyle") in {"solid", "auto"}
    page.emulate(dark=True, media="print")
    page.settle()
    assert page.run(style("body", "color")) == rgb("light", "ink")
    assert page.paper().startswith(b"%PDF")
