"""`gfimu optimize`: search accelerometer arrays."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gfimu.cli import completion
from gfimu.cli.output import print_json, print_paths, print_table, print_text, progress
from gfimu.cli.score import print_scores
from gfimu.cli.shared_options import JsonOption, shared

if TYPE_CHECKING:
    from gfimu.array_search.front import Front
    from gfimu.array_search.search import SearchResult

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="optimize")(_optimize)


def _optimize(
    brief: Annotated[
        Path | None,
        typer.Argument(metavar="[BRIEF]", help="Design brief (.toml; gfimu new brief); options replace its values."),
    ] = None,
    chips: Annotated[int | None, shared("--chips")] = None,
    axes_per_chip: Annotated[
        int | None, typer.Option("--axes-per-chip", help="Sensing axes of a chip: 1, 2 or 3; 3 by default.")
    ] = None,
    box: Annotated[
        tuple[float, float, float] | None,
        typer.Option("--box-m", help="Edges of a box around the body origin, m; 0.1 0.1 0.1 by default."),
    ] = None,
    spacing: Annotated[
        float | None, typer.Option("--min-spacing-m", help="Least distance between chips, m; 0.005 by default.")
    ] = None,
    non_recursive: Annotated[
        bool, typer.Option("--non-recursive", help="Only arrays whose angular acceleration is free of ω².")
    ] = False,
    objective: Annotated[
        str | None,
        typer.Option(
            "--objective",
            metavar="NAME",
            autocompletion=completion.objectives,
            help="What is to be small: gdop (default), gdop_joint, kappa, sigma_alpha, sigma_p, rate, drift, fault; "
            "with _worst at the end over the brief's tolerances.",
        ),
    ] = None,
    pareto: Annotated[
        tuple[str, str] | None,
        typer.Option("--pareto", help="Search the front of two objectives, or of one and chips or size; with --front."),
    ] = None,
    most_chips: Annotated[
        int | None, typer.Option("--most-chips", help="Of a front over chips: the largest number of them.")
    ] = None,
    restarts: Annotated[
        int | None, typer.Option("--restarts", help="Most random starts; 40 by default, fewer once ten agree.")
    ] = None,
    seed: Annotated[int | None, shared("--seed", min=0, more="; by default that of the brief, or 0")] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Array file to write (.toml).")] = None,
    picture: Annotated[Path | None, shared("--picture", more=": the array in its volume")] = None,
    front: Annotated[
        Path | None, typer.Option("--front", help="Folder to write: the front as picture, table and array files.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Search the array of chips in a volume that minimises an objective, or the front of two objectives.

    Examples
    --------
    gfimu optimize --chips 5 --non-recursive --out best5.toml
    # By a design brief
    gfimu new brief --out brief.toml
    gfimu optimize brief.toml --picture best.png
    # What each further chip gains
    gfimu optimize --chips 4 --most-chips 10 --pareto chips gdop --front by_chips
    """
    from gfimu.array_search.front import Front
    from gfimu.commands.optimize import optimize

    with progress("searching arrays", total=1.0 if pareto else restarts or 40) as advance:
        result = optimize(
            chips,
            brief=brief,
            axes_per_chip=axes_per_chip,
            box_m=box,
            min_spacing_m=spacing,
            non_recursive=non_recursive,
            objective=objective,
            pareto=pareto,
            most_chips=most_chips,
            restarts=restarts,
            seed=seed,
            out=out,
            picture=picture,
            front=front,
            report=advance,
        )
    named = {"array": out, "picture": picture, "front": front}
    files = {what: path for what, path in named.items() if path is not None}
    if json:
        print_json(result.to_dict() | {"files": files})
        return
    if isinstance(result, Front):
        _print_front(result)
    else:
        _print_result(result)
    print_paths(files.items())


def _print_result(result: SearchResult) -> None:
    tri_axial = len(result.array.chips[0].axes) == 3
    print_table(
        f"{result.array.name}: positions in the body frame",
        ["chip", "x m", "y m", "z m", "sensing axes"],
        [
            [
                chip.name,
                *(f"{value:.5f}" for value in chip.position),
                "any, e.g. body axes" if tri_axial else "  ".join(_vector(axis) for axis in chip.axes),
            ]
            for chip in result.array.chips
        ],
    )
    print_scores([result.score], f"1 rev/s about z and channel noise {result.score.noise_m_s2:.4g} m/s²")
    print_text(f"{result.objective.meaning}: {_figure(result.value)} {result.objective.unit}".rstrip())
    near = f", {result.near} within 0.1 %" if result.near > result.agreeing else ""
    print_text(f"{result.agreeing} of {result.starts} starts agree on it{near}")
    if result.certificate is None:
        print_text("certificate: none; no lower bound is known for this objective and these chips")
    else:
        print_text(result.certificate.text)


def _print_front(front: Front) -> None:
    heads = [f"{name}, {unit}" if unit else name for name, unit in zip(front.names, front.units, strict=True)]
    print_table(
        f"Front of {front.meanings[0]} and {front.meanings[1]}",
        ["array", *heads, "starts that agree", "bounds"],
        [
            [
                point.array.name,
                *(_figure(value) for value in point.values),
                f"{point.agreeing} of {point.starts}",
                "  ".join("—" if bound is None else f"{bound:.5g}" for bound in point.bounds),
            ]
            for point in front.points
        ],
        note="No array of the table is worse than another in both. Bounds: proven least of each figure alone; —: none.",
    )


def _figure(value: float) -> str:
    return f"{value:.5g}" if math.isfinite(value) else "—"


def _vector(axis: Iterable[float]) -> str:
    return "(" + ", ".join(f"{value:.4f}" for value in axis) + ")"
