"""The page of cases: its commands run from the raw files on, and find what was hidden."""

import json
import re
import runpy
import shlex
import sys

import numpy as np
import pytest

from gfimu import load_calibration
from gfimu.recording import Recording, inspect_file


@pytest.fixture(scope="module")
def page(project_root):
    return (project_root / "docs" / "cases" / "cases.md").read_text(encoding="utf-8")


@pytest.fixture
def run(page, project_root, gfimu_command, tmp_path, monkeypatch):
    """Run the commands of the page that hold a word, in their order."""
    monkeypatch.chdir(tmp_path)
    fenced = re.findall(r"^```(\w*)\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)
    (tmp_path / "belt.toml").write_text(next(text for language, text in fenced if language == "toml"))
    blocks = [text for language, text in fenced if not language]

    def commands(word):
        for line in (one for block in blocks for one in block.splitlines() if word in one):
            program, *arguments = shlex.split(line)
            if program == "python":
                monkeypatch.setattr(sys, "argv", arguments)
                runpy.run_path(str(project_root / "docs" / "examples" / arguments[0]), run_name="__main__")
            else:
                done = gfimu_command(*arguments)
                assert done.code == 0, done.stderr
        return tmp_path

    return commands


def numbers(text):
    return [float(one.replace("−", "-")) for one in re.findall(r"−?[\d.]*\d", text)]


def test_poses_in_counts_become_a_calibration(page, run, project_root):
    folder = run("poses")
    centre = [spec.offset for spec in inspect_file(folder / "poses.txt").column_map.channels.values()]
    quoted = numbers(re.search(r"sphere about ([\d., ]+) counts", page)[1])
    assert quoted == pytest.approx(centre, abs=1.0)
    hidden = runpy.run_path(str(project_root / "docs" / "examples" / "xsens_poses.py"))
    model = load_calibration(folder / "counts.json").models["a1"]
    found = numbers(re.search(r"^\| found \| (.*) \|$", page, re.MULTILINE)[1])
    _, scale, offset = model.to_correction()
    assert found[:3] == pytest.approx(1.0 / scale, abs=0.01)
    assert found[3:] == pytest.approx(offset, abs=0.02)
    assert offset == pytest.approx(hidden["BIAS"], abs=0.3)
    assert 1.0 / scale == pytest.approx(np.diag(hidden["SCALE"][:, None] * hidden["LEAN"]), rel=1e-3)


def test_a_trial_in_counts_is_read_by_its_map(run):
    folder = run("D06")
    trial = Recording.read(folder / "trial.parquet")
    assert trial.sample_rate == pytest.approx(200.0)
    assert trial.array.name == "sisfall_belt"
    still = trial.readings[:300].mean(axis=0)
    assert still == pytest.approx([0.0, -9.807, 0.0, 0.0, -10.1, -1.25], abs=0.02)


@pytest.mark.study
def test_a_trial_is_explained_by_what_was_hidden(run):
    run("D06")
    folder = run("trial.parquet --twin")
    verdict = json.loads((folder / "belt" / "verdict.json").read_text())
    assert verdict["verdict"] == "explained"
    causes = {cause["effect"]: cause["parameters"] for cause in verdict["causes"]}
    assert set(causes) == {"bias", "scale_factor"}

    def apart(effect, key):
        second, first = (causes[effect].get(key.format(chip), {"value": 0.0})["value"] for chip in (2, 1))
        return second - first

    assert apart("bias", "a{}3_m_s2") == pytest.approx(-1.25, abs=0.03)
    assert apart("scale_factor", "a{}1") == pytest.approx(0.03, abs=0.01)
    assert apart("scale_factor", "a{}2") == pytest.approx(0.03, abs=0.003)
