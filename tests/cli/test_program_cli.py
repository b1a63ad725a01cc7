"""The program itself: its commands, and that calling it leaves nothing behind."""

import subprocess
import sys

from gfimu.cli.app import COMMAND_FILES, program


def test_a_second_call_finds_the_program_as_the_first_did(gfimu_command):
    first = gfimu_command("--help").stdout
    assert len(program().registered_commands) == len(program().registered_commands)
    assert gfimu_command("--help").stdout == first
    assert set(COMMAND_FILES) <= set(first.split())


HEAVY = ("numpy", "scipy", "numba", "pyarrow", "mujoco", "rerun", "matplotlib", "sim", "firmware_bridge")


def test_help_waits_for_no_heavy_library():
    """Help of the program and of every command, in one process; then what it has imported."""
    code = f"""
import sys, typer
from gfimu.cli.app import main, program
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
