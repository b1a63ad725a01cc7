"""`gfimu optimize`: brief, sites, pictures, front, JSON, and what is wrong with an input."""

import json
import re
import tomllib
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from gfimu import AccelerometerArray

BRIEF = """
chips = 4
axes_per_chip = 3
starts = 2
[volume]
kind = "sites"
file = "mounts.csv"
"""
CORNERS = [(x, y, z) for x in (-0.05, 0.05) for y in (-0.05, 0.05) for z in (-0.05, 0.05)]
CSV = "x_m,y_m,z_m\n" + "".join(f"{x},{y},{z}\n" for x, y, z in [*CORNERS, (0.01, 0.0, 0.0)])


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "brief.toml").write_text(BRIEF)
    (tmp_path / "mounts.csv").write_text(CSV)
    return tmp_path


def has_ink(path):
    picture = matplotlib.image.imread(path)
    return np.ptp(picture[..., :3]) > 0.7 and np.mean(picture[..., :3].min(axis=-1) < 0.9) > 0.01


def test_a_brief_with_sites_gives_array_picture_and_certificate(gfimu_command, here):
    result = gfimu_command("optimize", "brief.toml", "--out", "best.toml", "--picture", "best.png")
    assert result.code == 0, result.stderr
    assert "2 of 2 starts agree on it" in result.stdout
    assert "certificate: optimal, equal to a proven bound, 1.0607" in result.stdout
    assert "wrote picture: best.png" in result.stdout
    assert has_ink(here / "best.png")
    np.testing.assert_allclose(np.abs(AccelerometerArray.load("best.toml").chip_positions), 0.05)


def test_options_replace_the_values_of_the_brief(gfimu_command, here):
    found = json.loads(gfimu_command("optimize", "brief.toml", "--chips", 8, "--objective", "sigma_p", "--json").stdout)
    assert len(found["array"]["chip"]) == 8
    assert found["objective"]["name"] == "sigma_p"
    assert found["objective"]["unit"] == "m/s²"
    box = json.loads(gfimu_command("optimize", "brief.toml", "--box-m", 0.02, 0.02, 0.02, "--json").stdout)
    assert np.abs([chip["position_m"] for chip in box["array"]["chip"]]).max() == pytest.approx(0.01)


def test_json_keeps_the_keys_it_had(gfimu_command):
    found = json.loads(gfimu_command("optimize", "--chips", 4, "--restarts", 2, "--json").stdout)
    assert {"array", "score", "gdop_lower_bound", "starts", "agreeing"} < set(found)
    assert found["starts"] == found["agreeing"] == 2
    assert found["gdop_lower_bound"] == pytest.approx(np.sqrt(9 / 8))
    assert found["certificate"]["bound"] == pytest.approx(np.sqrt(9 / 8))
    assert found["certificate"]["gap"] < 1e-6


def rows_of_the_page(root):
    page = (root / "docs" / "theory" / "geometry.md").read_text(encoding="utf-8")
    return re.findall(r"^\| `gfimu (optimize --chips [^`]+)` \| ([\d.]+) \| ([\d.]+) \|$", page, re.MULTILINE)


PAGE_ROWS = rows_of_the_page(Path(__file__).parents[2])


def test_the_page_has_its_rows():
    assert len(PAGE_ROWS) == 5


@pytest.mark.parametrize(("command", "gdop", "bound"), PAGE_ROWS)
def test_the_page_quotes_what_the_command_finds(gfimu_command, command, gdop, bound):
    found = json.loads(gfimu_command(*command.split(), "--json").stdout)
    assert f"{found['objective']['value']:.4f}" == gdop
    assert f"{found['certificate']['bound']:.4f}" == bound
    assert found["agreeing"] == 10
    assert found["starts"] <= 12


def test_sites_come_from_mjcf_and_array_files(gfimu_command, here, project_root):
    turntable = project_root / "models" / "mjcf" / "turntable.xml"
    mjcf = BRIEF.replace('"mounts.csv"', f'"{turntable}"\nnames = "a??"')
    (here / "mjcf.toml").write_text(mjcf)
    found = json.loads(gfimu_command("optimize", "mjcf.toml", "--json").stdout)
    assert found["objective"]["value"] == pytest.approx(np.sqrt(9 / 8), rel=1e-6)
    array = project_root / "models" / "arrays" / "corners8.toml"
    given = BRIEF.replace('"mounts.csv"', f'"{array}"').replace("chips = 4", "chips = 6").replace("= 3", "= 1")
    (here / "array.toml").write_text('directions = "site"' + given)
    single = json.loads(gfimu_command("optimize", "array.toml", "--json").stdout)
    axes = np.array([chip["axes"] for chip in single["array"]["chip"]])
    assert axes.shape == (6, 1, 3)
    assert np.isclose(np.abs(axes).max(axis=-1), 1.0).all()


