"""The report in a real browser: it zooms, answers keys, has a dark form, fits a telephone and paper."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from headless_browser import headless_browser
from made_diagnoses import made_diagnosis

from gfimu.base import chip_colour
from gfimu.diagnosis import report_html
from gfimu.visual import PAGE

READY = "document.documentElement.dataset.ready === 'true'"
PLOT = "document.querySelector('[data-plot=residual]')"
RANGE = f"{PLOT}.dataset.range.split(' ').map(Number)"
ACTIVE = "document.activeElement"


@pytest.fixture(scope="module")
def browser():
    with headless_browser() as one:
        yield one


@pytest.fixture(scope="module")
def report(tmp_path_factory, made_once):
    text = made_once("report-explained.html", lambda: report_html(made_diagnosis("explained")))
    file = tmp_path_factory.mktemp("report") / "report.html"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.fixture
def page(browser, report):
    browser.open(report)
    browser.wait(READY)
    browser.settle()
    yield browser
    assert browser.messages == []
    assert browser.requests == [report.as_uri()]  # the file itself, and nothing else


def button(words):
    return f"[...{PLOT}.querySelectorAll('button')].find(one => one.textContent.trim() === '{words}')"


def box_of_first_panel(page):
    script = (
        f"(box => [box.left, box.top, box.width, box.height])({PLOT}.querySelector('.u-over').getBoundingClientRect())"
    )
    page.run(f"{PLOT}.scrollIntoView()")
    page.settle()
    return page.run(script)


def pixels(page):
    """How often each opaque colour, ``#rrggbb``, stands in the first panel."""
    script = f"""(() => {{
        const shown = {PLOT}.querySelector('canvas'), found = {{}};
        const copy = new OffscreenCanvas(shown.width, shown.height).getContext('2d', {{ willReadFrequently: true }});
        copy.drawImage(shown, 0, 0);
        const data = copy.getImageData(0, 0, shown.width, shown.height).data;
        for (let k = 0; k < data.length; k += 4) if (data[k + 3] === 255) {{
            const key = '#' + [0, 1, 2].map(part => data[k + part].toString(16).padStart(2, '0')).join('');
            found[key] = (found[key] ?? 0) + 1;
        }}
        return JSON.stringify(found);
    }})()"""
    return json.loads(page.run(script))


def css(colour):
    return "#" + "".join(f"{part:02x}" for part in colour[:3])


def test_plots_stand_in_place_of_the_pictures(page):
    assert page.run("document.querySelectorAll('.zooming canvas').length") == 4  # three channels, one spectrum
    assert page.run("[...document.querySelectorAll('.still')].every(one => !one.checkVisibility())")
    assert page.run("document.querySelectorAll('figure svg').length") == 9
    found = pixels(page)
    assert found[css(PAGE["light"]["before"])] > 200
    assert found[css(PAGE["light"]["after"])] > 200


def test_a_drag_zooms_all_panels_and_a_double_click_shows_everything(page):
    whole = page.run(RANGE)
    left, top, width, height = box_of_first_panel(page)
    page.drag((left + 0.25 * width, top + 0.5 * height), (left + 0.5 * width, top + 0.5 * height))
    low, high = page.run(RANGE)
    span = whole[1] - whole[0]
    np.testing.assert_allclose([low, high], [whole[0] + 0.25 * span, whole[0] + 0.5 * span], atol=0.01 * span)
    for clicks in (1, 2):
        for kind in ("mousePressed", "mouseReleased"):
            page.call(
                "Input.dispatchMouseEvent",
                type=kind,
                x=left + 9,
                y=top + 9,
                button="left",
                clickCount=clicks,
                buttons=1,
            )
    page.settle()
    assert page.run(RANGE) == whole


def test_keys_zoom_pan_and_reset(page):
    whole = page.run(RANGE)
    page.run(f"{PLOT}.querySelector('.panels').focus()")
    page.press("+")
    low, high = page.run(RANGE)
    assert high - low == pytest.approx(0.5 * (whole[1] - whole[0]))
    page.press("PageDown")
    assert page.run(RANGE)[0] > low
    page.press("-")
    page.press("0")
    assert page.run(RANGE) == whole


