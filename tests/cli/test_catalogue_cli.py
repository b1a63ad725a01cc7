"""What comes with gfimu can be listed and shown, and every file to start from works as it is."""

import re

import pytest
from every_item import every

from firmware_bridge.frames.format_file import load_format
from gfimu import AccelerometerArray, load_map
from gfimu.array import Part
from gfimu.array_search.brief import load_brief
from gfimu.base import find_model, list_models
from gfimu.calibration import Stage
from gfimu.commands.list import KINDS
from gfimu.commands.new import TEMPLATES
from sim import DataSheet
from sim.scenarios import Scenario
from sim.trials import load_plan
from sim.twin import Twin

LOADERS = {
    "array": AccelerometerArray.load,
    "part": lambda path: (Part.load(str(path)), DataSheet.load(str(path))),
    "map": load_map,
    "twin": Twin.load,
    "scenario": Scenario.load,
    "frame": load_format,
    "stage": Stage.load,
    "plan": load_plan,
    "brief": load_brief,
}


@pytest.mark.parametrize("kind", KINDS)
def test_all_of_a_kind_are_listed_with_what_they_are(gfimu_command, kind):
    result = gfimu_command("list", kind, "--json")
    assert result.code == 0
    import json

    found = json.loads(result.stdout)
    assert len(found) >= 2
    assert all(found.values())
    if kind in {"arrays", "parts", "maps", "twins", "scenarios"}:
        assert set(found) == set(list_models(kind))


@pytest.mark.parametrize("kind", TEMPLATES)
def test_a_file_to_start_from_can_be_used(gfimu_command, tmp_path, kind):
    file = tmp_path / f"my_{kind}.toml"
    assert gfimu_command("new", kind, "--out", file).code == 0
    assert file.read_text().startswith(f"#:schema ./{kind}.schema.json\n# ")
    LOADERS[kind](file)
    again = gfimu_command("new", kind, "--out", file)
    assert again.code == 2
    assert "is there already" in again.stderr


def test_the_array_to_start_from_determines_all_motions(gfimu_command, tmp_path):
    assert gfimu_command("new", "array", "--out", tmp_path / "my_array.toml").code == 0
    scored = gfimu_command("score", tmp_path / "my_array.toml", "cube12")
    assert (scored.code, scored.stderr) == (0, "")


def test_a_sender_is_a_folder(gfimu_command, tmp_path):
    readme = gfimu_command("new", "sender").stdout
    assert readme.startswith("# A sender for gfimu")
    folder = tmp_path / "mine"
    assert gfimu_command("new", "sender", folder).code == 0
    assert (folder / "README.md").read_text() == readme.replace("sender.ino", "mine.ino")
    again = gfimu_command("new", "sender", folder)
    assert (again.code, "not empty; choose another name" in again.stderr) == (2, True)
    for words in (
        ("new", "sender", "--out", "x.toml"),
        ("new", "sender", "--schema", "x.json"),
        ("new", "array", folder),
    ):
        wrong = gfimu_command(*words)
        assert (wrong.code, wrong.stderr.count("\n")) == (2, 1)


@pytest.mark.parametrize("name", ["cube12", "adxl355", "klipper", "cube12_turntable", "rest", "table_tilt"])
def test_what_has_a_name_is_shown(gfimu_command, name):
    result = gfimu_command("show", name)
    assert result.code == 0
    assert name.partition("_turn")[0] in result.stdout


@pytest.mark.parametrize("words", [("list", "nothing"), ("show", "nothing"), ("new", "nothing")])
def test_an_unknown_name_is_one_line(gfimu_command, words):
    result = gfimu_command(*words)
    assert result.code == 2
    assert result.stderr.count("\n") == 1
    assert "nothing" in result.stderr


@every("name", sorted(set(list_models("parts")) - {"generic"}))
def test_every_figure_of_a_shipped_part_says_where_it_is_from(name):
    text = find_model("parts", name).read_text(encoding="utf-8")
    sources = set(re.findall(r"^# (\d): ", text, flags=re.MULTILINE))
    assert sources
    for line in text.splitlines():
        key = line.partition(" = ")[0]
        if line[:1] in {"#", "[", ""} or key in {"name", "manufacturer", "source"}:
            continue
        (mark,) = re.findall(r"\[(unchecked|derived|\d[\d, ]*\*?)\]$", line) or [None]
        assert mark is not None, f"{key}: no mark"
        assert mark in {"unchecked", "derived"} or set(re.findall(r"\d", mark)) <= sources, line


@every("name", list_models("parts"))
def test_every_shipped_part_has_a_sound_data_sheet(name):
    part, sheet = Part.load(name), DataSheet.load(name)
    assert 1e-7 < part.lsb < 1.0
    assert sheet.full_range > 100 * part.lsb
    density = part.noise_std_100_hz / 50.0**0.5 / 9.80665
    assert ((density > 1e-5) & (density < 6e-3)).all()  # 10 µg/√Hz to 6 mg/√Hz
    assert (sheet.offset_std < 0.5 * sheet.full_range).all()


def test_a_schema_is_written_beside_the_file_that_names_it(gfimu_command, tmp_path):
    import json

    (tmp_path / "editor").mkdir()
    out, schema = tmp_path / "my_array.toml", tmp_path / "editor" / "array.json"
    assert gfimu_command("new", "array", "--out", out, "--schema", schema).code == 0
    assert out.read_text().startswith("#:schema ./editor/array.json\n")
    assert "position_m" in json.loads(schema.read_text())["$defs"]["ChipTable"]["properties"]
    alone = gfimu_command("new", "twin", "--schema", tmp_path / "twin.schema.json")
    assert (alone.code, "[drive]" in alone.stdout) == (0, False)
    wrong = gfimu_command("new", "twin", "--schema", tmp_path / "twin.toml")
    assert (wrong.code, "a JSON schema ends in .json" in wrong.stderr) == (2, True)


def test_files_and_the_array_of_a_recording_are_shown(gfimu_command, tmp_path):
    file = tmp_path / "arm.toml"
    file.write_text(gfimu_command("new", "array").stdout.replace("# supply_V", "supply_V").replace("# own_", "own_"))
    assert gfimu_command("show", file).stdout == file.read_text()
    (tmp_path / "run.toml").write_text(f'array = "{file}"\nduration_s = 0.1\n[motion]\nkind = "rest"\n')
    run = tmp_path / "run.csv"
    assert gfimu_command("simulate", tmp_path / "run.toml", "--out", run).code == 0
    file.unlink()
    shown = gfimu_command("show", run).stdout
    assert "supply_V = 3.3" in shown
    assert "own_clock = true" in shown
    file.write_text(shown.replace("supply_V", "suply_V"))
    wrong = gfimu_command("show", file)
    assert wrong.code == 2
    assert "[[chip]] 1: unknown key 'suply_V'" in wrong.stderr
    assert "did you mean 'supply_V'?" in wrong.stderr
    gone = gfimu_command("show", tmp_path / "gone.toml")
    assert (gone.code, gone.stderr.count("\n"), "no such file" in gone.stderr) == (2, 1, True)
