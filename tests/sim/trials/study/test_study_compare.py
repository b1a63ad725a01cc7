"""Two files of outcomes compared: what differs, what leaves its interval, and files that can't be compared."""

from __future__ import annotations

import json
import lzma

import pytest

from sim.trials.study.__main__ import main
from sim.trials.study.compare import POLICY, compare, load_outcomes
from sim.trials.study.tally import score


def outcome(number, effects=("bias",), names=None, verdict=None, study="singles", **more):
    """An outcome that is right unless told otherwise."""
    names = effects if names is None else names
    told = [{"effect": name, "probability": 0.99, "rivals": [], "z": {"a": 0.5}, "place": ""} for name in names]
    said = verdict or ("explained" if names else "nothing_found")
    plain = {"key": f"{study}/{number}", "study": study, "seed": number, "source": "sim.campaign", "size": 60.0}
    plain |= {"without": "", "reached": 60.0, "noise": {}, "processor_s": 1.0, "duration": 40.0}
    return {**plain, "effects": list(effects), "causes": told, "verdict": said, **more}


def write(path, outcomes):
    path.write_text("".join(json.dumps(one) + "\n" for one in outcomes))
    return path


def run(capsys, *files):
    code = main(["compare", *map(str, files)])
    return code, capsys.readouterr()


@pytest.fixture
def twenty():
    return [outcome(number) for number in range(20)]


def test_the_same_outcomes_stay_within_every_interval(tmp_path, capsys, twenty):
    code, told = run(capsys, write(tmp_path / "old.jsonl", twenty), write(tmp_path / "new.jsonl", twenty))
    assert code == 0
    assert "20 cases compared in 1 lists, 0 differ" in told.out
    assert "every list stays within its interval" in told.out


def test_a_case_that_differs_is_printed_with_what_was_reported_before_and_after(tmp_path, capsys, twenty):
    new = [*twenty[:-1], outcome(19, names=(), blame="search")]
    code, told = run(capsys, write(tmp_path / "old.jsonl", twenty), write(tmp_path / "new.jsonl", new))
    assert code == 0  # one of twenty may miss
    (line,) = [line for line in told.out.splitlines() if line.strip().startswith("singles/19")]
    assert "explained bias (exact, fair, within) -> nothing_found (blame: search)" in line
    assert "named alone               1.000 (0.83-1.00) -> 0.950 (0.75-1.00)  0 better, 1 worse, p 0.5" in told.out
    assert "parameters within 1, 2, 3 std: 1.000 1.000 1.000 of 20 -> 1.000 1.000 1.000 of 19" in told.out


def test_seven_that_only_got_worse_leave_the_paired_interval_where_no_rate_is_promised(tmp_path, capsys):
    def some(missed):
        return [
            outcome(n, ("bias", "noise", "gravity"), () if n < missed else None, study="triples") for n in range(40)
        ]

    old = write(tmp_path / "old.jsonl", some(2))
    for missed, code in ((8, 0), (9, 1)):  # 6 and 7 of as many: p = 1/64 and 1/128
        got, told = run(capsys, old, write(tmp_path / "new.jsonl", some(missed)))
        assert got == code
        assert ("LEFT ITS INTERVAL  triples" in told.out) == bool(code)


def test_what_is_lost_here_and_won_there_is_no_worse():
    old = {("triples", str(n)): outcome(n, names=() if n < 10 else None, study="triples") for n in range(20)}
    new = {("triples", str(n)): outcome(n, names=() if n >= 10 else None, study="triples") for n in range(20)}
    found = compare(old, new)
    assert found.different == 20
    assert not found.left


