"""A campaign: inputs in a process of their own with limits on memory and time, and a table of how they ended."""

from __future__ import annotations

import contextlib
import io
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

__all__ = ["Tally", "run"]

MEMORY = 500 << 20
"""Bytes that an input may take beside twice its own size."""

SECONDS = 10.0
"""CPU time that an input may take."""

_GRACE = 300.0  # s without a word, after which the process of the inputs is ended; a busy machine takes its time
_LONGEST = 3000  # characters of a message, without the name of the file


@dataclass
class Tally:
    """How the inputs of a reader ended."""

    inputs: int = 0
    read: int = 0
    refused: int = 0
    failed: Counter[str] = field(default_factory=Counter)
    slowest_s: float = 0.0
    cpu_s: float = 0.0


class _TooSlow(BaseException):
    """An input took longer than it may."""


def run(count: int, seed: int, only: str | None, keep: Path, *, progress: bool = False) -> dict[str, Tally]:
    """Read mutated inputs in processes of their own; one that dies is replaced and counted as a failure.

    Parameters
    ----------
    count : int
        Inputs.
    seed : int
        Seed; an input depends on it and on its number alone.
    only : str, optional
        One reader; all by default.
    keep : Path
        Folder for the inputs that failed.
    progress : bool
        Whether to print the table as it grows.
    """
    tallies: dict[str, Tally] = {}
    first, shown = 0, time.monotonic()
    while first < count:
        command = [
            sys.executable,
            "-m",
            "tests.fuzz",
            "--worker",
            str(first),
            "--count",
            str(count),
            "--seed",
            str(seed),
        ]
        command += ["--keep", str(keep)] + (["--reader", only] if only else [])
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as worker:
            assert worker.stdout is not None
            current: dict[str, Any] = {}
            for line in _lines(worker):
                entry = json.loads(line)
                if "end" in entry:
                    _add(tallies, entry)
                    first, current = entry["number"] + 1, {}
                else:
                    current = entry
                if progress and time.monotonic() - shown > 30.0:
                    shown = time.monotonic()
                    print(
                        f"{first} of {count}",
                        *(f"{name}: {dict(one.failed)}" for name, one in tallies.items() if one.failed),
                        flush=True,
                    )
            worker.kill()
        if current:
            _add(tallies, current | {"end": "the process died or hung", "seconds": 0.0})
            first = current["number"] + 1
        elif first < count:
            raise RuntimeError(f"the process of the inputs ended with {worker.returncode} before input {first}")
    return tallies


def _lines(worker: subprocess.Popen[str]) -> Iterator[str]:
    """Yield lines until the process ends or says nothing for long."""
    import select

    assert worker.stdout is not None
    raw, rest = worker.stdout.fileno(), b""
    while select.select([raw], [], [], _GRACE)[0]:
        block = os.read(raw, 1 << 16)
        if not block:
            return
        *whole, rest = (rest + block).split(b"\n")
        yield from (line.decode() for line in whole)


def _add(tallies: dict[str, Tally], entry: dict[str, Any]) -> None:
    one = tallies.setdefault(entry["reader"], Tally())
    one.inputs += 1
    one.read += entry["end"] == "read"
    one.refused += entry["end"] == "refused"
    if entry["end"] not in {"read", "refused"}:
        one.failed[entry["end"]] += 1
    one.slowest_s = max(one.slowest_s, entry["seconds"])
    one.cpu_s += entry["seconds"]


def work(first: int, count: int, seed: int, only: str | None, keep: Path) -> None:
    """Read the inputs from a number on, one line of JSON before and after each; the process under `run`."""
    from tests.fuzz.mutations import mutated
    from tests.fuzz.odd_files import ODD
    from tests.fuzz.readers import targets

    out = os.fdopen(os.dup(1), "w", buffering=1)
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory(prefix="gfimu-fuzz-") as name:
        folder = Path(name)
        with contextlib.redirect_stdout(io.StringIO()):
            known = targets(folder)
        names = [only] if only else sorted(known)
        share = np.array([known[one].share for one in names])
        for one in names:  # what is imported and compiled first is no input's memory or time
            for data, suffix in known[one].seeds:
                file = folder / f"seed{suffix}"
                file.write_bytes(data)
                with contextlib.suppress(Exception), contextlib.redirect_stdout(io.StringIO()):
                    known[one].call(file)
        every = [data for one in names for data, _ in known[one].seeds]
        base = _size()
        signal.signal(signal.SIGPROF, _stop)
        for number in range(first, count):
            rng = np.random.default_rng([seed, number])
            reader = names[int(rng.choice(len(names), p=share / share.sum()))]
            target = known[reader]
            data, suffix = target.seeds[int(rng.integers(len(target.seeds)))]
            if rng.random() < 0.003:
                file, what = ODD[int(rng.integers(len(ODD)))](folder, suffix), "odd file"
                size = 0
            else:
                others = every if rng.random() < 0.1 else [one for one, _ in target.seeds]
                content, what = mutated(data, rng, others)
                file, size = folder / f"input{suffix}", len(content)
                file.write_bytes(content)
            out.write(json.dumps({"number": number, "reader": reader}) + "\n")
            end, seconds, trace = _ended(target.call, file, base + MEMORY + 2 * size)
            out.write(json.dumps({"number": number, "reader": reader, "end": end, "seconds": seconds}) + "\n")
            if trace and what != "odd file":
                keep.mkdir(parents=True, exist_ok=True)
                (keep / f"{number}-{reader}{suffix}").write_bytes(content)
                (keep / f"{number}-{reader}.trace").write_text(f"{what}\n{trace}", errors="backslashreplace")


def _ended(call: Any, file: Path, memory: int) -> tuple[str, float, str]:
    """Read one input: how it ended, CPU time, and where an error came from that is not one of gfimu's."""
    from gfimu import GfimuError

    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    start, trace = time.process_time(), ""
    resource.setrlimit(resource.RLIMIT_AS, (memory, hard))
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            call(file)
        end = "read"
    except GfimuError as error:
        text = str(error).replace(str(file), "")
        end = "refused" if "\n" not in text and len(text) <= _LONGEST else "message of several lines or too long"
        trace = "" if end == "refused" else repr(text)
    except _TooSlow:
        end, trace = f"more than {SECONDS:g} s", traceback.format_exc()
    except BaseException as error:  # noqa: BLE001  the kinds that should not be seen
        where = traceback.extract_tb(error.__traceback__)
        own = [
            one for one in where if "/gfimu/" in one.filename or "/sim/" in one.filename or "/firmware_" in one.filename
        ]
        place = own[-1] if own else where[-1]
        end = f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}"
        trace = traceback.format_exc()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
    return end, time.process_time() - start, trace


def _stop(number: int, frame: object) -> None:
    raise _TooSlow


def _size() -> int:
    """Return the address space of this process, bytes."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
