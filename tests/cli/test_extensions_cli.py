"""What a user adds from outside, through the commands, each in a process of its own: the package of the page, files."""

import json
import os
import re
import shlex
import socket
import subprocess
import sys
import threading
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import gfimu

FILE = re.compile(r"^<!-- file: (\S+) -->\n```\w+\n(.*?)^```$", re.DOTALL | re.MULTILINE)
SHELL = re.compile(r"^```sh\n(.*?)^```$", re.DOTALL | re.MULTILINE)
PROJECT_ROOT = Path(__file__).resolve().parents[2]
G = 9.80665
ONE_MPU = """
name = "one_mpu"
[[chip]]
name = "a1"
part = "my_chip.toml"
position_m = [0, 0, 0]
axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
"""


def run(folder, line, *, code=0):
    """Run a line of the shell in a folder whose packages are installed; returns what it prints."""
    program, *arguments = shlex.split(line, comments=True)
    assert program == "gfimu"
    path = os.pathsep.join([str(folder), str(PROJECT_ROOT), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-m", "gfimu", *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == code, (line, done.stderr)
    return done.stdout if code == 0 else done.stderr


@pytest.fixture(scope="module")
def page(project_root):
    return (project_root / "docs" / "development" / "extending.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def installed(tmp_path_factory, project_root, page):
    """A folder on the path with the package of the page, as pip would leave it there, and recordings of its logger."""
    folder = tmp_path_factory.mktemp("package")
    for name, text in FILE.findall(page):
        (folder / name).write_text(text, encoding="utf-8")
    example = project_root / "docs" / "examples" / "pendulum.py"
    (folder / example.name).write_bytes(example.read_bytes())
    project = tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    info = folder / "my_rig-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    groups = (
        (f"[{group}]", *(f"{name} = {at}" for name, at in points.items()))
        for group, points in project["entry-points"].items()
    )
    (info / "entry_points.txt").write_text("\n".join(line for group in groups for line in group))
    t = np.arange(500) / 100.0
    rows = np.column_stack([t, 0.1 * np.sin(t), 0.2 * np.cos(t), 1.0 + 0.01 * np.sin(9 * t)])
    for mark, name in ((b"BELTLOG\0", "shake.log"), (b"BELTRUN\0", "shake.run"), (b"BELTLOG\0cut", "cut.log")):
        (folder / name).write_bytes(mark + rows.tobytes())
    subprocess.run([sys.executable, example, "pendulum.csv"], cwd=folder, check=True, timeout=60)
    return folder


def test_every_command_of_the_page_takes_what_the_package_adds(installed, page):
    simulate, *lines = SHELL.findall(page)[-1].splitlines()
    inspect, convert = (line for line in lines if "shake.log" in line)
    run(installed, simulate)
    alone = [line for line in lines if "shake.log" not in line]
    with ThreadPoolExecutor() as at_once:
        printed = [at_once.submit(run, installed, line) for line in (*alone, inspect)]
        wrong = at_once.submit(run, installed, "gfimu inspect cut.log", code=2)
    run(installed, convert)

    (cause,) = json.loads((installed / "diagnosis" / "verdict.json").read_text(encoding="utf-8"))["causes"]
    size = cause["parameters"]["slip_s2_rad2"]
    assert cause["effect"] == "belt_slip"
    assert abs(size["value"] - 3e-4) < 5 * size["std"] < 5e-6
    assert "belt_slip" in (installed / "diagnosis" / "twin.toml").read_text(encoding="utf-8")
    assert f"({1e4 * size['value']:.3f} ± {1e4 * size['std']:.3f})·10⁻⁴" in page
    assert any("method median" in text.result() for text in printed)
    assert any("pivot_offset" in text.result() for text in printed)
    assert tomllib.loads((installed / "shake.toml").read_text(encoding="utf-8"))["format"] == "belt_log"
    for name in ("shake.csv", "run.csv"):
        found = gfimu.open_recording(installed / name)
        np.testing.assert_allclose(found.readings[0], [0.0, 0.2 * G, G], atol=1e-6)
        assert len(found.t_s) == 500
    assert wrong.result().splitlines()[-1] == "gfimu: cut.log: ends within a row; copy it again"


def sending(listener):
    """Send lines of a board to whoever connects, until it has gone."""
    host, _ = listener.accept()
    start = time.monotonic()
    with host:
        for number in range(100_000):
            try:
                host.sendall(f"{number * 10_000},0,0,2048,36.5\n".encode())
            except OSError:
                return
            time.sleep(max(0.0, start + (number + 1) / 100.0 - time.monotonic()))


def test_a_board_is_described_by_files_of_its_frame_its_array_and_its_part(tmp_path, project_root):
    """The example of docs/reference/frames.md, with a part of one's own."""
    frames = (project_root / "docs" / "reference" / "frames.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```toml\n(name = \"mpu_lines\".*?)^```$", frames, re.DOTALL | re.MULTILINE)
    (tmp_path / "mpu_lines.toml").write_text(block, encoding="utf-8")
    run(tmp_path, "gfimu new part --out my_chip.toml")
    part = (tmp_path / "my_chip.toml").read_text(encoding="utf-8").replace("# temperature_", "temperature_")
    (tmp_path / "my_chip.toml").write_text(part, encoding="utf-8")
    (tmp_path / "one_mpu.toml").write_text(ONE_MPU)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        threading.Thread(target=sending, args=[listener], daemon=True).start()
        port = f"socket://127.0.0.1:{listener.getsockname()[1]}"
        run(tmp_path, f"gfimu record --port {port} --format mpu_lines.toml --duration 1 --out run.csv")
    found = gfimu.open_recording(tmp_path / "run.csv")
    array = gfimu.AccelerometerArray.load(tmp_path / "one_mpu.toml")
    np.testing.assert_allclose(found.for_array(array)[5], [0.0, 0.0, 2048 * tomllib.loads(part)["lsb_m_s2"]], rtol=1e-9)
    run(tmp_path, "gfimu new array --out my_array.toml")
    text = (tmp_path / "my_array.toml").read_text(encoding="utf-8").replace("adxl345", "my_chip.toml")
    (tmp_path / "my_array.toml").write_text(text, encoding="utf-8")
    assert "my_array" in run(tmp_path, "gfimu score my_array.toml")
