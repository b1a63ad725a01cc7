"""`gfimu diagnose`: what the simulation gets wrong against recordings, and why."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from gfimu.cli.output import JsonOption, console, print_json, print_paths, print_table, progress

if TYPE_CHECKING:
    from gfimu.diagnosis.model import WorldModel
    from gfimu.diagnosis.verdict import Diagnosis
    from gfimu.recording import Recording
    from sim.twin import Twin

__all__ = ["register", "write_result"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="diagnose")(_diagnose)


def _diagnose(
    runs: Annotated[
        list[Path],
        typer.Argument(metavar="RUN...", help="Recordings of one rig: .csv, .parquet, .bin; fitted together."),
    ],
    twin: Annotated[str, typer.Option("--twin", help="What the simulation believes: a name, or a twin file (.toml).")],
    out: Annotated[Path, typer.Option("--out", help="Folder for verdict.json, twin.toml, report.html, diagnosis.rrd.")],
    held_out: Annotated[
        list[Path] | None,
        typer.Option("--held-out", metavar="RUN", help="Recording kept for measuring the gain; may be repeated."),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option("--calibration", help="Calibration of the unit, applied first (JSON, from `gfimu calibrate`)."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Show what a simulation gets wrong against recordings, name the cause, extend the simulation, measure the gain.

    Writes the verdict, the extended twin, a report for people and a rerun recording to a folder.

    Example: gfimu diagnose run.parquet --twin cube12_turntable --out diagnosis

    A unit fresh from the bench: gfimu diagnose run.parquet --twin cube12_turntable --calibration cal.json --out d
    """
    from gfimu.calibration.result import load_calibration
    from gfimu.calibration.run_file import open_calibrated_run
    from gfimu.diagnosis.diagnose import diagnose
    from gfimu.diagnosis.folder import check_folder
    from gfimu.recording_formats import open_recording
    from sim.twin import Twin

    model = Twin.load(twin)
    check_folder(out)
    if calibration is None:
        recordings, kept = (
            [open_recording(path, array=model.array) for path in paths] for paths in (runs, held_out or [])
        )
    else:
        unit = load_calibration(calibration)
        recordings, kept = (
            [open_calibrated_run(path, unit, model.array)[0] for path in paths] for paths in (runs, held_out or [])
        )
        if unit.positions:
            model = replace(model, array=unit.calibrated_array(model.array), array_name="array.toml")
    with progress("diagnosing", total=1.0) as done:
        found = diagnose(recordings, cast("WorldModel", model), held_out=kept, names=_names(runs), report=done)
        done(0.99, "write the report")
        written = write_result(out, found, recordings[0])
    if json:
        print_json(found.to_dict() | {"files": written})
        return
    print_diagnosis(found)
    print_paths(written.items())


def write_result(out: Path, found: Diagnosis, recording: Recording) -> dict[str, Path]:
    """Write the folder of a diagnosis, with the rig of the extended twin drawn by its MuJoCo model."""
    import tomli_w

    from gfimu.diagnosis.folder import write_diagnosis
    from gfimu.model_files import list_models
    from sim.drawing import rig_drawing

    twin = cast("Twin", found.twin)
    world = twin.world(mounting=recording.mounting_rotvec)
    content = twin.to_dict()
    more = {}
    if content["array"] not in list_models("arrays"):
        # An array file of the user's is named relative to the twin file: it moves with it.
        content["array"] = "array.toml"
        more["array.toml"] = twin.array.to_toml()
    return write_diagnosis(
        out,
        found,
        twin_toml=tomli_w.dumps(content),
        more=more,
        mounting=world.mount_rotvec,
        cube_centre=world.cube_offset.tolist(),
        shapes=None if twin.drive_source == "gyro" else rig_drawing(world),
    )


def print_diagnosis(found: Diagnosis) -> None:
    """Print a diagnosis for people."""
    from gfimu.diagnosis.plain_words import (
        gain_rows,
        headline,
        next_steps,
        odds,
        parameter_texts,
        parameter_units,
        percent,
        story,
        summary,
    )

    console.print(f"[bold]{headline(found)}[/bold]", highlight=False)
    console.print(story(found), highlight=False)
    if found.causes:
        rows = []
        for cause in found.causes:
            texts = parameter_texts(cause, parameter_units(found, cause))
            texts = [one for one in texts if one.significant] or texts
            rows += [(cause.effect, summary(found, cause), percent(cause.probability))]
            rows += [
                (f"  {one.name}", f"{one.value}{f' = {one.familiar}' if one.familiar else ''}", "") for one in texts
            ]
        print_table(
            f"Verdict: {found.verdict.replace('_', ' ')}",
            ("cause", "what is so in the world", "probability"),
            rows,
            left=2,
        )
    residual, gain = found.residual, found.gain
    error = [("prediction error, rms", f"{residual.rms_before:.3g} m/s²", f"{residual.rms_after:.3g} m/s²")]
    error += [(f"unseen data: {what}", before, after) for what, before, after in gain_rows(found)]
    share = percent(gain.share_of_excess_removed)
    note = f"the sensors' own noise: {residual.noise_floor:.3g} m/s²"
    if share != "–":
        note += f"; on unseen data ({gain.held_out}) {share} of the error beyond noise is gone"
    print_table("Error before and after", ("", "before", "after"), error, note=note)
    if found.rivals:
        rivals = [(" + ".join(one.effects) or "nothing", one.why, odds(one.log_odds)) for one in found.rivals[:5]]
        print_table("Other explanations, and why they lost", ("explanation", "why it lost", "odds"), rivals, left=2)
    for step in next_steps(found):
        console.print(f"next: {step}", highlight=False)


def _names(paths: list[Path]) -> list[str]:
    """Return names for people: file names where they tell the runs apart."""
    names = [path.name for path in paths]
    return names if len(set(names)) == len(names) else [str(path) for path in paths]
