"""What a file says of other files: HDF5 that lies elsewhere is refused before anything of it is opened."""

from __future__ import annotations

import os
import signal
import stat
import zipfile
from pathlib import Path

import numpy as np
import pytest

from gfimu import InputError
from gfimu.recording import read_foreign

h5py = pytest.importorskip("h5py")


def external_storage(file) -> None:
    file.create_dataset("a", shape=(100,), dtype="f8", external=[("elsewhere", 0, h5py.h5f.UNLIMITED)])


def external_link(file) -> None:
    file["group/a"] = h5py.ExternalLink("elsewhere", "/a")


def virtual(file, most=None) -> None:
    layout = h5py.VirtualLayout(shape=(100,), dtype="f8", maxshape=most)
    layout[:] = h5py.VirtualSource("elsewhere", "a", shape=(100,), maxshape=most)
    file.create_virtual_dataset("a", layout)


def virtual_without_end(file) -> None:
    virtual(file, (None,))


def unknown_filter(file) -> None:
    made = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    made.set_chunk((100,))
    made.set_filter(32015, h5py.h5z.FLAG_OPTIONAL, (1,))
    h5py.h5d.create(file.id, b"a", h5py.h5t.NATIVE_DOUBLE, h5py.h5s.create_simple((100,)), made)


REFUSED = {
    external_storage: "data set 'a' lies in another file; write it into this one",
    external_link: "'group/a' is a link to another file; copy the data into this one",
    virtual: "data set 'a' is put together of other files; write it into this one",
    virtual_without_end: "data set 'a' is put together of other files; write it into this one",
    unknown_filter: "data set 'a' is packed by filter 32015, which is not HDF5's; use gzip",
}


@pytest.mark.parametrize("ending", ["h5", "mat", "nc"])
@pytest.mark.parametrize("write", REFUSED)
def test_what_lies_elsewhere_is_refused_and_not_opened(tmp_path, monkeypatch, write, ending):
    """Where it is said to lie is a pipe: who opened it would wait until the alarm ends the tests."""
    monkeypatch.chdir(tmp_path)
    os.mkfifo("elsewhere")
    with h5py.File(f"run.{ending}", "w") as file:
        file["t"] = np.arange(100.0)
        write(file)
    signal.alarm(60)
    with pytest.raises(InputError) as caught:
        read_foreign(f"run.{ending}")
    signal.alarm(0)
    assert str(caught.value) == f"run.{ending}: {REFUSED[write]}"


def test_names_within_the_file_and_those_that_lead_nowhere_are_left_out(tmp_path):
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["t"] = np.arange(100.0)
        file["again"], file["nowhere"] = h5py.SoftLink("/t"), h5py.SoftLink("/x")
        file["reference"] = np.array([file["t"].ref] * 100, dtype=h5py.ref_dtype)
        file["region"] = np.array([file["t"].regionref[3:5]] * 100, dtype=h5py.regionref_dtype)
        mixed = [("x", "f8"), ("word", h5py.string_dtype()), ("n", "i4")]
        file.create_dataset("mixed", shape=(100,), dtype=mixed)
    assert list(read_foreign(tmp_path / "run.h5").tables["100 rows"].columns) == ["mixed.x", "mixed.n", "t"]


def test_links_and_paths_of_an_archive_lead_nowhere(tmp_path):
    (tmp_path / "secret.csv").write_text("t,ax\n0,7\n1,7\n2,7\n")
    link = zipfile.ZipInfo("link.csv")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(tmp_path / "run.zip", "w") as archive:
        archive.writestr(link, str(tmp_path / "secret.csv"))
        archive.writestr("../../outside.csv", "t,ax\n0,1\n1,1\n2,1\n")
    tables = read_foreign(tmp_path / "run.zip").tables
    assert list(tables) == ["../../outside.csv"]
    assert sorted(one.name for one in Path(tmp_path).iterdir()) == ["run.zip", "secret.csv"]
