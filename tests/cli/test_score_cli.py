"""`gfimu score` and `gfimu optimize`: table, JSON of the contract, files, bad input."""

import json

import pytest

from gfimu import AccelerometerArray
from gfimu.array import seeing_arrays


def test_without_arguments_compares_every_shipped_array(gfimu_command):
    result = gfimu_command("score")
    assert result.code == 0
    for name in seeing_arrays():
        assert name in result.stdout
    assert "0.05 m" in result.stdout
    assert "1.0607" in result.stdout


def test_a_ranking_that_depends_on_the_figure_is_stated(gfimu_command):
    assert (
        "p1_face_diagonals has a lower κ but a larger GDOP"
        in gfimu_command("score", "cube12", "p1_face_diagonals").stdout
    )
    assert "lower κ" not in gfimu_command("score", "cube12", "p3_three_plus_one").stdout


def test_json_has_the_keys_of_the_contract(gfimu_command):
    result = gfimu_command("score", "cube12", "p3_three_plus_one", "--json")
    content = json.loads(result.stdout)
    assert content["length_unit_m"] == 0.05
    first, second = content["arrays"]
    assert first["name"] == "cube12"
    assert first["condition_number"] == pytest.approx(1.4142, abs=5e-5)
    assert first["gdop"] == pytest.approx(1.0607, abs=5e-5)
    assert first["sigma_alpha"] == pytest.approx([0.35355339] * 3)
    assert first["sigma_p"] == pytest.approx([0.5] * 3)
    assert first["omega_squared_leakage"] == [0.0] * 6
    assert first["null_space_rank"] == 6
    assert max(second["omega_squared_leakage"]) == pytest.approx(0.47, abs=0.005)


def test_infinite_bounds_are_null_in_json(gfimu_command):
    content = json.loads(gfimu_command("score", "p1_face_diagonals", "--json").stdout)
    assert content["arrays"][0]["rate_bound_rad_s"] == [None] * 3
    assert content["arrays"][0]["gdop_joint"] is None


def test_speed_axis_and_noise_reach_the_bound(gfimu_command):
    options = ("--speed-rad-s", 10, "--spin-axis", "x", "--noise-m-s2", 0.05, "--json")
    content = json.loads(gfimu_command("score", "cube12", *options).stdout)
    sigma_alpha = 0.05 / (8**0.5 * 0.05)
    assert content["arrays"][0]["rate_bound_rad_s"] == pytest.approx(
        [sigma_alpha / 20, sigma_alpha / 10, sigma_alpha / 10]
    )


def test_reads_array_files_and_mjcf(gfimu_command, tmp_path, project_root):
    path = tmp_path / "mine.toml"
    path.write_text(AccelerometerArray.load("cube12").to_toml().replace('name = "cube12"', 'name = "mine"', 1))
    turntable = project_root / "models" / "mjcf" / "turntable.xml"
    result = gfimu_command("score", path, turntable, "--json")
    mine, rig = json.loads(result.stdout)["arrays"]
    assert mine["name"] == "mine"
    assert rig["gdop"] == pytest.approx(mine["gdop"], rel=1e-6)


def test_optimize_writes_an_array_that_score_reads(gfimu_command, tmp_path):
    out = tmp_path / "best4.toml"
    result = gfimu_command("optimize", "--chips", 4, "--restarts", 6, "--out", out)
    assert result.code == 0
    assert "wrote array" in result.stdout
    content = json.loads(gfimu_command("score", out, "--json").stdout)
    assert content["arrays"][0]["name"] == "best4"
    assert content["arrays"][0]["gdop"] == pytest.approx(1.0607, abs=5e-5)


def test_the_least_fault_of_each_channel_is_listed_on_demand(gfimu_command):
    short = json.loads(gfimu_command("score", "cube12", "corners8", "--json").stdout)["arrays"]
    cube, corners = (entry["least_fault"] for entry in short)
    assert cube["detected_m_s2"] > corners["detected_m_s2"] > 0.0
    assert cube["detected_without_rate_m_s2"] is None
    assert "channels" not in cube
    long = json.loads(gfimu_command("score", "cube12", "--per-channel", "--fault-time-s", 10, "--json").stdout)
    slow = long["arrays"][0]["least_fault"]
    assert [row["channel"] for row in slow["channels"]] == list(AccelerometerArray.load("cube12").channels)
    assert slow["detected_m_s2"] == max(row["detected_m_s2"] for row in slow["channels"]) < cube["detected_m_s2"]
    table = gfimu_command("score", "cube12", "corners8", "--per-channel").stdout
    assert "corners8 protects best" in table
    assert "a43" in table


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("score", "cube13"), "unknown array 'cube13'; valid: corners8, cube12"),
        (("score", "missing.toml"), "missing.toml: no such file"),
        (("score", "missing.xml"), "missing.xml: no such file"),
        (("score", "cube12", "--spin-axis", "w"), "unknown axis 'w'; valid: x, y, z"),
        (("score", "cube12", "--noise-m-s2", "0"), "noise_std"),
        (("score", "cube12", "--fault-time-s", "0"), "fault time 0.0 s: must be positive"),
        (("optimize", "--chips", "2", "--restarts", "2"), "can't see angular acceleration"),
        (("optimize", "--chips", "4", "--out", "best.json"), "ends in .toml"),
    ],
)
def test_bad_input_ends_with_one_line_and_code_two(gfimu_command, arguments, message):
    result = gfimu_command(*arguments)
    assert result.code == 2
    assert message in result.stderr
    assert result.stderr.count("\n") == 1
    assert "Traceback" not in result.stderr


def test_blind_array_file_names_the_motions(gfimu_command, tmp_path):
    path = tmp_path / "two.toml"
    axes = "axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]"
    path.write_text(
        f'name = "two"\n[[chip]]\nposition_m = [0.05, 0, 0]\n{axes}\n[[chip]]\nposition_m = [-0.05, 0, 0]\n{axes}\n'
    )
    result = gfimu_command("score", path)
    assert result.code == 2
    assert "rank 5 of 6" in result.stderr
    assert "angular acceleration about x" in result.stderr
