"""Tables of every kind: what each reader takes from a file, what it states about the samples, and what it refuses."""

import bz2
import gzip
import json
import lzma
import pickle

import numpy as np
import pyarrow as pa
import pytest

import gfimu
from gfimu import InputError
from gfimu.recording import read_foreign

N = 60
T = np.arange(N) / 50.0
FORCE = np.column_stack([0.6 * np.sin(5 * T), 0.8 * np.cos(4 * T), 9.8 + 0.1 * np.sin(9 * T)])
ROWS = [f"{t:.3f},{x:.6f},{y:.6f},{z:.6f}" for t, (x, y, z) in zip(T, FORCE, strict=True)]


def only(path):
    (table,) = read_foreign(path).tables.values()
    return table


def values(table):
    return np.column_stack([table.numbers(name) for name in table.columns])


def test_a_matrix_alone_has_columns_without_names_and_lies_either_way(tmp_path):
    matrix = np.column_stack([T, FORCE])
    for name, content in (("up.npy", matrix), ("flat.npy", matrix.T)):
        np.save(tmp_path / name, content)
        table = only(tmp_path / name)
        assert (table.named, len(table), next(iter(table.columns))) == (False, N, "column_1")
        assert np.array_equal(values(table), matrix)


def test_a_matrix_beside_others_has_their_names(tmp_path):
    np.savez(tmp_path / "run.npz", t=T, acc=FORCE)
    table = only(tmp_path / "run.npz")
    assert (table.named, list(table.columns)) == (True, ["t", "acc_1", "acc_2", "acc_3"])


@pytest.mark.parametrize("name", ["Fs", "fs", "sampling_rate", "sample_rate_hz", "SampleRate", "sampling_frequency"])
def test_a_rate_beside_the_samples_is_that_of_the_recording(tmp_path, name):
    from scipy.io import savemat

    h5py = pytest.importorskip("h5py")
    savemat(tmp_path / "run.mat", {"acc": FORCE, name: 128.5})
    np.savez(tmp_path / "run.npz", acc=FORCE, **{name: 128.5})
    (tmp_path / "run.json").write_text(json.dumps({"meta": {name: 128.5}, "acc": FORCE.tolist()}))
    for number in range(3):
        with h5py.File(tmp_path / f"run{number}.h5", "w") as file:
            data = file.create_dataset("imu/acc", data=FORCE)
            (file, file["imu"], data)[number].attrs[name] = 128.5
    for path in sorted(tmp_path.iterdir()):
        assert gfimu.inspect(path).sample_rate_hz == pytest.approx(128.5), path.name


def test_a_struct_array_of_matlab_has_a_row_per_element(tmp_path):
    from scipy.io import savemat

    kind = [("t", object), ("acc", object)]
    records = np.array([(t, force) for t, force in zip(T, FORCE, strict=True)], dtype=kind)
    savemat(tmp_path / "run.mat", {"s": records, "chips": {"x": FORCE[:, 0]}})
    table = next(iter(read_foreign(tmp_path / "run.mat").tables.values()))
    assert np.array_equal(table.columns["s.t"], T)
    assert np.array_equal(table.columns["chips.x"], FORCE[:, 0])


def test_text_of_matlab_in_hdf5_is_no_column(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "run.mat", "w") as file:
        file["acc"] = FORCE
        word = file.create_dataset("unit", data=np.arange(N, dtype="u2"))
        word.attrs["MATLAB_class"] = np.bytes_("char")
    assert not any(name.startswith("unit") for name in only(tmp_path / "run.mat").columns)


def test_arrow_files_are_read_packed_or_not(tmp_path):
    from pyarrow.feather import write_feather

    columns = pa.table({"t": T, "x": FORCE[:, 0], "n": np.arange(N)})
    for packing in ("uncompressed", "lz4", "zstd"):
        write_feather(columns, str(tmp_path / packing), compression=packing)
        table = only(tmp_path / packing)
        assert np.array_equal(table.columns["t"], T)
        assert table.columns["n"].dtype == np.int64


