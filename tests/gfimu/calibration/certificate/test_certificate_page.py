"""The page: self-contained, escaped, everything that is stated, one sheet of paper for a chip."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from certification_cases import calibration_of, random_covariance, random_model

from gfimu.base.files.outputs import OutputFolder
from gfimu.calibration import certificate_html, certify, compare
from gfimu.calibration.certificate.certificate import Component, Sheet, Term
from gfimu.calibration.certificate.numbers import plus_minus
from gfimu.calibration.certificate.page import write_certificate
from gfimu.commands.certificate import FOLDER


class Reader(HTMLParser):
    """Text and attributes of a page; every tag must be closed."""

    def __init__(self, page):
        super().__init__()
        self.open, self.text, self.attributes, self.tags = [], "", [], []
        self.feed(page)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.attributes += [value or "" for _, value in attributes]
        if tag not in {"meta", "br"}:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


@pytest.fixture
def found(rng):
    calibration = calibration_of(random_model(rng), random_covariance(rng), "x_axis")
    return certify(replace(calibration, statements=("<i>so</i> & so",)), item="<script>alert(1)</script>", date="today")


def test_the_page_shows_every_stated_value_and_what_was_not_determined(found):
    text = Reader(certificate_html(found)).text
    for term in found.terms:
        if term.expanded is not None:
            assert plus_minus(term.value, term.expanded) in text, term.name
            assert plus_minus(term.value * term.familiar_factor, term.expanded * term.familiar_factor) in text
    assert "Not determined by this calibration: K3 (third-order coefficient), Kip" in text
    assert text.count("0 (by definition)") == 6  # three misalignments, in two units
    for one in found.budget:
        assert one.source in text


def test_the_page_needs_nothing_outside_and_runs_nothing(found):
    page = certificate_html(found)
    reader = Reader(page)
    assert not {"script", "link", "img", "iframe"} & set(reader.tags)
    assert "<script>alert(1)</script>" in reader.text
    assert "<i>so</i> & so" in reader.text
    assert not re.search(r"https?://|url\(|@import", page)


def test_the_sheet_and_the_comparison_have_pages_of_their_own(found):
    sheet = Sheet(
        "As an angular sensor", (Term("r", "R<i>_α", "range", "rad/s", 40.0, 1.0, 2.0, 2.0),), {"at": "20 °C"}, ("n",)
    )
    both = replace(found, angular_sensor=sheet, comparison=compare(found, found, other="theirs.json"))
    reader = Reader(certificate_html(both))
    assert "As an angular sensor" in reader.text
    assert "40.0 ± 2.0" in reader.text
    assert "R<i>α" in reader.text  # escaped, its index below the line
    assert "21 of 21 quantities" in reader.text
    assert "Comparison with theirs.json" in reader.text
    assert reader.attributes.count("newpage") == 2
    assert Reader(certificate_html(found)).attributes.count("newpage") == 0


def test_the_budget_names_the_largest_of_each_source(found):
    table = [Component(f"a1{i}_K0", "table", "B", "uniform", 0.1 * i, "m/s²", 5.0) for i in (1, 2, 3)]
    table.append(Component("a11_K0", "gravity", "B", "normal", 1e-18, "m/s²"))
    calibration = calibration_of(random_model(np.random.default_rng(1)), random_covariance(np.random.default_rng(1)))
    page = certificate_html(certify(calibration, components=table))
    (row,) = re.findall(r"<tr><td>table</td>.*?</tr>", page, re.DOTALL)
    assert re.findall(r">([^<>\n]*)</td>", row)[:5] == ["table", "B", "uniform", "5", "0.3"]
    (nothing,) = re.findall(r"<tr><td>gravity</td>.*?</tr>", page, re.DOTALL)
    assert re.findall(r">([^<>\n]*)</td>", nothing)[3:5] == ["∞", "0"]


def test_sentences_of_several_chips_are_printed_once(found):
    chips = (found.chips[0], replace(found.chips[0], chip="b1"))
    statements = ("a1: level to 0.1 rad", "b1: level to 0.2 rad", "for all: this")
    text = Reader(certificate_html(replace(found, chips=chips, statements=statements))).text
    assert "a1, b1: level to 0.1 rad (figures of a1)" in text
    assert "for all: this" in text
    assert "0.2 rad" not in text


def test_the_folder_holds_what_the_command_says(found, tmp_path):
    written = write_certificate(tmp_path / "made", found)
    assert sorted(path.name for path in (tmp_path / "made").iterdir()) == sorted(FOLDER.names)
    assert set(written.values()) == {tmp_path / "made" / name for name in FOLDER.names}
    assert isinstance(FOLDER, OutputFolder)