def test_the_cursor_shows_values_with_their_unit(page):
    (run,) = made_diagnosis("explained").runs
    page.run(f"{PLOT}.querySelector('.panels').focus()")
    page.press("ArrowRight")
    page.settle()
    moment = page.run(f"{PLOT}.querySelector('.readout').textContent")
    t = float(re.fullmatch(r"t = ([\d.]+) s", moment).group(1))
    name, words = page.run(
        f"[...{PLOT}.querySelectorAll('.panel')][0].querySelectorAll('.head b, .head .values').values()"
        ".map(one => one.textContent).toArray()"
    )
    index = int(np.argmin(np.abs(run.t - t)))
    column = ["a11", "a12", "a13", "a21", "a22", "a23", "a31", "a32", "a33", "a41", "a42", "a43"].index(name)
    shown = [float(one.replace("−", "-")) for one in re.findall(r"−?\d[\d.]*(?:e−?\d+)?", words)[:2]]
    expected = run.measured[index, column] - np.array([run.before[index, column], run.after[index, column]])
    np.testing.assert_allclose(shown, expected, atol=run.white[column] / 4)
    assert words.endswith("m/s²")


def test_channels_and_lines_can_be_chosen(page):
    panels = f"{PLOT}.querySelectorAll('.panel').length"
    assert page.run(panels) == 3
    for words, count in (("a11", 4), ("a11", 3), ("all", 12), ("none", 0), ("strongest", 3), ("rate of rotation", 4)):
        page.run(f"{button(words)}.click()")
        assert page.run(panels) == count, words
    before = css(PAGE["light"]["before"])
    page.run(f"{button('before')}.click()")
    page.settle()
    assert page.run(f"{button('before')}.getAttribute('aria-pressed')") == "false"
    assert pixels(page).get(before, 0) == 0


def test_tab_reaches_every_control(page):
    """In the order of the page, and each shows that it has the focus."""
    controls = "button, summary, [tabindex='0']"
    count = page.run(
        f"(all => {{ all.forEach((one, k) => one.dataset.place = k); return all.length; }})"
        f"([...document.querySelectorAll(`{controls}`)].filter(one => one.checkVisibility()))"
    )
    assert count > 40
    seen, outlined = [], []
    for _ in range(count + 5):
        page.press("Tab")
        place, outline = page.run(f"[{ACTIVE}.dataset.place, getComputedStyle({ACTIVE}).outlineStyle]")
        if place is not None:
            seen.append(int(place))
            outlined.append(outline)
        if len(set(seen)) == count:
            break
    assert seen == list(range(count))
    assert set(outlined) <= {"solid", "auto"}


def test_every_plot_and_button_has_a_name(page):
    nameless = page.run(
        "[...document.querySelectorAll('button, .panels, .pair, [tabindex]')]"
        ".filter(one => !(one.getAttribute('aria-label') || one.textContent.trim())).length"
    )
    assert nameless == 0
    unlabelled = "[...document.querySelectorAll('[aria-roledescription=plot]')].filter(one => !one.ariaLabel).length"
    assert page.run(unlabelled) == 0
    assert page.run("[...document.querySelectorAll('figure')].every(one => one.querySelector('figcaption'))")


@pytest.mark.parametrize("folded", [True, False])
def test_it_fits_a_telephone(page, folded):
    page.resize(400, 800)
    page.settle()
    if not folded:
        page.run("document.querySelectorAll('details').forEach(one => one.open = true)")
    page.settle()
    page.settle()
    assert page.run("document.documentElement.scrollWidth") <= 400
    widest = page.run(
        "Math.max(...[...document.querySelectorAll('.zooming canvas')].map(one => one.getBoundingClientRect().right))"
    )
    assert widest <= 400
    assert page.run(f"{PLOT}.querySelector('canvas').getBoundingClientRect().width") > 300
    assert page.run("parseFloat(getComputedStyle(document.body).fontSize)") >= 14


