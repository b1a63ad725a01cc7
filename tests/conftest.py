"""Shared fixtures; one thread of linear algebra and a share of the processors per process, as more collapse on few."""

import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import settings

# NumPy reads these when it is first imported, which no import above does.
for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

# Each of several test processes keeps to its share of the processors, as a diagnosis takes all that it may.
_share = os.environ.get("PYTEST_XDIST_WORKER", "")
if _share and hasattr(os, "sched_setaffinity"):
    _processors = sorted(os.sched_getaffinity(0))
    _number, _count = int(_share.removeprefix("gw")), int(os.environ["PYTEST_XDIST_WORKER_COUNT"])
    os.sched_setaffinity(0, _processors[_number::_count] or {_processors[_number % len(_processors)]})

settings.register_profile("gfimu", deadline=None, derandomize=True, max_examples=50)
settings.load_profile("gfimu")

PROJECT_ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture
def several_processors():
    """As many processors as the machine lets this process have; the tests keep to their share otherwise."""
    if sys.platform != "linux":
        pytest.skip("no process is split off here")
    share = os.sched_getaffinity(0)
    os.sched_setaffinity(0, range(os.cpu_count() or 1))
    try:
        if len(os.sched_getaffinity(0)) < 2:
            pytest.skip("one processor")
        yield
    finally:
        os.sched_setaffinity(0, share)


@pytest.fixture(scope="session")
def project_root() -> Path:
    """Root of the checkout."""
    return PROJECT_ROOT


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the measured data beside the project; skips the test where it isn't there."""
    folder = PROJECT_ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"measured data not found at {folder}")
    return folder


@pytest.fixture(scope="session")
def made_once(tmp_path_factory) -> Callable[[str, Callable[[], str]], str]:
    """Texts that are costly to make, as ``made_once(file_name, make)``: the test processes of one run share them."""
    folder = tmp_path_factory.getbasetemp()
    folder = folder.parent if _share else folder  # of the whole run

    def text(name: str, make: Callable[[], str]) -> str:
        path = folder / name
        if not path.exists():
            part = path.with_name(f"{name}.{os.getpid()}")
            part.write_text(make(), encoding="utf-8")
            part.replace(path)  # the other process sees all of it or nothing
        return path.read_text(encoding="utf-8")

    return text


SLOW_TESTS = frozenset((PROJECT_ROOT / "tests" / "slow_tests.txt").read_text(encoding="utf-8").splitlines())
"""Tests by their names in full that run as studies, so that the usual run ends within minutes."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the slow tests as studies, before markers are selected by."""
    for item in items:
        if item.nodeid in SLOW_TESTS:
            item.add_marker(pytest.mark.study)
