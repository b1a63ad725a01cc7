"""The gate's list: what is in it, how it was chosen, free bodies, blame, and runs of a study as campaigns."""

from __future__ import annotations

from collections import Counter
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from gfimu import InputError
from sim.effects import EFFECTS
from sim.trials import Dataset, draw_world, study_cases
from sim.trials.study import __main__ as study
from sim.trials.study import blame, plan
from sim.trials.study.__main__ import main
from sim.trials.study.blame import blame_of, is_miss
from sim.trials.study.cases import EXOTICS, STUDIES, Case
from sim.trials.study.compare import load_outcomes
from sim.trials.study.gate import LONGEST, STRATA, choose_gate, gate_cases
from sim.trials.study.outcome_file import generator_name, read_outcomes
from sim.trials.sweep.engine import Workers
from sim.trials.sweep.plan import PlanFile


@pytest.fixture(scope="module")
def stored(request):
    return load_outcomes(request.config.rootpath / "docs" / "accuracy" / "diagnosis-study.jsonl.xz")


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
    assert main(["run", "gate", "--out", str(tmp_path / "run"), "--world", "some.py:hide"]) == 2
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


def run(folder, monkeypatch, *options, executor=ThreadPoolExecutor):
    """Run the first two cases of a study, in threads of this process."""

    @contextmanager
    def opened(count, cluster):
        with executor(count) as pool:
            yield Workers(pool, lambda: count, lambda error: 1 if isinstance(error, BrokenExecutor) else None)

    monkeypatch.setattr(study, "open_workers", opened)
    code = main(["run", *(options or ["nulls"]), "--first", "2", "--out", str(folder)])
    return code, read_outcomes(folder) if code == 0 else []


@pytest.fixture
def said(monkeypatch):
    """What each case is made to report, by its key, without drawing and diagnosing it; calls are counted."""
    found, calls = {}, Counter()

    def reported(case, source=""):
        calls[case.key] += 1
        outcome = {"key": case.key, "source": source or "sim.campaign", **case.to_dict(), "verdict": "nothing_found"}
        return {**outcome, "causes": [], "reached": np.inf, "processor_s": np.float64(0.1), **found.get(case.key, {})}

    monkeypatch.setattr(plan, "run_case", reported)
    return found, calls


class _Deadly(ThreadPoolExecutor):
    """A pool that breaks, as a process pool does, with the case whose worker is killed."""

    def submit(self, work, content, *task):
        future = Future()
        if content.factors["world"][task[1]] == study_cases("nulls")[1].key:
            future.set_exception(BrokenExecutor("a process in the process pool was terminated abruptly"))
            return future
        return super().submit(work, content, *task)


def test_a_killed_worker_is_an_outcome_that_says_so_and_the_others_go_on(tmp_path, monkeypatch, said, capsys):
    code, (alive, killed) = run(tmp_path / "run", monkeypatch, executor=_Deadly)
    assert code == 0
    assert (alive["verdict"], killed["verdict"]) == ("nothing_found", "error")
    assert "died" in killed["error"]
    assert set(killed) >= {"key", "source", "effects", "size", "without", "causes"}
    assert main(["report", str(tmp_path / "run")]) == 0
    assert killed["error"] in capsys.readouterr().out


def test_a_run_that_was_cut_off_is_resumed(tmp_path, monkeypatch, said, capsys):
    _, calls = said
    run(tmp_path / "run", monkeypatch)
    whole = sorted((tmp_path / "run").glob("*.parquet"))
    before = [file.read_bytes() for file in whole]
    whole[1].unlink()
    code, outcomes = run(tmp_path / "run", monkeypatch)
    assert code == 0
    first, second = study_cases("nulls", 2)
    assert calls == {first.key: 1, second.key: 2}
    assert [file.read_bytes() for file in whole] == before
    assert [one["key"] for one in outcomes] == [first.key, second.key]
    assert outcomes[0]["reached"] is None  # not finite
    assert run(tmp_path / "run", monkeypatch, "pairs")[0] == 2
    assert "another plan" in capsys.readouterr().err


def test_what_was_run_by_a_simpler_method_says_so(tmp_path, monkeypatch):
    def simpler(method, case, source):
        return {"key": case.key, "source": "sim.campaign", "method": method, **case.to_dict(), **SIMPLER}

    SIMPLER = {"verdict": "nothing_found", "causes": [], "reached": None, "processor_s": 0.1}
    monkeypatch.setattr(plan, "run_baseline", simpler)
    _, outcomes = run(tmp_path / "run", monkeypatch, "nulls", "--method", "greedy BIC")
    assert [one["method"] for one in outcomes] == ["greedy BIC", "greedy BIC"]


@pytest.mark.parametrize("verdict", ["nothing_found", "explained"])
def test_only_a_miss_is_fitted_from_the_truth(tmp_path, monkeypatch, said, verdict):
    missed, other = study_cases("pairs", 2)
    causes = [{"effect": name, "rivals": []} for name in missed.effects]
    said[0][missed.key] = {"verdict": verdict, "causes": causes if verdict == "explained" else []}
    causes = [{"effect": name, "rivals": []} for name in other.effects]
    said[0][other.key] = {"verdict": "explained", "causes": causes}
    monkeypatch.setattr(plan, "blame_of", lambda case, *_: {"blame": f"search of {case.key}"})
    _, outcomes = run(tmp_path / "run", monkeypatch, "pairs", "--blame")
    asked = f"search of {missed.key}" if verdict == "nothing_found" else None
    assert [one.get("blame") for one in outcomes] == [asked, None]


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("none.py:hide", "no such file"),
        ("sim/trials/benchmark/generators/independent_world.py:nobody", "unknown function"),
    ],
)
def test_a_generator_that_is_not_there_is_one_line_before_anything_runs(tmp_path, source, words, capsys):
    assert main(["run", "singles", "--world", source, "--out", str(tmp_path / "run")]) == 2
    printed = capsys.readouterr().err
    assert words in printed
    assert printed.count("\n") == 1
    assert not (tmp_path / "run").exists()


def test_another_campaign_has_no_outcomes_of_the_study(tmp_path, capsys):
    Dataset.create(tmp_path / "other", PlanFile({"scenario": ["paper_run"]}))
    assert main(["compare", str(tmp_path / "other")]) == 2
    assert "is another campaign" in capsys.readouterr().err


def test_a_file_of_outcomes_is_no_folder_to_run_into(tmp_path, capsys):
    (tmp_path / "run.jsonl").touch()
    assert main(["run", "nulls", "--first", "1", "--out", str(tmp_path / "run.jsonl")]) == 2
    assert "is a file" in capsys.readouterr().err
