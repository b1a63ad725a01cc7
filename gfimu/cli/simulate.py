"""`gfimu simulate`: make a recording from a scenario."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gfimu.cli import completion
from gfimu.cli.output import print_json, print_paths, print_table, progress
from gfimu.cli.shared_options import JsonOption, RrdOption, shared

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="simulate")(_simulate)


def _simulate(
    scenario: Annotated[
        str,
        typer.Argument(
            metavar="SCENARIO",
            autocompletion=completion.scenarios,
            help="Name of a scenario, or a scenario or twin file (.toml).",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", help="Recording to write (.csv, .parquet).")],
    seed: Annotated[int, shared("--seed", min=0)] = 0,
    changes: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Change a key of the scenario file; may be repeated."),
    ] = None,
    raw: Annotated[bool, typer.Option("--raw", help="Keep the readings as counts of the converter.")] = False,
    rrd: RrdOption = None,
    json: JsonOption = False,
) -> None:
    """Simulate a scenario on the MuJoCo turntable and write what the board would have recorded.

    Examples
    --------
    gfimu simulate paper_run --out run.parquet --seed 1
    # Keys of the scenario changed
    gfimu simulate paper_run --out run.csv --set sensor.range_g=8 --set duration_s=5
    # With a picture for the rerun viewer
    gfimu simulate tumble --out tumble.parquet --rrd tumble.rrd
    """
    from gfimu.commands.simulate import simulate
    from sim.scenarios import Scenario
    from sim.simulation import summarise

    with progress(f"simulating {scenario}", total=1.0) as done:
        recording = simulate(scenario, out=out, seed=seed, changes=changes or [], raw=raw, rrd=rrd, progress=done)
    written = {"recording": out} | ({} if rrd is None else {"rrd": rrd})
    run = Scenario.load(scenario, changes=changes or [])
    summary = summarise(run, recording)
    if json:
        print_json(summary | {"files": written})
        return
    rows = [
        ("samples", f"{summary['samples']} at {summary['sample_rate_hz']:g} Hz"),
        ("duration", f"{summary['duration_s']:.2f} s"),
        ("array", f"{summary['array']}, {len(summary['channels'])} channels"),
        ("motion", summary["drive"]),
        ("effects", ", ".join(summary["effects"]) or "none"),
        ("fastest turn", f"{summary['peak_rate_rad_s']:.3f} rad/s"),
        ("largest reading", f"{summary['peak_reading_m_s2']:.2f} m/s²"),
        ("seed", seed),
    ]
    print_table(run.name, ("quantity", "value"), rows, note=run.description)
    print_paths(written.items())
