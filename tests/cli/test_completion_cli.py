"""Shell completion: commands, options and values, driven as bash, zsh and fish drive it; quick, and documented."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from gfimu import catalogue

PROGRAM = [sys.executable, "-c", "from gfimu.commands.shell.program import main; main()"]


@pytest.fixture
def completed(gfimu_command, monkeypatch):
    """Return what bash offers for a line; its last word is being typed."""

    def offer(line):
        words = line.split(" ")
        monkeypatch.setenv("COMP_WORDS", line)
        monkeypatch.setenv("COMP_CWORD", str(len(words) - 1))
        monkeypatch.setenv("_GFIMU_COMPLETE", "complete_bash")
        result = gfimu_command()
        assert (result.code, result.stderr) == (0, "")
        return result.stdout.split()

    return offer


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("gfimu es", ["estimate"]),
        ("gfimu c", ["convert", "calibrate", "certificate", "check", "campaign"]),
        ("gfimu --ver", ["--version"]),
        ("gfimu firmware se", ["selftest"]),
        ("gfimu campaign st", ["status"]),
        ("gfimu estimate run.csv --me", ["--method"]),
        ("gfimu estimate run.csv --method s", ["smoother"]),
        ("gfimu estimate run.csv --array cube", ["cube12", "cube12_as_built"]),
        ("gfimu estimate run.csv --form l", ["linear"]),
        ("gfimu simulate pap", ["paper_run"]),
        ("gfimu score cube12 p3", ["p3_three_plus_one"]),
        ("gfimu check run.csv --twin mimu", ["mimu4444_free"]),
        ("gfimu design tacho_l", ["tacho_latency", "tacho_lag"]),
        ("gfimu calibrate six", ["six-position"]),
        ("gfimu tolerance cube12 --part adxl35", ["adxl355"]),
        ("gfimu tolerance cube12 --calibrated poses", ["poses", "poses+rest"]),
        ("gfimu convert log.csv run.csv --map kl", ["klipper"]),
        ("gfimu optimize --objective kap", ["kappa"]),
        ("gfimu record --format lpc", ["lpc1768"]),
        ("gfimu firmware run --image self", ["selfcheck"]),
        ("gfimu show adxl34", ["adxl345"]),
        ("gfimu new sen", ["sender"]),
        ("gfimu list ef", ["effects"]),
        ("gfimu schema cam", ["campaign"]),
        ("gfimu score --axis z --hub f", ["fixed", "free"]),
        ("gfimu drift --ti", []),  # a former name is not offered
        ("gfimu estimate my_", []),  # a file: left to the shell
    ],
)
def test_bash_is_offered_names_and_values(completed, line, offered):
    assert completed(line) == offered


def test_the_names_of_effects_are_those_of_the_library(completed):
    from sim.effects import added_effects

    listed = [name for name in catalogue("effects") if name not in added_effects()]
    assert completed("gfimu design ") == [name for name in listed if name != "unknown"]
    assert set(listed) <= set(completed("gfimu show "))


@pytest.mark.parametrize(
    ("shell", "variables", "wanted"),
    [
        ("zsh", {"_TYPER_COMPLETE_ARGS": "gfimu simulate pap"}, '"paper_run"'),
        (
            "fish",
            {"_TYPER_COMPLETE_ARGS": "gfimu simulate pap", "_TYPER_COMPLETE_FISH_ACTION": "get-args"},
            "paper_run",
        ),
    ],
)
def test_zsh_and_fish_are_offered_values(gfimu_command, monkeypatch, shell, variables, wanted):
    for name, value in {**variables, "_GFIMU_COMPLETE": f"complete_{shell}"}.items():
        monkeypatch.setenv(name, value)
    assert wanted in gfimu_command().stdout


@pytest.mark.parametrize(
    ("shell", "words"),
    [
        ("bash", ("complete -o default -F", "COMPREPLY")),
        ("zsh", ("#compdef gfimu",)),
        ("fish", ("complete --command",)),
    ],
)
def test_the_script_of_a_named_shell_is_printed(shell, words):
    done = subprocess.run([*PROGRAM, "--show-completion", shell], capture_output=True, text=True, check=True)
    assert all(word in done.stdout for word in words)
    if shutil.which(shell):
        subprocess.run([shell, "-n"], input=done.stdout, text=True, check=True)


@pytest.mark.parametrize("option", ["--install-completion", "--show-completion"])
def test_a_shell_that_is_none_is_named(gfimu_command, option):
    result = gfimu_command(option, "fsh")
    assert result.code == 2
    assert "unknown shell 'fsh'" in result.stderr
    assert "did you mean 'fish'" in result.stderr


@pytest.fixture
def own_home(tmp_path):
    """Return the environment of a user whose home is empty and whose shells find gfimu."""
    program = tmp_path / "bin" / "gfimu"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m gfimu "$@"\n')
    program.chmod(0o755)
    paths = {"PATH": f"{program.parent}:{os.environ['PATH']}", "HOME": str(tmp_path)}
    return {**os.environ, **paths, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}


@pytest.mark.parametrize(
    ("shell", "file"),
    [
        ("bash", ".bash_completions/gfimu.sh"),
        ("zsh", ".zfunc/_gfimu"),
        ("fish", ".config/fish/completions/gfimu.fish"),
    ],
)
def test_completion_is_installed_for_a_named_shell(own_home, project_root, shell, file):
    done = subprocess.run(
        ["gfimu", "--install-completion", shell], env=own_home, capture_output=True, text=True, check=True
    )
    assert f"{shell} completion installed in {own_home['HOME']}/{file}" in done.stdout
    assert Path(own_home["HOME"], file).is_file()
    page = (project_root / "docs" / "how_to" / "shell_completion.md").read_text(encoding="utf-8")
    assert f"| `~/{file}` |" in page


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
def test_bash_itself_completes(own_home):
    script = """