@pytest.mark.parametrize("pack", [gzip.compress, bz2.compress, lzma.compress])
def test_packed_text_and_json_are_read(tmp_path, pack):
    (tmp_path / "run.csv.packed").write_bytes(pack("\n".join(["t,x,y,z", *ROWS]).encode()))
    (tmp_path / "run.json.packed").write_bytes(pack(json.dumps([{"t": t} for t in T.tolist()]).encode()))
    assert np.allclose(values(only(tmp_path / "run.csv.packed"))[:, 1:], FORCE, atol=1e-6)
    assert np.array_equal(only(tmp_path / "run.json.packed").columns["t"], T)
    words = " ".join(map(str, np.random.default_rng(0).integers(0, 10**9, 9000)))
    (tmp_path / "cut").write_bytes(pack(words.encode())[:-2000])
    with pytest.raises(InputError, match=r"damaged (gzip|bzip2|xz) file \(cut off\); copy it again"):
        read_foreign(tmp_path / "cut")


REFUSED = {
    "an Excel 97 workbook; save it as .xlsx or .csv": bytes.fromhex("d0cf11e0a1b11ae1") + bytes(500),
    "a LabVIEW TDMS file; export it as .lvm or .csv": b"TDSm" + bytes(500),
    "a Python pickle, which could run code": pickle.dumps({"acc": FORCE}),
    "a Git LFS pointer of a file of 1360251 bytes; fetch it with git lfs pull": (
        b"version https://git-lfs.github.com/spec/v1\noid sha256:" + b"0123456789abcdef" * 4 + b"\nsize 1360251\n"
    ),
    "a packed parquet file; unpack it": gzip.compress(b"PAR1" + bytes(100)),
    "Object arrays cannot be loaded": None,  # NumPy's own words
}


