"""A file never runs code unless the user says so on the command line."""

from __future__ import annotations

import inspect
import os
import subprocess
import sys

import numpy as np
import pytest
import typer

import gfimu
from gfimu.base import plugins as loading
from gfimu.commands import program
from gfimu.model import load_model
from tests.gfimu.recording.importing import foreign_files

WITH_TWIN = {
    "check": ["check", "run.csv"],
    "diagnose": ["diagnose", "run.csv", "--out", "d"],
    "diagnose --check": ["diagnose", "run.csv", "--check"],
    "design": ["design", "radius"],
}
RIG = """
from pathlib import Path

import numpy as np

import gfimu
from gfimu.model.own_rig import Cause, Parameter, SimulatorModel

Path("ran").touch()


def twin():
    Path("called").touch()
    return SimulatorModel(
        gfimu.AccelerometerArray.load("one_chip"),
        lambda state, t, wrong: (np.zeros((len(t), 3)), state.rate),
        (Cause("radius", "", (Parameter("radius_m", "m", 0.01),)),),
    )
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    (tmp_path / "rig.py").write_text(RIG)
    info = tmp_path / "stranger_rig-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: stranger-rig\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[gfimu.twins]\nmy_rig = rig:twin\n")
    rows = "".join(f"{k / 100},1,2,9.8,{k / 100}\n" for k in range(500))
    (tmp_path / "run.csv").write_text("t_s,a11_m_s2,a12_m_s2,a13_m_s2,tacho_rad_s\n" + rows)
    loading._loaded.cache_clear()
    yield tmp_path
    loading._loaded.cache_clear()
    sys.modules.pop("rig", None)


@pytest.mark.parametrize("words", WITH_TWIN.values(), ids=WITH_TWIN)
@pytest.mark.parametrize("source", ["rig.py:twin", "../here/rig.py:twin", "{here}/rig.py:twin", "my_rig"])
def test_a_twin_file_asks_before_it_runs_code(gfimu_command, here, words, source):
    source = source.format(here=here).replace("../here", f"../{here.name}")
    (here / "twin.toml").write_text(f'simulator = "{source}"\n')
    refused = gfimu_command(*words, "--twin", "twin.toml")
    assert refused.code == 2
    assert refused.stderr == f"gfimu: twin.toml would run code: {source}; add --allow-code if you trust it\n"
    assert refused.stdout == ""
    assert not (here / "called").exists()
    assert source == "my_rig" or not (here / "ran").exists()  # entry points of an installed package are imported


@pytest.mark.parametrize("given", [["twin.toml", "--allow-code"], ["rig.py:twin"], ["my_rig"]])
def test_what_the_user_names_or_allows_is_run(gfimu_command, here, given):
    (here / "inner").mkdir()
    (here / "inner" / "rig.py").write_text(RIG)
    (here / "inner" / "twin.toml").write_text('simulator = "rig.py:twin"\n')
    twin, *more = given
    twin = f"inner/{twin}" if more else twin
    assert gfimu_command("check", "run.csv", "--twin", twin, *more).code == 0
    assert (here / "called").exists()


def test_the_twin_file_of_a_verdict_asks_again(gfimu_command, here):
    model = load_model("rig.py:twin")
    (here / "twin.toml").write_text(model.extended([model.families()["radius"]({"radius_m": 0.01})]).to_toml())
    (here / "called").unlink()
    refused = gfimu_command("diagnose", "run.csv", "--out", "d", "--twin", "twin.toml")
    assert (refused.code, (here / "called").exists()) == (2, False)
    assert f"would run code: {here / 'rig.py'}:twin" in refused.stderr
    assert [one.name for one in load_model("twin.toml", allow_code=True).effects] == ["radius"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ('simulator = "twin.toml"\n', "twin.toml: no such file; give a twin of one's own as FILE.py:FUNCTION"),
        ('simulator = "none.py:twin"\n', "none.py: no such file"),
        ("simulator = 3\n", "simulator = 3 must be a string"),
        ('simulator = "rig.py:twin"\neffect = 3\n', "effect = 3 must be an array of tables"),
        ('simulator = "rig.py:twin"\neffect = [{name = "radius", parameters = {radius_m = []}}]\n', "radius_m"),
        ('simulator = "rig.py:twin"\neffect = [{name = "radius", parameters = {radius_m = "x"}}]\n', "radius_m"),
        ('simulator = "rig.py:twin"\neffect = [{name = "radius", parameters = {radius_m = 1e999}}]\n', "finite"),
    ],
)
def test_a_wrong_twin_file_is_one_line(gfimu_command, here, content, words):
    (here / "twin.toml").write_text(content)
    result = gfimu_command("check", "run.csv", "--twin", "twin.toml", "--allow-code")
    assert result.code == 2
    assert words in result.stderr
    assert result.stderr.startswith("gfimu: twin.toml: ")
    assert result.stderr.count("\n") == 1


def test_every_command_and_function_with_a_twin_has_the_option():
    commands = typer.main.get_command(program()).commands
    for name, command in commands.items():
        options = {option for param in command.params for option in param.opts}
        assert ("--allow-code" in options) == ("--twin" in options), name
        if "--twin" in options:
            assert inspect.signature(getattr(gfimu, name)).parameters["allow_code"].default is False


@pytest.mark.parametrize("kind", ["estimate", "benchmark", "study"])
def test_a_plan_runs_no_code(gfimu_command, here, kind):
    factors = 'world = ["singles/10000 rig.py:twin"]\nmethod = ["rig.py:twin"]\nscenario = ["rig.py:twin"]\n'
    (here / "plan.toml").write_text(
        f'kind = "{kind}"\n[factors]\n{factors}release = ["gfimu-bench-1"]\nblame = [false]\n'
    )
    result = gfimu_command("campaign", "plan.toml", "--out", "c")
    assert (result.code, (here / "ran").exists()) == (2, False)
    (here / "c").mkdir()
    (here / "plan.toml").rename(here / "c" / "plan.toml")
    for words in (["campaign", "c"], ["benchmark", "run", "greedy_bic", "--out", "c", "--sets", "own", "--limit", "1"]):
        gfimu_command(*words)
    assert not (here / "ran").exists()


def test_definitions_in_a_bag_are_not_made_code(tmp_path, monkeypatch):
    """`rosbags` would compile the message as the bag defines it."""
    from rosbags.typesys.store import Typestore

    bags = foreign_files.bag_of_ros1(tmp_path / "a.bag"), foreign_files.bag_of_ros2(tmp_path / "bag")
    defined = []
    monkeypatch.setattr(Typestore, "register", lambda store, definitions: defined.append(definitions))
    for bag in bags:
        assert gfimu.inspect(bag).fitting == ("ros_imu",)
    assert not defined


def test_no_process_imports_from_the_current_folder(here):
    """Neither workers of a campaign nor the reader of MATLAB files; a module called signal may lie beside the data."""
    from scipy.io import savemat

    for name in ("signal", "scipy", "gfimu", "sim"):
        (here / f"{name}.py").write_text("open('ran', 'w')\nraise SystemExit(3)\n")
    savemat(here / "run.mat", {"t": np.arange(300) / 100.0, "acc": np.ones((300, 3))})
    (here / "plan.toml").write_text('kind = "measure"\n[factors]\n"eccentricity.x_m" = [0.001]\n')
    program = [sys.executable, "-P", "-c", "from gfimu.commands.shell.program import main; main()"]
    for words in (["inspect", "run.mat"], ["campaign", "plan.toml", "--out", "c", "--workers", "1"]):
        done = subprocess.run([*program, *words], cwd=here, capture_output=True, text=True, check=False)
        assert (done.returncode, (here / "ran").exists()) == (0, False), done.stderr


def test_numba_takes_no_compiled_code_from_the_current_folder(here):
    """It unpickles what lies in its cache."""
    pytest.importorskip("yaml")
    (here / ".numba_config.yaml").write_text("cache_dir: ./cache\ncache_locator_classes: rig.Locator\n")
    environment = {key: value for key, value in os.environ.items() if not key.startswith("NUMBA")}
    source = (
        "from gfimu.commands.shell.program import set_environment; set_environment()  # what the program does first\n"
        "import numba.core.config as c; print([c.CACHE_DIR, c.CACHE_LOCATOR_CLASSES])"
    )
    command = [sys.executable, "-P", "-c", source]
    done = subprocess.run(command, cwd=here, env=environment, capture_output=True, text=True, check=False)
    assert done.stdout == "['', '']\n", done.stderr
