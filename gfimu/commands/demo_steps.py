"""The steps of `gfimu demo`: each does one job of the package on the paper's run and says what came out in one line."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.declared import Declared, Written, figure, table
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


@dataclass(frozen=True)
class Row(Declared):
    """One line of the demo's table; which figures it has depends on the line."""

    what: Annotated[str, figure("What was asked.", head="what")]
    result: Annotated[str, figure("The answer with its unit.", head="result", in_json=False)]
    beside: Annotated[str, figure("What to compare it with.", head="to compare", in_json=False)]
    condition_number: Annotated[float | None, figure("Condition number κ(J) of the array.", absent=True)] = None
    gdop: Annotated[float | None, figure("GDOP of the array.", absent=True)] = None
    omega_squared_leakage: Annotated[
        float | None, figure("Largest coefficient of a product of ω in the linear solution.", absent=True)
    ] = None
    samples: Annotated[int | None, figure("Samples of the recording.", absent=True)] = None
    peak_rate_rad_s: Annotated[float | None, figure("Fastest rate of the run.", "rad/s", absent=True)] = None
    largest_bias_m_s2: Annotated[float | None, figure("Largest bias read off at rest.", "m/s²", absent=True)] = None
    rmse_m_s2: Annotated[float | None, figure("Error of p, rms.", "m/s²", absent=True)] = None
    noise_std_m_s2: Annotated[float | None, figure("Error that the noise alone gives.", "m/s²", absent=True)] = None
    rmse_rad_s2: Annotated[float | None, figure("Error of α, rms.", "rad/s²", absent=True)] = None
    peak_rad_s2: Annotated[float | None, figure("Largest α of the run.", "rad/s²", absent=True)] = None
    rmse_rad_s: Annotated[float | None, figure("Error of ω, rms.", "rad/s", absent=True)] = None
    rmse_raw_rad_s: Annotated[
        float | None, figure("Error of ω without the biases taken off, rms.", "rad/s", absent=True)
    ] = None
    expected_std_at_end_rad_s: Annotated[
        float | None, figure("Standard deviation of ω that is expected at the end.", "rad/s", absent=True)
    ] = None
    error_rad: Annotated[float | None, figure("Error of the angle at the end.", "rad", absent=True)] = None
    error_m: Annotated[float | None, figure("Error of the position at the end.", "m", absent=True)] = None
    expected_m: Annotated[float | None, figure("Position error that is expected, 1 σ.", "m", absent=True)] = None
    valid_until_s: Annotated[float | None, figure("Time until which the closed form holds.", "s", absent=True)] = None
    alpha_before_deg_s2: Annotated[
        float | None, figure("Apparent α at rest before the calibration.", "°/s²", absent=True)
    ] = None
    alpha_after_deg_s2: Annotated[float | None, figure("Apparent α at rest after it.", "°/s²", absent=True)] = None
    rmse_before_rad_s: Annotated[
        float | None, figure("Error of ω before the calibration, rms.", "rad/s", absent=True)
    ] = None
    rmse_after_rad_s: Annotated[float | None, figure("Error of ω after it, rms.", "rad/s", absent=True)] = None
    drift_before_m: Annotated[float | None, figure("Position drift before the calibration.", "m", absent=True)] = None
    drift_after_m: Annotated[float | None, figure("Position drift after it.", "m", absent=True)] = None
    hidden: Annotated[float | None, figure("Size of the hidden effect, in its unit.", absent=True)] = None
    found: Annotated[float | None, figure("Size that the diagnosis finds, in its unit.", absent=True)] = None
    std: Annotated[float | None, figure("Standard deviation of the size found, in its unit.", absent=True)] = None
    unit: Annotated[str | None, figure("Unit of these three.", absent=True)] = None
    verdict: Annotated[str | None, figure("Verdict of the diagnosis.", absent=True)] = None


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

    def position_error(self) -> NDArray[np.float64]:
        """Return the position error of the estimate in the world, m, shape (n, 3): the cube stands on the axis."""
        if self.estimate.position is None:
            raise TypeError("the estimate holds no position")
        true = self.truth("position", "m")
        return self.estimate.position - (true - true[0])


