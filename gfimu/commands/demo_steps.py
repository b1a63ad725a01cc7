"""The steps of `gfimu demo`: each does one job of the package on the paper's run and says what came out in one line."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.declared import Declared, Number, Written, figure, table
from gfimu.base.results import TableResult, text_column

if TYPE_CHECKING:
    from gfimu.budget.drift.monte_carlo import DriftSample
    from gfimu.motion.estimate import Estimate
    from gfimu.motion.rest_bias import RestBias
    from gfimu.recording import Recording
    from sim.scenarios import Scenario

__all__ = ["STEPS", "Demo", "DemoResult", "Row"]

_SCENARIO = "paper_run"
_TWIN = "cube12_turntable"
_DRIFT_SECONDS = 5.0  # the closed forms of the drift still hold then
_MONTE_CARLO_RUNS = 200

_optional = partial(figure, absent=True)


@dataclass(frozen=True)
class Row(Declared):
    """One line of the demo's table; which figures it has depends on the line."""

    what: Annotated[str, figure("What was asked.", head="what")]
    result: Annotated[str, figure("The answer with its unit.", head="result", in_json=False)]
    beside: Annotated[str, figure("What to compare it with.", head="to compare", in_json=False)]
    condition_number: Annotated[Number, _optional("Condition number κ(J) of the array.")] = None
    gdop: Annotated[Number, _optional("GDOP of the array.")] = None
    omega_squared_leakage: Annotated[
        Number, _optional("Largest coefficient of a product of ω in the linear solution.")
    ] = None
    samples: Annotated[int | None, _optional("Samples of the recording.")] = None
    peak_rate_rad_s: Annotated[Number, _optional("Fastest rate of the run.", "rad/s")] = None
    largest_bias_m_s2: Annotated[Number, _optional("Largest bias read off at rest.", "m/s²")] = None
    rmse_m_s2: Annotated[Number, _optional("Error of p, rms.", "m/s²")] = None
    noise_std_m_s2: Annotated[Number, _optional("Error that the noise alone gives.", "m/s²")] = None
    rmse_rad_s2: Annotated[Number, _optional("Error of α, rms.", "rad/s²")] = None
    peak_rad_s2: Annotated[Number, _optional("Largest α of the run.", "rad/s²")] = None
    rmse_rad_s: Annotated[Number, _optional("Error of ω, rms.", "rad/s")] = None
    rmse_raw_rad_s: Annotated[Number, _optional("Error of ω without the biases taken off, rms.", "rad/s")] = None
    expected_std_at_end_rad_s: Annotated[
        Number, _optional("Standard deviation of ω that is expected at the end.", "rad/s")
    ] = None
    error_rad: Annotated[Number, _optional("Error of the angle at the end.", "rad")] = None
    error_m: Annotated[Number, _optional("Error of the position at the end.", "m")] = None
    expected_m: Annotated[Number, _optional("Position error that is expected, 1 σ.", "m")] = None
    valid_until_s: Annotated[Number, _optional("Time until which the closed form holds.", "s")] = None
    alpha_before_deg_s2: Annotated[Number, _optional("Apparent α at rest before the calibration.", "°/s²")] = None
    alpha_after_deg_s2: Annotated[Number, _optional("Apparent α at rest after it.", "°/s²")] = None
    rmse_before_rad_s: Annotated[Number, _optional("Error of ω before the calibration, rms.", "rad/s")] = None
    rmse_after_rad_s: Annotated[Number, _optional("Error of ω after it, rms.", "rad/s")] = None
    drift_before_m: Annotated[Number, _optional("Position drift before the calibration.", "m")] = None
    drift_after_m: Annotated[Number, _optional("Position drift after it.", "m")] = None
    hidden: Annotated[Number, _optional("Size of the hidden effect, in its unit.")] = None
    found: Annotated[Number, _optional("Size that the diagnosis finds, in its unit.")] = None
    std: Annotated[Number, _optional("Standard deviation of the size found, in its unit.")] = None
    unit: Annotated[str | None, _optional("Unit of these three.")] = None
    verdict: Annotated[str | None, _optional("Verdict of the diagnosis.")] = None


