"""Recordings: files there and back, units, missing readings, and what a bad file is told."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gfimu import AccelerometerArray, InputError, Recording, UnitError
from gfimu.base import STANDARD_GRAVITY

CUBE = AccelerometerArray.load("cube12")
FORMATS = ("csv", "parquet")


def recording(n=50, seed=1, **reference):
    rng = np.random.default_rng(seed)
    return Recording.from_arrays(np.arange(n) / 100.0, rng.normal(size=(n, 12)), CUBE, reference=reference)


def write_text(folder, text, name="run.csv"):
    file = folder / name
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return file


def assert_equal(one: Recording, other: Recording):
    assert one.channels == other.channels
    np.testing.assert_array_equal(one.t_s, other.t_s)
    np.testing.assert_array_equal(one.readings, other.readings)
    assert one.reference.keys() == other.reference.keys()
    for name, values in one.reference.items():
        np.testing.assert_array_equal(values, other.reference[name])
    assert one.metadata == other.metadata
    assert one.extra.keys() == other.extra.keys()
    for name, values in one.extra.items():
        np.testing.assert_array_equal(values, other.extra[name])


readings_with_holes = st.floats(-1500.0, 1500.0) | st.just(np.nan)  # nothing that is left out as corrupt
json_values = st.none() | st.booleans() | st.integers(-(2**53), 2**53) | st.text() | st.lists(st.floats(-1e9, 1e9))
metadata_keys = st.from_regex(r"[A-Za-z][A-Za-z0-9_]{0,20}", fullmatch=True)


@st.composite
def recordings(draw):
    n = draw(st.integers(1, 40))
    steps = draw(arrays(float, n, elements=st.floats(1e-6, 10.0)))
    names = draw(st.sets(st.sampled_from(["tacho_rad_s", "command_rad_s", "angle_rad", "temperature_degC"])))
    return Recording(
        np.cumsum(steps),
        draw(arrays(float, (n, 12), elements=readings_with_holes)),
        CUBE.channels,
        {name: draw(arrays(float, n, elements=readings_with_holes)) for name in sorted(names)},
        draw(st.dictionaries(metadata_keys, json_values, max_size=4)),
        {"note_count": np.arange(n)},
    )


@pytest.mark.parametrize("suffix", FORMATS)
@given(original=recordings())
def test_file_there_and_back(tmp_path_factory, suffix, original):
    file = tmp_path_factory.mktemp("round") / f"run.{suffix}"
    original.write(file)
    assert_equal(original, Recording.read(file))
    assert_equal(original, Recording.read(file, array=CUBE))


@pytest.mark.parametrize("suffix", FORMATS)
def test_text_and_odd_names_are_kept(tmp_path, suffix):
    extra = {"note": np.array(["plain", 'with, comma and "quotes"', "a;b"], dtype=object), "serial, hex": np.arange(3)}
    original = replace(recording(3), extra=extra, metadata={"scenario": "12: spin", "mounting_rotvec_rad": np.ones(3)})
    original.write(tmp_path / f"run.{suffix}")
    back = Recording.read(tmp_path / f"run.{suffix}")
    assert back.extra["note"].tolist() == extra["note"].tolist()
    assert back.extra["serial, hex"].tolist() == [0, 1, 2]
    assert back.metadata == {"scenario": "12: spin", "mounting_rotvec_rad": [1.0, 1.0, 1.0]}


def test_columns_carry_their_units():
    columns = recording(3, tacho_rad_s=np.zeros(3)).to_columns()
    assert list(columns) == ["t_s", *(f"{channel}_m_s2" for channel in CUBE.channels), "tacho_rad_s"]


@pytest.mark.parametrize(
    ("column", "value", "expected"),
    [
        ("a11_m_s2", 2.0, 2.0),
        ("a11_g", 2.0, 2.0 * STANDARD_GRAVITY),
        ("a11_mg", 2.0, 0.002 * STANDARD_GRAVITY),
        ("a11_lsb", 2.0, 0.0078 * STANDARD_GRAVITY),
    ],
)
def test_reading_units(tmp_path, column, value, expected):
    file = write_text(tmp_path, f"t_s,{column}\n0,{value}\n0.01,{value}\n")
    assert Recording.read(file).readings[0, 0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("column", "value", "name", "expected"),
    [
        ("tacho_rpm", 60.0, "tacho_rad_s", 2 * np.pi),
        ("tacho_deg_s", 180.0, "tacho_rad_s", np.pi),
        ("command_deg_s", 90.0, "command_rad_s", np.pi / 2),
        ("angle_deg", 360.0, "angle_rad", 2 * np.pi),
        ("gyro_z_deg_s", -180.0, "gyro_z_rad_s", -np.pi),
        ("temperature_degC", 21.5, "temperature_degC", 21.5),
    ],
)
def test_reference_units(tmp_path, column, value, name, expected):
    file = write_text(tmp_path, f"t_s,a11_m_s2,{column}\n0,1,{value}\n1,1,\n")
    back = Recording.read(file).reference[name]
    assert back[0] == pytest.approx(expected, rel=1e-12)
    assert np.isnan(back[1])


def test_counts_use_the_size_in_the_metadata_then_the_part(tmp_path):
    counts = "t_s,m11_lsb\n0,2048\n1,-2048\n"
    assert Recording.read(write_text(tmp_path, f"# lsb_m_s2: 0.5\n{counts}")).readings[0, 0] == 1024.0
    by_part = Recording.read(write_text(tmp_path, f"# part: mpu9150\n{counts}"))
    np.testing.assert_allclose(by_part.readings[:, 0], [STANDARD_GRAVITY, -STANDARD_GRAVITY], rtol=1e-9)


def test_raw_counts_stay_counts_when_asked_for(tmp_path):
    file = write_text(tmp_path, "t_s,a11_lsb\n0,-5\n1,7\n")
    counts = Recording.read(file, unit="lsb")
    assert counts.readings[:, 0].tolist() == [-5.0, 7.0]
    with pytest.raises(UnitError, match="m/s² is needed"):
        counts.for_array(CUBE)
    counts.write(tmp_path / "again.csv")
    assert Recording.read(tmp_path / "again.csv", unit="lsb").readings[:, 0].tolist() == [-5.0, 7.0]
    with pytest.raises(UnitError, match="raw counts are needed"):
        Recording.read(write_text(tmp_path, "t_s,a11_g\n0,1\n"), unit="lsb")


def test_order_of_columns_does_not_matter(tmp_path):
    original = recording(20, tacho_rad_s=np.ones(20))
    original.write(tmp_path / "run.parquet")
    table = pq.read_table(tmp_path / "run.parquet")
    shuffled = np.random.default_rng(3).permutation(table.column_names).tolist()
    pq.write_table(table.select(shuffled), tmp_path / "shuffled.parquet")
    np.testing.assert_array_equal(
        Recording.read(tmp_path / "shuffled.parquet", array=CUBE).readings, original.for_array(CUBE)
    )


def test_line_ends_byte_order_mark_blank_lines_and_comments(tmp_path):
    plain = "# array: cube12\n# seed: 7\nt_s,a11_m_s2\n0,1.5\n1,-2\n"
    expected = Recording.read(write_text(tmp_path, plain))
    assert expected.metadata == {"array": "cube12", "seed": 7}
    variants = (
        plain.replace("\n", "\r\n"),
        plain.replace("\n", "\r"),
        "\ufeff" + plain,
        plain.replace("\nt_s", "\n\nt_s"),
        plain.replace("1,-2", "\n1,-2\n\n"),
        plain.removesuffix("\n"),
        plain.replace("t_s,a11_m_s2", ' t_s , "a11_m_s2" '),
    )
    for text in variants:
        assert_equal(Recording.read(write_text(tmp_path, text)), expected)


def test_parquet_metadata_of_other_writers(tmp_path):
    table = pa.table({"t_s": [0.0, 1.0], "a11_g": [1, 2]})
    table = table.replace_schema_metadata({"mounting_rotvec_rad": "[0.1, 0, 0]", "scenario": "spin up"})
    pq.write_table(table, tmp_path / "run.parquet")
    back = Recording.read(tmp_path / "run.parquet")
    assert back.mounting_rotvec.tolist() == [0.1, 0.0, 0.0]
    assert back.metadata["scenario"] == "spin up"


@pytest.mark.parametrize("value", ["[0, 1]", '"tilted"', "[0, 0, null]", "[[1, 2, 3]]"])
def test_bad_mounting(tmp_path, value):
    back = Recording.read(write_text(tmp_path, f"# mounting_rotvec_rad: {value}\nt_s,a11_g\n0,1\n"))
    with pytest.raises(InputError, match=r"mounting_rotvec_rad is .* three numbers"):
        _ = back.mounting_rotvec


def test_gaps_are_found_and_not_filled(tmp_path):
    whole = recording(100)
    keep = np.ones(100, dtype=bool)
    keep[[20, 21, 60]] = False
    original = replace(whole, t_s=whole.t_s[keep], readings=whole.readings[keep])
    original.write(tmp_path / "run.csv")
    back = Recording.read(tmp_path / "run.csv")
    assert len(back) == 97
    assert back.gaps.tolist() == [19, 57]
    assert back.sample_rate == pytest.approx(100.0)
    assert back.duration == pytest.approx(0.99)


def test_slices_are_views():
    whole = recording(100, tacho_rad_s=np.arange(100.0))
    part = whole.between(0.25, 0.5)
    assert part.t_s[[0, -1]].tolist() == [0.25, 0.49]
    assert part.reference["tacho_rad_s"][0] == 25.0
    assert np.shares_memory(part.readings, whole.readings)


def test_for_array_orders_and_names_what_is_missing():
    whole = recording(5)
    backwards = replace(whole, readings=whole.readings[:, ::-1], channels=whole.channels[::-1])
    np.testing.assert_array_equal(backwards.for_array(CUBE), whole.readings)
    with pytest.raises(InputError, match=r"lacks m11, .*name the array it was made with"):
        whole.for_array(AccelerometerArray.load("mimu4444"))


def test_shape_is_checked():
    with pytest.raises(InputError, match=r"shape \(3, 2\)"):
        Recording(np.arange(3.0), np.zeros((3, 2)), ("a11",))


HEADER = "t_s,a11_m_s2,a12_m_s2,tacho_rad_s\n"
BAD_CSV = {
    "missing time": ("a11_m_s2\n1\n", "column t_s is missing"),
    "time in ms": ("t_ms,a11_m_s2\n1,2\n", "'t_ms': unknown unit 'ms' .*valid: t_s"),
    "no readings": ("t_s,tacho_rad_s\n0,1\n", "no column holds a reading"),
    "wrong reading unit": ("t_s,a11_ft_s2\n0,1\n", "'a11_ft_s2': unknown unit 'ft_s2'; valid: a11_m_s2, a11_g"),
    "wrong tacho unit": ("t_s,a11_g,tacho_hz\n0,1,1\n", "'tacho_hz': unknown unit 'hz'; valid: tacho_rad_s"),
    "channel twice": ("t_s,a11_g,a11_mg\n0,1,1\n", "channel a11 appears as a11_g and a11_mg; keep one"),
    "column twice": ("t_s,a11_g,a11_g\n0,1,1\n", "column 'a11_g' appears twice"),
    "reference twice": ("t_s,a11_g,tacho_rpm,tacho_deg_s\n0,1,1,1\n", "tacho appears as tacho_rpm and tacho_deg_s"),
    "empty": ("", "empty file"),
    "header only": (HEADER, "no samples below the header"),
    "header only, no line end": (HEADER.strip(), "no samples below the header"),
    "comments only": ("# array: cube12\n", "no header line"),
    "binary": (bytes(range(256)) * 40, "binary data"),
    "nul bytes": (b"\x00" * 500, "binary data"),
    "junk below the header": (HEADER.encode() + bytes(range(256)), "binary data"),
    "semicolons": (HEADER.replace(",", ";") + "0;1;2;3\n", "not separated by commas"),
    "text in a number": (HEADER + "0,1,2,3\n1,1,abc,3\n", "line 3, column a12_m_s2: 'abc' is not a number"),
    "text in the time": (HEADER + "noon,1,2,3\n", "line 2, column t_s: 'noon'"),
    "text in the tacho": (HEADER + "0,1,2,fast\n", "line 2, column tacho_rad_s: 'fast'"),
    "decimal comma": (HEADER + '0,"1,5",2,3\n', "line 2, column a11_m_s2: '1,5'"),
    "cut-off line": (HEADER + "0,1,2,3\n1,1,2\n", "line 3 has 3 columns, the header 4"),
    "time backwards": (HEADER + "0,1,2,3\n1,1,2,3\n0.5,1,2,3\n", r"line 4: t_s does not increase \(1 s, then 0.5 s\)"),
    "time repeated": (HEADER + "0,1,2,3\n0,1,2,3\n", "line 3: t_s does not increase"),
    "time missing": (HEADER + "0,1,2,3\n,1,2,3\n", "line 3: t_s is missing"),
    "time nan": (HEADER + "0,1,2,3\nnan,1,2,3\n", "line 3: t_s is missing"),
    "time infinite": (HEADER + "0,1,2,3\ninf,1,2,3\n", "line 3: t_s is inf"),
    "infinite readings": (HEADER + "0,1,2,3\n1,-inf,inf,3\n2,inf,inf,3\n", "line 3, column a11_m_s2: -inf can't be a"),
    "huge readings": (HEADER + "0,1,1e300,3\n1,1e19,1e300,3\n", r"line 3, column a11_m_s2: 1e\+19 can't be a reading"),
    "bad size of a count": ("# lsb_m_s2: small\nt_s,a11_lsb\n0,1\n", "metadata lsb_m_s2 is 'small'"),
    "unknown part": ("# part: abc1\nt_s,a11_lsb\n0,1\n", "unknown part 'abc1'; valid: adxl345"),
}


@pytest.mark.parametrize(("text", "message"), BAD_CSV.values(), ids=BAD_CSV)
def test_bad_csv(tmp_path, text, message):
    file = write_text(tmp_path, text)
    with pytest.raises(InputError, match=message) as caught:
        Recording.read(file)
    assert "\n" not in str(caught.value)
    if "part" not in message:
        assert str(caught.value).startswith(str(file))


def test_fault_far_down_a_large_file_is_found(tmp_path):
    lines = [f"{k / 100},1,2,3\n" for k in range(300_000)]
    lines[250_000] = "1.0,1,2,3\n"
    with pytest.raises(InputError, match="line 250002: t_s does not increase"):
        Recording.read(write_text(tmp_path, HEADER + "".join(lines)))


def test_missing_channel_of_the_array(tmp_path):
    whole = recording(3)
    replace(whole, readings=whole.readings[:, :11], channels=whole.channels[:11]).write(tmp_path / "run.csv")
    with pytest.raises(InputError, match="column a43_m_s2 of array 'cube12' is missing"):
        Recording.read(tmp_path / "run.csv", array=CUBE)


def test_bad_parquet(tmp_path):
    file = tmp_path / "run.parquet"
    recording(5000).write(file)
    whole = file.read_bytes()
    for content in (whole[:-20], whole[: len(whole) // 2], b"PAR1", b"PAR1" + bytes(5000)):
        with pytest.raises(InputError, match="damaged Parquet file"):
            Recording.read(write_text(tmp_path, content, "cut.parquet"))
    for place in np.random.default_rng(2).integers(1000, len(whole) // 2, 20):
        flipped = bytearray(whole)
        flipped[place] ^= 0x40  # one bit, among digits that look like any other
        with pytest.raises(InputError, match="damaged Parquet file"):
            Recording.read(write_text(tmp_path, bytes(flipped), "flipped.parquet"))


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"t_s": [0.0, 1.0], "a11_g": ["1", "2"]}, "column a11_g holds string, not numbers"),
        ({"t_s": pa.array([0, 1], pa.timestamp("ns")), "a11_g": [1.0, 2.0]}, "column t_s holds timestamp"),
        ({"t_s": [0.0, None], "a11_g": [1.0, 2.0]}, "sample 2: t_s is missing"),
        ({"t_s": [1.0, 0.0], "a11_g": [1.0, 2.0]}, "sample 2: t_s does not increase"),
        ({"t_s": pa.array([], pa.float64()), "a11_g": pa.array([], pa.float64())}, "no samples"),
    ],
)
def test_bad_parquet_columns(tmp_path, columns, message):
    pq.write_table(pa.table(columns), tmp_path / "run.parquet")
    with pytest.raises(InputError, match=message):
        Recording.read(tmp_path / "run.parquet")


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        Recording.read(tmp_path / "nothing.csv")
    with pytest.raises(InputError, match="directory"):
        Recording.read(tmp_path)


@given(junk=st.binary(max_size=300))
def test_any_bytes_end_in_an_input_error(tmp_path_factory, junk):
    folder = tmp_path_factory.mktemp("junk")
    for head in (b"", b"PAR1", HEADER.encode()):
        file = write_text(folder, head + junk)
        try:
            Recording.read(file)
        except InputError as error:
            assert "\n" not in str(error)  # noqa: PT017


def test_write_is_whole_or_nothing(tmp_path):
    target = tmp_path / "run.parquet"
    recording(5).write(target)
    before = target.read_bytes()
    broken = replace(recording(5), extra={"mixed": np.array([1, "two", 3, 4, 5], dtype=object)})
    with pytest.raises(pa.ArrowException):
        broken.write(target)
    assert target.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["run.parquet"]


def test_write_refuses_other_formats_and_keys(tmp_path):
    with pytest.raises(InputError, match=r"unknown file format '\.xls'; use \.csv or .parquet"):
        recording(3).write(tmp_path / "run.xls")
    with pytest.raises(InputError, match="metadata key 'a:b'"):
        replace(recording(3), metadata={"a:b": 1}).write(tmp_path / "run.csv")
    assert not list(tmp_path.iterdir())


PEAK = """
import sys
from pathlib import Path
from gfimu import Recording
def peak():
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))
Recording.read(sys.argv[1])
before = peak()
run = Recording.read(sys.argv[2])
print(len(run), peak() - before)
"""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the peak memory is read from Linux's /proc")
@pytest.mark.parametrize("suffix", FORMATS)
def test_reading_holds_one_copy_of_the_data(tmp_path, suffix):
    n = 800_000
    small, large = tmp_path / f"small.{suffix}", tmp_path / f"large.{suffix}"
    whole = Recording.from_arrays(np.arange(n), np.random.default_rng(1).integers(-999, 999, (n, 12)), CUBE)
    whole.write(large)
    whole.slice(0, n // 10).write(small)
    if suffix == "parquet":  # as other writers leave it: one row group that is as large as the data
        for file in (small, large):
            pq.write_table(pq.read_table(file), file, row_group_size=n, compression="none", use_dictionary=False)
    command = [sys.executable, "-c", PEAK, str(small), str(large)]
    told = [subprocess.run(command, capture_output=True, text=True, check=True).stdout.split() for _ in range(2)]
    assert {int(samples) for samples, _ in told} == {n}
    data = n * 13 * 8 / 1024
    # The small file has warmed up the blocks of the reader; a second copy of the data would make it 2 or more. Threads
    # of the reader that happen to run at once add a little: the smaller of two readings.
    assert min(int(kilobytes) for _, kilobytes in told) < 1.6 * data