def score_geometry(demo: Demo) -> None:
    """Score the array."""
    from gfimu.array_search.scoring import score

    (cube,) = score("cube12")
    leakage = float(np.max(np.abs(cube.omega_squared_leakage)))
    demo.rows.append(
        Row(
            "geometry: condition number, GDOP",
            f"{cube.condition_number:.4f}, {cube.gdop:.4f}",
            "paper: 1.414, 1.061 (L/2 = 1)",
            condition_number=cube.condition_number,
            gdop=cube.gdop,
            omega_squared_leakage=leakage,
        )
    )


def simulate_run(demo: Demo) -> None:
    """Simulate the paper's run in MuJoCo."""
    from sim.scenarios import Scenario
    from sim.simulation import simulate

    path = demo.out / "run.parquet"
    demo.scenario = Scenario.load(_SCENARIO)
    demo.recording = simulate(demo.scenario, seed=demo.seed, out=path)
    demo.written["recording"] = path
    fastest = float(np.abs(demo.truth("omega", "rad_s")).max())
    largest = max(abs(bias) for bias in demo.recording.metadata["truth_bias_m_s2"].values())
    demo.rows.append(
        Row(
            "simulated run",
            f"{demo.recording.duration:.0f} s × {len(demo.recording.channels)} channels",
            f"±{fastest:.0f} rad/s at {demo.recording.sample_rate:.0f} Hz; biases up to {largest:.2f} m/s²",
            samples=len(demo.recording),
            peak_rate_rad_s=fastest,
            largest_bias_m_s2=largest,
        )
    )


def read_biases(demo: Demo) -> None:
    """Read the channels' biases off at rest, as the paper does."""
    from gfimu.motion.rest_bias import rest_bias

    array = demo.scenario.array
    demo.bias = rest_bias(demo.recording, array, gravity=demo.scenario.gravity)
    true_bias = np.array([demo.recording.metadata["truth_bias_m_s2"][channel] for channel in array.channels])
    error = float(np.sqrt(np.mean((demo.bias.bias - true_bias) ** 2)))
    spread = float(np.sqrt(np.mean(demo.bias.std**2)))
    demo.rows.append(
        Row(
            "biases read at rest, rms error",
            f"{error:.3f} m/s²",
            f"{spread:.3f} by noise, the rest by gain and axis errors",
            rmse_m_s2=error,
            noise_std_m_s2=spread,
        )
    )


def estimate_motion(demo: Demo) -> None:
    """Estimate acceleration, rate and angle."""
    from gfimu.motion.estimation import estimate
    from gfimu.motion.rest_bias import estimate_from_rest

    array = demo.scenario.array
    raw = estimate(demo.recording, array)
    path = demo.out / "estimate.parquet"
    demo.estimate = estimate_from_rest(demo.recording, array, gravity=demo.scenario.gravity, with_position=True)
    demo.estimate.write(path)
    demo.written["estimate"] = path
    alpha = _rms(demo.estimate.alpha[:, 2] - demo.truth("alpha", "rad_s2")[:, 2])
    omega = demo.estimate.omega[:, 2] - demo.truth("omega", "rad_s")[:, 2]
    without = _rms(raw.omega[:, 2] - demo.truth("omega", "rad_s")[:, 2])
    angle = float(demo.estimate.angle[-1] - demo.recording.reference["angle_rad"][-1])
    peak = float(np.abs(demo.truth("alpha", "rad_s2")[:, 2]).max())
    demo.rows += [
        Row(
            "angular acceleration, rms error",
            f"{alpha:.3f} rad/s²",
            f"the table reaches {peak:.1f} rad/s²",
            rmse_rad_s2=alpha,
            peak_rad_s2=peak,
        ),
        Row(
            "angular rate, integrated, rms error",
            f"{_rms(omega):.3f} rad/s",
            f"{without:.0f} rad/s with biases left in",
            rmse_rad_s=_rms(omega),
            rmse_raw_rad_s=without,
            expected_std_at_end_rad_s=float(demo.estimate.omega_std[-1, 2]),
        ),
        Row(
            "table angle, error at the end",
            f"{angle:+.2f} rad",
            f"after {np.abs(np.diff(demo.recording.reference['angle_rad'])).sum() / (2 * np.pi):.0f} revolutions",
            error_rad=angle,
        ),
    ]