@dataclass(frozen=True)
class DemoResult(Declared, TableResult):
    """The paper's experiment in simulation: the results of the demo, and the files that it wrote.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.demo("gfimu-demo").rows  # doctest: +SKIP
    """

    seed: Annotated[int, figure("Seed of all random numbers.")]
    rows: Annotated[tuple[Row, ...], figure("The table, line by line.", key="results")]
    files: Annotated[Mapping[str, Path], figure("Files and folders that were written, by what they are.")]

    def shown(self) -> Iterator[Any]:
        """Yield the table, the files, and what to do with them."""
        yield table(self._heading(), self.rows, "what result beside")
        yield from (Written(what, path) for what, path in self.files.items())
        yield f"look at it with: gfimu view {self.files['rerun recording']}"
        yield f"and open {self.files['diagnosis report']} in a browser"

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per question: the answer, and what to compare it with."""
        keys = {"what": "what", "result": "result", "to_compare": "beside"}
        return {name: text_column(getattr(row, key) for row in self.rows) for name, key in keys.items()}

    def _heading(self) -> str:
        return f"The paper's experiment in simulation (seed {self.seed})"

    def _notes(self) -> tuple[str, ...]:
        return tuple(f"{meaning}: {path}" for meaning, path in self.files.items())


@dataclass
class Demo:
    """What the steps have made so far; each step reads what earlier ones left here.

    Parameters
    ----------
    out : Path
        Folder for the files.
    seed : int
        Seed of all random numbers.
    """

    out: Path
    seed: int
    rows: list[Row] = field(default_factory=list)
    written: dict[str, Path] = field(default_factory=dict)
    scenario: Scenario = field(init=False)
    recording: Recording = field(init=False)
    bias: RestBias = field(init=False)
    estimate: Estimate = field(init=False)
    drift: DriftSample = field(init=False)

    def truth(self, quantity: str, unit: str) -> NDArray[np.float64]:
        """Return a vector of the true motion, shape (n, 3)."""
        return np.column_stack([self.recording.extra[f"truth_{quantity}_{axis}_{unit}"] for axis in "xyz"])

    def position_error(self, estimate: Estimate) -> NDArray[np.float64]:
        """Return the position error of an estimate in the world, m, shape (n, 3): the cube stands on the axis."""
        if estimate.position is None:
            raise TypeError("the estimate holds no position")
        true = self.truth("position", "m")
        return estimate.position - (true - true[0])

    def file(self, what: str, name: str) -> Path:
        """Return the path of a file that is written, and note what it is."""
        self.written[what] = self.out / name
        return self.written[what]

    @property
    def early(self) -> int:
        """First sample after the time until which the closed forms of the drift hold."""
        t_s = self.recording.t_s
        return int(np.searchsorted(t_s, t_s[0] + _DRIFT_SECONDS))


def score_geometry(demo: Demo) -> Iterator[Row]:
    """Score the array."""
    from gfimu.array_search.scoring import score

    del demo
    (cube,) = score("cube12")
    yield _row(
        "geometry: condition number, GDOP", "{condition_number:.4f}, {gdop:.4f}", "paper: 1.414, 1.061 (L/2 = 1)",
        condition_number=cube.condition_number, gdop=cube.gdop,
        omega_squared_leakage=float(np.max(np.abs(cube.omega_squared_leakage))),
    )  # fmt: skip


def simulate_run(demo: Demo) -> Iterator[Row]:
    """Simulate the paper's run in MuJoCo."""
    from sim.scenarios import Scenario
    from sim.simulation import simulate

    demo.scenario = Scenario.load(_SCENARIO)
    run = demo.recording = simulate(demo.scenario, seed=demo.seed, out=demo.file("recording", "run.parquet"))
    yield _row(
        "simulated run", f"{run.duration:.0f} s × {len(run.channels)} channels",
        f"±{{peak_rate_rad_s:.0f}} rad/s at {run.sample_rate:.0f} Hz; biases up to {{largest_bias_m_s2:.2f}} m/s²",
        samples=len(run), peak_rate_rad_s=float(np.abs(demo.truth("omega", "rad_s")).max()),
        largest_bias_m_s2=max(map(abs, run.metadata["truth_bias_m_s2"].values())),
    )  # fmt: skip


def read_biases(demo: Demo) -> Iterator[Row]:
    """Read the channels' biases off at rest, as the paper does."""
    from gfimu.motion.rest_bias import rest_bias

    array = demo.scenario.array
    demo.bias = rest_bias(demo.recording, array, gravity=demo.scenario.gravity)
    true_bias = np.array([demo.recording.metadata["truth_bias_m_s2"][channel] for channel in array.channels])
    yield _row(
        "biases read at rest, rms error", "{rmse_m_s2:.3f} m/s²",
        "{noise_std_m_s2:.3f} by noise, the rest by gain and axis errors",
        rmse_m_s2=_rms(demo.bias.bias - true_bias), noise_std_m_s2=_rms(demo.bias.std),
    )  # fmt: skip


