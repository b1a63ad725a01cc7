"""Draw the figures of docs/cases/worked_diagnoses.md and print its numbers.

Run ``python docs/scripts/make_worked_diagnoses.py [FOLDER]``; the folder is ``docs/figures`` unless given.
The case of the
real board needs its two recordings, in ``data/mimu4444`` beside the project's folder or under ``--data FOLDER``.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from gfimu.base.results.colours import AFTER_ON_PAPER, BEFORE_ON_PAPER, NOISE_ON_PAPER, css
from gfimu.diagnosis.criticism.views.residuals import residual_views
from gfimu.diagnosis.diagnose import diagnose
from gfimu.diagnosis.verdict.verdict import Diagnosis
from gfimu.recording.mimu4444 import read_mimu4444
from sim.scenarios import Scenario
from sim.simulation import simulate
from sim.twin import Twin

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data" / "mimu4444"
BEFORE, AFTER, INK = css(BEFORE_ON_PAPER), css(AFTER_ON_PAPER), css(NOISE_ON_PAPER)
TILT = {"x_rad": 0.015, "y_rad": -0.010}
_TURN_REST = 480.0  # s: the poses end about here in both recordings of the board


@dataclass(frozen=True)
class Cases:
    """The diagnoses that the page tells of; the board's is None where its recordings are not at hand."""

    table: Diagnosis
    board: Diagnosis | None


def diagnose_table() -> Diagnosis:
    """The paper's story: the twin's table is level, the true one is not."""
    recording = simulate(Scenario.load("paper_run", changes=table_changes()), seed=0)
    return diagnose([recording], Twin.load("cube12_turntable"), names=["tilted.parquet"])


def table_changes() -> list[str]:
    """Changes of the scenario: ideal chips but for noise, on a table that leans."""
    parameters = ", ".join(f"{key} = {value}" for key, value in TILT.items())
    return [
        "sensor.errors=false",
        "sensor.bandwidth=false",
        f'effect=[{{name = "table_tilt", parameters = {{{parameters}}}}}]',
    ]


def diagnose_board(data: Path = DATA) -> Diagnosis | None:
    """A board of eight accelerometers, turned to poses and shaken by hand, its gain on the other recording."""
    files = [data / f"exp_{number}.bin.gz" for number in (1, 2)]
    if not all(file.is_file() for file in files):
        return None
    first, other = (read_mimu4444(file) for file in files)
    return diagnose([first], Twin.load("mimu4444_free"), held_out=[other], names=[files[0].name])


def ripple(diagnosis: Diagnosis, path: Path) -> float:
    """Draw the residual over the table's angle and its order spectrum; return the order of the strongest line."""
    run = diagnosis.runs[0]
    before, after = (np.where(run.valid, run.measured - p, 0.0) for p in (run.before, run.after))
    orders = residual_views(run, diagnosis.twin.array.channels).orders
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained", dpi=80)
    turning = np.abs(run.rate) > 1.0
    turn = np.rad2deg(np.mod(run.angle, 2 * np.pi))[turning]
    left.plot(turn, before[turning, 0], ".", ms=1.2, color=BEFORE, label="level table assumed")
    left.plot(turn, after[turning, 0], ".", ms=1.2, color=AFTER, label="tilt in the twin")
    left.set(xlabel="angle of the table, degrees", ylabel="measured − predicted, m/s²", title="channel a11")
    left.legend(loc="upper right", fontsize=8, markerscale=6)
    strongest = 0.0
    if orders is not None:
        right.plot(orders.at, orders.before, color=BEFORE)
        right.plot(orders.at, orders.after, color=AFTER)
        right.plot(orders.at, orders.noise, color=INK, lw=0.8)
        right.set(
            xlabel="cycles per revolution", ylabel=orders.quantity, yscale="log", xlim=(0, 8), title="all channels"
        )
        strongest = orders.line_before.place if orders.line_before else 0.0
    figure.savefig(path)
    plt.close(figure)
    return strongest


def still_and_moving(diagnosis: Diagnosis) -> dict[str, tuple[float, float]]:
    """Return the residual's rms before and after at rest and in motion, m/s²."""
    run = diagnosis.runs[0]
    poses = run.t - run.t[0] < _TURN_REST
    found = {}
    for name, rows in (
        ("rest", poses & (run.rate < 0.05)),
        ("motion", run.rate > 10.0),
    ):
        use = run.valid & rows[:, None]
        found[name] = tuple(float(np.sqrt(np.mean((run.measured - p)[use] ** 2))) for p in (run.before, run.after))
    return found