def state_drift(demo: Demo) -> None:
    """State the position drift that was to be expected."""
    from gfimu.array.parts.part import white_noise_std
    from gfimu.budget.drift import ErrorSources, drift_budget
    from gfimu.budget.drift.monte_carlo import monte_carlo_drift

    array, recording = demo.scenario.array, demo.recording
    noise = _rms(white_noise_std(array, recording.sample_rate))
    sources = ErrorSources(bias=_rms(demo.bias.std), noise_density=noise / np.sqrt(recording.sample_rate / 2))
    budget = drift_budget(array, _DRIFT_SECONDS, sources, gravity=demo.scenario.gravity)
    duration = recording.duration
    demo.drift = monte_carlo_drift(
        array, duration, sources, runs=_MONTE_CARLO_RUNS, rng=np.random.default_rng(demo.seed)
    )
    error = demo.position_error()
    early = int(np.searchsorted(recording.t_s, recording.t_s[0] + _DRIFT_SECONDS))
    closed = float(np.hypot(*budget.total_std[:2]))
    final = float(np.hypot(*demo.drift.std[-1, :2]))
    demo.rows += [
        Row(
            f"position drift after {_DRIFT_SECONDS:.0f} s",
            f"{np.hypot(*error[early, :2]):.1f} m",
            f"expected {closed:.1f} m; formula holds to {budget.valid_until:.1f} s",
            error_m=float(np.hypot(*error[early, :2])),
            expected_m=closed,
            valid_until_s=budget.valid_until,
        ),
        Row(
            f"position drift after {duration:.0f} s",
            f"{np.hypot(*error[-1, :2]):.0f} m",
            f"expected {final:.0f} m by Monte Carlo",
            error_m=float(np.hypot(*error[-1, :2])),
            expected_m=final,
        ),
    ]


def calibrate_chips(demo: Demo) -> None:
    """Calibrate the same chips from static poses and compare the drift."""
    from dataclasses import replace

    from gfimu.calibration.array_calibration import calibrate_array
    from gfimu.motion.estimation import estimate
    from sim.motions.pose_sequence import PoseSequence
    from sim.simulation import simulate

    array, gravity = demo.scenario.array, demo.scenario.gravity
    sequence = PoseSequence()
    # The same seed draws the same chips.
    poses = simulate(replace(demo.scenario, motion=sequence, duration=sequence.duration), seed=demo.seed)
    calibration = calibrate_array(poses, array, gravity=gravity)
    path = demo.out / "calibration.json"
    calibration.save(path)
    demo.written["calibration"] = path
    early = int(np.searchsorted(demo.recording.t_s, demo.recording.t_s[0] + _DRIFT_SECONDS))
    still = demo.recording.t_s < demo.bias.stop_s
    true_position, true_omega = demo.truth("position", "m"), demo.truth("omega", "rad_s")
    alpha, omega, drift = [], [], []
    for recording in (demo.recording, calibration.apply(demo.recording)):
        found = estimate(recording, array, with_position=True)
        if found.position is None:
            raise TypeError("the estimate holds no position")
        alpha.append(float(np.rad2deg(np.linalg.norm(np.nanmean(found.alpha[still], axis=0)))))
        omega.append(_rms(np.linalg.norm(found.omega - true_omega, axis=1)))
        drift.append(float(np.hypot(*(found.position - (true_position - true_position[0]))[early, :2])))
    demo.rows += [
        Row(
            f"calibrated from {calibration.statistics['poses']:.0f} poses: α seen at rest",
            f"{alpha[1]:.1f} °/s²",
            f"{alpha[0]:.0f} °/s² before",
            alpha_before_deg_s2=alpha[0],
            alpha_after_deg_s2=alpha[1],
        ),
        Row(
            "calibrated: angular rate, rms error",
            f"{omega[1]:.2f} rad/s",
            f"{omega[0]:.0f} rad/s before; no bias read at rest in either",
            rmse_before_rad_s=omega[0],
            rmse_after_rad_s=omega[1],
        ),
        Row(
            f"calibrated: position drift after {_DRIFT_SECONDS:.0f} s",
            f"{drift[1]:.1f} m",
            f"{drift[0]:.0f} m before",
            drift_before_m=drift[0],
            drift_after_m=drift[1],
        ),
    ]


