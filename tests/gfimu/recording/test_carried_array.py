"""The array that a recording carries: there and back, own part files, damage, and recordings that only name it."""

import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray, InputError, Recording, SensorErrors
from gfimu.array import Part, PartLimits, white_noise_std
from gfimu.calibration import open_uncalibrated
from gfimu.recording import array_difference, open_run
from sim import DataSheet

CUBE = AccelerometerArray.load("cube12")
FORMATS = ("csv", "parquet")
PART = """name = "würfel-Chip"
lsb_m_s2 = 0.01
full_range_m_s2 = 400.0
noise_lsb_rms_100_hz = [2.0, 2.0, 3.0]
offset_std_m_s2 = [0.1, 0.1, 0.2]
range_g = [40]
"""


def own_array(folder, chips=2, part="my_chip.toml"):
    """Write an array file with its part file beside it, both the user's own; non-ASCII text on purpose."""
    folder.mkdir(exist_ok=True)
    (folder / "my_chip.toml").write_text(PART, encoding="utf-8")
    text = 'name = "Würfel \\"µ\\""\ndescription = "zwei\\nZeilen"\n'
    for number in range(1, chips + 1):
        text += (
            f'[[chip]]\nname = "arm{number}_"\npart = "{part}"\n'
            f"position_m = [{0.01 * number}, 0.02, {0.1 / 3}]\naxes = [[1,0,0],[0,1,0],[0,0,1]]\n"
        )
    file = folder / "own.toml"
    file.write_text(text, encoding="utf-8")
    return file


def recording(array, n=20, **metadata):
    readings = np.random.default_rng(0).normal(size=(n, array.n_channels))
    return Recording.from_arrays(np.arange(n) / 100.0, readings, array, metadata=metadata)


def same(one, other):
    return one.channels == other.channels and not array_difference(one, other) and one.part_files == other.part_files


@pytest.mark.parametrize("suffix", FORMATS)
def test_an_array_of_ones_own_is_in_the_recording(tmp_path, monkeypatch, suffix):
    file = own_array(tmp_path / "elsewhere")
    array = AccelerometerArray.load(file)
    run = tmp_path / f"run.{suffix}"
    recording(array).write(run)
    for path in file.parent.iterdir():
        path.unlink()
    monkeypatch.chdir(tmp_path)
    read, found = open_run(run)
    assert same(found, array)
    assert (found.name, found.description) == ('Würfel "µ"', "zwei\nZeilen")
    np.testing.assert_array_equal(found.positions, array.positions)  # exactly, to the last bit
    assert read.channels == array.channels == ("arm1_1", "arm1_2", "arm1_3", "arm2_1", "arm2_2", "arm2_3")
    assert same(read.array, array)
    np.testing.assert_allclose(white_noise_std(found, 100.0), [0.02, 0.02, 0.03] * 2)
    assert SensorErrors.from_parts(found, 100.0).full_range[0] == pytest.approx(399.99)
    assert Recording.read(run).channels == array.channels


def test_the_head_of_a_csv_file_holds_the_array_on_one_line(tmp_path):
    array = AccelerometerArray.load(own_array(tmp_path / "own"))
    recording(array).write(tmp_path / "run.csv")
    head = [line for line in (tmp_path / "run.csv").read_text(encoding="utf-8").splitlines() if line.startswith("#")]
    (line,) = [line for line in head if line.startswith("# array_toml: ")]
    assert tomllib.loads(json.loads(line.removeprefix("# array_toml: "))) == array.to_dict()
    (line,) = [line for line in head if line.startswith("# parts_toml: ")]
    assert json.loads(line.removeprefix("# parts_toml: ")) == {"my_chip.toml": PART}


def test_a_part_file_lies_beside_its_array_or_in_the_current_directory(tmp_path, monkeypatch):
    file = own_array(tmp_path / "own")
    monkeypatch.chdir(tmp_path)  # not where the part file is
    array = AccelerometerArray.load(file)
    assert Part.load(array.chips[0].part, array.part_files).lsb == 0.01
    assert PartLimits.of(array, 100.0).full_range[0] == 400.0
    (tmp_path / "own" / "my_chip.toml").rename(tmp_path / "my_chip.toml")
    assert AccelerometerArray.load(file).part_files == {"my_chip.toml": PART}
    (tmp_path / "my_chip.toml").unlink()
    with pytest.raises(InputError, match=r"my_chip\.toml: no such file; give a path or one of adxl345"):
        white_noise_std(AccelerometerArray.load(file), 100.0)


def test_two_part_files_of_one_name_stay_two(tmp_path):
    file = own_array(tmp_path / "own", part="my_chip.toml")
    (tmp_path / "own" / "b").mkdir()
    (tmp_path / "own" / "b" / "my_chip.toml").write_text(PART.replace("0.01", "0.02"), encoding="utf-8")
    text = file.read_text(encoding="utf-8")
    head, _, tail = text.rpartition('"my_chip.toml"')
    file.write_text(f'{head}"b/my_chip.toml"{tail}', encoding="utf-8")
    array = AccelerometerArray.load(file)
    assert [Part.load(chip.part, array.part_files).lsb for chip in array.chips] == [0.01, 0.02]


def test_counts_take_the_size_of_the_carried_part(tmp_path):
    array = AccelerometerArray.load(own_array(tmp_path / "own"))
    counts = replace(recording(array), readings=np.full((20, 6), 100.0), unit="lsb")
    counts.write(tmp_path / "run.csv")
    for path in (tmp_path / "own").iterdir():
        path.unlink()
    assert open_run(tmp_path / "run.csv")[0].readings[0, 0] == pytest.approx(1.0)
    assert Recording.read(tmp_path / "run.csv").readings[0, 0] == pytest.approx(1.0)


