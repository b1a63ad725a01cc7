"""The wheel is whole: models, firmware sources and every package are in it, and it runs without the checkout."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder holding the unpacked wheel, as an installer would leave it."""
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(folder)],
        cwd=ROOT,
        check=True,
        capture_output=True,
    )
    wheel = next(folder.glob("*.whl"))
    site = folder / "site"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    return site


def _run(site: Path, *arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    code = (
        "import sys, gfimu, sim; from pathlib import Path; "
        f"site = Path({str(site)!r}); "
        "assert all(Path(p.__file__).is_relative_to(site) for p in (gfimu, sim)), gfimu.__file__; "
        "from gfimu.cli import main; main()"
    )
    environment = {**os.environ, "PYTHONPATH": str(site)}
    return subprocess.run(
        [sys.executable, "-c", code, *arguments], cwd=cwd, env=environment, capture_output=True, text=True, check=False
    )


def test_models_lie_inside_the_wheel(installed: Path) -> None:
    assert (installed / "sim" / "models" / "arrays" / "cube12.toml").is_file()
    assert (installed / "sim" / "models" / "mjcf" / "turntable.xml").is_file()
    assert (installed / "gfimu" / "certification" / "certificate.schema.json").is_file()
    page = installed / "gfimu" / "visual" / "page"
    for name in ("plots.js", "plots.css", "uplot/uPlot.iife.min.js", "uplot/uPlot.min.css", "uplot/LICENSE"):
        assert (page / name).is_file(), name
    assert (installed / "gfimu" / "diagnosis" / "report" / "templates" / "report.css").is_file()
    assert not (installed / "tests").exists()


def test_type_checkers_find_types_in_the_wheel(installed: Path) -> None:
    for package in ("gfimu", "sim", "firmware_bridge"):
        assert (installed / package / "py.typed").is_file()


def test_commands_find_the_models_outside_the_checkout(installed: Path, tmp_path: Path) -> None:
    done = _run(installed, "score", "cube12", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert '"condition_number": 1.4142' in done.stdout


def test_a_scenario_runs_outside_the_checkout(installed: Path, tmp_path: Path) -> None:
    done = _run(installed, "simulate", "rest", "--out", "rest.parquet", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "rest.parquet").is_file()


def test_the_files_of_a_sender_are_in_the_wheel(installed: Path, tmp_path: Path) -> None:
    done = _run(installed, "new", "sender", "mine", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert {"core.c", "sender.c", "gfimu_port.h", "mine.ino"} <= {file.name for file in (tmp_path / "mine").iterdir()}
    assert len(list((tmp_path / "mine" / "ports").iterdir())) == 4