def draw_run(demo: Demo) -> None:
    """Write the rerun recording."""
    from gfimu.visual import ExpectedDrift, write_run
    from sim.drawing import rig_drawing
    from sim.truth import known_motion

    path = demo.out / "run.rrd"
    t = demo.recording.t_s
    spread = np.sqrt(np.mean(demo.drift.std[:, :2] ** 2, axis=1))
    expected = np.interp(t - t[0], demo.drift.t_s, spread)
    table = "\n".join(f"| {row.what} | {row.result} | {row.beside} |" for row in demo.rows)
    write_run(
        path,
        demo.recording,
        demo.scenario.array,
        estimate=demo.estimate,
        known=known_motion(demo.recording),
        drift=ExpectedDrift(t, demo.position_error(), expected),
        shapes=rig_drawing(demo.scenario.world),
        notes=f"| | | |\n|---|---|---|\n{table}",
        title="the paper's run",
    )
    demo.written["rerun recording"] = path


def diagnose_hidden(demo: Demo) -> None:
    """Hide a tilted table and an eccentric cube in the world, and diagnose the recording."""
    from gfimu.commands.diagnose import write_report
    from gfimu.diagnosis.diagnose import diagnose
    from sim.effects import make_effect
    from sim.scenarios import Scenario
    from sim.simulation import simulate
    from sim.twin import Twin

    rng = np.random.default_rng([demo.seed, 5])
    lean, offset = rng.uniform(2e-3, 8e-3), rng.uniform(0.4e-3, 2e-3)
    towards, beside = rng.uniform(0.0, 2 * np.pi, 2)
    hidden = {
        "table_tilt": {"x_rad": lean * np.cos(towards), "y_rad": lean * np.sin(towards)},
        "eccentricity": {"x_m": offset * np.cos(beside), "y_m": offset * np.sin(beside)},
    }
    scenario = Scenario.load(_SCENARIO)
    calibrated = replace(
        scenario,
        sensor=replace(scenario.sensor, errors=False),
        effects=tuple(make_effect(name, parameters) for name, parameters in hidden.items()),
    )
    recording = simulate(calibrated, seed=demo.seed, out=demo.out / "hidden.parquet")
    twin = Twin.load(_TWIN)  # assumes a level table with the cube on its axis
    found = diagnose([recording], twin, names=["hidden.parquet"])
    demo.written["diagnosis report"] = write_report(found, demo.out / "diagnosis")
    causes = {cause.effect: cause for cause in found.causes}
    for name, unit, factor, what in (
        ("table_tilt", "°", 180 / np.pi, "hidden tilt of the table, found"),
        ("eccentricity", "mm", 1e3, "hidden offset of the cube, found"),
    ):
        true = factor * float(np.hypot(*hidden[name].values()))
        cause = causes.get(name)
        if cause is None:
            demo.rows.append(Row(what, "not found", f"hidden {true:.3f} {unit}", hidden=true, found=None))
            continue
        size = factor * float(np.hypot(*cause.parameters.values()))
        std = factor * float(max(cause.std.values()))
        demo.rows.append(
            Row(
                what,
                f"{size:.3f} ± {std:.3f} {unit}",
                f"hidden {true:.3f} {unit}; verdict: {found.verdict.replace('_', ' ')}, {', '.join(causes)}",
                hidden=true,
                found=size,
                std=std,
                unit=unit,
                verdict=found.verdict,
            )
        )


STEPS: tuple[Callable[[Demo], None], ...] = (
    score_geometry,
    simulate_run,
    read_biases,
    estimate_motion,
    state_drift,
    calibrate_chips,
    draw_run,
    diagnose_hidden,
)
"""The steps in their order; the first line of each docstring is what the command shows while it runs."""


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