@pytest.mark.parametrize(
    ("before", "bad", "least"),
    [
        ({}, {"names": ()}, 3),  # in any set: 0.98 of 20 allows 2
        ({"study": "pairs", "effects": ("bias", "noise")}, {"names": ()}, 7),  # named alone: 0.88 of 20 allows 6
        ({"study": "pairs", "effects": ("bias", "noise")}, {"names": ("gravity",)}, 5),  # wrong: 0.05 of 20 allows 4
        ({"effects": (), "study": "nulls"}, {"names": ("bias",)}, 3),  # a false alarm: 0.01 of 20 allows 2
        ({"effects": (), "study": "nulls"}, {"verdict": "error"}, 1),  # a crash is never right
        ({"verdict": "unknown", "names": (), "study": "exotics"}, {"verdict": "explained", "names": ("noise",)}, 7),
    ],
)
def test_a_promised_rate_is_broken_by_so_many(before, bad, least):
    old = {("k", str(n)): outcome(n, **before) for n in range(20)}
    for count, left in ((least - 1, False), (least, True)):
        new = {("k", str(n)): outcome(n, **{**before, **(bad if n < count else {})}) for n in range(20)}
        assert bool(compare(old, new).left) == left, (count, compare(old, new).text)


def test_parameters_far_off_break_their_promise():
    old = {("k", str(n)): outcome(n) for n in range(40)}
    far = [{**cause, "z": {"a": 5.0}} for cause in old["k", "0"]["causes"]]
    new = {name: {**one, "causes": far} if one["seed"] < 5 else one for name, one in old.items()}
    assert any("within 3 std" in reason for reason in compare(old, new).left)


def test_lists_too_small_to_show_it_show_it_together():
    names = [f"list{n}" for n in range(8)]
    old = {("k", name): outcome(n, study=name) for n, name in enumerate(names)}
    new = {("k", name): outcome(n, names=("noise",), study=name) for n, name in enumerate(names)}
    assert all(reason.startswith("all lists together") for reason in compare(old, new).left)
    assert len(compare(old, new).left) == 2


def test_cases_of_one_file_are_counted_and_named_and_files_of_generators_may_stand_anywhere(tmp_path, capsys):
    here, there = "tests/independent_world.py:hide", "/elsewhere/independent_world.py:hide"
    old = [outcome(1), outcome(2, source=here), outcome(3, source=here)]
    new = [outcome(2, source=there), outcome(4), outcome(1, method="greedy BIC")]
    code, told = run(capsys, write(tmp_path / "old.jsonl", old), write(tmp_path / "new.jsonl", new))
    assert code == 0
    assert "1 cases compared" in told.out
    assert "only in the old file: 2\n  singles, independent_world, 1: 3\n  singles, sim.campaign, 1: 1\n" in told.out
    assert "only in the new file: 1\n  singles, sim.campaign, 1: 4\n" in told.out


def test_a_later_outcome_replaces_an_earlier(tmp_path):
    file = write(tmp_path / "new.jsonl", [outcome(1, names=()), outcome(2), outcome(1)])
    found = load_outcomes(file)
    assert len(found) == 2
    assert score(found["singles/1", "sim.campaign"])["exact"]
    packed = tmp_path / "new.jsonl.xz"
    packed.write_bytes(lzma.compress(file.read_bytes()))
    assert load_outcomes(packed) == found


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "no outcomes"),
        ("{torn", "no file of outcomes"),
        ("12\n", "outcome 1 has no 'key'"),
        ('{"key": "singles/1"}\n', "outcome 1 has no 'study'"),
        (json.dumps(outcome(99)), "no case is in both files"),
        (json.dumps(outcome(1, duration=12.0)), "singles/1: duration is 40.0 in the old file and 12.0 in the new"),
        (None, "no outcomes"),
    ],
)
def test_files_that_cannot_be_compared_are_one_clear_line(tmp_path, capsys, twenty, content, message):
    old, new = write(tmp_path / "old.jsonl", twenty), tmp_path / "new.jsonl"
    if content is not None:
        new.write_text(content)
    code, told = run(capsys, old, new)
    assert code == 2
    assert message in told.err
    assert told.err.count("\n") == 1


def test_the_stored_outcomes_stay_within_the_policy(project_root):
    """What the study page states is what the promises ask."""
    stored = load_outcomes(project_root / "docs" / "accuracy" / "diagnosis-study.jsonl.xz")
    found = compare(stored, stored)
    assert not found.left
    assert {study for study, _ in POLICY.promises} - {key.partition("/")[0] for key, _ in stored} == {
        "fast_samples",
        "threshold_nulls",
        "long_nulls",
    }
