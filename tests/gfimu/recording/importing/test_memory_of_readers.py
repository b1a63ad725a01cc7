"""Every reader states the memory that it needs and refuses what is beyond the limit, before it takes that memory."""

from __future__ import annotations

import gzip
import lzma
import sys
import zipfile
import zlib
from pathlib import Path

import foreign_files as foreign
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import gfimu
from gfimu import InputError, read_mimu4444
from gfimu.base import MemoryLimit, MemoryLimitError, with_memory
from gfimu.recording import Recording, read_foreign

LIMIT = "20MB"
ENOUGH = "600MB"
GROWTH_MB = 45.0  # by which the process may grow where a file is refused: the limit, and what is loaded to look at it


def constant_parquet(path: Path) -> None:
    rows = 1_000_000
    zeros = {name: np.zeros(rows) for name in ("a11_m_s2", "a12_m_s2", "a13_m_s2")}
    pq.write_table(pa.table({"t_s": np.arange(float(rows)), **zeros}), path)


def repeated_word(path: Path) -> None:
    words = pa.DictionaryArray.from_arrays(pa.array(np.zeros(200, np.int32)), ["x" * 3_000_000])
    pq.write_table(pa.table({"t_s": np.arange(200.0), "a11_m_s2": np.zeros(200), "note": words}), path)


def words_in_tables(path: Path) -> None:
    words = pa.array(["x" * 10_000] * 3000)
    pq.write_table(pa.table({"t_s": np.arange(3000.0), "a": pa.StructArray.from_arrays([words], ["note"])}), path)