def estimate_motion(demo: Demo) -> Iterator[Row]:
    """Estimate acceleration, rate and angle."""
    from gfimu.motion.estimation import estimate
    from gfimu.motion.rest_bias import estimate_from_rest

    array, gravity = demo.scenario.array, demo.scenario.gravity
    raw = estimate(demo.recording, array)
    motion = demo.estimate = estimate_from_rest(demo.recording, array, gravity=gravity, with_position=True)
    motion.write(demo.file("estimate", "estimate.parquet"))
    true_alpha, true_omega = demo.truth("alpha", "rad_s2")[:, 2], demo.truth("omega", "rad_s")[:, 2]
    true_angle = demo.recording.reference["angle_rad"]
    yield _row(
        "angular acceleration, rms error", "{rmse_rad_s2:.3f} rad/s²", "the table reaches {peak_rad_s2:.1f} rad/s²",
        rmse_rad_s2=_rms(motion.alpha[:, 2] - true_alpha), peak_rad_s2=float(np.abs(true_alpha).max()),
    )  # fmt: skip
    yield _row(
        "angular rate, integrated, rms error", "{rmse_rad_s:.3f} rad/s",
        "{rmse_raw_rad_s:.0f} rad/s with biases left in",
        rmse_rad_s=_rms(motion.omega[:, 2] - true_omega), rmse_raw_rad_s=_rms(raw.omega[:, 2] - true_omega),
        expected_std_at_end_rad_s=float(motion.omega_std[-1, 2]),
    )  # fmt: skip
    turns = np.abs(np.diff(true_angle)).sum() / (2 * np.pi)
    error = float(motion.angle[-1] - true_angle[-1])
    yield _row(
        "table angle, error at the end", "{error_rad:+.2f} rad", f"after {turns:.0f} revolutions", error_rad=error
    )


def state_drift(demo: Demo) -> Iterator[Row]:
    """State the position drift that was to be expected."""
    from gfimu.array.parts.part import white_noise_std
    from gfimu.budget.drift import ErrorSources, drift_budget
    from gfimu.budget.drift.monte_carlo import monte_carlo_drift

    array, recording = demo.scenario.array, demo.recording
    noise = _rms(white_noise_std(array, recording.sample_rate))
    sources = ErrorSources(bias=_rms(demo.bias.std), noise_density=noise / np.sqrt(recording.sample_rate / 2))
    budget = drift_budget(array, _DRIFT_SECONDS, sources, gravity=demo.scenario.gravity)
    rng = np.random.default_rng(demo.seed)
    demo.drift = monte_carlo_drift(array, recording.duration, sources, runs=_MONTE_CARLO_RUNS, rng=rng)
    error = demo.position_error(demo.estimate)
    yield _row(
        f"position drift after {_DRIFT_SECONDS:.0f} s", "{error_m:.1f} m",
        "expected {expected_m:.1f} m; formula holds to {valid_until_s:.1f} s",
        error_m=_horizontal(error[demo.early]), expected_m=_horizontal(budget.total_std),
        valid_until_s=budget.valid_until,
    )  # fmt: skip
    yield _row(
        f"position drift after {recording.duration:.0f} s", "{error_m:.0f} m",
        "expected {expected_m:.0f} m by Monte Carlo",
        error_m=_horizontal(error[-1]), expected_m=_horizontal(demo.drift.std[-1]),
    )  # fmt: skip


def calibrate_chips(demo: Demo) -> Iterator[Row]:
    """Calibrate the same chips from static poses and compare the drift."""
    from gfimu.calibration.array_calibration import calibrate_array
    from gfimu.motion.estimation import estimate
    from sim.motions.pose_sequence import PoseSequence
    from sim.simulation import simulate

    array, sequence = demo.scenario.array, PoseSequence()
    # The same seed draws the same chips.
    poses = simulate(replace(demo.scenario, motion=sequence, duration=sequence.duration), seed=demo.seed)
    calibration = calibrate_array(poses, array, gravity=demo.scenario.gravity)
    calibration.save(demo.file("calibration", "calibration.json"))
    still = demo.recording.t_s < demo.bias.stop_s

    def errors(recording: Recording) -> tuple[float, float, float]:
        found = estimate(recording, array, with_position=True)
        alpha = np.linalg.norm(np.nanmean(found.alpha[still], axis=0))
        omega = np.linalg.norm(found.omega - demo.truth("omega", "rad_s"), axis=1)
        return float(np.rad2deg(alpha)), _rms(omega), _horizontal(demo.position_error(found)[demo.early])

    (alpha_before, omega_before, drift_before), (alpha, omega, drift) = map(
        errors, (demo.recording, calibration.apply(demo.recording))
    )
    yield _row(
        f"calibrated from {calibration.statistics['poses']:.0f} poses: α seen at rest", "{alpha_after_deg_s2:.1f} °/s²",
        "{alpha_before_deg_s2:.0f} °/s² before", alpha_before_deg_s2=alpha_before, alpha_after_deg_s2=alpha,
    )  # fmt: skip
    yield _row(
        "calibrated: angular rate, rms error", "{rmse_after_rad_s:.2f} rad/s",
        "{rmse_before_rad_s:.0f} rad/s before; no bias read at rest in either",
        rmse_before_rad_s=omega_before, rmse_after_rad_s=omega,
    )  # fmt: skip
    yield _row(
        f"calibrated: position drift after {_DRIFT_SECONDS:.0f} s", "{drift_after_m:.1f} m",
        "{drift_before_m:.0f} m before", drift_before_m=drift_before, drift_after_m=drift,
    )  # fmt: skip


