"""Under `gfimu campaign`: many simulated cases by a plan, kept as one dataset that a second call goes on with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from gfimu.files.outputs import OutputFolder, writes
from gfimu.results import Panel, PlottedResult

if TYPE_CHECKING:
    from sim.sweep.summary import Group

__all__ = ["CampaignResult", "campaign"]


@dataclass(frozen=True)
class CampaignResult(PlottedResult):
    """Summary of a campaign's folder: cases, results and failures.

    Parameters
    ----------
    folder : Path
        The folder: ``plan.toml`` and one Parquet file per batch.
    cases : int
        Cases of the plan.
    done : int
        Cases whose row is there, failed ones included.
    failures : dict of str to int
        How many cases failed, by the reason.
    groups : tuple of Group
        Quantiles of each result by the values of the factors.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.campaign("plan.toml", out="campaign").to_pandas()  # doctest: +SKIP
    """

    folder: Path
    cases: int
    done: int
    failures: dict[str, int]
    groups: tuple[Group, ...]

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per case that is done, with the columns of the dataset: factors, results, failure."""
        from gfimu.files.table import as_found
        from sim.sweep.dataset import Dataset

        table = Dataset.open(self.folder).table()
        return {name: as_found(table.column(name)) for name in table.column_names}

    def _heading(self) -> str:
        return f"Campaign in {self.folder}"

    def _facts(self) -> list[tuple[str, str]]:
        from gfimu.commands.campaign_views import progress_facts

        return progress_facts(self.cases, self.done, self.failures)

    def _shown(self) -> dict[str, NDArray[Any]]:
        from gfimu.commands.campaign_views import group_columns

        return group_columns(self.groups)

    def _panels(self) -> list[Panel]:
        from gfimu.commands.campaign_views import group_panels

        return group_panels(self.groups)

    def to_dict(self) -> dict[str, Any]:
        """Return the content for JSON."""
        return {
            "folder": str(self.folder),
            "cases": self.cases,
            "done": self.done,
            "failures": self.failures,
            "groups": [group.to_dict() for group in self.groups],
        }


@writes(reads=("plan",), out=OutputFolder(("plan.toml",)))
def campaign(
    plan: str | Path,
    *,
    out: str | Path | None = None,
    by: Sequence[str] = (),
    workers: int | None = None,
    cluster: str = "",
    progress: Callable[[int, int], None] | None = None,
) -> CampaignResult:
    """Run the cases of a plan that its folder lacks, and summarise all; or summarise a folder.

    Parameters
    ----------
    plan : str or Path
        The plan (.toml), or the folder of a campaign, of which nothing is run.
    out : str or Path, optional
        Folder of the campaign, with a plan.
    by : sequence of str
        Factors by whose values the results are grouped; all that are lists of values by default.
    workers : int, optional
        Worker processes, or jobs of Slurm; by default as many as this process has processors.
    cluster : str
        Address of a Dask scheduler, such as ``tcp://host:8786``, or ``slurm`` for jobs, in place of processes of this
        machine.
    progress : callable, optional
        Called with the number of cases that are done and of all.

    Returns
    -------
    CampaignResult
        Counts, failures and quantiles.

    Raises
    ------
    InputError
        If the plan is wrong, a folder is needed or holds another campaign, Dask is not installed, or no scheduler
        answers.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.campaign("plan.toml", out="campaign").plot()  # doctest: +SKIP
    """
    from gfimu.commands.campaign_cases import KINDS, check_factors
    from gfimu.errors import InputError
    from sim.sweep.dataset import Dataset
    from sim.sweep.design import Design
    from sim.sweep.engine import run_campaign
    from sim.sweep.executors import check_cluster, open_workers, processors
    from sim.sweep.plan import load_plan
    from sim.sweep.summary import failures, grouped

    if workers is not None and workers < 1:
        raise InputError(f"--workers {workers}: must be at least 1")
    if Path(plan).is_dir():
        if out is not None:
            raise InputError(f"{plan}: is the folder of a campaign; --out goes with a plan")
        dataset = Dataset.open(plan)
    else:
        found = load_plan(plan)
        check_factors(found, Design(found)[0], str(plan))
        if out is None:
            raise InputError(f"{plan}: give the folder of the campaign with --out")
        check_cluster(cluster)  # one that is not there is reported before anything is written
        opened = partial(open_workers, workers or processors(), cluster)
        dataset = Dataset.create(out, plan)
        run_campaign(dataset, KINDS[found.kind], opened, progress=progress)
    table = dataset.table()
    groups = tuple(grouped(table, dataset.plan, list(by)))
    return CampaignResult(dataset.folder, len(Design(dataset.plan)), len(table), failures(table), groups)
