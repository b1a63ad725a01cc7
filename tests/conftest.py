"""Shared fixtures; the same arithmetic everywhere, and a share of the processors per process."""

import os
import sys
from collections import defaultdict
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import pytest
from hypothesis import settings

from tests.arithmetic import set_arithmetic

set_arithmetic()  # before NumPy is first imported, which no import above does

# Each of several test processes keeps to its share of the processors, as a diagnosis takes all that it may.
_share = os.environ.get("PYTEST_XDIST_WORKER", "")
if _share and hasattr(os, "sched_setaffinity"):
    _processors = sorted(os.sched_getaffinity(0))
    _number, _count = int(_share.removeprefix("gw")), int(os.environ["PYTEST_XDIST_WORKER_COUNT"])
    os.sched_setaffinity(0, _processors[_number::_count] or {_processors[_number % len(_processors)]})

# The lot by which a run draws what it tries of a long list: the test processes share it, and setting it draws it again.
LOT = os.environ.setdefault("GFIMU_LOT", datetime.now(UTC).date().isoformat())

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


def pytest_terminal_summary(terminalreporter):
    """Print what draws the same lot again."""
    terminalreporter.write_line(f"lot: GFIMU_LOT={LOT}")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave in the usual suite what the marker ``study`` of a function leaves there, before markers are selected by."""
    cases, listed = defaultdict(set), {}
    for item in items:
        mark = item.get_closest_marker("study")
        if mark is None or not mark.kwargs:
            continue
        test, case = item.nodeid.partition("[")[0], item.callspec.id
        cases[test].add(case)
        listed[test] = {one for names in mark.kwargs.values() for one in names}
        if case in mark.kwargs.get("but", ()) or case not in mark.kwargs.get("only", (case,)):
            item.own_markers = [one for one in item.own_markers if one.name != "study"]
    if not any("::" in one for one in config.args):  # otherwise not all cases are here
        absent = {test: sorted(listed[test] - cases[test]) for test in listed if listed[test] - cases[test]}
        assert not absent, f"marked study for cases that are not there: {absent}"
