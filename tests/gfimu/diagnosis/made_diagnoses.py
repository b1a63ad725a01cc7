"""Diagnoses made by hand from known worlds: what the report and the views must show is known beforehand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gfimu import Diagnosis, NamedCause
from gfimu.diagnosis import RunView
from gfimu.diagnosis.criticism.gain import Gain
from gfimu.diagnosis.verdict.parts import FunctionTable, Located, NoiseLevels, Residual, Rival, Unexplained
from sim.effects import Effect, make_effect
from sim.trials import Measurement, measure, random_profile
from sim.twin import Twin

SETTING = Measurement(duration=40.0)


def made_run(
    effects: Sequence[Effect] = (),
    *,
    explained: Sequence[Effect] | None = None,
    seed: int = 1,
    setting: Measurement = SETTING,
    name: str = "run.parquet",
) -> RunView:
    """Measure a world with effects; predict it without them, and with ``explained`` (the truth by default)."""
    twin = Twin.load("cube12_turntable")
    rng = np.random.default_rng(seed)
    motion = random_profile(rng, setting.duration)
    recording = measure(rng, twin, effects, setting, motion=motion)
    t = recording.t_s
    temperature = recording.reference["temperature_degC"]
    before, reference_before = twin.predict(motion, t, temperature=temperature)
    known = list(effects if explained is None else explained)
    after, reference_after = twin.predict(motion, t, effects=known, temperature=temperature)
    state = motion.at(t)
    return RunView(
        name=name,
        t=t,
        measured=recording.readings,
        valid=np.isfinite(recording.readings),
        before=before,
        after=after,
        reference=recording.reference["tacho_rad_s"],
        reference_before=reference_before,
        reference_after=reference_after,
        angle=state.angle,
        rate=state.rate,
        acceleration=state.acceleration,
        temperature=temperature,
        white=twin.expected_noise(setting.sample_rate).white,
    )


def made_diagnosis(verdict: str = "explained", *, seed: int = 1) -> Diagnosis:
    """Diagnosis of a tilted table (``explained``, ``ambiguous``) or of what nothing explains or of nothing."""
    twin = Twin.load("cube12_turntable")
    tilt = make_effect("table_tilt", {"x_rad": 0.004, "y_rad": -0.002})
    effects = [] if verdict == "nothing_found" else [tilt]
    run = made_run(effects, explained=[] if verdict == "unknown" else None, seed=seed)
    causes: tuple[NamedCause, ...] = ()
    if verdict == "explained":
        causes = (_cause("table_tilt", tilt.parameters, why="gravity turns once per revolution in a11, a12, a21"),)
    if verdict == "ambiguous":
        pair = ("eccentricity", "sensor_position")
        parameters = {"eccentricity": {"x_m": 1e-3, "y_m": 2e-4}, "sensor_position": {"a1_x_m": 1e-3, "a2_x_m": 1e-3}}
        causes = tuple(
            _cause(name, parameters[name], alike=tuple(one for one in pair if one != name), probability=0.5)
            for name in pair
        )
    unexplained = Unexplained()
    if verdict == "unknown":
        table = FunctionTable((-6.0, 0.0, 6.0), (-0.02, 0.0, 0.03), (0.004, 0.001, 0.005), "rad/s", "rad/s")
        located = Located(
            place="reference",
            what="reads",
            pattern="all",
            series=(),
            dependence="f(omega)",
            text="the reference reads otherwise than the table turns, as a function of the rate (+0.03 rad/s)",
            place_probability=0.88,
            dependence_probability=0.8,
            instead=("the axis tilts in the room, always",),
            function=table,
        )
        remedy = "held speeds, slow and fast, both ways"
        cause = NamedCause("unlisted", {}, {}, 0.88, would_be_separated_by=remedy, why=located.text, log_odds=230.0)
        causes = (replace(cause, unlisted=located),)
        unexplained = Unexplained(True, located.text, 240.0)
    rivals = (Rival(("axis_wobble",), -120.0, "its inertial part at high rate is not in the data"),)
    return Diagnosis(
        verdict=verdict,
        causes=causes,
        residual=_residual(run, twin.array.channels),
        gain=Gain("stretches of the recording", 0.04, 0.029, 0.99, 1.1, 0.05, 0.03, 0.01, 0.5, 0.1)
        if effects
        else Gain(),
        unexplained=unexplained,
        rivals=rivals if effects and causes else (),
        twin=twin.extended([tilt]) if verdict == "explained" else twin,
        runs=(run,),
        sentences=("The table's axis is not vertical.",) if causes else ("Nothing found.",),
        noise=NoiseLevels(white_over_data_sheet=1.0, bias_instability_m_s2=0.0015, reference_white=0.02),
    )


def _cause(
    name: str,
    parameters: Mapping[str, float],
    *,
    why: str = "",
    alike: tuple[str, ...] = (),
    probability: float = 0.999,
) -> NamedCause:
    std = dict.fromkeys(parameters, 5e-5)
    remedy = "the cube remounted on its side" if alike else ""
    return NamedCause(name, dict(parameters), std, probability, "", alike, remedy, why, 300.0)


def _residual(run: RunView, channels: Sequence[str]) -> Residual:
    before = np.sqrt(np.mean((run.measured - run.before) ** 2, axis=0))
    after = np.sqrt(np.mean((run.measured - run.after) ** 2, axis=0))
    floor = float(np.sqrt(np.mean(run.white**2)))
    rms = [float(np.sqrt(np.mean(one**2))) for one in (before, after)]
    by_channel = [dict(zip(channels, one.tolist(), strict=True)) for one in (before, after)]
    return Residual(*rms, floor, *by_channel)
