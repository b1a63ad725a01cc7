"""Scenario files: reading and checking their keys."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gfimu.errors import InputError
from gfimu.files.model_files import find_model, read_toml
from gfimu.geometry.array import AccelerometerArray
from gfimu.units import STANDARD_GRAVITY
from sim.adxl345 import SensorSettings
from sim.carried import Hand, Wheel
from sim.data_sheet import DataSheet
from sim.effects import Effect, make_effect
from sim.motion import BodyMotion, SpinMotion
from sim.pose_sequence import PoseSequence
from sim.profiles import Chirp, Hold, Ramp, Segment, Sine, Tumble, spin_profile
from sim.toml_table import TomlTable

__all__ = ["ReferenceSettings", "change_key", "scenario_fields"]

_TWIN_MOTION = "paper_run"  # the motion of a twin file, which has none of its own


@dataclass(frozen=True)
class ReferenceSettings:
    """Quality of the references.

    Parameters
    ----------
    tacho_noise_std : float
        White noise of the tachometer, rad/s.
    tacho_resolution : float
        Step of the tachometer, rad/s (0: continuous).
    encoder_resolution : float
        Step of the angle encoder, rad (0: continuous).
    gyro_noise_std : float or None
        White noise of a reference gyro on the cube, rad/s; None: no gyro.
    """

    tacho_noise_std: float = 0.0
    tacho_resolution: float = 0.0
    encoder_resolution: float = 0.0
    gyro_noise_std: float | None = None


def scenario_fields(data: Mapping[str, Any], source: str, beside: Path | None) -> dict[str, Any]:
    """Return the fields of a `sim.scenarios.Scenario` from the keys of its file.

    Parameters
    ----------
    data : mapping
        Content of the file; a twin file, which has no motion, is given that of the paper's run.
    source : str
        File, for messages.
    beside : Path, optional
        Folder of the file, in which its array may lie.

    Raises
    ------
    InputError
        For a key that is missing, unknown (the message lists the valid ones) or has a wrong value.
    """
    if "motion" not in data and isinstance(data.get("drive"), Mapping) and "source" in data["drive"]:
        paper = read_toml(find_model("scenarios", _TWIN_MOTION))
        data = {"reference": paper.get("reference", {}), "motion": paper["motion"], **data}
    table = TomlTable(data, source)
    array = AccelerometerArray.load(table.text("array"), beside=beside)
    sample_rate = table.number("sample_rate_hz", 100.0, above=0.0)
    motion, length = _motion(table.table("motion"))
    sensor, drive = table.table("sensor"), table.table("drive")
    part = sensor.text("part", "") or None
    if part is not None:
        array, part = array.with_part_file(part, beside=beside)
    drive.raw("source", None)  # of a twin file; a simulation drives itself
    fields: dict[str, Any] = {
        "name": table.text("name", Path(source).stem),
        "description": table.text("description", ""),
        "array": array,
        "motion": motion,
        "duration": table.number("duration_s", length, above=0.0) if length else table.number("duration_s", above=0.0),
        "sample_rate": sample_rate,
        "sensor": _sensor(sensor, sample_rate, DataSheet.load(part or array.chips[0].part, array.part_files)),
        "part": part,
        "chips_seed": sensor.whole("chips_seed", None, least=0),
        "gravity": table.number("gravity_m_s2", STANDARD_GRAVITY, above=0.0),
        "cube_offset": _triple(table.numbers("cube_offset_m", 3, (0.0, 0.0, 0.06))),
        "mounting_rotvec": _triple(table.numbers("mounting_rotvec_rad", 3, (0.0, 0.0, 0.0))),
        "axis_inclination": table.number("axis_inclination_rad", 0.0, least=0.0),
        "driven": drive.text("mode", "prescribed", choices=("prescribed", "driven")) == "driven",
        "physics_step": drive.number("step_s", 1e-3, above=0.0),
        "reference": _reference(table.table("reference")),
        "effects": tuple(_effect(entry, array) for entry in table.tables("effect")),
        "temperature": _temperature(table.table("temperature")),
    }
    for finished in (sensor, drive, table):
        finished.finish()
    if fields["duration"] * sample_rate < 2:
        raise InputError(f"{source}: duration_s and sample_rate_hz give fewer than two samples; simulate longer")
    return fields


def change_key(data: dict[str, Any], change: str) -> None:
    """Set one key of a scenario, ``table.key=value`` with the value as in TOML (a bare word is a string)."""
    key, equals, text = change.partition("=")
    if not equals or not key.strip():
        raise InputError(f"change {change!r}: write it as key=value, such as sensor.range_g=8")
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text.strip()
    *tables, last = key.strip().split(".")
    place = data
    for name in tables:
        place = place.setdefault(name, {})
        if not isinstance(place, dict):
            raise InputError(f"change {change!r}: {name} is not a table of the scenario")
    place[last] = value


def _motion(table: TomlTable) -> tuple[SpinMotion | BodyMotion, float]:
    """Motion of the [motion] table, and its length where it has one of its own, s."""
    kind = table.text("kind", "profile", choices=("profile", "rest", "tumble", "poses", "wheel", "hand"))
    if kind == "poses":
        sequence = PoseSequence(
            table.text("poses", PoseSequence.poses),
            table.number("rest_s", PoseSequence.rest),
            table.number("turn_s", PoseSequence.turn),
        )
        table.finish()
        return sequence, sequence.duration
    if kind == "tumble":
        tumble = Tumble(
            rate=table.number("rate_rad_s", Tumble.rate),
            inclination=table.number("inclination_rad", Tumble.inclination),
            rest=table.number("rest_s", Tumble.rest),
            spin_up=table.number("spin_up_s", Tumble.spin_up),
            inertia=_triple(table.numbers("inertia", 3, Tumble.inertia)),
            sway=_triple(table.numbers("sway_m", 3, Tumble.sway)),
            sway_frequency=_triple(table.numbers("sway_hz", 3, Tumble.sway_frequency)),
        )
        table.finish()
        return tumble, 0.0
    if kind == "hand":
        hand = Hand(
            duration=table.number("duration_s", above=0.0),
            turn=table.number("turn_rad", Hand.turn, least=0.0),
            sway=table.number("sway_m", Hand.sway, least=0.0),
            pace=table.number("pace_s", Hand.pace, above=0.0),
            rest=table.number("rest_s", Hand.rest, least=0.0),
            seed=table.whole("seed", Hand.seed) or 0,
        )
        table.finish()
        return hand, hand.duration
    wheel: dict[str, Any] = {}
    if kind == "wheel":
        wheel = {
            "radius": table.number("radius_m", Wheel.radius, least=0.0),
            "axis": _triple(table.numbers("axis", 3, Wheel.axis)),
            "shake": table.number("shake_m_s2", Wheel.shake, least=0.0),
            "shake_frequency": table.number("shake_hz", Wheel.shake_frequency, above=0.0),
            "seed": table.whole("seed", Wheel.seed) or 0,
        }
    angle = table.number("start_angle_rad", 0.0)
    if kind == "rest":
        table.finish()
        return spin_profile([Hold(1.0)], start_angle=angle), 0.0
    rate = table.number("start_rate_rad_s", 0.0)
    segments = [_segment(entry) for entry in table.tables("segment")]
    table.finish()
    spin = spin_profile(segments, start_rate=rate, start_angle=angle)
    return Wheel(spin, **wheel) if wheel else spin, sum(segment.duration for segment in segments)


def _segment(table: TomlTable) -> Segment:
    """One entry of motion.segment."""
    kind = table.text("kind", choices=("hold", "ramp", "sine", "chirp"))
    duration = table.number("duration_s", above=0.0)
    segment: Segment
    if kind == "hold":
        segment = Hold(duration)
    elif kind == "ramp":
        segment = Ramp(table.number("to_rad_s"), duration)
    elif kind == "sine":
        segment = Sine(table.number("amplitude_rad_s"), table.number("frequency_hz", above=0.0), duration)
    else:
        start, stop = table.number("start_hz", above=0.0), table.number("stop_hz", above=0.0)
        segment = Chirp(table.number("amplitude_rad_s"), start, stop, duration)
    table.finish()
    return segment


def _sensor(table: TomlTable, sample_rate: float, sheet: DataSheet) -> SensorSettings:
    """Sensor settings; the output data rate is by default the lowest one that keeps up with the sample rate."""
    settings = SensorSettings(
        output_data_rate=table.number("output_data_rate_hz", _lowest_rate(sheet, sample_rate), above=0.0),
        range_g=int(table.number("range_g", max(sheet.ranges_g), above=0.0)),
        full_resolution=table.flag("full_resolution", True),
        supply=table.number("supply_V", 2.5),
        errors=table.flag("errors", True),
        noise=table.flag("noise", True),
        quantisation=table.flag("quantisation", True),
        bandwidth=table.flag("bandwidth", True),
        bias_instability=table.number("bias_instability_m_s2", 0.0, least=0.0),
    )
    settings.check(sheet)
    return settings.perfect() if table.flag("perfect", False) else settings


def _lowest_rate(sheet: DataSheet, sample_rate: float) -> float:
    if sample_rate > sheet.rate_max * (1 + 1e-9):
        raise InputError(f"sample_rate_hz {sample_rate:g}: {sheet.name} has at most {sheet.rate_max:g} Hz")
    if not sheet.rate_min:
        return sample_rate
    return float(sheet.rate_max / 2.0 ** np.floor(np.log2(sheet.rate_max / sample_rate) + 1e-9))


def _reference(table: TomlTable) -> ReferenceSettings:
    settings = ReferenceSettings(
        tacho_noise_std=table.number("tacho_noise_std_rad_s", 0.0, least=0.0),
        tacho_resolution=table.number("tacho_resolution_rad_s", 0.0, least=0.0),
        encoder_resolution=table.number("encoder_resolution_rad", 0.0, least=0.0),
        gyro_noise_std=None if "gyro_noise_std_rad_s" not in table else table.number("gyro_noise_std_rad_s", least=0.0),
    )
    table.raw("gyro_noise_std_rad_s", None)
    table.finish()
    return settings


def _effect(table: TomlTable, array: AccelerometerArray) -> Effect:
    name, parameters = table.text("name"), table.raw("parameters", {})
    table.finish()
    TomlTable(parameters, f"effect {name!r}: parameters")
    return make_effect(name, parameters, array)


def _temperature(table: TomlTable) -> tuple[float, float, float]:
    start = table.number("start_degC", 25.0)
    values = (start, table.number("final_degC", start), table.number("time_constant_s", 600.0, above=0.0))
    table.finish()
    return values


def _triple(values: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = values
    return (x, y, z)
