"""Workers of a campaign as jobs of a Slurm cluster, which dask-jobqueue submits and cancels."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from gfimu.base.errors import InputError
from gfimu.base.optional_packages import require
from sim.trials.sweep.cluster import open_cluster
from sim.trials.sweep.engine import Workers

if TYPE_CHECKING:
    from dask_jobqueue.slurm import SLURMCluster

__all__ = ["check_slurm", "open_slurm"]

_FILE = "~/.config/dask/jobqueue.yaml"


@contextmanager
def open_slurm(jobs: int) -> Iterator[Workers]:
    """Submit so many jobs, each with the workers that dask-jobqueue's file says, and cancel them in the end.

    Queue, cores, memory and wall time are those of ``jobqueue: slurm:`` in ``~/.config/dask/jobqueue.yaml``.

    Raises
    ------
    InputError
        As `check_slurm`.
    """
    with _cluster() as cluster:
        cluster.scale(jobs=jobs)
        with open_cluster(cluster.scheduler_address, "squeue shows whether their jobs wait in the queue") as workers:
            yield workers


def check_slurm() -> None:
    """Submit nothing, and raise `InputError` if dask-jobqueue, Slurm, or a size of the jobs is missing."""
    if shutil.which("sbatch") is None:
        raise InputError("--cluster slurm: no sbatch here; call gfimu on a machine that submits jobs")
    with _cluster():
        pass


def _cluster() -> SLURMCluster:
    require("--cluster slurm", "dask_jobqueue")
    from dask_jobqueue.slurm import SLURMCluster

    try:
        return SLURMCluster()
    except ValueError as error:
        raise InputError(f"--cluster slurm: {str(error).partition(chr(10))[0]}; give it in {_FILE}") from None
