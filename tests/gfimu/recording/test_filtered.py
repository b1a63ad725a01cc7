"""Rows left out on request: counted, reported, and the others as they were; nothing else is left out."""

import warnings

import numpy as np
import pytest

import gfimu
from gfimu import AccelerometerArray, InputError, MappedFile, Recording, RecordingWarning
from gfimu.recording import increasing_times, mapped_recording, open_run

CUBE = AccelerometerArray.load("cube12")
N = 500


@pytest.fixture
def clean():
    rng = np.random.default_rng(3)
    readings = rng.normal(0, 0.03, (N, 12)) + CUBE.axes @ [0.0, 0.0, 9.81]
    reference = {"tacho_rad_s": rng.normal(0, 0.01, N)}
    return Recording.from_arrays(np.arange(N) / 100.0, readings, CUBE, reference=reference)


def written(clean, path, rows, cells=()):
    """Write rows of a recording in this order, with cells (place, column, text) replaced."""
    clean.write(path)
    lines = path.read_text().splitlines()
    head = next(place for place, line in enumerate(lines) if line.startswith("t_s"))
    names, data = lines[head].split(","), [lines[head + 1 + row].split(",") for row in rows]
    for place, name, text in cells:
        data[place][names.index(name)] = text
    path.write_text("\n".join([*lines[: head + 1], *(",".join(row) for row in data)]) + "\n")
    return path


ALL = range(N)
TWICE = [*range(200), *range(190, 200), *range(200, N)]
TURNED = [*range(200), 202, 200, 201, *range(203, N)]
CASES = {
    "corrupt": (ALL, [(50, "a12_m_s2", "1e19"), (60, "a12_m_s2", "-inf"), (60, "a43_m_s2", "1e9")], {50, 60}),
    "missing": (ALL, [(k, "a21_m_s2", "nan") for k in range(70, 90)], set(range(70, 90))),
    "out_of_range": (ALL, [(80, "a31_m_s2", "200"), (81, "a31_m_s2", "-200"), (82, "a31_m_s2", "156")], {80, 81}),
    "duplicates": (TWICE, [], set()),
    "unordered": (TURNED, [], {202}),
    "untimed": (ALL, [(90, "t_s", ""), (91, "t_s", "1e19")], {90, 91}),
}


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
@pytest.mark.parametrize("kind", CASES)
def test_rows_are_left_out_counted_and_said(clean, tmp_path, kind, suffix):
    rows, cells, gone = CASES[kind]
    path = written(clean, tmp_path / "run.csv", rows, cells)
    if suffix == "parquet":
        pa_csv, pq = pytest.importorskip("pyarrow.csv"), pytest.importorskip("pyarrow.parquet")
        text = path.read_text().splitlines(keepends=True)
        path.write_text("".join(line for line in text if line[0] != "#"))
        pq.write_table(pa_csv.read_csv(path), tmp_path / "run.parquet")
        path = tmp_path / "run.parquet"
    with pytest.warns(RecordingWarning, match="left out") as caught:
        found = gfimu.convert(path, drop="unordered" if kind == "untimed" else kind, array=CUBE)
    kept = [row for row in ALL if row not in gone]
    count = 10 if kind == "duplicates" else len(gone)
    assert found.t_s == pytest.approx(clean.t_s[kept])
    assert np.array_equal(found.reference["tacho_rad_s"], clean.reference["tacho_rad_s"][kept])
    untouched = [column for column in range(12) if not cells or column not in (1, 3, 6)]
    assert np.array_equal(found.readings[:, untouched], clean.readings[kept][:, untouched])
    assert found.dropped == {kind: count}
    assert any(f"left out {count} rows" in str(one.message) for one in caught)


def test_what_is_not_asked_for_stays(clean, tmp_path):
    path = written(clean, tmp_path / "run.csv", ALL, [(70, "a21_m_s2", "nan"), (71, "a31_m_s2", "200")])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = gfimu.convert(path, drop="duplicates")
    assert len(found) == N
    assert found.dropped == {}
    for rows, kind in ((TWICE, "corrupt"), (TURNED, "missing")):
        with pytest.raises(InputError, match=r"does not increase.*--drop duplicates,unordered"):
            gfimu.convert(written(clean, tmp_path / "run.csv", rows), drop=kind)