@pytest.mark.parametrize("words", REFUSED)
def test_what_is_not_read_is_named_with_the_remedy(tmp_path, words):
    if REFUSED[words] is None:
        np.save(tmp_path / "run.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
        (tmp_path / "run.npy").rename(tmp_path / "run")
    else:
        (tmp_path / "run").write_bytes(REFUSED[words])
    with pytest.raises(InputError) as error:
        gfimu.inspect(tmp_path / "run")
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_every_reader_names_a_git_lfs_pointer(tmp_path):
    words = "a Git LFS pointer of a file of 1360251 bytes"
    (tmp_path / "run.csv").write_bytes(REFUSED[f"{words}; fetch it with git lfs pull"])
    for read in (gfimu.Recording.read, gfimu.convert, gfimu.AccelerometerArray.load):
        with pytest.raises(InputError, match=words):
            read(tmp_path / "run.csv")


def test_an_opendocument_spreadsheet_is_named(tmp_path):
    import zipfile

    with zipfile.ZipFile(tmp_path / "run.ods", "w") as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr("content.xml", "<x/>")
    with pytest.raises(InputError, match=r"an OpenDocument spreadsheet; save it as \.xlsx or \.csv"):
        gfimu.inspect(tmp_path / "run.ods")


def test_the_lines_after_the_numbers_are_no_samples_and_say_what_was_lost(tmp_path):
    last = ["Mean,0.1,0.2,9.8", "Rate 1344, overflows 3", "", "# end"]
    (tmp_path / "run.csv").write_text("\n".join(["t,x,y,z", *ROWS, *last]) + "\n")
    table = only(tmp_path / "run.csv")
    assert len(table) == N
    assert [line for line in last if line] == list(table.preamble[-3:])
    assert [note for note in table.notes if "'overflows 3', so samples were lost" in note]
    (tmp_path / "none.csv").write_text("\n".join(["t,x,y,z", *ROWS, "Rate 1344, overflows 0"]) + "\n")
    assert not only(tmp_path / "none.csv").notes


def test_a_last_row_of_numbers_stays_and_one_that_was_cut_off_is_counted(tmp_path):
    (tmp_path / "run.csv").write_text("\n".join(["t,x,y,z", *ROWS, "7.0,nan,1.0,2.0"]))
    assert len(only(tmp_path / "run.csv")) == N + 1
    (tmp_path / "cut.csv").write_text("\n".join(["t,x,y,z", *ROWS, "7.0,1.0"]))
    assert any("left out 1 lines" in note for note in only(tmp_path / "cut.csv").notes)


@pytest.mark.parametrize(("count", "is_flat"), [(19, False), (20, True)])
def test_lines_that_begin_with_a_name_are_columns_where_they_are_long(tmp_path, count, is_flat):
    series = dict(zip(("t", "ax", "ay", "az"), np.column_stack([T, FORCE])[:count].T, strict=True))
    lines = [f"{name};{';'.join(f'{one:.4f}' for one in column)}" for name, column in series.items()]
    (tmp_path / "series.csv").write_text("\n".join(["recorded in May", *lines]))
    table = only(tmp_path / "series.csv")
    if not is_flat:
        assert len(table) == 4
        return
    assert list(table.columns) == ["t", "ax", "ay", "az"]
    assert np.allclose(values(table), np.column_stack([T, FORCE])[:count], atol=1e-4)
    assert "# recorded in May" in table.preamble


def test_a_short_table_of_many_columns_with_names_stays_as_it_is(tmp_path):
    names = ",".join(f"c{k}" for k in range(48))
    rows = [",".join(f"{0.1 * k + row:.3f}" for k in range(48)) for row in range(6)]
    (tmp_path / "poses.csv").write_text("\n".join([names, *rows]))
    assert (len(only(tmp_path / "poses.csv")), len(only(tmp_path / "poses.csv").columns)) == (6, 48)


def test_a_labview_file_of_several_segments_has_all_rows_units_and_its_rate(tmp_path):
    lines = ["LabVIEW Measurement\t", "Separator\tTab", "***End_of_Header***\t"]
    for part in (FORCE[:30], FORCE[30:]):
        lines += [
            "Channels\t3",
            "Samples\t30\t30\t30",
            "Y_Unit_Label\tg\tg\tg",
            "X0\t0\t0\t0",
            "Delta_X\t0.02\t0.02\t0.02",
        ]
        lines += ["***End_of_Header***", "X_Value\tax\tay\taz\tComment"]
        lines += ["\t" + "\t".join(f"{one:.6f}" for one in row) + "\t" for row in part] + [""]
    (tmp_path / "run.lvm").write_text("\n".join(lines))
    table = only(tmp_path / "run.lvm")
    assert list(table.columns) == ["ax [g]", "ay [g]", "az [g]"]
    assert np.allclose(values(table), FORCE, atol=1e-6)
    assert "# sample rate 50 Hz" in table.preamble


LOGS = {
    "I ({ms}) IMU: {x:.4f}, {y:.4f}, {z:.4f}": True,
    "[INFO] [{s:.3f}] [imu_node]: {x:.4f} {y:.4f} {z:.4f}": True,
    "2024-05-17 10:25:{clock} - imu - INFO - {x:.4f},{y:.4f},{z:.4f}": True,
    "[INFO] imu: {x:.4f} {y:.4f} {z:.4f}": False,
}


@pytest.mark.parametrize("form", LOGS)
def test_what_a_log_puts_before_the_numbers_goes_but_its_time_stays(tmp_path, form):
    lines = [
        form.format(ms=round(5000 + 1000 * t), s=17.0 + t, clock=f"{10 + t:06.3f}".replace(".", ","), x=x, y=y, z=z)
        for t, (x, y, z) in zip(T, FORCE, strict=True)
    ]
    (tmp_path / "run.log").write_text("\n".join(["[INFO] started", *lines]))
    table = only(tmp_path / "run.log")
    assert len(table.columns) == 3 + LOGS[form]
    assert np.allclose(values(table)[:, -3:], FORCE, atol=1e-4)


def test_lines_of_two_sensors_in_turn_are_rows_of_both(tmp_path):
    made = []
    for x, y, z in FORCE:
        made += [f"acc: {x:.4f} {y:.4f} {z:.4f}", f"gyro: {-x:.4f} {-y:.4f} {-z:.4f}"]
    (tmp_path / "run.log").write_text("\n".join(made))
    table = only(tmp_path / "run.log")
    assert list(table.columns) == ["acc X", "acc Y", "acc Z", "gyro X", "gyro Y", "gyro Z"]
    assert np.allclose(values(table), np.column_stack([FORCE, -FORCE]), atol=1e-4)


def test_dates_with_times_between_tabs_are_one_cell(tmp_path):
    rows = [f"2024-05-17 10:25:{10 + t:06.3f}\tnode\t{x:.4f}\t{y:.4f}" for t, (x, y, _) in zip(T, FORCE, strict=True)]
    (tmp_path / "run.txt").write_text("\n".join(["Time\tName\tx\ty", *rows]))
    assert list(only(tmp_path / "run.txt").columns) == ["Time", "Name", "x", "y"]


def test_names_of_rows_shift_no_column(tmp_path):
    rows = [f'"{k}" {t:.3f} {x:.4f}' for k, (t, x) in enumerate(zip(T, FORCE[:, 0], strict=True), start=1)]
    (tmp_path / "frame.txt").write_text("\n".join(['"t" "ax"', *rows]))
    table = only(tmp_path / "frame.txt")
    assert np.allclose(table.numbers("ax"), FORCE[:, 0], atol=1e-4)


def test_a_recording_in_json_is_converted_by_the_map_that_inspect_prints(tmp_path):
    records = [
        {"t": t, "acc": {"x": x, "y": y, "z": z}} for t, (x, y, z) in zip(T.tolist(), FORCE.tolist(), strict=True)
    ]
    lists = {"data": {"t": T.tolist(), **{f"a{axis}": FORCE[:, k].tolist() for k, axis in enumerate("xyz")}}}
    rows = {"payload": {"interval_ms": 20, "values": np.column_stack([T, FORCE]).tolist()}}
    contents = {"objects.json": json.dumps(records), "lists.json": json.dumps(lists), "rows.json": json.dumps(rows)}
    contents["lines.json"] = "\n".join(map(json.dumps, records))
    for name, content in contents.items():
        (tmp_path / name).write_text(content)
        found = gfimu.inspect(tmp_path / name, out=tmp_path / "map.toml")
        recording = gfimu.convert(tmp_path / name, tmp_path / "run.csv", column_map=tmp_path / "map.toml")
        assert found.chips == 1, name
        assert np.allclose(recording.readings, FORCE, atol=1e-9), name


@pytest.mark.parametrize("step", ["0", "1E-999", "1.2.3", "", "-0.02"])
def test_a_labview_file_without_a_period_states_no_rate(tmp_path, step):
    lines = ["LabVIEW Measurement", "***End_of_Header***", f"Delta_X\t{step}", "***End_of_Header***", "X_Value\tax"]
    (tmp_path / "run.lvm").write_text(
        "\n".join([*lines, *(f"{t:.3f}\t{x:.4f}" for t, x in zip(T, FORCE[:, 0], strict=True))])
    )
    assert not any("sample rate" in line for line in only(tmp_path / "run.lvm").preamble)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_labview_file_without_rows_is_one_line(tmp_path, count):
    (tmp_path / "run.lvm").write_text("LabVIEW Measurement\n" + "***End_of_Header***" * count)
    with pytest.raises(InputError, match="no line holds numbers"):
        read_foreign(tmp_path / "run.lvm")


def test_a_map_that_was_made_for_json_reads_json_and_a_calibration_needs_none(tmp_path):
    (tmp_path / "cal.json").write_text("{}")
    with pytest.raises(InputError, match="not a calibration file"):
        gfimu.convert(tmp_path / "cal.json")
