"""Real types reach a user: a strict type checker on a script of a user, against the wheel as installed."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

SCRIPT = """
from typing import reveal_type

import numpy as np

import gfimu

recording = gfimu.simulate("paper_run", seed=1)
reveal_type(recording)  # Recording
reveal_type(recording.readings)  # numpy.ndarray
reveal_type(recording.plot())  # matplotlib.figure.Figure
reveal_type(recording.to_polars())  # DataFrame
estimate = gfimu.estimate(recording, method="filter")
reveal_type(estimate)  # Estimate
reveal_type(gfimu.estimate((np.zeros(3), np.zeros((3, 12))), "cube12"))  # Estimate
reveal_type(gfimu.estimate(recording.to_polars(), "cube12"))  # Estimate
found = gfimu.diagnose(recording, "cube12_turntable")
reveal_type(found)  # Diagnosis
reveal_type(found.causes[0])  # NamedCause
reveal_type(found.gain.share_of_excess_removed)  # float
reveal_type(found.report("folder"))  # Path
scores = gfimu.score("cube12")
reveal_type(scores)  # Scores
reveal_type(scores.best.gdop)  # float
reveal_type(gfimu.calibrate("six-position", recording))  # Calibration
reveal_type(gfimu.noise(recording))  # RecordingNoise
reveal_type(gfimu.recording_noise(recording))  # RecordingNoise
reveal_type(gfimu.drift("cube12", noise_ug=290.0))  # Drift
reveal_type(gfimu.tolerance("cube12"))  # ToleranceResult
reveal_type(gfimu.optimize(4))  # SearchResult
reveal_type(gfimu.campaign("plan.toml", out="folder"))  # CampaignResult
reveal_type(gfimu.firmware.run())  # VirtualRun
reveal_type(gfimu.Twin.load("cube12_turntable"))  # Twin
"""

WRONG = """
import gfimu

gfimu.simulate("paper_run", seed="one")
gfimu.estimate(3)
gfimu.score("cube12").best.gdopp
gfimu.simulat("paper_run")
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that holds the unpacked wheel."""
    folder = tmp_path_factory.mktemp("types")
    command = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    with zipfile.ZipFile(next(folder.glob("*.whl"))) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def checked(site: Path, folder: Path, script: str) -> list[str]:
    """Return what mypy --strict says of a script that stands in an empty folder."""
    (folder / "mine.py").write_text(script, encoding="utf-8")
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(site.parent / "cache"), "mine.py"]
    environment = {**os.environ, "PYTHONPATH": str(site), "PYTHONSAFEPATH": "1"}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert not done.stderr, done.stderr
    return done.stdout.splitlines()


@pytest.mark.study
def test_a_user_sees_real_types(site: Path, tmp_path: Path) -> None:
    lines = checked(site, tmp_path, SCRIPT)
    assert lines[-1].startswith("Success"), "\n".join(lines)
    revealed = {int(line.split(":")[1]): line.partition('Revealed type is "')[2].rstrip('"') for line in lines[:-1]}
    for number, line in enumerate(SCRIPT.splitlines(), start=1):
        if "reveal_type(" in line and not line.startswith("from"):
            expected = line.rpartition("# ")[2]
            assert re.search(rf"(^|\.){re.escape(expected)}\b", revealed[number]), f"{line}: {revealed[number]}"
            assert not re.fullmatch(r"Any|.* \| Any", revealed[number])


def test_a_mistake_of_a_user_is_found(site: Path, tmp_path: Path) -> None:
    found = {int(line.split(":")[1]) for line in checked(site, tmp_path, WRONG) if "error:" in line}
    assert found == {4, 5, 6, 7}
