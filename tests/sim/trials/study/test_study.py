"""The study of the diagnosis: what counts as right, and the tables made of it."""

from __future__ import annotations

import json

import pytest

from gfimu import InputError
from sim.trials import draw_world
from sim.trials.study.__main__ import main
from sim.trials.study.cases import Case
from sim.trials.study.outcome_file import read_outcomes
from sim.trials.study.report import reliability, summarise, write_report
from sim.trials.study.tally import rate_with_interval, score


def outcome(effects=(), causes=(), verdict="nothing_found", **more):
    """An outcome with the causes given as (effect, probability, rivals)."""
    told = [
        {"effect": name, "probability": probability, "rivals": list(rivals), "z": {}, "place": "", "log_odds": 50.0}
        for name, probability, rivals in causes
    ]
    plain = {
        "key": "singles/1",
        "study": "singles",
        "source": "sim.campaign",
        "size": 60.0,
        "without": "",
        "reached": 60.0,
        "noise": {},
        "processor_s": 1.0,
    }
    return {**plain, "effects": list(effects), "causes": told, "verdict": verdict, **more}


def test_a_name_too_many_is_wrong_and_a_set_is_right_only_where_nothing_parts_it():
    right = score(outcome(["bias"], [("bias", 0.9, ())], "explained"))
    assert right["exact"]
    assert not right["wrong"]
    more = score(outcome(["bias"], [("bias", 0.9, ()), ("noise", 0.9, ())], "explained"))
    assert more["wrong"]
    assert not more["exact"]
    honest = score(outcome(["bias"], [("bias", 0.5, ("scale_factor",))], "ambiguous"))
    assert honest["fair"]
    assert not honest["exact"]
    escape = score(outcome(["bias"], [("bias", 0.5, ("clock_error",))], "ambiguous"))
    assert escape["within"]
    assert not escape["fair"]
    assert score(outcome())["exact"]
    told = ([("clock_error", 0.8, ("tacho_latency",)), ("tacho_latency", 0.2, ("clock_error",))], "ambiguous")
    for left, fair in ((2.0, True), (5.0, False)):
        assert score(outcome(["clock_error"], *told, left_by={"tacho_latency": left}))["fair"] == fair


def test_stated_probabilities_are_compared_with_what_was_observed():
    outcomes = [outcome(["bias"], [("bias", 0.8, ())], "explained") for _ in range(3)]
    outcomes.append(outcome(["noise"], [("bias", 0.8, ())], "explained"))
    ((stated, observed, count),) = reliability(outcomes)
    assert (stated, observed, count) == (pytest.approx(0.8), pytest.approx(0.75), 4)
    assert "over all 4 causes: 0.050" in summarise(outcomes)


def test_singles_are_sorted_by_their_size_with_the_drive_unknown():
    outcomes = [
        outcome(["bias"], drive_unknown=4.0),
        outcome(["bias"], [("bias", 0.9, ())], "explained", drive_unknown=8),
    ]
    lines = [
        line for line in summarise(outcomes).splitlines() if line.startswith(("| 0 to 5 | 1 |", "| 7 to 10 | 1 |"))
    ]
    assert [line.split("|")[3].split()[0] for line in lines] == ["0.0", "100.0"]


def test_an_interval_holds_its_rate():
    rate, low, high = rate_with_interval(9, 10)
    assert low < rate < high
    assert rate_with_interval(0, 100)[2] == pytest.approx(0.0362, abs=1e-4)  # 1 − 0.025^(1/100)


@pytest.mark.parametrize(("name", "least", "most"), [("table_tilt", 50.0, 250.0), ("eccentricity", 0.0, 3.0)])
def test_an_effect_taken_out_is_as_far_from_the_rest_as_it_is_unlike_it(name, least, most):
    world = draw_world(Case("left_out", 5, (name,), 200.0, duration=20.0, without=name))
    assert least <= min(world.left_by.values()) <= most
    assert world.left_by_two <= min(world.left_by.values()) <= world.drive_unknown <= world.reached
    assert name not in world.twin.families()
    line = next(
        row
        for row in summarise([outcome([name], study="left_out", without=name, left_by=world.left_by)]).splitlines()
        if row.startswith("| **taken out")
    )
    assert ("confounded with one other effect" in line) == (most < 15.0)


def test_the_report_keeps_what_was_written_by_hand(tmp_path):
    outcomes = [outcome(["bias"], [("bias", 0.8, ())], "explained"), outcome(["noise"])]
    page = write_report(outcomes, tmp_path)[0]
    first = page.read_text()
    remark = "**State.** Two runs only."
    page.write_text(first.replace("\n<!-- end of remarks -->", f"\n{remark}\n\n<!-- end of remarks -->"))
    write_report(outcomes, tmp_path)
    once = page.read_text()
    assert once.count(remark) == 1
    write_report(outcomes, tmp_path)
    assert page.read_text() == once
    page.write_text(first.replace("<!-- end of remarks -->", remark))
    with pytest.raises(InputError, match="remarks"):
        write_report(outcomes, tmp_path)
    assert remark in page.read_text()


def test_the_tables_can_be_made_again_from_what_is_kept_beside_them(tmp_path):
    outcomes = [
        outcome(["bias"], [("bias", 1.0 / 3.0, ())], "explained", drive_unknown=None, z=[1.0 / 3.0]),
        outcome(["noise"], key="singles/2"),
    ]
    page, kept = write_report(outcomes, tmp_path / "first")[:2]
    again = tmp_path / "new.jsonl"
    again.write_text(json.dumps(outcome(["noise"], [("noise", 0.9, ())], "explained", key="singles/2")) + "\n")
    assert main(["report", str(kept), "--out", str(tmp_path / "second")]) == 0
    assert (tmp_path / "second" / page.name).read_text() == page.read_text()
    assert main(["report", str(kept), str(again), "--out", str(tmp_path / "third")]) == 0
    assert [one["verdict"] for one in read_outcomes(tmp_path / "third" / kept.name)] == ["explained", "explained"]


def test_the_page_of_the_study_is_that_of_the_outcomes_beside_it(project_root):
    page = (project_root / "docs" / "accuracy" / "diagnosis-study.md").read_text(encoding="utf-8")
    assert summarise(read_outcomes(project_root / "docs" / "accuracy" / "diagnosis-study.jsonl.xz")) in page


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("outcomes.jsonl.xz", b""),
        ("outcomes.jsonl.xz", b"\xfd7zXZ\x00 cut off"),
        ("outcomes.jsonl.xz", b"no archive"),
        ("outcomes.jsonl", b""),
        ("outcomes.jsonl", b"\xff\xfe"),
        ("outcomes.jsonl", None),
    ],
)
def test_a_file_without_outcomes_is_one_clear_line(tmp_path, name, content, capsys):
    file = tmp_path / name
    if content is not None:
        file.write_bytes(content)
    assert main(["report", str(file), "--out", str(tmp_path / "page")]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert str(file) in told
    assert not (tmp_path / "page").exists()
