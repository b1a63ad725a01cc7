"""`gfimu design`: the experiment that best separates effects."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gfimu.cli import completion
from gfimu.cli.output import print_json, print_paths, print_table, progress
from gfimu.cli.shared_options import JsonOption, MapOption, MapSetOption, TwinOption, shared

if TYPE_CHECKING:
    from gfimu.diagnosis.design.proposal import Proposal

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="design")(_design)


def _design(
    twin: TwinOption,
    effects: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[EFFECT]...", autocompletion=completion.effects, help="Effects to distinguish; or use --verdict."
        ),
    ] = None,
    verdict: Annotated[
        Path | None, typer.Option("--verdict", help="Take the effects of an ambiguous verdict (verdict.json).")
    ] = None,
    runs: Annotated[
        list[Path] | None,
        typer.Option("--run", help="Recording at hand, to be diagnosed together with the new one; may be repeated."),
    ] = None,
    column_map: MapOption = None,
    map_set: MapSetOption = None,
    max_rate: Annotated[
        float, typer.Option("--max-rate", metavar="RAD/S", help="Largest rate of the table, rad/s.")
    ] = 15.0,
    max_acceleration: Annotated[
        float,
        typer.Option("--max-acceleration", metavar="RAD/S²", help="Largest angular acceleration of the table, rad/s²."),
    ] = 20.0,
    duration: Annotated[float, shared("--duration")] = 60.0,
    upright: Annotated[bool, typer.Option("--upright", help="Never propose to mount the array differently.")] = False,
    evaluations: Annotated[int, typer.Option("--evaluations", min=1, help="How many profiles to try.")] = 150,
    seed: Annotated[int, shared("--seed", min=0)] = 0,
    out: Annotated[Path | None, typer.Option("--out", help="Scenario to write (.toml): the experiment.")] = None,
    json: JsonOption = False,
) -> None:
    """Propose the table profile, or the mounting, that best separates effects.

    Examples
    --------
    gfimu design tacho_scale sensor_position --twin cube12_turntable --max-rate 12 --out next.toml
    # The effects of an ambiguous verdict, with the recording at hand
    gfimu design --verdict diagnosis/verdict.json --run run.parquet --twin cube12_turntable --out next.toml
    """
    from gfimu.commands.design import design

    with progress("designing", total=1.0) as advance:
        proposal = design(
            twin,
            effects or [],
            verdict=verdict,
            run=runs or [],
            column_map=column_map,
            map_set=map_set or [],
            max_rate=max_rate,
            max_acceleration=max_acceleration,
            duration=duration,
            upright=upright,
            evaluations=evaluations,
            seed=seed,
            out=out,
            report=advance,
        )
    if json:
        print_json(proposal.to_dict() | {"files": {} if out is None else {"scenario": out}})
        return
    _print(proposal, at_hand=bool(runs))
    if out is not None:
        print_paths([("scenario", out)])


def _print(proposal: Proposal, *, at_hand: bool) -> None:
    names = proposal.effects
    print_table(
        "Margin of each effect over each rival, nats",
        ["effect", "rival", "recorded so far" if at_hand else "plain run", "with this experiment"],
        [
            [names[i], names[j], f"{proposal.before.nats[i, j]:.3g}", f"{proposal.after.nats[i, j]:.3g}"]
            for i in range(len(names))
            for j in range(len(names))
            if i != j
        ],
        note="Expected log likelihood by which the effect, at its size, beats the best fit of the rival.",
    )
    pieces = proposal.profile.in_words()
    print_table("Profile", ["piece"], [[f"{number}. {piece}"] for number, piece in enumerate(pieces, start=1)])
    typer.echo(proposal.text)
