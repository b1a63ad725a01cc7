"""Draw docs/figures/diagnosis_report.png: the first screen of the report of the diagnosis in docs/first_hour.md.

Run ``python docs/scripts/make_report_picture.py [FOLDER]``; the folder is ``docs/figures`` unless given. It takes a
Chromium.
"""

from __future__ import annotations

import runpy
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import gfimu

DOCS = Path(__file__).resolve().parents[1]
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
SIZE = (1225, 1010)  # pixels


def browser() -> str | None:
    """Return the path of a Chromium; None if there is none."""
    return next(filter(None, map(shutil.which, BROWSERS)), None)


def main(folder: Path = DOCS / "figures") -> Path:
    """Diagnose the run, open its report and draw what a screen shows first."""
    program = browser()
    if program is None:
        raise SystemExit(f"no browser found; install one of {', '.join(BROWSERS)}")
    t, force, rate = runpy.run_path(str(DOCS / "examples" / "table_run.py"))["readings"]()
    cube = gfimu.AccelerometerArray.load("cube12")
    recording = gfimu.Recording.from_arrays(t, force, cube, reference={"tacho_rad_s": rate})
    target = folder.resolve() / "diagnosis_report.png"
    with tempfile.TemporaryDirectory() as scratch:
        gfimu.diagnose(recording, "cube12_turntable", out=Path(scratch) / "diagnosis")
        report = (Path(scratch) / "diagnosis" / "report.html").as_uri()
        options = [
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--hide-scrollbars",
            f"--user-data-dir={scratch}/user",
        ]
        size = f"--window-size={SIZE[0]},{SIZE[1]}"
        subprocess.run(
            [program, *options, size, "--virtual-time-budget=5000", f"--screenshot={target}", report],
            check=True,
            capture_output=True,
        )
    return target


if __name__ == "__main__":
    print(main(Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS / "figures"))