def board_residual(diagnosis: Diagnosis, path: Path) -> None:
    """Draw the residual of one channel over the whole recording, and the rms of every channel at rest."""
    run = diagnosis.runs[0]
    channels = diagnosis.twin.array.channels
    rest = (run.rate < 0.05)[:, None] & run.valid
    rms = [
        np.sqrt(np.sum(np.where(rest, run.measured - p, 0.0) ** 2, axis=0) / rest.sum(axis=0))
        for p in (run.before, run.after)
    ]
    worst = int(np.argmax(rms[0]))
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained", dpi=80, width_ratios=[1, 1.2])
    for prediction, colour, label in ((run.before, BEFORE, "as drawn"), (run.after, AFTER, "extended")):
        left.plot(
            run.t, np.where(run.valid, run.measured - prediction, np.nan)[:, worst], color=colour, lw=0.5, label=label
        )
    left.set(xlabel="time, s", ylabel="measured − predicted, m/s²", title=f"channel {channels[worst]}", ylim=(-3, 3))
    left.legend(loc="lower left", fontsize=8)
    places = np.arange(len(channels))
    right.bar(places - 0.2, rms[0], 0.4, color=BEFORE)
    right.bar(places + 0.2, rms[1], 0.4, color=AFTER)
    right.plot(places, run.white * np.sqrt(1 - 3 / len(channels)), "_", color="black", ms=8, label="white noise")
    right.set_xticks(places, channels, rotation=90, fontsize=7)
    right.set(yscale="log", title="rms at rest, m/s²")
    right.legend(fontsize=8)
    figure.savefig(path)
    plt.close(figure)


def board_noise(diagnosis: Diagnosis, path: Path) -> None:
    """Draw what is left against how fast the readings change."""
    run = diagnosis.runs[0]
    period = run.t[1] - run.t[0]
    change = np.sqrt(np.mean((run.measured[2:] - run.measured[:-2]) ** 2, axis=1)) / (2 * period)
    use = run.valid[1:-1].all(axis=1)
    left_over = np.sqrt(np.mean((run.measured - run.after)[1:-1] ** 2, axis=1))
    figure, panel = plt.subplots(figsize=(5.4, 3.4), layout="constrained", dpi=80)
    panel.loglog(change[use], left_over[use], ".", ms=1.2, color=AFTER, alpha=0.4, rasterized=True)
    line = np.geomspace(5, change[use].max(), 50)
    floor = diagnosis.residual.noise_floor
    panel.loglog(line, np.hypot(floor, diagnosis.noise.disagreement_s * line), color="black", lw=1.2)
    panel.axhline(floor, color=INK, lw=0.8)
    panel.set(xlabel="rate of change of the readings, m/s³", ylabel="rms of 24 channels left, m/s²")
    figure.savefig(path)
    plt.close(figure)


def main(folder: Path = ROOT / "docs" / "figures", data: Path = DATA) -> tuple[Cases, list[Path]]:
    """Diagnose the cases and draw their figures; returns both."""
    folder.mkdir(parents=True, exist_ok=True)
    cases = Cases(diagnose_table(), diagnose_board(data))
    paths = [folder / "diagnosis_ripple.png"]
    order = ripple(cases.table, paths[0])
    print(f"table: {cases.table.verdict}, strongest at {order:.2f} cycles per revolution")
    for cause in cases.table.causes:
        print(f"  {cause.effect}: {cause.parameters} ± {cause.std}")
    if cases.board is not None:
        paths += [folder / "diagnosis_board.png", folder / "diagnosis_board_noise.png"]
        board_residual(cases.board, paths[1])
        board_noise(cases.board, paths[2])
        print(f"board: {cases.board.verdict}, gain {cases.board.gain}, {still_and_moving(cases.board)}")
        print(f"  {cases.board.noise}")
        for cause in cases.board.causes:
            print(f"  {cause.effect} {cause.log_odds:.0f}: {cause.parameters} ± {cause.std}")
    return cases, paths


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "docs" / "figures")
    parser.add_argument("--data", type=Path, default=DATA)
    options = parser.parse_args()
    main(options.folder, options.data)
