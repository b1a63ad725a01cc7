"""Memory and speed of reading a large recording: 10⁷ samples of 12 channels, 1.04 GB in memory.

Run ``python benchmarks/recording.py [SAMPLES]``. Peak memory above the data itself is what the reader costs; a second
copy would show as 100 %. Each reader runs in a process of its own, so that peaks don't mix.
"""

from __future__ import annotations

import multiprocessing
import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from gfimu import AccelerometerArray, Recording


def main() -> None:
    samples = int(float(sys.argv[1])) if len(sys.argv) > 1 else 10_000_000
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "run.parquet"
        _in_own_process(_write, file, samples)
        data = samples * 13 * 8 / 2**20
        print(
            f"{samples:,} samples × 13 columns: {data:.0f} MiB in memory, {file.stat().st_size / 2**20:.0f} MiB on disk"
        )
        for name, read in (("gfimu.Recording.read", _read), ("pyarrow, then NumPy", _read_plainly)):
            peak, seconds = _in_own_process(read, file)
            print(
                f"{name:22s} peak {peak:6.0f} MiB above start = data + {100 * (peak / data - 1):4.0f} %, "
                f"{seconds:5.1f} s, {data / seconds:5.0f} MiB/s"
            )


def _write(file: Path, samples: int) -> None:
    rng = np.random.default_rng(1)
    readings = np.round(rng.normal(size=(samples, 12)) * 100.0) * 0.0382459
    Recording.from_arrays(np.arange(samples) / 3200.0, readings, AccelerometerArray.load("cube12")).write(file)


def _read(file: Path) -> object:
    return Recording.read(file)


def _read_plainly(file: Path) -> object:
    import pyarrow.parquet as pq

    table = pq.read_table(file)
    return np.column_stack([table.column(name).to_numpy() for name in table.column_names])


def _measured(function, arguments, pipe) -> None:
    before = _peak()
    start = time.perf_counter()
    kept = function(*arguments)
    pipe.send((_peak() - before, time.perf_counter() - start))
    del kept


def _peak() -> float:
    # Linux hands ru_maxrss on from the parent process; its own high-water mark is in /proc.
    status = Path("/proc/self/status")
    if status.exists():
        return (
            next(int(line.split()[1]) for line in status.read_text().splitlines() if line.startswith("VmHWM")) / 1024.0
        )
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def _in_own_process(function, *arguments) -> tuple[float, float]:
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_measured, args=(function, arguments, sender))
    process.start()
    result = receiver.recv()
    process.join()
    return result


if __name__ == "__main__":
    main()
