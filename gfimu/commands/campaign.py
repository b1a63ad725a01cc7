"""Run many simulated cases of a plan into one dataset, and summarise it; a second call continues the first.

The word run may be left out.

Examples
--------
gfimu campaign plan.toml --out campaign
# Its progress, from another terminal
gfimu campaign status campaign
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from gfimu.base.errors import InputError
from gfimu.base.files.outputs import OutputFile, OutputFolder
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import BY, WORKERS, picture_file

if TYPE_CHECKING:
    from sim.trials.sweep.results import CampaignPlot, CampaignResult, CampaignStatus, CampaignTable

__all__ = ["campaign", "campaign_plot", "campaign_status", "campaign_table"]

_PLAN = Option("Plan (.toml), or the folder of a campaign, of which nothing is run.", "PLAN", argument=True, reads=True)
_OUT = Option("Folder to write; one that was begun is continued.", writes=OutputFolder(("plan.toml",)), what="campaign")
_PROGRESS = Option("Called with the number of cases that are done and of all.", shell=False)
_FOLDER = Option("Folder of the campaign.", "DIR", argument=True, reads=True)
_TABLE = OutputFile("a table", (".csv",))
_CSV = Option("File to write: the quantiles, one row per group.", "FILE", writes=_TABLE, what="quantiles")
_DRAWING = Option("Picture to write (.png, .svg, .html).", writes=picture_file(".png", ".svg", ".html"), what="picture")
_RESULT = Option("Result to draw; may be repeated. The first four by default.", "NAME", kind=list[str])


def _exit_code(result: "CampaignResult") -> int:
    from gfimu.commands.shell.output import print_text

    if not (result.ran and result.every_case_failed):
        return 0
    print_text("every case failed", style="yellow", stderr=True)
    return 1


@command(doing=lambda given: f"campaign {given['plan']}", continues=True, exit_code=_exit_code)
def campaign(
    plan: Annotated[str | Path, _PLAN],
    *,
    out: Annotated[str | Path | None, _OUT] = None,
    by: Annotated[Sequence[str], BY] = (),
    workers: Annotated[int | None, WORKERS.also("; with --cluster slurm, jobs", least=1)] = None,
    cluster: Annotated[str, Option("Dask scheduler instead, such as tcp://host:8786, or slurm.")] = "",
    progress: Annotated[Callable[[int, int], None] | None, _PROGRESS] = None,
) -> "CampaignResult":
    """Run the cases of a plan that its folder lacks, and summarise them; or summarise a folder.

    Exit code 1 if every case failed. After Ctrl-C the finished cases stay; the same command goes on with the others.

    Shell
    -----
    # A plan to edit, then its cases
    gfimu new plan --out plan.toml
    gfimu campaign plan.toml --out campaign
    # Summarise a folder by a factor
    gfimu campaign campaign --by method

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
    from sim.trials.campaign.cases import KINDS, check_factors
    from sim.trials.sweep.dataset import Dataset
    from sim.trials.sweep.design import Design
    from sim.trials.sweep.engine import run_campaign
    from sim.trials.sweep.executors import check_cluster, open_workers, processors
    from sim.trials.sweep.plan import load_plan
    from sim.trials.sweep.results import CampaignResult

    if Path(plan).is_dir():
        if out is not None:
            raise InputError(f"{plan}: is the folder of a campaign; --out goes with a plan")
        dataset = Dataset.open(plan)
    else:
        loaded = load_plan(plan)
        check_factors(loaded, Design(loaded)[0], str(plan))
        if out is None:
            raise InputError(f"{plan}: give the folder of the campaign with --out")
        check_cluster(cluster)  # one that is not there is reported before anything is written
        opened = partial(open_workers, workers or processors(), cluster)
        dataset = Dataset.create(out, plan)
        run_campaign(dataset, KINDS[loaded.kind], opened, progress=progress)
    return CampaignResult.of(dataset, by, ran=out is not None)


@command("campaign status")
def campaign_status(folder: Annotated[str | Path, _FOLDER]) -> "CampaignStatus":
    """Say how far a campaign is, also while another process runs it: cases, rate, time left, failures.

    Writes nothing.

    Shell
    -----
    gfimu campaign status campaign
    # For a monitor
    gfimu campaign status campaign --json

    Raises
    ------
    InputError
        If the folder holds no campaign, or a file in it is damaged.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.campaign_status("campaign").done  # doctest: +SKIP
    """
    from sim.trials.sweep.dataset import Dataset
    from sim.trials.sweep.results import CampaignStatus

    return CampaignStatus.of(Dataset.open(folder))


@command("campaign table", doing="reading the campaign")
def campaign_table(
    folder: Annotated[str | Path, _FOLDER],
    *,
    by: Annotated[Sequence[str], BY] = (),
    csv: Annotated[str | Path | None, _CSV] = None,
) -> "CampaignTable":
    """Print quantiles of each result by the values of factors, and which factors cause its variance.

    Shell
    -----
    gfimu campaign table campaign --by method
    # The quantiles as a file
    gfimu campaign table campaign --by method --csv quantiles.csv

    Raises
    ------
    InputError
        If the folder holds no campaign, a file in it is damaged, or there is no such factor.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.campaign_table("campaign").to_pandas()  # doctest: +SKIP
    """
    from sim.trials.sweep.dataset import Dataset
    from sim.trials.sweep.results import CampaignTable

    result = CampaignTable.of(Dataset.open(folder), by)
    if csv is not None:
        result.write_csv(csv)
    return result


def _plot(drawn: list[str], _: Mapping[str, Any]) -> "CampaignPlot":
    from sim.trials.sweep.results import CampaignPlot

    return CampaignPlot(drawn)


@command("campaign plot", report=_plot, doing="drawing")
def campaign_plot(
    folder: Annotated[str | Path, _FOLDER],
    *,
    out: Annotated[str | Path, _DRAWING],
    result: Annotated[Sequence[str], _RESULT] = (),
) -> list[str]:
    """Draw results against each factor, and which factors cause their variance; return the names of what is drawn.

    An ``.html`` page holds the picture with the counts and the reasons of failures.

    Shell
    -----
    gfimu campaign plot campaign --out campaign.png
    # One result, to zoom into
    gfimu campaign plot campaign --result rate_rmse_rad_s --out campaign.html

    Raises
    ------
    InputError
        If the folder holds no campaign or no result yet, a file in it is damaged, or there is no such result.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.campaign_plot("campaign", out="campaign.png")  # doctest: +SKIP
    """
    from sim.trials.sweep.dataset import Dataset
    from sim.trials.sweep.design import Design
    from sim.trials.sweep.picture import campaign_picture

    dataset = Dataset.open(folder)
    return campaign_picture(out, dataset.folder, dataset.table(), Design(dataset.plan), list(result))