def unwritten_hdf5(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.create_dataset("a", shape=(4, 2_000_000), chunks=(1, 1000), dtype="f8", fillvalue=1.0)


def wide_chunk(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.create_dataset("a", shape=(10,), maxshape=(None,), chunks=(8_000_000,), dtype="f8", compression="gzip")


def packed_matlab(path: Path) -> None:
    from scipy.io import savemat

    savemat(path, {"a": {"b": np.zeros((1_000_000, 4))}}, do_compression=True)


def packed_text(path: Path) -> None:
    path.write_bytes(gzip.compress(b"t,ax,ay,az\n" + b"0.0,0.0,0.0,9.8\n" * 1_000_000))


def zipped_text(path: Path) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("run.csv", b"t,ax,ay,az\n" + b"0.0,0.0,0.0,9.8\n" * 1_000_000)


def rows_without_cells(path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in ([0.0, 1.0, 2.0], [0.1, 1.0, 2.0], [0.2, 1.0, 2.0]):
        book.active.append(row)
    book.save(path)
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    sheet = parts["xl/worksheets/sheet1.xml"]
    sheet = sheet.replace(b'<row r="3"', b'<row r="400000"').replace(b'"A1:C3"', b'"A1:XFD400000"')
    for letter in b"ABC":
        sheet = sheet.replace(bytes([letter]) + b'3"', bytes([letter]) + b'400000"')
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in (parts | {"xl/worksheets/sheet1.xml": sheet}).items():
            archive.writestr(name, content)


def small_objects(path: Path) -> None:
    path.write_bytes(b"[" + b'{"t":1},' * 100_000 + b'{"t":2}]')


def named_cells(path: Path) -> None:
    path.write_text("t:1 ax:0.1 ay:0.2 az:9.8\n" * 40_000)


def empty_lines(path: Path) -> None:
    names = ",".join(f"b{k}" for k in range(40))
    path.write_text(f"t_s,a11_m_s2,{names}\n0,1{',0' * 40}\n" + "\n" * 200_000)


def lines_of_metadata(path: Path) -> None:
    path.write_text("".join(f"# k{k}: [{'[],' * 300}[]]\n" for k in range(950)) + "t_s,a11_m_s2\n0,1\n1,2\n")


def packed_matrix(path: Path) -> None:
    np.savez_compressed(path.with_suffix(".npz"), a=np.zeros((1_000_000, 4)))
    path.with_suffix(".npz").rename(path)


def packed_arrow(path: Path) -> None:
    from pyarrow.feather import write_feather

    write_feather(pa.table({name: np.zeros(1_000_000) for name in "tabc"}), str(path), compression="zstd")


def text_in_xz(path: Path) -> None:
    path.write_bytes(lzma.compress(b"t,ax,ay,az\n" + b"0.0,0.0,0.0,9.8\n" * 1_000_000))


def packed_stream(path: Path) -> None:
    path.write_bytes(gzip.compress(bytes.fromhex("A02800C8") + bytes(10_000_000)))


def small(write, limit="1kB"):
    """A file that is not packed, against a limit below its own size."""
    return write, read_foreign, limit


CASES = {
    "parquet, own": (constant_parquet, Recording.read, LIMIT),
    "parquet": (constant_parquet, read_foreign, LIMIT),
    "parquet of tables": (words_in_tables, read_foreign, LIMIT),
    "hdf5": (unwritten_hdf5, read_foreign, LIMIT),
    "hdf5 chunk": (wide_chunk, read_foreign, LIMIT),
    "matlab": (packed_matlab, read_foreign, LIMIT),
    "gzip": (packed_text, read_foreign, LIMIT),
    "zip": (zipped_text, read_foreign, LIMIT),
    "xz": (text_in_xz, read_foreign, LIMIT),
    "numpy": (packed_matrix, read_foreign, LIMIT),
    "arrow": (packed_arrow, read_foreign, LIMIT),
    "xlsx": (rows_without_cells, read_foreign, LIMIT),
    "json": (small_objects, read_foreign, LIMIT),
    "serial": (named_cells, read_foreign, LIMIT),
    "csv, own": (empty_lines, Recording.read, LIMIT),
    "csv metadata": (lines_of_metadata, Recording.read, LIMIT),
    "ulog": small(foreign.ulog),
    "mcap": small(foreign.mcap),
    "bag": small(foreign.bag_of_ros1),
}

SUFFIXES = {"xlsx": ".xlsx", "bag": ".bag"}


def grown(call) -> float:
    """Megabytes by which the process grows at most within a call."""
    Path("/proc/self/clear_refs").write_text("5")  # the peak counts from here
    before = memory("VmHWM")
    call()
    return memory("VmHWM") - before


def memory(name: str) -> float:
    lines = Path("/proc/self/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith(name)).split()[1]) / 1e3


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize("name", CASES)
def test_a_file_beyond_its_limit_is_refused_before_it_takes_the_memory(tmp_path, name):
    write, read, limit = CASES[name]
    file = tmp_path / f"file{SUFFIXES.get(name, '')}"
    write(file)

    def refused() -> None:
        with pytest.raises(InputError, match=r"^[^\n]*file[.a-z]*: needs .* limit (is|of) .*; --max-memory .*$"):
            read(with_memory(file, limit))

    assert grown(refused) < GROWTH_MB
    read(with_memory(file, ENOUGH))


def test_a_stream_of_a_board_is_refused_too(tmp_path):
    packed_stream(tmp_path / "run.bin.gz")
    with pytest.raises(MemoryLimitError, match="needs more memory than the limit of 20 MB"):
        read_mimu4444(with_memory(tmp_path / "run.bin.gz", LIMIT))


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_word_of_many_rows_is_kept_once(tmp_path):
    repeated_word(tmp_path / "run.parquet")
    read = []
    assert grown(lambda: read.append(read_foreign(with_memory(tmp_path / "run.parquet", "100MB")))) < 100.0
    assert set(map(len, read[0].tables[""].columns["note"])) == {3_000_000}


def test_an_unpacked_size_that_is_a_lie_is_kept_to_the_limit(tmp_path):
    h5py = pytest.importorskip("h5py")
    packer = zlib.compressobj(1)
    zeros = packer.compress(bytes(1 << 24)) + packer.flush(zlib.Z_FULL_FLUSH)
    again = packer.compress(bytes(1 << 24)) + packer.flush(zlib.Z_FULL_FLUSH)  # independent of what comes before
    data = zeros + 60 * again  # a gigabyte
    with h5py.File(tmp_path / "liar.h5", "w") as file:
        made = file.create_dataset("a", shape=(1000,), chunks=(1000,), dtype="f8", compression="gzip")
        made.id.write_direct_chunk((0,), data)

    def refused() -> None:
        with pytest.raises(InputError, match=r"liar\.h5: "):
            read_foreign(with_memory(tmp_path / "liar.h5", LIMIT))

    assert grown(refused) < 600.0  # the net lets through 500 MB beside the limit


@pytest.mark.parametrize("read", [read_foreign, Recording.read])
def test_the_need_of_a_parquet_file_is_its_numbers(tmp_path, read):
    constant_parquet(tmp_path / "run.parquet")
    need = 8 * 4 * 1_000_000
    with pytest.raises(MemoryLimitError, match="needs about 32 MB, the limit is 32 MB; --max-memory 40MB is enough"):
        read(with_memory(tmp_path / "run.parquet", need - 1))
    if read is read_foreign:
        assert len(read(with_memory(tmp_path / "run.parquet", need)).tables[""]) == 1_000_000


def test_the_limit_is_four_times_the_file_and_500_mb(tmp_path):
    (tmp_path / "file").write_bytes(bytes(1000))
    limit = MemoryLimit.of(tmp_path / "file")
    limit.needs(500_004_000)
    with pytest.raises(
        MemoryLimitError, match=r"needs about 0\.5 GB, the limit is 0\.5 GB; --max-memory 510MB is enough"
    ):
        limit.needs(500_004_001)
    assert MemoryLimit.of(with_memory(tmp_path / "file", "1 GiB")).most == 1 << 30
    assert MemoryLimit.of(with_memory(tmp_path / "file", 7)).most == 7
    for wrong in ("", "GB", "-1GB", "1e9", 0, -5):
        with pytest.raises(InputError, match="no size; write it as 800MB or 6GB"):
            with_memory(tmp_path / "file", wrong)


@pytest.mark.parametrize("read", [Recording.read, gfimu.open_recording])
def test_functions_of_python_take_the_limit_too(tmp_path, read):
    constant_parquet(tmp_path / "run.parquet")
    assert len(read(tmp_path / "run.parquet", max_memory=32_000_000)) == 1_000_000
    with pytest.raises(MemoryLimitError, match="the limit is 30 MB"):
        read(str(tmp_path / "run.parquet"), max_memory="30MB")