def test_dark_colours_are_those_of_the_dark_page(page, report):
    page.open(report, dark=True)
    page.wait(READY)
    page.settle()
    style = "(one => getComputedStyle(document.querySelector(one))"
    rgb = lambda name: "rgb({}, {}, {})".format(*PAGE["dark"][name][:3])  # noqa: E731
    assert page.run(f"{style}.backgroundColor)('body')") == rgb("ground")
    assert page.run(f"{style}.color)('body')") == rgb("ink")
    assert page.run(f"{style}.backgroundColor)('header')") == rgb("card")
    assert page.run(f"{style}.fill)('figure:not(.still) svg path')") == rgb("card")
    found = pixels(page)
    assert found[css(PAGE["dark"]["before"])] > 200
    assert css(PAGE["light"]["before"]) not in found
    # A swatch of a chip is that of the dark page too.
    colour = page.run(f"{style}.backgroundColor)('.channels .swatch')")
    assert colour == "rgb({}, {}, {})".format(*chip_colour(0)[:3])
    page.emulate(dark=False)  # the plots follow at once
    page.settle()
    assert pixels(page)[css(PAGE["light"]["before"])] > 200


def test_paper_has_the_still_pictures_in_light_colours_and_unfolded(page):
    page.emulate(dark=True, media="print")
    page.settle()
    assert page.run("[...document.querySelectorAll('.zooming')].every(one => !one.checkVisibility())")
    assert page.run("[...document.querySelectorAll('figure.still')].every(one => one.checkVisibility())")
    assert page.run("getComputedStyle(document.body).color") == "rgb({}, {}, {})".format(*PAGE["light"]["ink"][:3])
    page.emulate()
    page.run(
        "addEventListener('beforeprint', () => window.open_ = document.querySelectorAll('details:not([open])').length)"
    )
    paper = page.paper()
    assert paper.startswith(b"%PDF")
    assert 4 <= len(re.findall(rb"/Type\s*/Page\b", paper)) <= 8
    assert re.search(rb"/MediaBox \[0 0 59[45][.\d]* 84[12][.\d]*\]", paper)
    assert page.run("document.querySelectorAll('details:not([open])').length") > 0  # folded again


def test_without_scripts_the_pictures_stay(browser, report, tmp_path):
    plain = tmp_path / "plain.html"
    plain.write_text(re.sub(r"<script>.*?</script>", "", report.read_text(encoding="utf-8"), flags=re.DOTALL), "utf-8")
    browser.open(plain)
    assert browser.run("[...document.querySelectorAll('figure.still')].every(one => one.checkVisibility())")
    assert browser.run("document.querySelectorAll('canvas').length") == 0


def test_a_script_from_outside_does_not_run(browser, report, tmp_path):
    hostile = tmp_path / "hostile.html"
    text = report.read_text(encoding="utf-8").replace("<main>", "<main><script>window.hostile = true</script>", 1)
    hostile.write_text(text, encoding="utf-8")
    browser.open(hostile)
    browser.wait(READY)
    assert browser.run("window.hostile") is None


def test_tables_of_channels_and_sizes_are_whole_on_a_telephone(page):
    """Value and degrees of a parameter, rms and noise of a channel: all within the width, with nothing to scroll."""
    page.resize(400, 800)
    page.settle()
    for cells in (".familiar", "table.bars td"):
        assert page.run(f"document.querySelectorAll('{cells}').length") > 1
        right = f"Math.max(...[...document.querySelectorAll('{cells}')].map(one => one.getBoundingClientRect().right))"
        assert page.run(right) <= 400


def test_ticks_of_a_spectrum_are_round_numbers(browser, tmp_path):
    diagnosis = made_diagnosis("explained")
    (run,) = diagnosis.runs
    with_tone = run.measured + 0.2 * np.sin(2 * np.pi * 11.3 * run.t)[:, None]
    file = tmp_path / "tone.html"
    file.write_text(report_html(replace(diagnosis, runs=(replace(run, measured=with_tone),))), encoding="utf-8")
    browser.open(file)
    browser.wait(READY)
    browser.settle()
    plot = "document.querySelector('[data-plot=a-line-over-frequency]')"
    drawn = browser.run(
        "(() => { const real = CanvasRenderingContext2D.prototype.fillText, words = [];"
        " CanvasRenderingContext2D.prototype.fillText = function (text, ...more) { words.push(text);"
        " return real.call(this, text, ...more); };"
        f" {plot}.querySelector('button[aria-label=\"show everything\"]').click();"
        " return new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => {"
        " CanvasRenderingContext2D.prototype.fillText = real; done(words); }))); })()"
    )
    numbers = [word for word in drawn if re.fullmatch(r"[\d.]+(e−?\d+)?", word)]
    assert len(numbers) >= 2
    assert all(re.fullmatch(r"0*\.?0*[125]0*", word) for word in numbers), numbers
