"""The program itself: its commands, and that calling it leaves nothing behind."""

import subprocess
import sys

import numpy as np
import typer

import gfimu
from gfimu import AccelerometerArray
from gfimu.commands import program
from gfimu.recording import Recording


def test_a_second_call_finds_the_program_as_the_first_did(gfimu_command):
    first = gfimu_command("--help").stdout
    assert gfimu_command("--help").stdout == first
    assert set(typer.main.get_command(program()).commands) <= set(first.split())


def test_the_list_of_commands_imports_none_of_them():
    code = """
import sys
from gfimu.commands.shell.program import main
sys.argv = ["gfimu", "--help"]
try:
    main()
except SystemExit:
    pass
names = [name for name in sys.modules if name.startswith(("gfimu.commands.", "rich"))]
names = [name for name in names if not name.startswith("gfimu.commands.shell")]
assert not names, names
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_score_waits_for_no_compiler():
    code = """
import sys
from gfimu.commands.shell.program import main
sys.argv = ["gfimu", "score"]
try:
    main()
except SystemExit:
    pass
print(*{name.split(".")[0] for name in sys.modules} & {"numba", "pyarrow", "mujoco"}, file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "cube12" in done.stdout
    assert done.stderr.strip() == ""


def test_an_estimate_waits_for_no_library_that_it_does_not_use(tmp_path):
    """Rest of an ideal cube; pandas where installed, and the parts of scipy that few recordings need."""
    t = np.arange(300) / 100.0
    cube = AccelerometerArray.load("cube12")
    noise = 0.01 * np.random.default_rng(1).standard_normal((len(t), cube.n_channels))
    readings = noise + cube.regression_matrix[:, 5] * 9.81
    Recording(t, readings, cube.channels).write(tmp_path / "rest.parquet")
    code = f"""
import sys
from gfimu.commands.shell.program import main
sys.argv = ["gfimu", "estimate", {str(tmp_path / "rest.parquet")!r}, "--array", "cube12", "--method", "ml",
            "--out", {str(tmp_path / "out.parquet")!r}]
try:
    main()
except SystemExit as stop:
    assert not stop.code
unused = ("pandas", "scipy.signal", "scipy.optimize", "scipy.interpolate", "matplotlib")
print("loaded:", *(name for name in unused if name in sys.modules))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out.parquet").exists()
    assert done.stdout.splitlines()[-1] == "loaded:"
    other = [line for line in done.stderr.splitlines() if "estimating by ml" not in line]  # where kernels compile
    assert other == []


HEAVY = ("numpy", "scipy", "numba", "pyarrow", "mujoco", "rerun", "matplotlib", "sim", "firmware_bridge")


def test_help_waits_for_no_heavy_library():
    """Help of the program and of every command, in one process; then what it has imported."""
    code = f"""
import sys, typer
from gfimu.commands.shell.program import main, program
words = [[]]
for name, command in typer.main.get_command(program()).commands.items():
    words += [[name]] + [[name, inner] for inner in getattr(command, "commands", ())]
for word in words:
    sys.argv = ["gfimu", *word, "--help"]
    try:
        main()
    except SystemExit as stop:
        assert not stop.code, word
assert len(words) > 20
print(*(name for name in {HEAVY} if name in sys.modules), file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr.strip() == ""
    assert "Usage: gfimu estimate" in done.stdout
    assert "--debug" in done.stdout


def test_python_runs_the_package_as_the_program():
    done = subprocess.run([sys.executable, "-m", "gfimu", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.split()[-1] == gfimu.__version__
