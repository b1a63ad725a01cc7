"""A column map given key by key, without a file: the same as the file, and every mistake lists the valid keys."""

import inspect

import foreign_files as files
import numpy as np
import pytest
import typer

import gfimu
from gfimu import InputError, load_map
from gfimu.commands import program
from gfimu.recording import ColumnSpec, mapped_recording

TIME = ["time.column=ms", "time.unit=ms"]
CHIP = ["unit=g", "channels.a11=ax", "channels.a12=ay", "channels.a13=az"]
G = 9.80665


@pytest.fixture
def plain(tmp_path):
    """A plain csv in ms, g and rpm."""
    columns = [1000.0 * files.T, *(files.FORCE / G).T, 60.0 * files.T]
    return files.rows(tmp_path / "log.csv", ["ms,ax,ay,az,rpm"], columns, form="{:.12g}")


def test_keys_make_a_whole_map(plain):
    found = gfimu.convert(
        plain, column_map=gfimu.load_map(None, [*TIME, *CHIP, 'reference.tacho_rad_s={column="rpm", unit="rpm"}'])
    )
    assert found.t_s == pytest.approx(files.T)
    assert found.readings == pytest.approx(files.FORCE)
    assert found.reference["tacho_rad_s"] == pytest.approx(60.0 * files.T * np.pi / 30.0)


def test_keys_are_those_of_a_map_file(plain, tmp_path):
    """Whatever the form, the map is the same as that of a file."""
    (tmp_path / "m.toml").write_text(
        'name = "options"\n[time]\ncolumn = "ms"\nunit = "ms"\n[channels]\n'
        'a11 = { column = "ax", unit = "g" }\na12 = { column = 3, unit = "mg" }\n'
    )
    forms = [
        [*TIME, 'channels.a11={column="ax", unit="g"}', 'channels.a12={column=3, unit="mg"}'],
        [*TIME, "unit=g", "channels.a11=ax", "channels.a12=3", "channels.a12.unit=mg"],
        ['time={column="ms", unit="ms"}', 'channels={a11={column="ax"}, a12={column=3, unit="mg"}}', 'unit="g"'],
    ]
    for form in forms:
        assert load_map(None, form) == load_map(tmp_path / "m.toml")


def test_a_key_of_a_named_map_is_changed(tmp_path):
    path = files.klipper(tmp_path / "a.csv")
    turned = gfimu.convert(path, column_map=gfimu.load_map("klipper", ["channels.a13.scale=-1", "keep_other=false"]))
    assert turned.readings == pytest.approx(files.FORCE * [1.0, 1.0, -1.0], abs=1e-6)
    assert load_map("klipper").channels["a13"].scale == 1.0
    assert load_map(load_map("klipper"), ["channels.a13.scale=-1"]).channels["a13"] == ColumnSpec(
        "accel_z", "mm/s^2", -1.0
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ([*TIME, *CHIP, "colour=red"], ["--map-set", "colour", "keep_other", "unit"]),
        ([*TIME, *CHIP, "time.clock=3"], ["time", "clock", "rate_hz", "start_s"]),
        ([*TIME, *CHIP, "text.mark=;"], ["text", "mark", "separator"]),
        ([*TIME, 'channels.a11={column="ax", unit="g", gain=2}'], ["channels", "gain", "offset"]),
        ([*TIME, *CHIP, "time.unit=furlong"], ["furlong", "ms"]),
        ([*TIME, *CHIP, "unit=furlong"], ["a11", "furlong", "mm/s2"]),
        ([*TIME, *CHIP, "drop=garbage"], ["garbage", "out_of_range"]),
        ([*TIME, *CHIP, "drop=3"], ["drop", "duplicates"]),
        ([*TIME, *CHIP, "time.start_s=5", "time.stop_s=4"], ["stop_s", "start_s"]),
        ([*TIME, *CHIP, "time.start_s=-1"], ["time.start_s"]),
        ([*TIME, "reference.speed={column=5, unit=\"rpm\"}"], ["speed", "tacho_rad_s"]),
        (TIME, ["channels.a11"]),
        (["unit=g"], ["channels.a11"]),
        (CHIP, ["rate_hz"]),
        (["time"], ["key=value"]),
        (["time.unit.x=3", *CHIP], ["time.unit"]),
        (["name=a", "name.x=3"], ["name"]),
        ([*TIME, "channels.a11={column=ax"], ["TOML"]),
        (["channels=3", *TIME], ["channels", "table"]),
    ],
)  # fmt: skip
def test_a_mistake_is_one_line_that_lists_what_is_valid(plain, changes, words):
    with pytest.raises(InputError) as error:
        gfimu.convert(plain, column_map=gfimu.load_map(None, changes))
    message = str(error.value)
    assert "\n" not in message
    assert all(word in message for word in words), message


def test_a_key_of_a_named_map_says_which_map(plain):
    with pytest.raises(InputError, match=r"klipper\.toml with --map-set: time\.scale"):
        gfimu.convert(plain, column_map=gfimu.load_map("klipper", ["time.scale=abc"]))


def test_only_a_part_of_the_file_is_taken(plain):
    found = gfimu.convert(
        plain, column_map=gfimu.load_map(None, [*TIME, *CHIP, "skip_rows=10", "time.start_s=1", "time.stop_s=1.5"])
    )
    rows = slice(110, 161)
    assert found.t_s == pytest.approx(files.T[rows])
    assert found.readings == pytest.approx(files.FORCE[rows])
    with pytest.raises(InputError, match=r"lasts 2\.99 s"):
        gfimu.convert(plain, column_map=gfimu.load_map(None, [*TIME, *CHIP, "time.start_s=10"]))
    with pytest.raises(InputError, match="skip fewer"):
        gfimu.convert(plain, column_map=gfimu.load_map(None, [*TIME, *CHIP, "skip_rows=300"]))


def test_an_array_beside_its_map_is_found_from_elsewhere(plain, tmp_path):
    from gfimu import AccelerometerArray

    folder = tmp_path / "maps"
    folder.mkdir()
    (folder / "mine.toml").write_text(AccelerometerArray.load("one_adxl345").to_toml())
    (folder / "m.toml").write_text(
        'array = "mine.toml"\nunit = "g"\n[time]\ncolumn = "ms"\nunit = "ms"\n'
        '[channels]\na11 = "ax"\na12 = "ay"\na13 = "az"\n'
    )
    assert mapped_recording(plain, folder / "m.toml").array is not None


def test_every_command_with_a_map_takes_its_keys():
    commands = typer.main.get_command(program()).commands
    names = ("convert", "estimate", "diagnose", "check", "calibrate", "noise", "join", "view", "design")
    for name in names:
        assert "column_map" in inspect.signature(getattr(gfimu, name)).parameters, name
        assert "--map-set" in {word for param in commands[name].params for word in param.opts}, name


def test_a_recording_that_was_read_already_takes_no_keys(plain):
    found = gfimu.convert(plain, column_map=gfimu.load_map(None, [*TIME, *CHIP]))
    with pytest.raises(InputError, match="read already"):
        gfimu.convert(found, column_map=gfimu.load_map(None, ["drop=corrupt"]))
    with pytest.raises(InputError, match="read already"):
        gfimu.noise(found, column_map=gfimu.load_map(None, ["drop=corrupt"]))
