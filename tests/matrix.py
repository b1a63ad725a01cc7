"""Run the tests with other interpreters and versions of the packages, each in an environment of its own.

    python tests/matrix.py newest --python python3.13      the newest versions that the bounds allow
    python tests/matrix.py lowest                          the lowest versions that the bounds allow
    python tests/matrix.py next                            mujoco and rerun-sdk newer than their bounds allow
    python tests/matrix.py light                           the core without extras: tests/core_commands.py
    python tests/matrix.py dist                            wheel and sdist: build, twine, tests from the sdist
    python tests/matrix.py sizes                           size and packages of each extra, as a table

Continuous integration calls these, and a person may. They need uv (``pip install uv``), which resolves lowest versions
and installs in seconds. ``--tests all`` runs the whole suite in place of the rooms that use most of the packages'
interfaces (`ROOMS`); further arguments go to pytest.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

ROOMS = (
    "tests/test_light_install.py",
    "tests/test_installation_page.py",
    "tests/test_wheel.py",
    "tests/gfimu/array_search",
    "tests/gfimu/calibration",
    "tests/gfimu/calibration/certificate",
    "tests/gfimu/calibration/exporting",
    "tests/gfimu/base/files",
    "tests/gfimu/array",
    "tests/gfimu/recording/importing",
    "tests/gfimu/rate",
    "tests/gfimu/recording",
    "tests/gfimu/sensor_noise",
    "tests/gfimu/visual",
    "tests/sim/rigs/test_dc_motor.py",
    "tests/sim/test_drawing.py",
    "tests/sim/rigs/test_driven.py",
    "tests/sim/rigs/test_mjcf_array.py",
    "tests/sim/rigs/test_rig_model.py",
    "tests/sim/test_scenarios.py",
    "tests/sim/rigs/test_turntable.py",
    "tests/cli/test_convert_cli.py",
    "tests/cli/test_errors_cli.py",
    "tests/cli/test_score_cli.py",
)
"""Tests that use most of what gfimu takes from its packages, within minutes."""

EXTRAS = ("", "sim", "view", "plot", "demo", "firmware", "formats", "tables", "cluster", "all")
MOVING = ("mujoco", "rerun-sdk")
"""Packages with an upper bound, as their releases change interfaces."""


def uv() -> list[str]:
    """Return the command of uv; ends the program where it is not installed."""
    if shutil.which("uv"):
        return ["uv"]
    if importlib.util.find_spec("uv") is not None:
        return [sys.executable, "-m", "uv"]
    sys.exit("uv is not installed; run: pip install uv")


def run(*command: str | Path, cwd: Path = ROOT, check: bool = True) -> int:
    """Run a command of which the output is shown; it does not see the environment of this program."""
    variables = {name: value for name, value in os.environ.items() if name not in {"PYTHONPATH", "VIRTUAL_ENV"}}
    return subprocess.run([*map(str, command)], cwd=cwd, env=variables, check=check).returncode


def environment(folder: Path, python: str, *packages: str, options: Sequence[str] = ()) -> Path:
    """Make an environment with packages, and return its interpreter."""
    run(*uv(), "venv", "--quiet", "--python", python, folder)
    found = folder / "bin" / "python"
    # Binary wheels only: a release without one for this interpreter is not a version that users get.
    binary = ("--only-binary", ":all:", "--no-binary", "gfimu")
    run(*uv(), "pip", "install", "--quiet", "--python", found, *binary, *options, *packages)
    return found


def tested(python: Path, given: argparse.Namespace) -> int:
    """Run tests with an interpreter, and return the exit code."""
    versions = (
        "import sys, importlib.metadata as m; print(sys.version.split()[0], *(f'{n} {m.version(n)}' for n in %r))"
    )
    run(python, "-c", versions % (("numpy", "scipy", "numba", "pyarrow", "matplotlib", *MOVING),))
    began = time.monotonic()
    tests = ROOMS if given.tests == "rooms" else ()
    code = run(python, "-m", "pytest", "-p", "no:cacheprovider", *given.pytest, *tests, check=False)
    print(f"{time.monotonic() - began:.0f} s, exit code {code}")
    return code


def newest(folder: Path, given: argparse.Namespace) -> int:
    """Test the newest versions within the bounds."""
    return tested(environment(folder / "env", given.python, f"{ROOT}[test]"), given)


def lowest(folder: Path, given: argparse.Namespace) -> int:
    """Test the lowest versions within the bounds."""
    options = ("--resolution", "lowest-direct")
    return tested(environment(folder / "env", given.python, f"{ROOT}[test]", options=options), given)


def following(folder: Path, given: argparse.Namespace) -> int:
    """Test the newest mujoco and rerun-sdk, whatever the bounds."""
    python = environment(folder / "env", given.python, f"{ROOT}[test]")
    run(*uv(), "pip", "install", "--quiet", "--upgrade", "--python", python, *MOVING)
    return tested(python, given)


def light(folder: Path, given: argparse.Namespace) -> int:
    """Call the commands in an environment with the core alone."""
    python = environment(folder / "env", given.python, str(ROOT))
    return run(python, ROOT / "tests" / "core_commands.py", cwd=folder, check=False)


def dist(folder: Path, given: argparse.Namespace) -> int:
    """Build wheel and sdist, check them, and run tests of the sdist."""
    python = environment(folder / "env", given.python, f"{ROOT}[test]")
    run(python, "-m", "hatchling", "build", "--directory", folder / "dist")
    run(python, "-m", "twine", "check", "--strict", *(folder / "dist").iterdir())
    return run(python, "-m", "pytest", "-n", "0", "-p", "no:cacheprovider", "tests/test_wheel.py", check=False)


def sizes(folder: Path, given: argparse.Namespace) -> int:
    """Print size on disk and number of packages of each extra, installed with the core."""
    print("| installed | packages | size, MB |", "|---|---|---|", sep="\n")
    for extra in EXTRAS:
        target = folder / (extra or "core")
        environment(target, given.python, f"{ROOT}[{extra}]" if extra else str(ROOT))
        packages = len(list(target.glob("lib/*/site-packages/*.dist-info")))
        used = subprocess.run(["du", "-sm", target], capture_output=True, text=True, check=True).stdout.split()[0]
        print(f"| {f'`{extra}`' if extra else 'core'} | {packages} | {used} |", flush=True)
    return 0


JOBS: dict[str, Callable[[Path, argparse.Namespace], int]] = {
    "newest": newest,
    "lowest": lowest,
    "next": following,
    "light": light,
    "dist": dist,
    "sizes": sizes,
}


def bounds() -> dict[str, str]:
    """Return the bounds of every package that users may install, by its name on PyPI, from pyproject.toml."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = {name: lines for name, lines in project["optional-dependencies"].items() if name not in {"test", "docs"}}
    found = {}
    for line in [*project["dependencies"], *(line for lines in extras.values() for line in lines)]:
        if not line.startswith("gfimu["):
            name, sign, bound = line.partition(">=")
            found[name] = sign + bound
    return found


def main() -> None:
    """Run one job in a folder that is removed, unless it is given."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("job", choices=JOBS)
    options.add_argument("--python", default=sys.executable, help="interpreter: a path, or a version for uv to find")
    options.add_argument("--tests", choices=("rooms", "all"), default="rooms")
    options.add_argument("--folder", type=Path, help="keep the environments there")
    given, given.pytest = options.parse_known_args()
    if given.folder is not None:
        given.folder.mkdir(parents=True, exist_ok=True)
        sys.exit(JOBS[given.job](given.folder.resolve(), given))
    with tempfile.TemporaryDirectory(prefix="gfimu-matrix-") as folder:
        sys.exit(JOBS[given.job](Path(folder), given))


if __name__ == "__main__":
    main()
