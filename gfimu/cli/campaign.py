"""`gfimu campaign`: many simulated cases by a plan."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gfimu.cli.output import JsonOption, print_json, print_paths, print_table, print_text, progress

if TYPE_CHECKING:
    from gfimu.commands.campaign import CampaignResult

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="campaign")(_campaign)


def _campaign(
    plan: Annotated[Path, typer.Argument(help="Plan (.toml), or the folder of a campaign, of which nothing is run.")],
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder to write; one that was begun is gone on with.")
    ] = None,
    by: Annotated[
        list[str] | None, typer.Option("--by", metavar="FACTOR", help="Factor to group by; may be repeated.")
    ] = None,
    workers: Annotated[int | None, typer.Option("--workers", help="Processes; by default one per processor.")] = None,
    cluster: Annotated[str, typer.Option("--cluster", help="Dask scheduler instead, such as tcp://host:8786.")] = "",
    json: JsonOption = False,
) -> None:
    """Run many simulated cases by a plan into one dataset, and summarise it; a second call goes on where one ended.

    Example: gfimu new plan --out plan.toml, then gfimu campaign plan.toml --out campaign

    Example: gfimu campaign campaign --by method
    """
    from gfimu.commands.campaign import campaign

    with progress(f"campaign {plan}", total=1.0) as done:
        found = campaign(
            plan,
            out=out,
            by=by or [],
            workers=workers,
            cluster=cluster,
            progress=lambda ready, cases: done(ready / cases),
        )
    if json:
        print_json(found.to_dict())
        return
    _print(found)
    if out is not None:
        print_paths([("campaign", out)])


def _print(found: CampaignResult) -> None:
    factors = list(found.groups[0].values) if found.groups else []
    rows = [
        (
            *(str(group.values[name]) for name in factors),
            group.result,
            str(group.cases),
            f"{group.median:.4g}",
            f"{group.low:.4g} … {group.high:.4g}",
        )
        for group in found.groups
    ]
    title = f"{found.folder}: {found.done} of {found.cases} cases"
    print_table(title, (*factors, "result", "cases", "median or share", "5 … 95 %"), rows)
    for reason, count in found.failures.items():
        print_text(f"{count} failed: {reason}", style="yellow")
