"""The report: complete, self-contained, small, and its words follow the numbers."""

from __future__ import annotations

import base64
import hashlib
import html
import re
from dataclasses import fields, replace
from html.parser import HTMLParser
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from made_diagnoses import made_diagnosis

from gfimu import InputError, NamedCause
from gfimu.diagnosis import headline, next_steps, report_html, story, write_diagnosis
from gfimu.diagnosis.report.folder import check_folder
from gfimu.diagnosis.report.plain_words import odds, parameter_texts, percent

VERDICTS = ("explained", "ambiguous", "unknown", "nothing_found")


class Page(HTMLParser):
    """Tags that are open, and what the page refers to."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.links: list[str] = []

    def handle_starttag(self, tag, attrs):
        if tag not in {"meta", "br", "link", "img", "hr"}:
            self.open.append(tag)
        self.links += [value for key, value in attrs if key in {"href", "src", "xlink:href"}]

    def handle_startendtag(self, tag, attrs):
        self.links += [value for key, value in attrs if key in {"href", "src", "xlink:href"}]

    def handle_endtag(self, tag):
        assert self.open, tag
        assert self.open.pop() == tag


def page_of(verdict: str) -> str:
    """The page of a verdict; of the unknown one, a channel is dead and the file has a hostile name."""
    diagnosis = made_diagnosis(verdict)
    if verdict == "unknown":
        (run,) = diagnosis.runs
        valid = run.valid.copy()
        valid[:, 4] = False
        hostile = replace(run, name="<script>alert(1)</script>\x1b[31m\u202e.csv", valid=valid)
        diagnosis = replace(diagnosis, runs=(hostile,))
    return report_html(diagnosis)


class Pages(dict):
    """Pages by verdict, each drawn when a test first reads it: one takes seconds."""

    def __init__(self, made_once):
        self._made_once = made_once

    def __missing__(self, verdict):
        self[verdict] = self._made_once(f"report-{verdict}.html", lambda: page_of(verdict))
        return self[verdict]


@pytest.fixture(scope="session")
def pages(made_once):
    """One page per verdict."""
    return Pages(made_once)


def words_of(page: str) -> str:
    text = re.sub(r"<style>.*?</style>|<script.*?</script>|<!--.*?-->|<svg.*?</svg>", "", page, flags=re.DOTALL)
    return re.sub(r"\s+", " ", html.unescape(re.sub(r"<[^>]+>", " ", text)))


@pytest.mark.study(but=["explained", "nothing_found"])
@pytest.mark.parametrize("verdict", VERDICTS)
def test_the_page_is_whole_and_needs_no_network(pages, verdict):
    page = Page()
    page.feed(pages[verdict])
    assert page.open == []
    assert page.links
    assert all(link.startswith(("#", "data:")) for link in page.links)
    assert not re.search(r"url\((?!#)|@import|<script[^>]*src", pages[verdict])
    assert len(pages[verdict].encode()) < 1_000_000


def test_no_script_runs_but_those_of_the_page(pages):
    """The page's own policy names its two scripts by their content, and lets nothing be loaded."""
    page = pages["unknown"]
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]+)"', page)
    policy = html.unescape(policy)
    assert policy.startswith("default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src ")
    scripts = re.findall(r"<script>(.*?)</script>", page, flags=re.DOTALL)
    hashes = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts]
    assert len(scripts) == 2
    assert policy.rpartition("script-src ")[2] == " ".join(f"'sha256-{one}'" for one in hashes)


def test_what_has_a_place_and_no_name_is_said_first_and_drawn(pages):
    words = words_of(pages["unknown"])
    text = "the reference reads otherwise than the table turns, as a function of the rate (+0.03 rad/s)"
    assert f"Something is wrong that has no name in the library: {text}." in words
    assert "Probability of the place: 88 %." in words
    assert "Not separable from this by these data: the axis tilts in the room, always." in words
    assert "the function that the data show, ±2σ" in words
    assert "Measured and predicted, by the simulation as given and extended" in words
    assert "Where it is: the axis, with the table and its reference." in words


