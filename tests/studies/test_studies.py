"""The named command for the long lists, and the marker that says what belongs to them."""

import runpy
from types import SimpleNamespace

import pytest

STUDIES = runpy.run_path(__file__.replace("test_studies", "__main__"))
REPORT = """<testsuites><testsuite>
<testcase classname="tests.hidden.test_rates" name="test_pairs[campaign]" time="90.0">
<properties><property name="fair" value="38 of 40" /></properties></testcase>
<testcase classname="tests.hidden.test_rates" name="test_nothing" time="30.0"><failure>E</failure></testcase>
<testcase classname="tests.rate.test_one" name="test_two" time="0.0"><skipped message="no data" /></testcase>
</testsuite></testsuites>"""


def test_a_report_becomes_an_outcome():
    assert STUDIES["read_report"](REPORT) == {
        "cases": 3,
        "minutes": 2.0,
        "failed": ["hidden.test_rates.test_nothing"],
        "skipped": ["rate.test_one.test_two"],
        "figures": {"hidden.test_rates.test_pairs[campaign]": {"fair": "38 of 40"}},
    }


def test_every_list_is_a_room_with_studies_and_has_a_dated_outcome_or_none(capsys):
    lists = STUDIES["study_lists"]()
    assert {"calibration", "diagnosis", "docs", "firmware_bridge", "hidden", "rate"} <= set(lists)
    assert set(STUDIES["stored"]()) <= set(lists)
    assert all(one["date"] and one["commit"] for one in STUDIES["stored"]().values())
    assert STUDIES["main"](["--list"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == len(lists)


def test_an_unknown_list_is_refused_with_the_names(capsys):
    with pytest.raises(SystemExit, match="2"):
        STUDIES["main"](["nothing"])
    first = min(STUDIES["study_lists"]())
    assert f"no list nothing; the lists are {first}" in capsys.readouterr().err


def collected(mark, *cases, args=("tests",)):
    """Cases of a function that are studies, after the hook of tests/conftest.py."""
    marks = [] if mark is None else [mark.mark]
    items = [
        SimpleNamespace(
            nodeid=f"test_a.py::test_b[{case}]",
            callspec=SimpleNamespace(id=case),
            own_markers=list(marks),
            get_closest_marker=lambda name: marks[0] if marks else None,
        )
        for case in cases
    ]
    hook = runpy.run_path(__file__.replace("studies/test_studies", "conftest"))["pytest_collection_modifyitems"]
    hook(SimpleNamespace(args=args), items)
    return [item.callspec.id for item in items if item.own_markers]


def test_a_marker_names_the_cases_that_are_studies_or_those_that_are_not():
    assert collected(None, "a", "b") == []
    assert collected(pytest.mark.study, "a", "b") == ["a", "b"]
    assert collected(pytest.mark.study(but=["a"]), "a", "b") == ["b"]
    assert collected(pytest.mark.study(only=["a"]), "a", "b") == ["a"]


def test_a_case_that_was_renamed_is_noticed():
    with pytest.raises(AssertionError, match=r"not there: \{'test_a.py::test_b': \['c'\]\}"):
        collected(pytest.mark.study(but=["c"]), "a", "b")
    assert collected(pytest.mark.study(but=["c"]), "a", args=("tests/test_a.py::test_b[a]",)) == ["a"]