def test_the_text_holds_where_the_name_disagrees(tmp_path):
    run = recording(CUBE)
    replace(run, metadata={**run.metadata, "array": "cube12_as_built"}).write(tmp_path / "run.csv")
    read, found = open_run(tmp_path / "run.csv")
    assert read.metadata["array"] == "cube12_as_built"
    np.testing.assert_array_equal(found.axes, CUBE.axes)


@pytest.mark.parametrize("suffix", FORMATS)
def test_recordings_that_only_name_their_array(tmp_path, suffix):
    old = replace(recording(CUBE), metadata={"array": "cube12"})
    file = tmp_path / f"run.{suffix}"
    old.write(file)
    assert "array_toml" in Recording.read(file).metadata  # one of models/arrays is added when it is written
    unknown = replace(old, metadata={"array": "gone"})
    unknown.write(file)
    assert Recording.read(file).metadata == {"array": "gone"}
    with pytest.raises(InputError, match=rf"run\.{suffix}: names its array only, and unknown array 'gone'.*--array"):
        open_run(file)
    assert open_run(file, CUBE)[1] is CUBE
    file.with_name("shape.toml").write_text(CUBE.to_toml(), encoding="utf-8")
    replace(old, metadata={"array": "shape.toml"}).write(file)
    assert same(open_run(file)[1], CUBE)  # beside the recording


DAMAGE = {
    "cut off": CUBE.to_toml()[:-40],
    "not TOML": "name = ",
    "no text": 12,
    "no chips": 'name = "x"',
    "wrong chips": "chip = [1, 2]",
    "wrong unit": CUBE.to_toml().replace("length_unit_m = 0.05", "length_unit_m = []"),
}


@pytest.mark.parametrize("text", DAMAGE.values(), ids=DAMAGE)
@pytest.mark.parametrize("suffix", FORMATS)
def test_a_damaged_text_is_one_line_with_the_remedy(tmp_path, suffix, text):
    file = tmp_path / f"run.{suffix}"
    recording(CUBE, array_toml=text).write(file)
    with pytest.raises(
        InputError, match=r"metadata array_toml is damaged \(.*\); give the array with --array"
    ) as error:
        open_run(file)
    assert str(error.value).startswith(f"{file}: ")
    assert "\n" not in str(error.value)
    assert open_run(file, CUBE)[1] is CUBE
    assert Recording.read(file).channels == CUBE.channels  # the readings need no array
    with pytest.raises(InputError, match="damaged"):
        _ = Recording.read(file).array


def test_a_damaged_text_is_no_reason_to_guess_the_size_of_a_count(tmp_path):
    counts = replace(recording(CUBE, array_toml="name ="), readings=np.ones((20, 12)), unit="lsb")
    counts.write(tmp_path / "run.csv")
    with pytest.raises(InputError, match="array_toml is damaged"):
        Recording.read(tmp_path / "run.csv")
    assert open_uncalibrated(tmp_path / "run.csv").unit == "lsb"


def test_channels_that_do_not_match_the_carried_array(tmp_path):
    file = tmp_path / "run.csv"
    replace(recording(CUBE), channels=("a99", *CUBE.channels[1:])).write(file)
    with pytest.raises(InputError, match=r"column a99_m_s2 is no channel of the recording's own array 'cube12'"):
        open_run(file)
    fewer = replace(recording(CUBE), channels=CUBE.channels[1:], readings=np.zeros((20, 11)))
    fewer.write(file)
    with pytest.raises(InputError, match=r"column a11_m_s2 of array 'cube12' is missing"):
        open_run(file)


def test_an_extra_column_that_is_no_reading_is_kept(tmp_path):
    replace(recording(CUBE), extra={"b1_count": np.arange(20), "bar_Pa": np.arange(20)}).write(tmp_path / "run.csv")
    assert set(open_run(tmp_path / "run.csv")[0].extra) == {"b1_count", "bar_Pa"}


def test_what_differs_between_two_arrays():
    assert array_difference(CUBE, CUBE.relative_to([0, 0, 0])) == ""
    assert array_difference(CUBE, CUBE.relative_to([0, 0, 0.003])) == "positions by up to 3 mm"
    assert "axes by up to" in array_difference(CUBE, AccelerometerArray.load("cube12_as_built"))
    assert "m11" in array_difference(CUBE, AccelerometerArray.load("mimu4444"))


def test_the_documented_part_file_is_enough(project_root, tmp_path):
    text = (project_root / "docs" / "reference" / "recording-format.md").read_text(encoding="utf-8")
    block = text.split("## Part\n")[1].split("```toml\n")[1].split("```")[0]
    (tmp_path / "my_chip.toml").write_text(block, encoding="utf-8")
    array = AccelerometerArray.load(own_array(tmp_path / "own", part="../my_chip.toml"))
    assert DataSheet.load(array.chips[0].part, array.part_files).ranges_g == (2, 4, 8, 16)
    assert np.isfinite(SensorErrors.from_parts(array, 100.0).noise_std).all()
    for key in tomllib.loads(block).keys() - {"name", "range_g"}:
        left = "\n".join(line for line in block.splitlines() if not line.startswith(key))
        with pytest.raises(InputError, match=rf"part 'my_chip\.toml': key '{key}' is missing; add it"):
            SensorErrors.from_parts(replace(array, part_files={"my_chip.toml": left}), 100.0)
