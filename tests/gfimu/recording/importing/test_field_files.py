"""Raw files of rigs that nothing is known of: what `inspect` prints reads them, and says what it can't know."""

import io
import sys
import zipfile

import field_chips  # noqa: F401 - adds its cases
import field_files as field
import numpy as np
import pytest

import gfimu
from gfimu import GfimuError, InputError, RecordingWarning, load_map
from gfimu.recording import factor_of, inspect_file, mapped_recording

GYRO = ("gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s")


@pytest.mark.filterwarnings("ignore::gfimu.base.errors.RecordingWarning")
@pytest.mark.parametrize("name", field.CASES)
def test_the_map_that_is_printed_reads_the_file(name, tmp_path):
    (tmp_path / "raw").mkdir()
    case = field.CASES[name](tmp_path / "raw")
    found = inspect_file(case.path)
    (tmp_path / "m.toml").write_text(found.map_toml)
    recording = mapped_recording(case.path, load_map(tmp_path / "m.toml"))
    assert recording.t_s - recording.t_s[0] == pytest.approx(case.t - case.t[0], abs=2e-3 if not case.doubt else 1e-2)
    off = np.abs(recording.readings - np.column_stack(case.chips))
    assert np.isnan(off).mean() < 0.002
    assert np.nanquantile(off, 0.98) < case.force
    assert set(GYRO) <= set(recording.reference) if case.gyro is not None else not set(GYRO) & set(recording.reference)
    if case.gyro is not None:
        rates = np.column_stack([recording.reference[axis] for axis in GYRO])
        assert np.quantile(np.abs(rates - case.gyro), 0.98) < 0.01
    if case.tacho is not None:
        assert recording.reference["tacho_rad_s"] == pytest.approx(case.tacho, abs=1e-3)
    checks = [line for line in found.reasons if "(check this)" in line]
    assert any(case.doubt in line for line in checks) if case.doubt else not checks


def test_a_unit_in_a_name_that_gravity_belies_is_marked(tmp_path):
    t, force, rates = field.hand()
    path = field.rows(
        tmp_path / "run.csv",
        ["t,ax (g),ay (g),az (g),gx (rad/s),gy (rad/s),gz (rad/s)"],
        [t, *force.T, *np.degrees(rates).T],
    )
    reasons = " ".join(inspect_file(path).reasons)
    assert "which is not gravity (check this)" in reasons
    path = field.rows(
        tmp_path / "rad.csv", ["t,ax,ay,az,gx (rad/s),gy (rad/s),gz (rad/s)"], [t, *force.T, *np.degrees(rates).T]
    )
    assert any(
        "by the turn of gravity they are 0.017 times that, nearest to °/s (check this)" in one
        for one in inspect_file(path).reasons
    )


@pytest.mark.parametrize(
    "scale", [1.0, np.degrees(1.0), 1000 * np.degrees(1.0), 65.5 * np.degrees(1.0), 14.375 * np.degrees(1.0)]
)
def test_the_unit_of_a_gyro_follows_from_how_gravity_turns(tmp_path, scale):
    t, force, rates = field.hand()
    path = field.rows(tmp_path / "run.csv", ["t,ax,ay,az,gx,gy,gz"], [t, *force.T, *(scale * rates).T])
    spec = inspect_file(path).column_map.reference["gyro_x_rad_s"]
    assert spec.scale * factor_of(spec.unit, "rate") * scale == pytest.approx(1.0, rel=1e-3)


def test_a_map_keeps_the_digits_of_a_counter(tmp_path):
    assert "wrap = 4294967296.0" in inspect_file(field.CASES["millis_that_start_anew"](tmp_path).path).map_toml


def test_a_restart_is_refused_with_its_row_and_any_part_may_be_taken(tmp_path):
    path = field.CASES["a_restart"](tmp_path).path
    keys = ["time.column=millis", "time.unit=ms", "unit=m/s^2", "channels.a11=ax"]
    with pytest.raises(InputError, match=r"starts anew in row 1001 .*2 parts of 1000, 600 rows; time\.part = 1"):
        gfimu.convert(path, column_map=gfimu.load_map(None, keys))
    with pytest.raises(InputError, match="the clock starts 2 times"):
        gfimu.convert(path, column_map=gfimu.load_map(None, [*keys, "time.part=3"]))
    with pytest.warns(RecordingWarning, match="took part 2 of 2, 600 of 1600 rows"):
        second = gfimu.convert(path, column_map=gfimu.load_map(None, [*keys, "time.part=2"]))
    assert len(second) == 600
    assert second.t_s[-1] == pytest.approx(5.99)


