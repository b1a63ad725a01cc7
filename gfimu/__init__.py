"""gfimu: a gyro-free inertial measurement unit in software.

Glossary
--------
specific force, f = a − g
    What an accelerometer reads, m/s²: acceleration a less the gravity vector g. At rest it is 9.81 m/s² upwards.
p
    Specific force of the body origin, in body axes, m/s².
alpha, α
    Angular acceleration of the body, in body axes, rad/s².
omega, ω
    Angular rate of the body against the world, in body axes, rad/s.
J, Q
    Regression matrix (c × 6) and centripetal matrix (c × 6) of c sensing axes: readings = J [α; p] + Q s, with s the
    six products of the components of ω.
GDOP
    Geometric dilution of precision, √tr((JᵀJ)⁻¹), with lengths in the array's length unit (half the cube's edge).
bias, scale factor, input-axis misalignment, cross-axis sensitivity
    Constant offset, gain, angle between a sensing axis and its drawn direction, share of the acceleration across the
    sensing axis in its reading (IEEE 528, 1293).
velocity random walk N, bias instability B, acceleration random walk K
    Coefficients of the Allan deviation of an accelerometer: white noise, 1/f noise and random walk of the bias.
twin
    The simulation of a rig that a diagnosis compares with recordings.
effect
    One physical error that a rig can have, such as a bias or a tilt of the table; a cause is an effect in a verdict.
drive
    Motion of the table over time.

Frames: world with z up; table frame turned by θ about the table's axis; body (cube) frame with its origin at the
cube's centre. Attitude quaternions (w, x, y, z) turn body axes into world axes.
Units: SI throughout; angles in rad, rates in rad/s. Every column name and file key ends with its unit.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    # What type checkers and editors see; at run time names load on first use (`_PUBLIC`).
    from gfimu.array_search.front import Front as Front
    from gfimu.array_search.search import SearchResult as SearchResult
    from gfimu.bounds.posterior import posterior_rate_bound as posterior_rate_bound
    from gfimu.bounds.sample import rate_bound as rate_bound
    from gfimu.calibration.array_calibration import calibrate_array as calibrate_array
    from gfimu.calibration.array_calibration import update_array_calibration as update_array_calibration
    from gfimu.calibration.result import Calibration as Calibration
    from gfimu.calibration.result import load_calibration as load_calibration
    from gfimu.certification.certificate import Certificate as Certificate
    from gfimu.commands import benchmark as benchmark
    from gfimu.commands import firmware as firmware
    from gfimu.commands.benchmark import benchmark_list as benchmark_list
    from gfimu.commands.calibrate import calibrate as calibrate
    from gfimu.commands.campaign import CampaignResult as CampaignResult
    from gfimu.commands.campaign import campaign as campaign
    from gfimu.commands.campaign_views import CampaignStatus as CampaignStatus
    from gfimu.commands.campaign_views import CampaignTable as CampaignTable
    from gfimu.commands.campaign_views import campaign_plot as campaign_plot
    from gfimu.commands.campaign_views import campaign_status as campaign_status
    from gfimu.commands.campaign_views import campaign_table as campaign_table
    from gfimu.commands.catalogue import catalogue as catalogue
    from gfimu.commands.catalogue import new as new
    from gfimu.commands.catalogue import show as show
    from gfimu.commands.certificate import certificate as certificate
    from gfimu.commands.check import check as check
    from gfimu.commands.convert import convert as convert
    from gfimu.commands.demo import DemoResult as DemoResult
    from gfimu.commands.demo import demo as demo
    from gfimu.commands.design import design as design
    from gfimu.commands.diagnose import diagnose as diagnose
    from gfimu.commands.diagnose import write_report as write_report
    from gfimu.commands.drift import Drift as Drift
    from gfimu.commands.drift import axis_drift as axis_drift
    from gfimu.commands.drift import drift as drift
    from gfimu.commands.drift_from_position import EquivalentErrors as EquivalentErrors
    from gfimu.commands.drift_from_position import drift_from_position as drift_from_position
    from gfimu.commands.drift_of_rest import drift_of_rest as drift_of_rest
    from gfimu.commands.estimate import estimate as estimate
    from gfimu.commands.impact import impact as impact
    from gfimu.commands.inspect import inspect as inspect
    from gfimu.commands.join import join as join
    from gfimu.commands.live import live as live
    from gfimu.commands.noise import noise as noise
    from gfimu.commands.optimize import optimize as optimize
    from gfimu.commands.record import record as record
    from gfimu.commands.schema import schema as schema
    from gfimu.commands.score import Scores as Scores
    from gfimu.commands.score import score as score
    from gfimu.commands.simulate import simulate as simulate
    from gfimu.commands.tolerance import ToleranceResult as ToleranceResult
    from gfimu.commands.tolerance import tolerance as tolerance
    from gfimu.commands.view import view as view
    from gfimu.crash.event import Impact as Impact
    from gfimu.diagnosis.design.proposal import Proposal as Proposal
    from gfimu.diagnosis.design.run_check import RunCheck as RunCheck
    from gfimu.diagnosis.verdict.parts import NamedCause as NamedCause
    from gfimu.diagnosis.verdict.verdict import Diagnosis as Diagnosis
    from gfimu.errors import CorruptValueWarning as CorruptValueWarning
    from gfimu.errors import GeometryError as GeometryError
    from gfimu.errors import GfimuError as GfimuError
    from gfimu.errors import InputError as InputError
    from gfimu.errors import MissingPackageError as MissingPackageError
    from gfimu.errors import RecordingWarning as RecordingWarning
    from gfimu.errors import UnitError as UnitError
    from gfimu.errors import WriteError as WriteError
    from gfimu.geometry.array import AccelerometerArray as AccelerometerArray
    from gfimu.geometry.array import Chip as Chip
    from gfimu.geometry.dilution import gdop as gdop
    from gfimu.geometry.gravity import local_gravity as local_gravity
    from gfimu.geometry.kinematics import closed_form as closed_form
    from gfimu.geometry.kinematics import joint_form as joint_form
    from gfimu.geometry.kinematics import motion_from_readings as motion_from_readings
    from gfimu.geometry.kinematics import null_space as null_space
    from gfimu.geometry.kinematics import pseudo_inverse as pseudo_inverse
    from gfimu.geometry.kinematics import specific_force as specific_force
    from gfimu.geometry.scoring import Score as Score
    from gfimu.geometry.turning_axis import TurningAxis as TurningAxis
    from gfimu.importing.column_map import ColumnMap as ColumnMap
    from gfimu.importing.inspection import Inspection as Inspection
    from gfimu.joining.join import Joined as Joined
    from gfimu.known_axis.accuracy.bounds import AxisBounds as AxisBounds
    from gfimu.known_axis.accuracy.drift import AxisDrift as AxisDrift
    from gfimu.motion.attitude import integrate_attitude as integrate_attitude
    from gfimu.motion.earth import EarthRotation as EarthRotation
    from gfimu.motion.equivalent_errors import equivalent_p_bias as equivalent_p_bias
    from gfimu.motion.equivalent_errors import equivalent_rate_drift as equivalent_rate_drift
    from gfimu.motion.estimate import Estimate as Estimate
    from gfimu.motion.estimate_summary import centripetal_agreement as centripetal_agreement
    from gfimu.motion.estimate_summary import summarise as summarise
    from gfimu.motion.navigation import level as level
    from gfimu.motion.navigation import navigate as navigate
    from gfimu.motion.rest_bias import estimate_from_rest as estimate_from_rest
    from gfimu.position_drift import drift_budget as drift_budget
    from gfimu.position_drift.budget import DriftBudget as DriftBudget
    from gfimu.position_drift.closed_forms import ErrorSources as ErrorSources
    from gfimu.position_drift.monte_carlo import DriftSample as DriftSample
    from gfimu.position_drift.monte_carlo import monte_carlo_drift as monte_carlo_drift
    from gfimu.position_drift.rest_windows import RestDrift as RestDrift
    from gfimu.rate.integration import integrate_rate as integrate_rate
    from gfimu.rate.live import LiveRateFilter as LiveRateFilter
    from gfimu.rate.methods import estimate_rate as estimate_rate
    from gfimu.rate.result import RateEstimate as RateEstimate
    from gfimu.rate.sensing import SensorErrors as SensorErrors
    from gfimu.recording import Recording as Recording
    from gfimu.recording.formats import open_recording as open_recording
    from gfimu.recording.mapped import MappedFile as MappedFile
    from gfimu.recording.mimu4444 import read_mimu4444 as read_mimu4444
    from gfimu.sensor_noise import allan_deviation as allan_deviation
    from gfimu.sensor_noise import identify_noise as identify_noise
    from gfimu.sensor_noise.allan import AllanDeviation as AllanDeviation
    from gfimu.sensor_noise.identification import NoiseModel as NoiseModel
    from gfimu.sensor_noise.recording_noise import RecordingNoise as RecordingNoise
    from gfimu.sensor_noise.recording_noise import recording_noise as recording_noise
    from sim.scenarios import Scenario as Scenario
    from sim.twin import Twin as Twin

__version__ = "0.2.0"

_PUBLIC = {
    "AccelerometerArray": "gfimu.geometry.array",
    "AllanDeviation": "gfimu.sensor_noise.allan",
    "AxisBounds": "gfimu.known_axis.accuracy.bounds",
    "AxisDrift": "gfimu.known_axis.accuracy.drift",
    "Calibration": "gfimu.calibration.result",
    "CampaignResult": "gfimu.commands.campaign",
    "CampaignStatus": "gfimu.commands.campaign_views",
    "CampaignTable": "gfimu.commands.campaign_views",
    "Certificate": "gfimu.certification.certificate",
    "Chip": "gfimu.geometry.array",
    "ColumnMap": "gfimu.importing.column_map",
    "CorruptValueWarning": "gfimu.errors",
    "DemoResult": "gfimu.commands.demo",
    "Diagnosis": "gfimu.diagnosis.verdict.verdict",
    "Drift": "gfimu.commands.drift",
    "DriftBudget": "gfimu.position_drift.budget",
    "DriftSample": "gfimu.position_drift.monte_carlo",
    "EarthRotation": "gfimu.motion.earth",
    "EquivalentErrors": "gfimu.commands.drift_from_position",
    "ErrorSources": "gfimu.position_drift.closed_forms",
    "Estimate": "gfimu.motion.estimate",
    "Front": "gfimu.array_search.front",
    "GeometryError": "gfimu.errors",
    "GfimuError": "gfimu.errors",
    "Impact": "gfimu.crash.event",
    "InputError": "gfimu.errors",
    "Inspection": "gfimu.importing.inspection",
    "Joined": "gfimu.joining.join",
    "LiveRateFilter": "gfimu.rate.live",
    "MappedFile": "gfimu.recording.mapped",
    "MissingPackageError": "gfimu.errors",
    "NamedCause": "gfimu.diagnosis.verdict.parts",
    "NoiseModel": "gfimu.sensor_noise.identification",
    "Proposal": "gfimu.diagnosis.design.proposal",
    "RateEstimate": "gfimu.rate.result",
    "Recording": "gfimu.recording",
    "RecordingNoise": "gfimu.sensor_noise.recording_noise",
    "RecordingWarning": "gfimu.errors",
    "RestDrift": "gfimu.position_drift.rest_windows",
    "RunCheck": "gfimu.diagnosis.design.run_check",
    "Scenario": "sim.scenarios",
    "Score": "gfimu.geometry.scoring",
    "Scores": "gfimu.commands.score",
    "SearchResult": "gfimu.array_search.search",
    "SensorErrors": "gfimu.rate.sensing",
    "ToleranceResult": "gfimu.commands.tolerance",
    "TurningAxis": "gfimu.geometry.turning_axis",
    "Twin": "sim.twin",
    "UnitError": "gfimu.errors",
    "WriteError": "gfimu.errors",
    "allan_deviation": "gfimu.sensor_noise",
    "axis_drift": "gfimu.commands.drift",
    "benchmark": "gfimu.commands",
    "benchmark_list": "gfimu.commands.benchmark",
    "calibrate": "gfimu.commands.calibrate",
    "calibrate_array": "gfimu.calibration.array_calibration",
    "campaign": "gfimu.commands.campaign",
    "campaign_plot": "gfimu.commands.campaign_views",
    "campaign_status": "gfimu.commands.campaign_views",
    "campaign_table": "gfimu.commands.campaign_views",
    "catalogue": "gfimu.commands.catalogue",
    "centripetal_agreement": "gfimu.motion.estimate_summary",
    "certificate": "gfimu.commands.certificate",
    "check": "gfimu.commands.check",
    "closed_form": "gfimu.geometry.kinematics",
    "convert": "gfimu.commands.convert",
    "demo": "gfimu.commands.demo",
    "design": "gfimu.commands.design",
    "diagnose": "gfimu.commands.diagnose",
    "drift": "gfimu.commands.drift",
    "drift_budget": "gfimu.position_drift",
    "drift_from_position": "gfimu.commands.drift_from_position",
    "drift_of_rest": "gfimu.commands.drift_of_rest",
    "equivalent_p_bias": "gfimu.motion.equivalent_errors",
    "equivalent_rate_drift": "gfimu.motion.equivalent_errors",
    "estimate": "gfimu.commands.estimate",
    "estimate_from_rest": "gfimu.motion.rest_bias",
    "estimate_rate": "gfimu.rate.methods",
    "firmware": "gfimu.commands",
    "gdop": "gfimu.geometry.dilution",
    "identify_noise": "gfimu.sensor_noise",
    "impact": "gfimu.commands.impact",
    "inspect": "gfimu.commands.inspect",
    "integrate_attitude": "gfimu.motion.attitude",
    "integrate_rate": "gfimu.rate.integration",
    "join": "gfimu.commands.join",
    "joint_form": "gfimu.geometry.kinematics",
    "level": "gfimu.motion.navigation",
    "live": "gfimu.commands.live",
    "load_calibration": "gfimu.calibration.result",
    "local_gravity": "gfimu.geometry.gravity",
    "monte_carlo_drift": "gfimu.position_drift.monte_carlo",
    "motion_from_readings": "gfimu.geometry.kinematics",
    "navigate": "gfimu.motion.navigation",
    "new": "gfimu.commands.catalogue",
    "noise": "gfimu.commands.noise",
    "null_space": "gfimu.geometry.kinematics",
    "open_recording": "gfimu.recording.formats",
    "optimize": "gfimu.commands.optimize",
    "posterior_rate_bound": "gfimu.bounds.posterior",
    "pseudo_inverse": "gfimu.geometry.kinematics",
    "rate_bound": "gfimu.bounds.sample",
    "read_mimu4444": "gfimu.recording.mimu4444",
    "record": "gfimu.commands.record",
    "recording_noise": "gfimu.sensor_noise.recording_noise",
    "schema": "gfimu.commands.schema",
    "score": "gfimu.commands.score",
    "show": "gfimu.commands.catalogue",
    "simulate": "gfimu.commands.simulate",
    "specific_force": "gfimu.geometry.kinematics",
    "summarise": "gfimu.motion.estimate_summary",
    "tolerance": "gfimu.commands.tolerance",
    "update_array_calibration": "gfimu.calibration.array_calibration",
    "view": "gfimu.commands.view",
    "write_report": "gfimu.commands.diagnose",
}
"""Public names and the modules that hold them: classes, then functions, by name."""

_MODULES = {"benchmark", "firmware"}
"""Public names that are modules."""

__all__ = ["__version__"]
__all__ += list(_PUBLIC)

if not TYPE_CHECKING:  # a type checker would take every name for a public one

    def __getattr__(name: str) -> Any:
        # Public names load on first use, so that `gfimu --help` does not wait for numba and scipy.
        if name not in _PUBLIC:
            raise AttributeError(f"module 'gfimu' has no attribute {name!r}")
        module = _PUBLIC[name]
        if name in _MODULES:
            return importlib.import_module(f"{module}.{name}")
        return getattr(importlib.import_module(module), name)


def __dir__() -> list[str]:
    return sorted(__all__)