def test_a_shorter_front_leaves_no_array_of_the_one_it_replaces(gfimu_command, here):
    for most in (6, 5):
        options = ("--restarts", 1, "--pareto", "chips", "gdop", "--front", "front")
        assert gfimu_command("optimize", "--chips", 4, "--most-chips", most, *options).code == 0
    assert sorted(file.name for file in (here / "front").glob("*.toml")) == ["front_01.toml", "front_02.toml"]


def test_a_front_is_a_folder_of_arrays_with_a_picture(gfimu_command, here):
    result = gfimu_command(
        "optimize", "--chips", 4, "--most-chips", 6, "--restarts", 2, "--pareto", "chips", "gdop", "--front", "front"
    )
    assert result.code == 0, result.stderr
    assert "Front of number of chips and GDOP" in result.stdout
    assert {file.name for file in (here / "front").iterdir()} == {
        "front.json", "front.png", "front_01.toml", "front_02.toml", "front_03.toml"
    }  # fmt: skip
    assert has_ink(here / "front" / "front.png")
    points = json.loads((here / "front" / "front.json").read_text())["points"]
    for point in points:
        chips = tomllib.loads((here / "front" / f"{point['array']}.toml").read_text())["chip"]
        assert len(chips) == point["values"][0]


@pytest.mark.parametrize(
    ("csv", "message"),
    [
        ("x_m,y_m\n0,0\n", "no column z_m"),
        ("x_m,y_m,z_m\n0,0,nan\n", "site 1: z_m = 'nan' must be a finite number"),
        ("x_m,y_m,z_m\n0,0\n", "site 1: z_m = None must be a finite number"),
        ("x_m,y_m,z_m\n", "no candidate site"),
        ("x_m,y_m,z_m,axis_x,axis_y,axis_z\n0,0,0,0,0,0\n", "its axis has length zero"),
        ("x_m,y_m,z_m\n0,0,0\n1,0,0\n", "2 candidate sites for 4 chips; give at least 4"),
    ],
)
def test_bad_sites_end_with_one_line(gfimu_command, here, csv, message):
    (here / "mounts.csv").write_text(csv)
    refused(gfimu_command("optimize", "brief.toml"), message)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--chips", "4", "--objective", "gdp"], "unknown objective 'gdp'"),
        (["--chips", "4", "--objective", "gdop_worst"], "needs [tolerance]"),
        (["--chips", "4", "--pareto", "gdop", "kappa"], "go together"),
        (["--chips", "4", "--front", "x"], "go together"),
        (["--chips", "4", "--most-chips", "6"], "give --pareto chips OBJECTIVE"),
        (
            ["--chips", "4", "--pareto", "gdop", "size", "--front", "x", "--most-chips", "6"],
            "--most-chips is of a front",
        ),
        (["--chips", "4", "--pareto", "gdop", "chips", "--front", "x", "--out", "y.toml"], "leave out --out"),
        (["--chips", "4", "--pareto", "gdop", "chips", "--front", "x", "--most-chips", "3"], "must exceed 4"),
        (["--chips", "4", "--box-m", "0.1", "nan", "0.1"], "--box-m 0.1 nan 0.1: must be a finite number"),
        (["none.toml"], "none.toml: no such file"),
        ([], "give chips in the brief, or --chips"),
    ],
)
def test_bad_options_end_with_one_line(gfimu_command, here, words, message):
    refused(gfimu_command("optimize", *words), message)
    assert not (here / "x").exists()


@pytest.mark.parametrize(
    ("brief", "message"),
    [
        ("[volume]\nkind = 'ball'\n", "kind = 'ball' must be one of box, sphere, cylinder, sites"),
        ("chips = 4\n[volume]\nkind = 'sphere'\nradius_m = -1\n", "radius_m = -1 must be greater than 0"),
        ("chips = 4\ncolour = 1\n[volume]\nkind = 'sphere'\nradius_m = 1\n", "unknown key 'colour'"),
        ("chips = 4\ndirections = 'site'\n", "no sites with axes"),
        ("chips = 4\n[[keep_out]]\nkind = 'box'\nedges_m = [1, 1, 1]\n", "leave nothing of a box of 0.1 × 0.1 × 0.1 m"),
        ("chips = 4\n[volume]\nkind = 'sites'\nfile = 'mounts.txt'\n", "come from .xml, .toml or .csv"),
    ],
)
def test_bad_briefs_end_with_one_line(gfimu_command, here, brief, message):
    (here / "brief.toml").write_text(brief)
    refused(gfimu_command("optimize", "brief.toml"), message)


def refused(result, message):
    assert result.code == 2, result
    assert result.stderr.count("\n") == 1, result.stderr
    assert message in result.stderr
