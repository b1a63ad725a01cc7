"""gfimu without its extras: what works there, what is refused with one line, and that no import slips in."""

from __future__ import annotations

import ast
import subprocess
import sys
import tomllib

import pytest

from gfimu import GfimuError, InputError, MissingPackageError
from gfimu.base.errors import OmittedFileWarning
from gfimu.base.optional_packages import OPTIONAL, install_command, missing, packages_of, require

BLOCKED_BY_PACKAGE = ("sim/rigs/",)
"""Folders whose ``__init__`` refuses the import where the package is missing."""

DRAWING = {
    "matplotlib": {
        "gfimu/array_search/pictures.py",
        "gfimu/calibration/pictures.py",
        "gfimu/diagnosis/report/figures.py",
        "gfimu/budget/tolerances/picture.py",
        "gfimu/visual/page/svg.py",
        "gfimu/visual/rig/figure.py",
        "sim/trials/sweep/page.py",
        "sim/trials/sweep/panels.py",
        "sim/trials/sweep/picture.py",
    },
    "rerun": {
        "gfimu/visual/comparison.py",
        "gfimu/visual/live.py",
        "gfimu/visual/live_drawing.py",
        "gfimu/visual/plots.py",
        "gfimu/visual/rrd_file.py",
        "gfimu/visual/run.py",
        "gfimu/visual/scene.py",
        "gfimu/visual/trace.py",
    },
    "mujoco": {"sim/drawing.py", "sim/trials/benchmark/generators/independent_table.py"},
    "unicorn": {"firmware_bridge/board/cpu.py"},  # guarded there
}
"""Modules that import an optional package at their top; whoever imports them has called `require` before."""


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=False)


def test_calls_that_need_an_extra_are_refused_before_any_work(project_root):
    done = run(str(project_root / "tests" / "core_commands.py"), "--block", "--part", "refused")
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.study
def test_all_calls_of_the_core_work_without_the_extras(project_root):
    done = run(str(project_root / "tests" / "core_commands.py"), "--block")
    assert done.returncode == 0, done.stdout + done.stderr


def top_imports(source: str) -> set[str]:
    """Packages that a module imports when it is imported itself."""
    found = set()

    def visit(body: list[ast.stmt]) -> None:
        for node in body:
            if isinstance(node, ast.Import):
                found.update(alias.name.partition(".")[0] for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                found.add((node.module or "").partition(".")[0])
            elif isinstance(node, ast.Try) or (isinstance(node, ast.If) and "TYPE_CHECKING" not in ast.dump(node.test)):
                visit(node.body)

    visit(ast.parse(source).body)
    return found


def test_optional_packages_are_imported_at_the_top_of_listed_modules_only(project_root):
    found: dict[str, set[str]] = {}
    for package in ("gfimu", "sim", "firmware_bridge"):
        for file in (project_root / package).rglob("*.py"):
            name = file.relative_to(project_root).as_posix()
            if not name.startswith(BLOCKED_BY_PACKAGE):
                for module in top_imports(file.read_text(encoding="utf-8")) & set(OPTIONAL):
                    found.setdefault(module, set()).add(name)
    assert found == DRAWING


def test_extras_install_what_the_refusals_name(project_root):
    project = tomllib.loads((project_root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    for package, extra in OPTIONAL.values():
        assert any(line.startswith(package) for line in extras[extra]), package
    core = {line.split(">")[0].lower() for line in project["dependencies"]}
    assert not core & {package for package, _ in OPTIONAL.values()}
    assert extras["all"] == [f"gfimu[{','.join(dict.fromkeys(extra for _, extra in OPTIONAL.values()))}]"]
    assert "gfimu[all]" in extras["test"]


@pytest.mark.parametrize("module", OPTIONAL)
def test_a_missing_package_is_one_line_with_its_remedy(module, monkeypatch):
    monkeypatch.setitem(sys.modules, module, None)
    assert missing(module) == [module]
    with pytest.raises(MissingPackageError) as caught:
        require("this", module, instead="do that")
    package, extra = OPTIONAL[module]
    assert str(caught.value) == (
        f"this needs {package}, which is not installed; run: pip install 'gfimu[{extra}]'; or do that"
    )
    assert isinstance(caught.value, InputError | GfimuError)
    assert isinstance(caught.value, ImportError)


def test_several_missing_packages_are_one_line(monkeypatch):
    for module in ("mujoco", "rerun", "matplotlib"):
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingPackageError, match=r"mujoco, rerun-sdk and matplotlib.*gfimu\[sim,view,plot\]"):
        require("all", "mujoco", "rerun", "matplotlib")
    assert packages_of(["mujoco", "rerun"]) == "mujoco and rerun-sdk"
    assert install_command(["mcap", "rosbags"]) == "pip install 'gfimu[formats]'"


def test_what_is_installed_is_not_refused():
    require("this", "matplotlib")
    assert missing("matplotlib") == []


def test_a_diagnosis_warns_of_files_that_it_will_not_write(monkeypatch):
    from gfimu.diagnosis.report.folder import files_to_write, warn_of_omitted

    assert set(files_to_write()) == {"verdict.json", "twin.toml", "report.html", "diagnosis.rrd"}
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert set(files_to_write()) == {"verdict.json", "twin.toml", "report.html"}
    with pytest.warns(OmittedFileWarning, match=r"diagnosis\.rrd not written: rerun-sdk .*'gfimu\[view\]'"):
        warn_of_omitted()
