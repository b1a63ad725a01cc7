"""The gate's list: what is in it, how it was chosen, free bodies, blame, and a worker that is killed."""

from __future__ import annotations

from collections import Counter
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest

from gfimu.errors import InputError
from sim.effects import EFFECTS
from sim.study import blame, runner
from sim.study.__main__ import main
from sim.study.blame import blame_of, is_miss
from sim.study.cases import EXOTICS, STUDIES, Case
from sim.study.compare import load_outcomes
from sim.study.gate import LONGEST, STRATA, choose_gate, gate_cases
from sim.study.outcome import draw_world
from sim.study.outcome_file import generator_name, read_outcomes
from sim.study.runner import run_study


@pytest.fixture(scope="module")
def stored(request):
    return load_outcomes(request.config.rootpath / "docs" / "diagnosis-study.jsonl.xz")


def test_the_gate_has_every_kind_of_case(stored):
    cases = gate_cases()
    assert len(set(cases)) == len(cases) >= 300
    singles = {case.effects[0] for case, _ in cases if case.study == "singles"}
    assert singles == set(EFFECTS)
    assert {case.effects[0] for case, _ in cases if case.study == "exotics"} == set(EXOTICS)
    kinds = Counter(case.study for case, _ in cases)
    assert set(kinds) == {stratum.study for stratum in STRATA}
    assert sum(not case.effects for case, _ in cases) >= 50
    assert {source.rpartition("/")[2] for _, source in cases} == {
        "",
        "independent_world.py:hide",
        "independent_profiles.py:hide",
    }
    known = [(case, source) for case, source in cases if case.study != "free_body"]
    names = [(case.key, generator_name(source or "sim.campaign")) for case, source in known]
    assert all(name in stored for name in names)
    # Drawing a world takes half a second to two besides.
    assert sum(stored[name]["processor_s"] for name in names) < 1400.0
    assert gate_cases(20) == cases[:20]


def test_the_gate_is_chosen_by_time_and_seed_and_not_by_what_was_reported(stored):
    outcomes = [one for one in stored.values() if one["study"] in {"pairs", "exotics"}]
    chosen = choose_gate(outcomes)
    blind = [{**one, "verdict": "error", "causes": []} for one in outcomes]
    assert choose_gate(blind) == chosen
    pairs = [line for line in chosen if line.startswith("pairs/")]
    quick = sorted(one["seed"] for one in outcomes if one["study"] == "pairs" and one["processor_s"] <= LONGEST)
    assert [int(line.rpartition("/")[2]) for line in pairs] == quick[: len(pairs)]


def test_the_gate_has_its_own_generators(tmp_path, capsys):
    assert main(["run", "gate", "--out", str(tmp_path / "out.jsonl"), "--world", "some.py:hide"]) == 2
    assert "leave out --world" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["chip_delay", "scale_factor"])
def test_a_free_body_has_its_effect_at_the_size_that_was_asked(name):
    case = next(case for case in STUDIES["free_body"]() if case.effects == (name,))
    world, again = draw_world(case), draw_world(case)
    assert world.twin.drive_source == "gyro"
    assert world.reached == pytest.approx(case.size, rel=0.03)
    assert [effect for effect, _ in world.truth] == [name]
    np.testing.assert_array_equal(world.recording.readings, again.recording.readings)
    assert "gyro_x_rad_s" in world.recording.reference


def test_a_free_body_of_an_array_without_parts_is_refused():
    with pytest.raises(InputError, match="corners8"):
        draw_world(Case("free_body", 1, body=True, array="corners8"))


_SHORT = Case("singles", 555, ("table_tilt",), 300.0, duration=12.0)


def test_the_search_is_to_blame_where_the_truth_is_more_probable_and_the_evidence_where_it_is_not(monkeypatch):
    """A search that stops before it begins misses what the truth explains; a faint size is too little for any."""
    missed = {"verdict": "nothing_found", "causes": [], "effects": ["table_tilt"], "without": "", "study": "singles"}
    assert is_miss({**missed, "reached": 60.0})
    assert not is_miss({**missed, "reached": 5.0})
    faint = blame_of(replace(_SHORT, size=2.0), "", missed)
    assert faint["blame"] == "evidence"
    assert faint["truth_over_found"] < 0
    search = blame.understand_any_length

    def stopped(*arguments):
        found = search(*arguments)
        return replace(found, explanation=replace(found.explanation, best=found.explanation.nothing))

    monkeypatch.setattr(blame, "understand_any_length", stopped)
    blind = blame_of(_SHORT, "", missed)
    assert blind["blame"] == "search"
    assert blind["truth_over_found"] > 100


def test_an_effect_without_a_size_and_a_crash_have_no_fit_to_blame():
    case = replace(_SHORT, effects=("noise",), size=0.0)
    assert blame_of(case, "", {"verdict": "nothing_found"})["blame"].startswith("no fit")
    assert blame_of(case, "", {"verdict": "error"})["blame"] == "crash"


class _Pool(Executor):
    """A pool that breaks, as a process pool does, with the case whose worker is killed, and with all after it."""

    def __init__(self):
        self._broken = False

    def submit(self, work, case, source):
        future = Future()
        self._broken |= case.seed == 2
        if self._broken:
            future.set_exception(BrokenExecutor("a process in the process pool was terminated abruptly"))
        else:
            found = {"key": case.key, "source": source or "sim.campaign", **case.to_dict(), "verdict": "nothing_found"}
            future.set_result(found)
        return future


@pytest.mark.parametrize("suspects", [1, 8])
def test_a_killed_worker_is_a_row_that_says_so_and_the_others_go_on(tmp_path, monkeypatch, suspects):
    monkeypatch.setattr(runner, "open_executor", lambda workers: nullcontext(_Pool()))
    monkeypatch.setattr(runner, "_SUSPECTS", suspects)
    cases = [Case("nulls", seed) for seed in (1, 2, 3)]
    assert run_study(cases, tmp_path / "out.jsonl", _Pool()) == 3
    rows = {row["seed"]: row for row in read_outcomes(tmp_path / "out.jsonl")}
    assert {seed: row["verdict"] for seed, row in rows.items()} == {1: "nothing_found", 2: "error", 3: "nothing_found"}
    assert "killed" in rows[2]["error"]


@pytest.mark.parametrize(("verdict", "asked"), [("nothing_found", ["nulls/1"]), ("explained", [])])
def test_only_a_miss_is_fitted_from_the_truth(tmp_path, monkeypatch, verdict, asked):
    told = [] if verdict == "nothing_found" else [{"effect": "bias", "rivals": []}]
    monkeypatch.setattr(
        runner,
        "run_case",
        lambda case, source: {**_row(case), "effects": ["bias"], "verdict": verdict, "causes": told, "reached": 60.0},
    )
    seen = []
    monkeypatch.setattr(runner, "blame_of", lambda case, *_: seen.append(case.key) or {"blame": "search"})
    with ThreadPoolExecutor(1) as executor:
        run_study([Case("nulls", 1)], tmp_path / "out.jsonl", executor, blame=True)
    (row,) = read_outcomes(tmp_path / "out.jsonl")
    assert seen == asked
    assert row.get("blame") == ("search" if asked else None)


def _row(case):
    return {"key": case.key, "source": "sim.campaign", **case.to_dict()}
