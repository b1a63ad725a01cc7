"""`gfimu campaign status`, `table` and `plot`: what the folder of a campaign holds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gfimu.cli.output import print_json, print_paths, print_table, print_text, progress
from gfimu.cli.shared_options import JsonOption, shared

if TYPE_CHECKING:
    from gfimu.commands.campaign_views import CampaignTable
    from sim.sweep.summary import Group

__all__ = ["ByOption", "duration_text", "plot", "print_failures", "print_groups", "status", "table"]

FolderArgument = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of the campaign.")]
ByOption = Annotated[list[str] | None, shared("--by")]


def status(folder: FolderArgument, json: JsonOption = False) -> None:
    """Say how far a campaign is, also while another process runs it: cases, rate, time left, failures.

    Writes nothing.

    Examples
    --------
    gfimu campaign status campaign
    # For a monitor
    gfimu campaign status campaign --json
    """
    from gfimu.commands.campaign_views import campaign_status

    found = campaign_status(folder)
    if json:
        print_json(found.to_dict())
        return
    share = f" ({100.0 * found.done / found.cases:.1f} %)"
    print_text(f"{found.folder}: {found.done} of {found.cases} cases{share}, {sum(found.failures.values())} failed")
    if found.runs:
        places = ", ".join(f"process {run.pid} on {run.host}" for run in found.runs)
        left = "time left not known yet" if math.isnan(found.left_s) else f"{duration_text(found.left_s)} left"
        print_text(f"runs: {places}; {found.rate_per_s:.3g} cases/s, {left}")
    elif found.done < found.cases:
        print_text(f"does not run; gfimu campaign PLAN.toml --out {found.folder} with its plan goes on with it")
    print_failures(found.failures)


def table(
    folder: FolderArgument,
    by: ByOption = None,
    csv: Annotated[
        Path | None, typer.Option("--csv", metavar="FILE", help="File to write: the quantiles, one row per group.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Print quantiles of each result by the values of factors, and which factors cause its variance.

    Examples
    --------
    gfimu campaign table campaign --by method
    # The quantiles as a file
    gfimu campaign table campaign --by method --csv quantiles.csv
    """
    from gfimu.commands.campaign_views import campaign_table

    with progress("reading the campaign"):
        found = campaign_table(folder, by=by or [], csv=csv)
    if json:
        print_json(found.to_dict() | {"files": {} if csv is None else {"quantiles": csv}})
        return
    print_groups(str(folder), found.groups)
    _print_sensitivities(found)
    if csv is not None:
        print_paths([("quantiles", csv)])


def plot(
    folder: FolderArgument,
    out: Annotated[Path, typer.Option("--out", help="Picture to write (.png, .svg, .html).")],
    result: Annotated[
        list[str] | None,
        typer.Option("--result", metavar="NAME", help="Result to draw; may be repeated. The first four by default."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Draw results against each factor, and which factors cause their variance.

    Examples
    --------
    gfimu campaign plot campaign --out campaign.png
    # One result, to zoom into
    gfimu campaign plot campaign --result rate_rmse_rad_s --out campaign.html
    """
    from gfimu.commands.campaign_views import campaign_plot

    with progress("drawing"):
        drawn = campaign_plot(folder, out=out, result=result or [])
    if json:
        print_json({"results": drawn, "files": {"picture": out}})
    else:
        print_paths([("picture", out)])


def print_groups(title: str, groups: Sequence[Group]) -> None:
    """Print the quantiles of each result, or its share and the interval of that, in a table of its own."""
    print_text(title)
    factors = list(groups[0].values) if groups else []
    for result in dict.fromkeys(group.result for group in groups):
        of_result = [group for group in groups if group.result == result]
        heads = ("from", "share", "to (95 %)") if of_result[0].share else ("5 %", "median", "95 %")
        rows = [
            (
                *(str(group.values[name]) for name in factors),
                str(group.cases),
                *(f"{value:.4g}" for value in (group.low, group.median, group.high)),
            )
            for group in of_result
        ]
        print_table(result, (*factors, "cases", *heads), rows, left=len(factors))


def print_failures(failures: dict[str, int]) -> None:
    """Print how many cases failed, a line for each reason."""
    for reason, count in failures.items():
        print_text(f"{count} failed: {reason}", style="yellow")


def duration_text(seconds: float) -> str:
    """Return a time as people say it, to two places: ``3 h 20 min``."""
    units = (("d", 86400), ("h", 3600), ("min", 60), ("s", 1))
    whole = round(seconds)
    for (name, size), (smaller, part) in pairwise(units):
        if whole >= size:
            return f"{whole // size} {name} {whole % size // part} {smaller}"
    return f"{whole} s"


def _print_sensitivities(found: CampaignTable) -> None:
    from sim.sweep.sensitivity import METHODS

    if not found.sensitivities:
        print_text("no sensitivities: no factor varies, or too few combinations are done")
        return
    rows = [
        (
            one.result,
            one.factor,
            _index(one.first, one.first_low, one.first_high),
            _index(one.total, one.total_low, one.total_high),
            str(one.points),
        )
        for one in found.sensitivities
    ]
    rows += [(result, "(seeds)", f"{share:.3f}", "", "") for result, share in found.seed_shares.items()]
    order = list(dict.fromkeys(row[0] for row in rows))
    rows.sort(key=lambda row: order.index(row[0]))
    print_table("Share of the variance", ("result", "factor", "first order", "total", "points"), rows, left=2)
    for method in dict.fromkeys(one.method for one in found.sensitivities):
        print_text(METHODS[method])
    print_text("Factors: of the variance of the mean over seeds, with 95 % interval (bootstrap). ", style="dim")
    print_text(
        "Seeds: of the variance of single cases; factors act through them too."
        if found.seed_shares
        else "One seed for all combinations: what chance causes is not seen; repeats = N shows it.",
        style="dim",
    )


def _index(value: float, low: float, high: float) -> str:
    if math.isnan(value):
        return ""
    return f"{value:.3f}" if math.isnan(low) else f"{value:.3f} ± {(high - low) / 2.0:.3f}"
