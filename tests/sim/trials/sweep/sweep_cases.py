"""Work for campaigns of tests: quick, failing, or deadly to its worker."""

import os
import signal
import time
from pathlib import Path

from gfimu import InputError


def quick(case):
    """A number of the factors and the seed; size 3 can't be set up, and size 4 breaks."""
    size = case.values.get("size", 1)
    if size == 3:
        raise InputError("size 3 is not made")
    if size == 4:
        raise ZeroDivisionError("by nothing")
    return {"result_m": float(size) * (case.seed % 1000), "good": case.seed % 2 == 0}


def dies_once(case):
    """Kill the worker of case 5 the first time."""
    marker = Path(os.environ["GFIMU_TEST_MARKER"])
    if case.number == 5 and not marker.exists():
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return quick(case)


def always_dies(case):
    """Kill the worker of case 5 each time."""
    if case.number == 5:
        time.sleep(0.1)
        os.kill(os.getpid(), signal.SIGKILL)
    return quick(case)


def counted(case):
    """Leave a file per execution."""
    Path(os.environ["GFIMU_TEST_MARKER"], f"{case.number}-{os.getpid()}-{time.monotonic_ns()}").touch()
    return quick(case)


def waits(case):
    """Take a while, and leave a file per execution."""
    time.sleep(0.05)
    return counted(case)
