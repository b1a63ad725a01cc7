"""The commands of the program by job, each with the file that holds it and its line of help.

The table stands here, and not in the files, so that ``gfimu --help`` imports none of them and a command only its own.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["COMMANDS", "JOBS", "Entry"]


@dataclass(frozen=True)
class Entry:
    """One command: its name, its line of help, and the file of `gfimu.cli` that registers it."""

    name: str
    help: str
    file: str


JOBS: dict[str, tuple[Entry, ...]] = {
    "First steps": (
        Entry(
            "demo",
            "Run the paper's experiment in simulation: geometry, recording, estimate, drift, picture, diagnosis.",
            "demo",
        ),
        Entry("list", "List what gfimu ships: arrays, parts, scenarios, twins, effects and other kinds.", "list"),
        Entry(
            "show",
            "Print a shipped file, a file of your own (checked), the array of a recording, or an effect.",
            "show",
        ),
        Entry("new", "Write a commented file to edit.", "new"),
        Entry(
            "schema",
            "Print the JSON schema of what a command prints with --json: every key with its meaning and unit.",
            "schema",
        ),
    ),
    "Bring a recording": (
        Entry(
            "inspect",
            "Show what a file holds (columns, units, rate, gaps, rails, corrupt values, chips) and a column map "
            "to start from.",
            "inspect",
        ),
        Entry(
            "convert",
            "Convert a recording between CSV and Parquet, or import MIMU4444 streams and foreign files. Readings "
            "become m/s².",
            "convert",
        ),
        Entry(
            "join",
            "Find the offset and the rate error between two clocks, and put channels and reference into one recording.",
            "join",
        ),
        Entry("record", "Record from a board (real or virtual), with the angular rate shown as it comes.", "record"),
    ),
    "Calibrate and estimate": (
        Entry(
            "calibrate",
            "Calibrate the accelerometers or the gyro of a recording, each parameter with its standard deviation.",
            "calibrate",
        ),
        Entry(
            "certificate",
            "State a calibration in the terms of IEEE 1293 and NIST, with expanded uncertainties and their budget.",
            "certificate",
        ),
        Entry(
            "noise",
            "Identify velocity random walk N, bias instability B, acceleration random walk K, "
            "quantisation Q and ramp R.",
            "noise",
        ),
        Entry("estimate", "Estimate p, α, ω, attitude and table angle from a recording.", "estimate"),
        Entry(
            "impact",
            "Measure one impact: channels zeroed and filtered to a class, time zero, polarity, peaks of p, α and ω.",
            "impact",
        ),
        Entry(
            "live",
            "Estimate the angular rate while samples arrive: CSV lines in, one JSON line per sample out.",
            "live",
        ),
        Entry(
            "view", "Open a run in the rerun viewer: the rig in 3-D, raw channels, and the estimate over time.", "view"
        ),
    ),
    "Find what a simulation gets wrong": (
        Entry(
            "check",
            "Check recordings before a diagnosis: data quality, effects that their motion separates, what to record "
            "next.",
            "check",
        ),
        Entry(
            "diagnose",
            "Compare recordings with a simulation: name the causes of the difference, extend the simulation, measure "
            "the gain.",
            "diagnose",
        ),
        Entry("design", "Propose the table profile, or the mounting, that best separates effects.", "design"),
        Entry(
            "benchmark",
            "Measure how well a method names what a simulation gets wrong: fixed worlds, a judge, baselines.",
            "benchmark",
        ),
    ),
    "Design and simulate": (
        Entry(
            "score",
            "Score array geometries: condition number, GDOP, errors, leakage of ω², visible products of ω, least "
            "faults.",
            "score",
        ),
        Entry(
            "optimize",
            "Search the array of chips in a volume that minimises an objective, or the front of two objectives.",
            "optimize",
        ),
        Entry(
            "drift",
            "Position-drift budget of an array in closed form, with a Monte Carlo; the drift of a recording at rest.",
            "drift",
        ),
        Entry(
            "tolerance",
            "Budget the errors of α, ω and position from machining and chip tolerances: shares, simulated units.",
            "tolerance",
        ),
        Entry(
            "simulate",
            "Simulate a scenario on the MuJoCo turntable and write what the board would have recorded.",
            "simulate",
        ),
        Entry(
            "campaign",
            "Run many simulated cases of a plan into one dataset, and summarise it; a second call continues the first.",
            "campaign",
        ),
        Entry("firmware", "The LPC1768 image in the emulator: run, build, selftest, trace, faults, check.", "firmware"),
    ),
}
"""Commands by job, in the order of the help."""

COMMANDS: dict[str, Entry] = {entry.name: entry for entries in JOBS.values() for entry in entries}
"""Commands by name."""
