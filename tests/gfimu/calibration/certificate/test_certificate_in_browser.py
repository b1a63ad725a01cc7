"""The certificate in a real browser: dark by night, light on paper, one sheet, legible on a telephone, no script."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from certification_cases import calibration_of, random_covariance, random_model
from headless_browser import headless_browser

from gfimu.calibration import certificate_html, certify
from gfimu.visual import PAGE


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    rng = np.random.default_rng(1)
    calibration = calibration_of(random_model(rng), random_covariance(rng), "x_axis")
    page = certificate_html(certify(replace(calibration, statements=("so",)), item="cube no. 7", date="today"))
    path = tmp_path_factory.mktemp("certificate") / "certificate.html"
    path.write_text(page, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def browser():
    with headless_browser() as one:
        yield one


@pytest.fixture
def page(browser, file):
    browser.open(file)
    yield browser
    assert browser.messages == []
    assert browser.requests == [file.as_uri()]


def colour(theme, name):
    return "rgb({}, {}, {})".format(*PAGE[theme][name][:3])


def test_it_is_dark_by_night_and_light_on_paper(page):
    shown = "getComputedStyle(document.body)"
    for dark, medium, theme in ((False, "", "light"), (True, "", "dark"), (True, "print", "light")):
        page.emulate(dark=dark, media=medium)
        page.settle()
        assert page.run(f"{shown}.backgroundColor") == colour(theme, "card")
        assert page.run(f"{shown}.color") == colour(theme, "ink")


def test_a_chip_is_one_sheet_of_paper(page):
    assert len(re.findall(rb"/Type\s*/Page\b", page.paper())) == 1


@pytest.mark.parametrize("width", [400, 1280])
def test_letters_are_legible_and_wide_tables_scroll_in_their_place(page, width):
    page.resize(width, 800)
    page.settle()
    assert page.run("document.documentElement.scrollWidth") <= width
    sizes = "[...document.querySelectorAll('td, th, p, li')].map(one => parseFloat(getComputedStyle(one).fontSize))"
    assert page.run(f"Math.min(...{sizes})") >= 13
    wide = "[...document.querySelectorAll('.scroll')].filter(one => one.scrollWidth > one.clientWidth)"
    assert page.run(f"{wide}.every(one => one.tabIndex === 0 && one.ariaLabel)")
    outside = "[...document.querySelectorAll('table')].filter(one => !one.closest('.scroll')).length"
    assert page.run(outside) == 0


def test_a_script_from_outside_does_not_run(browser, file, tmp_path):
    hostile = tmp_path / "hostile.html"
    text = file.read_text(encoding="utf-8").replace("<header>", "<header><script>window.hostile = true</script>", 1)
    hostile.write_text(text, encoding="utf-8")
    browser.open(hostile)
    assert browser.run("window.hostile") is None
