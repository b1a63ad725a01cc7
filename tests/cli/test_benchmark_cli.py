"""`gfimu benchmark` on the command line: from its worlds to its table."""

import json

import pytest


def test_the_list_names_release_sets_and_methods(gfimu_command):
    shown = gfimu_command("benchmark", "list")
    assert shown.code == 0
    assert all(word in shown.stdout for word in ("gfimu-bench-1", "own", "dcmotor", "greedy_bic"))
    found = json.loads(gfimu_command("benchmark", "list", "--json").stdout)
    assert found["release"] == "gfimu-bench-1"
    assert {one["name"]: one["test"] for one in found["sets"]}["independent"] == 40
    assert found["methods"][0] == "gfimu"


def test_worlds_are_plain_files_without_truth(gfimu_command, tmp_path):
    out = tmp_path / "worlds"
    found = json.loads(
        gfimu_command("benchmark", "worlds", "--out", out, "--sets", "dcmotor", "--limit", "1", "--json").stdout
    )
    assert found["worlds"] == ["dcmotor/dev/000"]
    names = sorted(file.name for file in (out / "dcmotor" / "dev" / "000").iterdir())
    assert names == ["recording.parquet", "twin.toml"]
    schema = json.loads((out / "answer.schema.json").read_text())
    assert "world" in schema["$defs"]["Answer"]["required"]
    twin = (out / "dcmotor" / "dev" / "000" / "twin.toml").read_text()
    assert "[[effect]]" not in twin


def test_run_judge_and_table(gfimu_command, tmp_path):
    run, judged = tmp_path / "run", tmp_path / "judged.jsonl.xz"
    ran = gfimu_command(
        "benchmark", "run", "always_unknown", "--out", run, "--sets", "own", "--limit", "2", "--workers", "1", "--json"
    )
    assert ran.code == 0, ran.stderr
    found = json.loads(ran.stdout)
    assert (found["worlds"], found["failed"], found["method"]) == (2, 0, "always_unknown")
    shown = gfimu_command("benchmark", "judge", run, "--partial", "--out", judged)
    assert "+0.25 ± 0.00" in shown.stdout
    table = json.loads(gfimu_command("benchmark", "table", judged, "--json").stdout)
    assert table["summaries"][0]["outcomes"] == {"unknown": 2}
    assert [one["world"] for one in table["judged"]] == ["own/dev/000", "own/dev/001"]


@pytest.mark.parametrize(
    ("words", "remedy"),
    [
        (("run", "always_unknown", "--sets", "independant"), "did you mean"),
        (("run", "always_unknown", "--split", "train"), "valid"),
        (("run", "gfimo"), "did you mean"),
        (("judge", "none.jsonl"), "none.jsonl"),
        (("table", "none.jsonl"), "judge --out"),
    ],
)
def test_bad_input_is_one_line(gfimu_command, tmp_path, monkeypatch, words, remedy):
    monkeypatch.chdir(tmp_path)
    out = ("--out", "made") if words[0] == "run" else ()
    result = gfimu_command("benchmark", *words, *out)
    assert result.code == 2, result
    assert result.stderr.count("\n") == 1
    assert remedy in result.stderr, result.stderr
    assert not (tmp_path / "made").exists()
