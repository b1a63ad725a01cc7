"""`gfimu simulate`: make a recording from a scenario."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gfimu.cli.output import JsonOption, print_json, print_paths, print_table, progress

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="simulate")(_simulate)


def _simulate(
    scenario: Annotated[str, typer.Argument(help="Name of a scenario, or a scenario or twin file (.toml).")],
    out: Annotated[Path, typer.Option("--out", help="Recording to write, .csv or .parquet.")],
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of everything left to chance.")] = 0,
    changes: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Change a key of the scenario file; may be repeated."),
    ] = None,
    raw: Annotated[bool, typer.Option("--raw", help="Keep the readings as counts of the converter.")] = False,
    rrd: Annotated[Path | None, typer.Option("--rrd", help="Rerun recording to write.")] = None,
    json: JsonOption = False,
) -> None:
    """Simulate a scenario on the MuJoCo turntable and write what the board would have recorded.

    Example: gfimu simulate paper_run --out run.parquet --seed 1 --set sensor.range_g=8
    """
    from gfimu.commands.simulate import simulate
    from sim.scenarios import Scenario, summarise

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