def test_kinds_together_and_again(clean, tmp_path):
    cells = [(50, "a12_m_s2", "1e19"), (70, "a21_m_s2", "")]
    path = written(clean, tmp_path / "run.csv", TWICE, cells)
    with pytest.warns(RecordingWarning):
        gfimu.convert(path, tmp_path / "again.csv", drop=("corrupt", "missing", "duplicates"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        again = Recording.read(tmp_path / "again.csv")
    assert again.dropped == {"corrupt": 1, "missing": 1, "duplicates": 10}
    assert len(again) == N - 2


def test_a_file_whose_rows_are_all_written_twice(clean, tmp_path):
    path = written(clean, tmp_path / "run.csv", [row for row in ALL for _ in range(2)])
    with pytest.warns(RecordingWarning, match="left out 500 rows"):
        assert np.array_equal(gfimu.convert(path, drop="duplicates").readings, clean.readings)


@pytest.mark.parametrize(
    ("name", "options"),
    [("estimate", {}), ("noise", {}), ("check", {"twin": "cube12_turntable"}), ("convert", {})],
)
def test_other_commands_leave_out_by_the_map(clean, tmp_path, name, options):
    path = written(clean, tmp_path / "run.csv", TWICE)
    with pytest.raises(InputError, match="does not increase"):
        getattr(gfimu, name)(path, **options)
    with pytest.warns(RecordingWarning, match="left out 10 rows"):
        getattr(gfimu, name)(path, column_map=gfimu.load_map(None, ["drop=duplicates"]), **options)


def test_raw_counts_stay_counts(clean, tmp_path):
    clean.write(tmp_path / "run.csv")
    path = tmp_path / "raw.csv"
    path.write_text((tmp_path / "run.csv").read_text().replace("_m_s2", "_lsb"))
    from gfimu import load_map
    from gfimu.calibration import open_uncalibrated

    raw = open_uncalibrated(MappedFile(path, load_map(None, ["time.start_s=1"])))
    assert raw.unit == "lsb"
    assert np.array_equal(raw.readings, clean.readings[100:])


def test_a_foreign_file_and_a_table_are_filtered_as_well(clean, tmp_path):
    import pyarrow as pa

    columns = {name: clean.readings[:, place].copy() for place, name in enumerate(clean.channels)}
    columns["a12"][50], columns["a13"][60] = 1e19, np.nan
    table = pa.table({"time": clean.t_s, **columns})
    names = [f"channels.{name}={name}" for name in clean.channels]
    from gfimu import load_map

    chosen = load_map(None, ["time.column=time", "unit=m/s^2", *names, "drop=corrupt,missing"])
    with pytest.warns(RecordingWarning):
        found = mapped_recording(table, chosen, array=CUBE)
    assert found.dropped == {"corrupt": 1, "missing": 1}
    assert np.array_equal(found.readings, np.delete(clean.readings, [50, 60], axis=0))


def test_a_dead_channel_is_named_where_no_row_is_left(clean, tmp_path):
    path = written(clean, tmp_path / "run.csv", ALL, [(k, "a21_m_s2", "") for k in ALL])
    with pytest.warns(RecordingWarning), pytest.raises(InputError, match="channel a21 has no value at all"):
        gfimu.convert(path, drop="missing")


def test_a_range_that_is_not_known_is_said(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("t_s,a11_m_s2\n" + "".join(f"{k / 100},{k % 7}\n" for k in range(20)))
    with pytest.raises(InputError, match="--array"):
        gfimu.convert(path, drop="out_of_range")


def test_the_array_of_a_filtered_recording_is_its_own(clean, tmp_path):
    from gfimu import load_map

    path = written(clean, tmp_path / "run.csv", TWICE)
    with pytest.warns(RecordingWarning):
        assert open_run(MappedFile(path, load_map(None, ["drop=duplicates"])))[1].name == "cube12"


def test_as_few_rows_as_possible_are_left_out():
    """One wild time costs one row, not all after it."""
    t = np.arange(50.0)
    t[10], t[20], t[49] = 1e6, -5.0, 1e13
    with pytest.raises(InputError, match="times do not increase"):
        increasing_times(t, 0.0, "run.csv: column t")
    found = increasing_times(t, 0.0, "run.csv: column t", drop=("unordered",))
    assert np.flatnonzero(~found.rows).tolist() == [10, 20, 49]
    assert found.dropped == {"unordered": 2, "untimed": 1}
    repeated = increasing_times(np.array([0.0, 1.0, 1.0, 2.0, 3.0]), 0.0, "x: column t")
    assert np.flatnonzero(~repeated.rows).tolist() == [2]
    assert repeated.dropped == {"duplicates": 1}
