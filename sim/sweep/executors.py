"""Executors of a campaign: a process pool of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import os
from contextlib import AbstractContextManager

from sim.sweep.cluster import open_cluster
from sim.sweep.engine import Workers
from sim.sweep.pool import open_pool

__all__ = ["open_workers", "processors"]


def processors() -> int:
    """Return how many processors this process has."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def open_workers(count: int, cluster: str = "") -> AbstractContextManager[Workers]:
    """Open so many processes, or the workers of a Dask cluster at an address such as ``tcp://host:8786``.

    Raises
    ------
    GfimuError
        If no worker can start, or no scheduler answers.
    """
    return open_cluster(cluster) if cluster else open_pool(count)
