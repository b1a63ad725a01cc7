"""Executors of a campaign: a process pool of this machine, the workers of a Dask cluster, or jobs of Slurm."""

from __future__ import annotations

import os
from contextlib import AbstractContextManager

from sim.trials.sweep.cluster import open_cluster
from sim.trials.sweep.engine import Workers
from sim.trials.sweep.pool import open_pool
from sim.trials.sweep.slurm import check_slurm, open_slurm

__all__ = ["check_cluster", "open_workers", "processors"]

_SLURM = "slurm"


def processors() -> int:
    """Return how many processors this process has."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def open_workers(count: int, cluster: str = "") -> AbstractContextManager[Workers]:
    """Open so many processes, or the workers of a cluster.

    Parameters
    ----------
    count : int
        Processes of this machine, or jobs of Slurm.
    cluster : str
        Address of a Dask scheduler, such as ``tcp://host:8786``; ``slurm`` for jobs of Slurm.

    Raises
    ------
    GfimuError
        If no worker can start, or no scheduler answers.
    """
    if cluster == _SLURM:
        return open_slurm(count)
    return open_cluster(cluster) if cluster else open_pool(count)


def check_cluster(cluster: str) -> None:
    """Raise `InputError` if a cluster, as `open_workers` takes it, can't be used; nothing is run."""
    if cluster == _SLURM:
        check_slurm()
    elif cluster:
        with open_cluster(cluster):
            pass
