"""Verdicts of every kind: sentences, steps and page say the same of names, shares, probabilities and rivals."""

from __future__ import annotations

import html
import re
from dataclasses import replace

import pytest
from made_diagnoses import made_diagnosis

from gfimu.diagnosis import headline, next_steps, report_html
from gfimu.diagnosis.report.plain_words import percent
from gfimu.diagnosis.verdict.wording import verdict_sentences


def of_free_time(found):
    """The same verdict with a place and no function."""
    (cause,) = found.causes
    located = replace(cause.unlisted, dependence="time", function=None, instead=(), text="the bench shakes, in time")
    return replace(found, causes=(replace(cause, unlisted=located, would_be_separated_by="", why=located.text),))


def beside_a_name(found):
    """A named cause with one that has a place only."""
    unknown = made_diagnosis("unknown")
    return replace(unknown, causes=(*found.causes, *unknown.causes))


KINDS = {
    "nothing": lambda: made_diagnosis("nothing_found"),
    "named": made_diagnosis,
    "one of two": lambda: made_diagnosis("ambiguous"),
    "described": lambda: made_diagnosis("unknown"),
    "in time": lambda: of_free_time(made_diagnosis("unknown")),
    "named and described": lambda: beside_a_name(made_diagnosis()),
    "nowhere": lambda: replace(made_diagnosis("unknown"), causes=()),
}


@pytest.fixture(scope="module", params=KINDS)
def reported(request):
    """A verdict with its sentences, its headline and steps, and the text of its page."""
    found = KINDS[request.param]()
    sentences = verdict_sentences(found.verdict, found.causes, found.residual, found.gain, found.unexplained, ())
    found = replace(found, sentences=sentences)
    page = re.sub(r"<(style|script|svg).*?</\1>", " ", report_html(found), flags=re.DOTALL)
    text = re.sub(r"\s+", " ", html.unescape(re.sub(r"<[^>]+>", " ", page)))
    return found, (" ".join(sentences), f"{headline(found)} {' '.join(next_steps(found))}", text)


def test_a_name_is_said_where_it_is_a_cause_and_nowhere_else(reported):
    found, (sentences, steps, page) = reported
    named = {cause.effect for cause in found.causes if cause.unlisted is None}
    for name in named:
        assert name in sentences
        assert name in page
    for other in {"table_tilt", "eccentricity", "sensor_position"} - named:
        assert other not in sentences
        assert other not in steps


def test_shares_and_probabilities_are_the_same_everywhere(reported):
    found, (sentences, _, page) = reported
    if found.gain.held_out:
        share = found.gain.share_of_excess_removed
        assert f"{100 * share:.1f} % of the excess" in sentences
        assert percent(share) in page
    for cause in found.causes:
        chance = cause.probability if cause.unlisted is None else cause.unlisted.place_probability
        assert percent(chance) in page


def test_the_residual_of_the_sentence_is_the_one_of_the_page(reported):
    found, (sentences, _, page) = reported
    if found.causes:
        before, after = (f"{one:.3g}" for one in (found.residual.rms_before, found.residual.rms_after))
        assert (f"from {before} to {after}" in sentences) == (before != after)
        assert f"{found.residual.rms_after:#.3g}" in page
    assert f"{found.residual.rms_before:#.3g}" in page


def test_a_place_its_rivals_and_what_decides_are_in_all_three(reported):
    found, (sentences, steps, page) = reported
    for cause in found.causes:
        if cause.unlisted is None:
            continue
        assert cause.unlisted.text in sentences.lower()
        assert cause.unlisted.text in page.lower()
        for other in cause.unlisted.instead:
            assert other in sentences
            assert other in page
        assert (cause.would_be_separated_by in steps) or found.verdict != "unknown"
    if any(cause.unlisted is not None for cause in found.causes):
        assert "None named" not in page


def test_nothing_is_not_said_beside_something(reported):
    found, (sentences, steps, page) = reported
    nothing = "agrees with the measurement" in sentences
    assert nothing == (found.verdict == "nothing_found")
    if nothing:
        assert "wrong" not in sentences
        assert "Keep the simulation as it is" in steps
    unexplained = "nothing in the library explains" in sentences
    assert unexplained == (found.verdict == "unknown")
    if found.verdict == "nothing_found":
        assert "Nothing to measure" in page
