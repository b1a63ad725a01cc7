"""Writing that fails: one line that names the file and the reason, no half file, the old file untouched."""

import sys

import numpy as np
import pytest

from gfimu import AccelerometerArray, GfimuError, Recording, estimate

resource = pytest.importorskip("resource", reason="no file size limit on this system")
CUBE = AccelerometerArray.load("cube12")
FORMATS = ("csv", "parquet")


@pytest.fixture
def no_room():
    """Let no file grow beyond 20 kB, which fails like a full disk; Python ignores the signal that goes with it."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture(scope="module")
def results():
    rng = np.random.default_rng(0)
    run = Recording.from_arrays(np.arange(4000) / 100.0, rng.normal(size=(4000, 12)), CUBE)
    return {"recording": run, "estimate": estimate(run, CUBE)}


@pytest.mark.skipif(sys.platform != "linux", reason="the limit acts on Linux")
@pytest.mark.usefixtures("no_room")
@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("what", ["recording", "estimate"])
def test_whole_or_not_at_all(tmp_path, results, what, suffix):
    file = tmp_path / f"out.{suffix}"
    file.write_bytes(b"of yesterday")
    with pytest.raises(GfimuError) as error:
        results[what].write(file)
    assert str(error.value).startswith(f"{file}: not written: File too large; free space")
    assert "\n" not in str(error.value)
    assert file.read_bytes() == b"of yesterday"
    assert [path.name for path in tmp_path.iterdir()] == [file.name]


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_folder_in_the_place_of_the_file(tmp_path, results, suffix):
    file = tmp_path / f"out.{suffix}"
    file.mkdir()
    with pytest.raises(GfimuError, match=rf"out\.{suffix}: .*[Dd]irectory"):
        results["recording"].write(file)
    assert [path.name for path in tmp_path.iterdir()] == [file.name]
