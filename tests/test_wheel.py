"""Wheel and sdist are whole: the wheel runs without the checkout, the sdist runs its tests, both pass `twine check`."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

import gfimu

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder holding wheel and sdist."""
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "--directory", str(folder)],
        cwd=ROOT,
        check=True,
        capture_output=True,
    )
    return folder


@pytest.fixture(scope="module")
def installed(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder holding the unpacked wheel, as an installer would leave it."""
    site = tmp_path_factory.mktemp("site")
    with zipfile.ZipFile(next(built.glob("*.whl"))) as archive:
        archive.extractall(site)
    return site


@pytest.fixture(scope="module")
def unpacked(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the unpacked sdist."""
    folder = tmp_path_factory.mktemp("sdist")
    with tarfile.open(next(built.glob("*.tar.gz"))) as archive:
        archive.extractall(folder, filter="data")
    (found,) = folder.iterdir()
    return found


def _run(site: Path, *arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    code = (
        "import sys, gfimu, sim; from pathlib import Path; "
        f"site = Path({str(site)!r}); "
        "assert all(Path(p.__file__).is_relative_to(site) for p in (gfimu, sim)), gfimu.__file__; "
        "from gfimu.commands.shell.program import main; main()"
    )
    environment = {**os.environ, "PYTHONPATH": str(site)}
    return subprocess.run(
        [sys.executable, "-c", code, *arguments], cwd=cwd, env=environment, capture_output=True, text=True, check=False
    )


def test_models_lie_inside_the_wheel(installed: Path) -> None:
    assert (installed / "sim" / "models" / "arrays" / "cube12.toml").is_file()
    assert (installed / "sim" / "models" / "mjcf" / "turntable.xml").is_file()
    assert (installed / "gfimu" / "calibration" / "certificate" / "certificate.schema.json").is_file()
    page = installed / "gfimu" / "visual" / "page"
    for name in (
        "plots.js",
        "plots.css",
        "basics.css",
        "page.css",
        "uplot/uPlot.iife.min.js",
        "uplot/uPlot.min.css",
        "uplot/LICENSE",
    ):
        assert (page / name).is_file(), name
    assert (installed / "gfimu" / "diagnosis" / "report" / "templates" / "report.css").is_file()
    assert (installed / "sim" / "models" / "effects" / "catalogue.json").is_file()
    assert (installed / "sim" / "trials" / "benchmark" / "gfimu-bench-1.jsonl.xz").is_file()
    assert not (installed / "tests").exists()
    (licences,) = installed.glob("*.dist-info/licenses")
    assert (licences / "LICENSE").is_file()
    assert "Leon Sorokin" in (licences / "gfimu/visual/page/uplot/LICENSE").read_text(encoding="utf-8")


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


def test_both_pass_twine(built: Path) -> None:
    pytest.importorskip("twine", reason="twine is in the extra 'test'")
    files = sorted(map(str, built.glob("gfimu-*")))
    done = subprocess.run(
        [sys.executable, "-m", "twine", "check", "--strict", *files], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("PASSED") == len(files) == 2


def test_the_version_stands_in_one_place(built: Path, installed: Path) -> None:
    assert {file.name for file in built.iterdir()} == {
        f"gfimu-{gfimu.__version__}-py3-none-any.whl",
        f"gfimu-{gfimu.__version__}.tar.gz",
    }
    metadata = next(installed.glob("gfimu-*.dist-info")) / "METADATA"
    assert f"\nVersion: {gfimu.__version__}\n" in metadata.read_text(encoding="utf-8")


def test_the_sdist_holds_what_git_holds_and_no_more(unpacked: Path) -> None:
    there = {file.relative_to(unpacked).as_posix() for file in unpacked.rglob("*") if file.is_file()} - {"PKG-INFO"}
    if not (ROOT / ".git").exists():
        pytest.skip("no checkout")
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    tracked = {name for name in listed.split("\0") if name and (ROOT / name).is_file()}
    assert tracked - there == set()
    assert not [
        name for name in there - tracked if "__pycache__" in name or name.startswith((".venv", "dist", "build"))
    ]
    assert sum(file.stat().st_size for file in unpacked.rglob("*") if file.is_file()) < 20e6


def test_tests_run_from_the_sdist(unpacked: Path) -> None:
    tests = ["tests/gfimu/array/test_kinematics.py", "tests/test_docs_words.py"]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-n", "0", "-p", "no:cacheprovider", *tests],
        cwd=unpacked,
        env={**os.environ, "PYTHONPATH": str(unpacked)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
