"""`gfimu campaign`: many simulated cases by a plan: run, status, table, plot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from gfimu.cli.campaign_views import (
    ByOption,
    duration_text,
    plot,
    print_failures,
    print_groups,
    status,
    table,
)
from gfimu.cli.command import CommandApp, GfimuGroup
from gfimu.cli.output import print_json, print_paths, print_text, progress
from gfimu.cli.shared_options import JsonOption, shared
from gfimu.errors import InputError, nearest_name

__all__ = ["register"]


class _Campaigns(GfimuGroup):
    """The commands; without the name of one, what follows is the plan that `run` takes."""

    default = "run"

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if args and args[0] not in {*self.commands, "--help", "-h"}:
            meant = nearest_name(args[0], self.commands)
            if meant and not Path(args[0]).exists():
                raise InputError(f"{args[0]}: neither a plan nor a command; did you mean gfimu campaign {meant}?")
            args = [self.default, *args]
        return super().parse_args(ctx, args)


def register(app: typer.Typer) -> None:
    """Add the commands."""
    group = CommandApp(
        cls=_Campaigns,
        help="Run many simulated cases of a plan into one dataset, and summarise it; a second call continues the first."
        "\n\nThe word run may be left out.\n\nExamples\n--------\ngfimu campaign plan.toml --out campaign\n"
        "# Its progress, from another terminal\ngfimu campaign status campaign",
        no_args_is_help=True,
        subcommand_metavar="PLAN --out DIR | COMMAND [ARGS]...",
    )
    group.command(name="run")(_run)
    group.command(name="status")(status)
    group.command(name="table")(table)
    group.command(name="plot")(plot)
    app.add_typer(group, name="campaign")


def _run(
    plan: Annotated[
        Path, typer.Argument(metavar="PLAN", help="Plan (.toml), or the folder of a campaign, of which nothing is run.")
    ],
    out: Annotated[Path | None, typer.Option("--out", help="Folder to write; one that was begun is continued.")] = None,
    by: ByOption = None,
    workers: Annotated[int | None, shared("--workers", more="; with --cluster slurm, jobs")] = None,
    cluster: Annotated[
        str, typer.Option("--cluster", help="Dask scheduler instead, such as tcp://host:8786, or slurm.")
    ] = "",
    json: JsonOption = False,
) -> None:
    """Run the cases of a plan that the folder lacks, and summarise them; or summarise a folder.

    Exit code 1 if every case failed. After Ctrl-C the finished cases stay; the same command goes on with the others.

    Examples
    --------
    # A plan to edit, then its cases
    gfimu new plan --out plan.toml
    gfimu campaign plan.toml --out campaign
    # Summarise a folder by a factor
    gfimu campaign campaign --by method
    """
    from gfimu.commands.campaign import campaign

    with progress(f"campaign {plan}", total=1.0, time_left=False) as done:
        found = campaign(
            plan, out=out, by=by or [], workers=workers, cluster=cluster, progress=_Shown(f"campaign {plan}", done)
        )
    if json:
        print_json(found.to_dict() | {"files": {} if out is None else {"campaign": out}})
    else:
        print_groups(f"{found.folder}: {found.done} of {found.cases} cases", found.groups)
        print_failures(found.failures)
        if out is not None:
            print_paths([("campaign", out)])
    if out is not None and found.done == sum(found.failures.values()):
        print_text("every case failed", style="yellow", stderr=True)
        raise typer.Exit(1)


class _Shown:
    """Progress on the terminal: cases, their rate in this call, and the time left by that rate."""

    def __init__(self, title: str, show: Any) -> None:
        from sim.sweep.pace import Pace

        self._title, self._show, self._pace = title, show, Pace()
        self._before: int | None = None

    def __call__(self, ready: int, cases: int) -> None:
        self._before = ready if self._before is None else self._before
        rate = self._pace.note(ready - self._before)
        left = f", {rate:.3g}/s, {duration_text((cases - ready) / rate)} left" if rate else ""
        self._show(ready / cases, f"{self._title}: {ready} of {cases}{left}")
