"""The page of worked diagnoses: its commands run, its figures are drawn, and it quotes what they find."""

import importlib.util
import json
import re
import shlex
import struct
import sys

import numpy as np
import pytest

from gfimu import read_mimu4444
from gfimu.diagnosis import diagnose
from sim.twin import Twin


@pytest.fixture(scope="module")
def script(project_root):
    path = project_root / "docs" / "scripts" / "make_worked_diagnoses.py"
    specification = importlib.util.spec_from_file_location("make_worked_diagnoses", path)
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module  # dataclasses look their module up
    specification.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def page(project_root):
    return (project_root / "docs" / "cases" / "worked_diagnoses.md").read_text(encoding="utf-8")


def commands(page, name):
    """Arguments of each gfimu command in the fenced block that holds a name."""
    block = next(text for text in re.findall(r"^```\n(.*?)^```$", page, re.DOTALL | re.MULTILINE) if name in text)
    return [shlex.split(line)[1:] for line in block.replace("\\\n", "").splitlines()]


def same_size(drawn, project_root):
    stored = project_root / "docs" / "figures" / drawn.name
    return struct.unpack(">II", stored.read_bytes()[16:24]) == struct.unpack(">II", drawn.read_bytes()[16:24])


def test_the_tilted_table_is_found_by_the_commands_of_the_page(page, gfimu_command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for arguments in commands(page, "table_tilt"):
        assert gfimu_command(*arguments).code == 0
    verdict = json.loads((tmp_path / "tilted" / "verdict.json").read_text())
    assert verdict["verdict"] == "explained"
    (cause,) = verdict["causes"]
    assert cause["effect"] == "table_tilt"
    for key, told in (("x_rad", r"x = ([\d.]+) ± ([\d.]+) mrad"), ("y_rad", r"y = (−[\d.]+) ± ([\d.]+) mrad")):
        found, quoted = cause["parameters"][key], re.search(told, page)
        assert found["value"] == pytest.approx(1e-3 * float(quoted[1].replace("−", "-")), abs=found["std"])
        assert found["value"] == pytest.approx({"x_rad": 0.015, "y_rad": -0.010}[key], abs=4 * found["std"])


def test_the_ripple_is_at_once_per_revolution(script, project_root, tmp_path):
    table = script.diagnose_table()
    assert script.ripple(table, tmp_path / "diagnosis_ripple.png") == pytest.approx(1.0, abs=0.05)
    assert same_size(tmp_path / "diagnosis_ripple.png", project_root)
    assert [cause.effect for cause in table.causes] == ["table_tilt"]


def lag_of_the_page(page):
    return 1e-3 * float(re.search(r"(−[\d.]+) ± [\d.]+ ms: the accelerometers lag", page)[1].replace("−", "-"))


def causes_of_the_page(page):
    return set(re.findall(r"^\| `(\w+)` \| (?!what)", page, re.MULTILINE))


def check_what_its_makers_state(board):
    """Data sheet: offsets of 80 to 150 mg, gains of 3 %: the largest of 24 below two sigma and not below a tenth."""
    causes = {cause.effect: cause for cause in board.causes}
    assert board.verdict == "explained"
    assert 0.3 < max(map(abs, causes["bias"].parameters.values())) < 2.9
    assert 0.002 < max(map(abs, causes["scale_factor"].parameters.values())) < 0.03
    assert board.unexplained.significant
    assert "as if each were sampled at an instant of its own" in board.unexplained.signature
    assert "channel m41 has a tone" in board.unexplained.signature
    # Chips on clocks of their own: the innovations of the rate filter say 1.5 ms.
    assert board.noise.disagreement_s == pytest.approx(1.5e-3, rel=0.4)
    assert board.gain.held_out == "another recording"
    assert board.gain.log_likelihood_per_sample > 5 * board.gain.log_likelihood_std


def check_figures(board, script, project_root, folder):
    for name, draw in (("diagnosis_board", script.board_residual), ("diagnosis_board_noise", script.board_noise)):
        path = folder / f"{name}.png"
        draw(board, path)
        assert path.stat().st_size < 150_000
        assert same_size(path, project_root)


def seventy_seconds(recording):
    """The last two poses of a recording of the board and the first half minute of its motion."""
    return recording.slice(*np.searchsorted(recording.t_s, [440.0, 510.0]))


@pytest.mark.study
def test_seventy_seconds_of_a_real_board_show_most_of_what_the_page_says(
    script, shared_data, page, project_root, tmp_path
):
    """All of it takes a minute and a half, and is the study below."""
    runs = [seventy_seconds(read_mimu4444(shared_data / "mimu4444" / f"exp_{number}.bin.gz")) for number in (1, 2)]
    board = diagnose(runs[:1], Twin.load("mimu4444_free"), held_out=runs[1:])
    check_what_its_makers_state(board)
    named = {cause.effect for cause in board.causes}
    # The lag and the displacements are of the fast motion that is cut off.
    assert {"bias", "scale_factor", "cross_axis"} <= named <= causes_of_the_page(page)
    assert script.still_and_moving(board)["rest"] == pytest.approx((0.30, 0.044), rel=0.05)
    check_figures(board, script, project_root, tmp_path)


@pytest.fixture(scope="module")
def board(script, shared_data):
    """Diagnosis of the real board, its gain on the other recording."""
    return script.diagnose_board(shared_data / "mimu4444")


@pytest.mark.study
def test_a_real_board_has_the_errors_that_its_makers_state_and_more_noise_in_motion(board, page):
    check_what_its_makers_state(board)
    causes = {cause.effect: cause for cause in board.causes}
    assert set(causes) == causes_of_the_page(page)
    # The accelerometers are within a millimetre of where the drawing has them; the packages are 4 mm wide.
    assert max(map(abs, causes["sensor_position"].parameters.values())) < 1e-3
    assert causes["gyro_latency"].parameters["delay_s"] == pytest.approx(lag_of_the_page(page), abs=0.05e-3)


@pytest.mark.study
def test_the_extension_of_a_real_board_helps_on_the_other_recording(board, script, page, project_root, tmp_path):
    share = float(re.search(r"(\d+) % of the excess over that noise is gone", page)[1])
    assert 100 * board.gain.share_of_excess_removed == pytest.approx(share, abs=2)
    assert board.residual.rms_after > 3 * board.residual.noise_floor  # what the motion adds counts as error
    sizes = script.still_and_moving(board)
    assert sizes["rest"] == pytest.approx((0.30, 0.044), rel=0.05)
    assert sizes["motion"][1] == pytest.approx(1.2, rel=0.05)
    check_figures(board, script, project_root, tmp_path)
