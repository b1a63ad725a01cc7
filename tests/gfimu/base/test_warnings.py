"""Warnings name the line of the user that led to them, whatever lies between."""

from __future__ import annotations

import subprocess
import sys

SCRIPT = """
import gfimu

run = gfimu.simulate("rest", seed=1, changes=["duration_s=3"])
gfimu.estimate(run, "p3_three_plus_one")  # of another array
"""


def test_a_warning_names_the_line_of_the_caller(tmp_path):
    """Of the command's function, which a decorator checks, a library function warns."""
    script = tmp_path / "mine.py"
    script.write_text(SCRIPT)
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True)
    place, _, text = done.stderr.splitlines()[0].partition(" RecordingWarning: ")
    assert place == f"{script}:5:"
    assert "recorded with array 'cube12'" in text