def test_the_licence_of_the_plots_is_on_the_page(pages):
    assert "Copyright (c) 2022 Leon Sorokin" in pages["explained"]


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_figure_is_a_picture_of_its_own(pages, verdict):
    figures = re.findall(r"<svg.*?</svg>", pages[verdict], flags=re.DOTALL)
    assert len(figures) >= 4  # trace, array twice, all channels, and what was found
    for figure in figures:
        ET.fromstring(figure)
    names = re.findall(r'\bid="([^"]+)"', pages[verdict])
    assert len(names) == len(set(names))
    used = re.findall(r'(?:url\(|href=")#([^)"]+)', pages[verdict])
    assert set(used) <= set(names)


def test_the_first_screen_says_what_is_wrong_how_much_and_what_to_do(pages):
    text = words_of(pages["explained"])
    first = text[: text.index("Other explanations")]
    for words in (
        "Explained",
        "Found what the simulation leaves out: the table's axis is not vertical.",
        "99 % of the error beyond noise is gone",
        "4.000 ± 0.050 mrad",
        "0.2292 ± 0.0029 °",
        "99.9 %",
        "What to do next",
        "twin.toml",
    ):
        assert words in first
    assert "axis_wobble" in text
    assert "1 : 10⁵²" in text
    assert "its inertial part at high rate is not in the data" in text


def test_each_verdict_has_its_own_words(pages):
    assert "does not show which: the whole array is off the table's axis or a chip is not where" in words_of(
        pages["ambiguous"]
    )
    assert "remounted on its side" in words_of(pages["ambiguous"])
    assert "Something is wrong that has no name in the library" in words_of(pages["unknown"])
    assert "The reference reads otherwise than the table turns" in words_of(pages["unknown"])
    assert "nexplained" not in words_of(pages["unknown"])  # what a function describes is not left
    calm = words_of(pages["nothing_found"])
    assert "Nothing is wrong with the simulation that this recording could show." in calm
    assert "None named." in calm


def test_the_views_that_speak_are_drawn_and_the_others_named(pages):
    words = words_of(pages["explained"])
    assert "cycle per revolution" in words
    assert "after: gone" in words
    assert "What was wrong in a" in words
    assert "goes with the angle within a revolution" in words
    calm = words_of(pages["nothing_found"])
    assert "Before," not in calm
    assert "Nothing beyond chance: a line over frequency (" in calm
    assert "Where it is" not in calm


def test_noise_levels_have_their_units(pages):
    assert (
        "white noise of the channels over that of the data sheet (median) 1.00; bias instability (median of the "
        "channels) 0.00150 m/s²; white noise of the reference 0.0200 rad/s. Made by gfimu"
    ) in words_of(pages["explained"])


def test_text_from_outside_cannot_break_the_page(pages):
    assert "<script>alert" not in pages["unknown"]
    assert r"&lt;script&gt;alert(1)&lt;/script&gt;\u001b[31m\u202e.csv" in pages["unknown"]
    assert not re.search("[\x1b\u202e]", pages["unknown"])


def test_a_dead_channel_is_named(pages):
    assert "Left out for want of a usable sample: a22." in words_of(pages["unknown"])


