"""The scenario file: its schema, and the fields of a scenario from it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.array.gravity import local_gravity
from gfimu.base.errors import InputError
from gfimu.base.files.model_files import find_model, read_toml
from gfimu.base.files.schema import NotNegative, Positive, Table, Triple, about, read
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.motion.earth import EarthRotation
from sim.chips.adxl345 import SensorSettings
from sim.chips.data_sheet import DataSheet
from sim.effect_table import EffectTable
from sim.motions.motion_file import MotionTable, ProfileTable
from sim.rigs.dc_motor import DcMotor
from sim.rigs.motor_file import MotorTable
from sim.twin_file import Inclination

__all__ = ["ReferenceTable", "ScenarioFile", "scenario_fields"]

Latitude = Annotated[float, msgspec.Meta(ge=-90.0, le=90.0)]
"""Geodetic latitude, degrees."""

_MOST_SAMPLES = 20_000_000  # of a run: 55 hours at 100 Hz
_TWIN_MOTION = "paper_run"  # the motion of a twin file, which has none of its own
_CARRIAGE_MOTION = "linear_axis"  # that of a twin file of a linear axis


class SensorTable(Table, frozen=True):
    """How the chips are set up, and which of their imperfections are simulated."""

    part: Annotated[
        str | None,
        about("Part of every chip, or the path of a part file beside this file.", default="those of the array"),
    ] = None
    output_data_rate_hz: Annotated[
        Positive | None,
        about(
            "Output data rate of every chip that has none in the array file.",
            "Hz",
            default="the lowest one of the part that keeps up with the sample rate",
        ),
    ] = None
    range_g: Annotated[
        Positive | None,
        about("Range that is set, in units of standard gravity.", default="the widest one of the part"),
    ] = None
    full_resolution: Annotated[bool, about("Whether a count keeps its size in every range.")] = True
    supply_V: Annotated[
        Positive, about("Supply voltage of every chip that has none in the array file, 2.5 or 3.3.", "V")
    ] = SensorSettings.supply
    chips_seed: Annotated[
        Annotated[int, msgspec.Meta(ge=0)] | None,
        about("Seed of the errors of the chips.", default="follows from the seed of the run"),
    ] = None
    errors: Annotated[bool, about("Biases, gains, cross-axis sensitivity, non-linearity, temperature.")] = True
    noise: Annotated[bool, about("White noise.")] = True
    quantisation: Annotated[bool, about("Rounding to counts, and the range.")] = True
    bandwidth: Annotated[bool, about("The average over the conversions of a sample.")] = True
    bias_instability_m_s2: Annotated[NotNegative, about("Flicker floor B of the Allan deviation; 0: none.", "m/s²")] = (
        0.0
    )
    perfect: Annotated[bool, about("Readings are the specific force itself: all imperfections are left out.")] = False

    def settings(self, sample_rate: float, sheet: DataSheet) -> SensorSettings:
        """Return the settings of a part sampled at a rate, Hz; raises `InputError` for what the part does not have."""
        lowest = _lowest_rate(sheet, sample_rate)
        range_g = max(sheet.ranges_g) if self.range_g is None else self.range_g
        settings = SensorSettings(
            output_data_rate=lowest if self.output_data_rate_hz is None else self.output_data_rate_hz,
            range_g=int(range_g) if range_g == int(range_g) else range_g,  # type: ignore[arg-type]  # refused below
            full_resolution=self.full_resolution,
            supply=self.supply_V,
            errors=self.errors,
            noise=self.noise,
            quantisation=self.quantisation,
            bandwidth=self.bandwidth,
            bias_instability=self.bias_instability_m_s2,
        )
        settings.check(sheet)
        return settings.perfect() if self.perfect else settings


class DriveTable(Table, frozen=True):
    """How the table follows its command."""

    mode: Annotated[
        Literal["prescribed", "driven", "dcmotor"],
        about(
            "The table moves as commanded; or a drive with limited torque turns it against inertia and friction; or a "
            "motor with winding, cogging and LuGre friction does."
        ),
    ] = "prescribed"
    step_s: Annotated[Positive, about("Step of the driven simulation.", "s")] = 1e-3
    motor: Annotated[
        MotorTable | None, about("Figures of the motor of mode dcmotor.", default="those of the table")
    ] = None
    source: Annotated[str, about("Of a twin file: not used here, as a simulation drives itself.", default="none")] = ""


class ReferenceTable(Table, frozen=True):
    """Quality of the references."""

    tacho_noise_std_rad_s: Annotated[NotNegative, about("White noise of the tachometer.", "rad/s")] = 0.0
    tacho_resolution_rad_s: Annotated[NotNegative, about("Step of the tachometer; 0: continuous.", "rad/s")] = 0.0
    encoder_resolution_rad: Annotated[NotNegative, about("Step of the angle encoder; 0: continuous.", "rad")] = 0.0
    gyro_noise_std_rad_s: Annotated[
        NotNegative | None, about("White noise of a reference gyro on the body.", "rad/s", default="no gyro")
    ] = None
    carriage_noise_std_m: Annotated[NotNegative, about("White noise of the place of a carriage.", "m")] = 0.0
    carriage_resolution_m: Annotated[
        NotNegative, about("Step of the place of a carriage, such as a microstep; 0: continuous.", "m")
    ] = 0.0


class TemperatureTable(Table, frozen=True):
    """Temperature of the board."""

    start_degC: Annotated[float, about("Temperature at the start.", "°C")] = 25.0
    final_degC: Annotated[
        float | None, about("Temperature approached in the end.", "°C", default="that of the start")
    ] = None
    time_constant_s: Annotated[Positive, about("Time constant between the two.", "s")] = 600.0

    def course(self) -> Triple:
        """Return start and end, °C, and the time constant, s."""
        final = self.start_degC if self.final_degC is None else self.final_degC
        return (self.start_degC, final, self.time_constant_s)


class ScenarioFile(Table, frozen=True):
    """A run to simulate: motion, array, sensors, references, and the effects that the rig has.

    A twin file is a scenario too: its world, moved as in the scenario ``paper_run``.
    """

    array: Annotated[
        str,
        about("Name of an array (gfimu list arrays), or the path of an array file beside this file.", example="cube12"),
    ]
    name: Annotated[str, about("Name of the scenario.", default="the name of the file")] = ""
    description: Annotated[str, about("Description, one line.")] = ""
    duration_s: Annotated[Positive | None, about("Length of the run.", "s", default="the length of the motion")] = None
    sample_rate_hz: Annotated[Positive, about("Sample rate.", "Hz")] = 100.0
    gravity_m_s2: Annotated[
        Positive | None,
        about("Local gravity.", "m/s²", default="9.80665, or with a latitude the normal gravity there"),
    ] = None
    latitude_deg: Annotated[
        Latitude | None,
        about("Latitude: the world turns with the Earth.", "°", default="the world does not turn"),
    ] = None
    north_rad: Annotated[
        float, about("With a latitude: direction of north from the world's x-axis, about up.", "rad")
    ] = 0.0
    cube_offset_m: Annotated[
        Triple, about("Body origin from the point of the axis at table height, table frame.", "m")
    ] = (0.0, 0.0, 0.06)
    mounting_rotvec_rad: Annotated[
        Triple, about("Rotation vector by which the body was turned from upright before the run.", "rad")
    ] = (0.0, 0.0, 0.0)
    axis_inclination_rad: Annotated[
        Inclination, about("Angle between the table's axis and the vertical; π/2 of a pendulum or a wheel.", "rad")
    ] = 0.0
    motion: Annotated[MotionTable, about("Motion of the table or of the free body.")] = ProfileTable()
    drive: Annotated[DriveTable, about("How the table follows its command.")] = DriveTable()
    sensor: Annotated[SensorTable, about("How the chips are set up.")] = SensorTable()
    reference: Annotated[ReferenceTable, about("Quality of the references.")] = ReferenceTable()
    temperature: Annotated[TemperatureTable, about("Temperature of the board.")] = TemperatureTable()
    effect: Annotated[tuple[EffectTable, ...], about("What is wrong in this world.")] = ()


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
    file = read(_with_motion(data), ScenarioFile, source)
    array = AccelerometerArray.load(file.array, beside=beside)
    part = file.sensor.part or None
    if part is not None:
        array, part = array.with_part_file(part, beside=beside)
    duration = file.duration_s or file.motion.length
    motion = file.motion.motion()
    if not duration:
        raise InputError(f"{source}: key 'duration_s' is missing; add it: the motion has no length of its own")
    if duration * file.sample_rate_hz < 2:
        raise InputError(f"{source}: duration_s and sample_rate_hz give fewer than two samples; simulate longer")
    if duration * file.sample_rate_hz > _MOST_SAMPLES:
        raise InputError(
            f"{source}: duration_s and sample_rate_hz give more than {_MOST_SAMPLES:g} samples; simulate less"
        )
    sheet = DataSheet.load(part or array.chips[0].part, array.part_files)
    return {
        "name": file.name if "name" in data else Path(source).stem,
        "description": file.description,
        "array": array,
        "motion": motion,
        "duration": duration,
        "sample_rate": file.sample_rate_hz,
        "sensor": file.sensor.settings(file.sample_rate_hz, sheet),
        "part": part,
        "chips_seed": file.sensor.chips_seed,
        "gravity": _gravity(file),
        "earth": None if file.latitude_deg is None else EarthRotation(file.latitude_deg, file.north_rad),
        "cube_offset": file.cube_offset_m,
        "mounting_rotvec": file.mounting_rotvec_rad,
        "axis_inclination": file.axis_inclination_rad,
        "driven": file.drive.mode != "prescribed",
        "motor": _motor(file.drive, source),
        "physics_step": file.drive.step_s,
        "reference": file.reference,
        "effects": tuple(table.effect(array, source) for table in file.effect),
        "temperature": file.temperature.course(),
    }


def _motor(drive: DriveTable, source: str) -> DcMotor | None:
    """Return the motor of a drive; None where it has none."""
    if drive.mode == "dcmotor":
        try:
            return DcMotor() if drive.motor is None else drive.motor.motor()
        except InputError as error:
            raise InputError(f"{source}: {error}") from None
    if drive.motor is not None:
        raise InputError(f"{source}: [drive.motor] belongs to drive.mode = 'dcmotor'; set that, or leave the motor out")
    return None


def _gravity(file: ScenarioFile) -> float:
    """Return the gravity of the file, or that of its latitude, m/s²."""
    if file.gravity_m_s2 is not None:
        return file.gravity_m_s2
    return STANDARD_GRAVITY if file.latitude_deg is None else local_gravity(file.latitude_deg)


def _with_motion(data: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the content of a scenario; a twin file is given a motion, and what is of the diagnosis only left out."""
    if "motion" in data or not isinstance(data.get("drive"), Mapping) or "source" not in data["drive"]:
        return data
    twin = {key: value for key, value in data.items() if key != "carriage_axis"}
    if str(data["drive"]["source"]).startswith("carriage"):
        motion = read_toml(find_model("scenarios", _CARRIAGE_MOTION))["motion"]
        return {"motion": motion | {"axis": data.get("carriage_axis", motion["axis"])}, **twin}
    paper = read_toml(find_model("scenarios", _TWIN_MOTION))
    return {"reference": paper.get("reference", {}), "motion": paper["motion"], **twin}


def _lowest_rate(sheet: DataSheet, sample_rate: float) -> float:
    if sample_rate > sheet.rate_max * (1 + 1e-9):
        raise InputError(f"sample_rate_hz {sample_rate:g}: {sheet.name} has at most {sheet.rate_max:g} Hz")
    if not sheet.rate_min:
        return sample_rate
    return float(sheet.rate_max / 2.0 ** np.floor(np.log2(sheet.rate_max / sample_rate) + 1e-9))