source <(gfimu --show-completion bash)
COMP_WORDS=(gfimu simulate pap) COMP_CWORD=2
_gfimu_completion gfimu
echo "${COMPREPLY[@]}"
"""
    done = subprocess.run(["bash", "-c", script], env=own_home, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "paper_run"


@pytest.mark.skipif(shutil.which("fish") is None, reason="no fish here")
@pytest.mark.parametrize(
    ("line", "offered"),
    [("gfimu simulate pap", "paper_run"), ("gfimu es", "estimate"), ("gfimu score my_", "my_array")],
)
def test_fish_itself_completes(own_home, tmp_path, line, offered):
    (tmp_path / "my_array.toml").touch()
    subprocess.run(["gfimu", "--install-completion", "fish"], env=own_home, capture_output=True, check=True)
    done = subprocess.run(
        ["fish", "-c", f"complete -C '{line}'"], env=own_home, cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert offered in done.stdout


@pytest.mark.parametrize("line", ["gfimu design tacho", "gfimu es", "gfimu estimate run.csv --array cu"])
def test_completion_waits_for_no_heavy_library(line):
    code = """
import sys
from pathlib import Path
from gfimu.commands.shell.program import main
try:
    main()
except SystemExit:
    pass
print(*{name.split(".")[0] for name in sys.modules} & {"numpy", "scipy", "numba", "pyarrow", "mujoco"}, file=sys.stderr)
"""
    environment = {
        **os.environ,
        "COMP_WORDS": line,
        "COMP_CWORD": str(line.count(" ")),
        "_GFIMU_COMPLETE": "complete_bash",
    }
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout
    assert done.stderr.strip() == ""


def test_the_page_shows_what_the_program_prints(project_root, gfimu_command):
    page = (project_root / "docs" / "how_to" / "shell_completion.md").read_text(encoding="utf-8")
    help_text = gfimu_command("--help").stdout
    for option in re.findall(r"gfimu (--[a-z-]+)", page):
        assert option in help_text
    assert {"bash", "zsh", "fish"} <= set(re.findall(r"\w+", page))