def test_a_column_to_split_by_is_checked(tmp_path):
    path = field.CASES["a_row_per_chip"](tmp_path).path
    keys = ["time.column=time", "unit=m/s^2", "channels.a11=x"]
    with pytest.raises(InputError, match="no column 'chip' to split by; the file has 'time', 'sensor'"):
        gfimu.convert(path, column_map=gfimu.load_map(None, [*keys, "split_by=chip"]))
    with pytest.raises(InputError, match="would make"):
        gfimu.convert(path, column_map=gfimu.load_map(None, [*keys, "split_by=x"]))
    with pytest.raises(InputError, match="no table 'sensor=9'; it has 'sensor=1'"):
        gfimu.convert(
            path,
            column_map=gfimu.load_map(
                None, [*keys, "split_by=sensor", 'channels.a21={column="x", unit="g", table="sensor=9"}']
            ),
        )


def test_rounded_times_leave_their_column_without_a_role_of_its_own(tmp_path):
    found = inspect_file(field.CASES["whole_seconds"](tmp_path).path)
    assert found.columns[0].role == "time or counter"
    assert found.sample_rate_hz == pytest.approx(100.0)


def test_a_rate_that_only_holds_the_place_is_not_reported(tmp_path):
    assert np.isnan(inspect_file(field.CASES["no_times_at_all"](tmp_path).path).sample_rate_hz)


def test_a_workbook_is_read_or_the_remedy_said(tmp_path, monkeypatch):
    (tmp_path / "book.xlsx").write_bytes(_workbook())
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    with pytest.raises(GfimuError, match=r"needs openpyxl.*gfimu\[formats\].*save the sheet as CSV"):
        inspect_file(tmp_path / "book.xlsx")


def test_sheets_of_a_workbook_are_tables(tmp_path):
    openpyxl = pytest.importorskip("openpyxl", reason="openpyxl is not installed (gfimu[formats])")
    t, force, _ = field.hand(seconds=12.0)
    book = openpyxl.Workbook()
    book.active.append(["remarks"])
    sheet = book.create_sheet("run")
    sheet.append(["Time (s)", "ax (m/s^2)", "ay (m/s^2)", "az (m/s^2)"])
    for row in np.column_stack([t, force]).tolist():
        sheet.append(row)
    book.save(tmp_path / "run.xlsx")
    found = inspect_file(tmp_path / "run.xlsx")
    assert mapped_recording(tmp_path / "run.xlsx", found.column_map).readings == pytest.approx(force)


def _workbook():
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("xl/workbook.xml", "<workbook/>")
    return stream.getvalue()


def board_of_numbered_columns(path, *, tilted=1.0):
    """A file of two chips whose six columns are numbered on; the second one's z axis is scaled by ``tilted``."""
    t = np.arange(1000) / 100.0
    noise = np.random.default_rng(3).normal(0.0, 0.003, (len(t), 6))
    columns = noise + np.array([0.0, 0.0, 1.0, 0.0, 0.0, tilted])
    return field.rows(
        path, ["tick," + ",".join(f"CH{k}(g)" for k in range(9, 15)) + ",spd"], [t, *columns.T, 10.0 * np.sin(t)]
    )


def test_columns_that_are_numbered_on_over_the_chips_are_all_taken(tmp_path):
    found = inspect_file(board_of_numbered_columns(tmp_path / "board.csv"))
    assert found.chips == 2
    assert {key: one.column for key, one in found.column_map.channels.items()} == {
        f"a{chip}{axis}": f"CH{5 + 3 * chip + axis}(g)" for chip in (1, 2) for axis in (1, 2, 3)
    }


def test_numbered_columns_without_gravity_in_each_three_are_no_chips(tmp_path):
    found = inspect_file(board_of_numbered_columns(tmp_path / "board.csv", tilted=0.2))
    assert found.column_map is None or "a23" not in found.column_map.channels


def test_a_column_that_may_be_a_reference_is_pointed_out(tmp_path):
    reasons = inspect_file(board_of_numbered_columns(tmp_path / "board.csv")).reasons
    assert any(line.startswith("spd: not used; ") and 'tacho_rad_s = { column = "spd"' in line for line in reasons)


def test_a_name_that_the_numbers_contradict_is_marked(tmp_path):
    t, force, rates = field.hand()
    head = "time_s,gyro_x,gyro_y,gyro_z,wx,wy,wz"
    path = field.rows(tmp_path / "exchanged.csv", [head], [t, *(force / 9.80665).T, *rates.T])
    found = inspect_file(path)
    [reason] = [line for line in found.reasons if line.startswith("chip a1")]
    assert "gravity in g; its name is that of a rate, its numbers are not (check this)" in reason
    assert found.column_map.channels["a11"].column == "gyro_x"