def draw_run(demo: Demo) -> Iterator[Row]:
    """Write the rerun recording."""
    from gfimu.visual import ExpectedDrift, write_run
    from sim.drawing import rig_drawing
    from sim.truth import known_motion

    t = demo.recording.t_s
    spread = np.sqrt(np.mean(demo.drift.std[:, :2] ** 2, axis=1))
    drift = ExpectedDrift(t, demo.position_error(demo.estimate), np.interp(t - t[0], demo.drift.t_s, spread))
    lines = "\n".join(f"| {row.what} | {row.result} | {row.beside} |" for row in demo.rows)
    write_run(
        demo.file("rerun recording", "run.rrd"), demo.recording, demo.scenario.array, estimate=demo.estimate,
        known=known_motion(demo.recording), drift=drift, shapes=rig_drawing(demo.scenario.world),
        notes=f"| | | |\n|---|---|---|\n{lines}", title="the paper's run",
    )  # fmt: skip
    yield from ()


def diagnose_hidden(demo: Demo) -> Iterator[Row]:
    """Hide a tilted table and an eccentric cube in the world, and diagnose the recording."""
    from gfimu.commands.diagnose import write_report
    from gfimu.diagnosis.diagnose import diagnose
    from sim.effects import make_effect
    from sim.simulation import simulate
    from sim.twin import Twin

    rng = np.random.default_rng([demo.seed, 5])
    lean, offset = rng.uniform(2e-3, 8e-3), rng.uniform(0.4e-3, 2e-3)
    towards, beside = rng.uniform(0.0, 2 * np.pi, 2)
    hidden = {
        "table_tilt": {"x_rad": lean * np.cos(towards), "y_rad": lean * np.sin(towards)},
        "eccentricity": {"x_m": offset * np.cos(beside), "y_m": offset * np.sin(beside)},
    }
    effects = tuple(make_effect(name, parameters) for name, parameters in hidden.items())
    calibrated = replace(demo.scenario, sensor=replace(demo.scenario.sensor, errors=False), effects=effects)
    recording = simulate(calibrated, seed=demo.seed, out=demo.out / "hidden.parquet")
    twin = Twin.load(_TWIN)  # assumes a level table with the cube on its axis
    found = diagnose([recording], twin, names=["hidden.parquet"])
    demo.written["diagnosis report"] = write_report(found, demo.out / "diagnosis")
    causes = {cause.effect: cause for cause in found.causes}
    verdict = f"{found.verdict.replace('_', ' ')}, {', '.join(causes)}"
    for name, unit, factor, what in (
        ("table_tilt", "°", 180 / np.pi, "hidden tilt of the table, found"),
        ("eccentricity", "mm", 1e3, "hidden offset of the cube, found"),
    ):
        true = factor * float(np.hypot(*hidden[name].values()))
        if name not in causes:
            yield _row(what, "not found", f"hidden {{hidden:.3f}} {unit}", hidden=true)
            continue
        yield _row(
            what, "{found:.3f} ± {std:.3f} {unit}", f"hidden {{hidden:.3f}} {{unit}}; verdict: {verdict}",
            hidden=true, found=factor * float(np.hypot(*causes[name].parameters.values())),
            std=factor * float(max(causes[name].std.values())), unit=unit, verdict=found.verdict,
        )  # fmt: skip


STEPS: tuple[Callable[[Demo], Iterator[Row]], ...] = (
    *(score_geometry, simulate_run, read_biases, estimate_motion, state_drift),
    *(calibrate_chips, draw_run, diagnose_hidden),
)
"""The steps in their order; the first line of each docstring is what the command shows while it runs."""


def _row(what: str, result: str, beside: str, **figures: Any) -> Row:
    """Return a line of the table, whose texts name its figures."""
    return Row(what, result.format(**figures), beside.format(**figures), **figures)


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.nanmean(values**2)))


def _horizontal(vector: NDArray[np.float64]) -> float:
    return float(np.hypot(*vector[:2]))