def test_the_folder_holds_all_files_or_none(tmp_path, monkeypatch):
    diagnosis = made_diagnosis("explained")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "verdict.json").write_text("kept")
    written_report = []  # drawing it takes seconds, and the pages above are of it
    monkeypatch.setattr(
        "gfimu.diagnosis.report.page.write_report", lambda path, *_: written_report.append(path.write_text("report"))
    )
    with monkeypatch.context() as patch:
        patch.setattr("gfimu.diagnosis.report.picture.write_picture", lambda *_, **__: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            write_diagnosis(tmp_path / "out", diagnosis)
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["verdict.json"]
    assert (tmp_path / "out" / "verdict.json").read_text() == "kept"
    assert len(written_report) == 1  # before the picture failed
    written = write_diagnosis(tmp_path / "out", diagnosis)
    names = {"verdict.json", "twin.toml", "report.html", "diagnosis.rrd"}
    assert {file.name for file in (tmp_path / "out").iterdir()} == names == {path.name for path in written.values()}


def test_a_folder_that_cannot_be_is_refused_before_any_work(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="choose a folder"):
        check_folder(tmp_path / "file")
    with pytest.raises(InputError, match="choose a folder"):
        check_folder(tmp_path / "file" / "below")
    with pytest.raises(InputError, match="choose a folder"):
        check_folder(tmp_path / "new" / "below")
    check_folder(tmp_path / "new")
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    ("key", "unit", "value", "std", "name", "text", "familiar"),
    [
        ("x_rad", "rad", 0.0041, 0.0001, "x", "4.10 ± 0.10 mrad", "0.2349 ± 0.0057 °"),
        ("x_m", "m", -0.0012, 2e-5, "x", "−1.200 ± 0.020 mm", ""),
        ("a11_m_s2", "m/s²", 0.5, 0.01, "a11", "0.500 ± 0.010 m/s²", "51.0 ± 1.0 mg"),
        ("a11", "ratio", 0.002, 1e-4, "a11", "0.00200 ± 0.00010", "0.200 ± 0.010 %"),
        ("frequency_hz", "Hz", 12.345, 0.01, "frequency", "12.345 ± 0.010 Hz", ""),
        ("stretch_s2_rad2", "s²/rad²", 2.5e-5, 1e-6, "stretch", "(2.50 ± 0.10)·10⁻⁵ s²/rad²", ""),
        ("order", "number", 7.0, None, "order", "7", ""),
        ("chip", "name", "a2", None, "chip", "a2", ""),
        ("channels", "name", ["a11", "a12"], None, "channels", "a11, a12", ""),
    ],
)
def test_parameters_read_as_people_write_them(key, unit, value, std, name, text, familiar):
    cause = NamedCause("bias", {key: value}, {} if std is None else {key: std}, 0.9)
    (found,) = parameter_texts(cause, {key: unit})
    assert (found.name, found.value, found.familiar, found.significant) == (name, text, familiar, True)


def test_a_parameter_within_its_error_is_pale():
    (found,) = parameter_texts(NamedCause("table_tilt", {"x_rad": 1e-4}, {"x_rad": 1e-4}, 0.9), {"x_rad": "rad"})
    assert not found.significant


def test_odds_and_percent():
    assert odds(-np.log(20.0)) == "1 : 20"
    assert odds(-52 * np.log(10.0)) == "1 : 10⁵²"
    assert odds(np.log(3.0)) == "3 : 1"
    assert odds(-1e6) == "< 1 : 10¹⁰⁰"
    assert percent(0.9995) == "> 99.9 %"
    assert percent(0.97) == "97 %"
    assert percent(float("nan")) == "–"


def test_several_causes_are_counted_and_named():
    diagnosis = made_diagnosis("explained")
    second = NamedCause(
        "eccentricity", {"x_m": 1e-3}, {"x_m": 1e-5}, 0.98, not_distinguishable_from=("sensor_position",)
    )
    both = replace(diagnosis, causes=(*diagnosis.causes, second))
    assert headline(both).startswith("Found two things that the simulation leaves out: ")
    assert "these put into the simulation" in story(both)
    assert any("confounded with sensor_position" in step for step in next_steps(both))


def test_a_run_of_one_sample_leaves_the_words():
    diagnosis = made_diagnosis("nothing_found")
    (run,) = diagnosis.runs
    first = {
        item.name: value[:1]
        for item in fields(run)
        if isinstance(value := getattr(run, item.name), np.ndarray) and item.name != "white"
    }
    words = words_of(report_html(replace(diagnosis, runs=(replace(run, **first),))))
    assert "Nothing is wrong with the simulation that this recording could show." in words
    assert "What was wrong" not in words


def test_the_page_of_a_linear_axis_has_speeds_in_metres():
    diagnosis = made_diagnosis("nothing_found")
    linear = replace(diagnosis, runs=tuple(replace(run, linear=True) for run in diagnosis.runs))
    words = words_of(report_html(linear))
    assert "rad/s" not in words
