"""Notebooks: each runs on one core in under a minute, its assertions hold, and the stored one is of its script."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "docs" / "notebooks"
NAMES = ["choose_a_geometry", "diagnose_a_recording", "paper_experiment"]


def maker():
    spec = importlib.util.spec_from_file_location("make_notebooks", ROOT / "docs" / "scripts" / "make_notebooks.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_notebook_is_tested():
    assert sorted(file.stem for file in FOLDER.glob("*.py")) == NAMES
    assert sorted(file.stem for file in FOLDER.glob("*.ipynb")) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_a_script_runs_in_less_than_a_minute_of_processor_time(name, tmp_path):
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    before = time.monotonic(), os.times()
    command = [sys.executable, str(FOLDER / f"{name}.py")]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    after = os.times()
    assert done.returncode == 0, done.stderr[-2000:]
    spent = after.children_user - before[1].children_user + after.children_system - before[1].children_system
    assert spent < 60.0


@pytest.mark.parametrize("name", NAMES)
def test_the_notebook_is_that_of_its_script(name):
    make = maker()
    notebook = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))
    assert make.cells_of_notebook(notebook) == make.cells_of((FOLDER / f"{name}.py").read_text(encoding="utf-8")), (
        "run docs/scripts/make_notebooks.py"
    )


@pytest.mark.parametrize("name", NAMES)
def test_the_notebook_shows_tables_and_pictures_and_no_error(name):
    text = (FOLDER / f"{name}.ipynb").read_text(encoding="utf-8")
    outputs = [one for cell in json.loads(text)["cells"] for one in cell.get("outputs", [])]
    kinds = [kind for one in outputs for kind in one.get("data", {})]
    assert kinds.count("image/png") >= 2
    assert kinds.count("text/html") >= 2
    assert not [one for one in outputs if one["output_type"] == "error" or one.get("name") == "stderr"]
    assert "/home/" not in text
    assert "Traceback" not in text


@pytest.mark.parametrize("name", NAMES)
def test_the_notebook_checks_what_it_claims(name):
    script = (FOLDER / f"{name}.py").read_text(encoding="utf-8")
    assert script.count("\nassert ") >= 3


def test_a_notebook_is_executed_by_jupyter(tmp_path, monkeypatch):
    pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    make = maker()
    script = tmp_path / "small.py"
    script.write_text(
        "# %% [markdown]\n# A text.\n\n# %%\nimport gfimu\n\n# %%\nscore = gfimu.score('cube12').best\nscore\n\n"
        "# %%\nscore.plot()\n",
        encoding="utf-8",
    )
    monkeypatch.setattr(make, "FOLDER", tmp_path)
    cells = json.loads(make.make(script).read_text(encoding="utf-8"))["cells"]
    assert [cell["cell_type"] for cell in cells] == ["markdown", "code", "code", "code"]
    assert "GDOP" in "".join(cells[2]["outputs"][0]["data"]["text/html"])
    assert [len(cells[3]["outputs"]), "image/png" in cells[3]["outputs"][0]["data"]] == [1, True]
