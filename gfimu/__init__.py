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

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.array.array import AccelerometerArray as AccelerometerArray
    from gfimu.array.array import Chip as Chip
    from gfimu.array.dilution import gdop as gdop
    from gfimu.array.gravity import Latitude as Latitude
    from gfimu.array.gravity import local_gravity as local_gravity
    from gfimu.array.integration import integrate_rate as integrate_rate
    from gfimu.array.kinematics import closed_form as closed_form
    from gfimu.array.kinematics import joint_form as joint_form
    from gfimu.array.kinematics import motion_from_readings as motion_from_readings
    from gfimu.array.kinematics import null_space as null_space
    from gfimu.array.kinematics import pseudo_inverse as pseudo_inverse
    from gfimu.array.kinematics import specific_force as specific_force
    from gfimu.array.turning_axis import TurningAxis as TurningAxis
    from gfimu.array_search.front import Front as Front
    from gfimu.array_search.scores import Scores as Scores
    from gfimu.array_search.scoring import Score as Score
    from gfimu.array_search.search import SearchResult as SearchResult
    from gfimu.base.errors import CorruptValueWarning as CorruptValueWarning
    from gfimu.base.errors import GeometryError as GeometryError
    from gfimu.base.errors import GfimuError as GfimuError
    from gfimu.base.errors import InputError as InputError
    from gfimu.base.errors import MissingPackageError as MissingPackageError
    from gfimu.base.errors import RecordingWarning as RecordingWarning
    from gfimu.base.errors import UnitError as UnitError
    from gfimu.base.errors import WriteError as WriteError
    from gfimu.base.version import __version__ as __version__
    from gfimu.budget.drift import drift_budget as drift_budget
    from gfimu.budget.drift.budget import DriftBudget as DriftBudget
    from gfimu.budget.drift.closed_forms import ErrorSources as ErrorSources
    from gfimu.budget.drift.equivalent import EquivalentErrors as EquivalentErrors
    from gfimu.budget.drift.monte_carlo import DriftSample as DriftSample
    from gfimu.budget.drift.monte_carlo import monte_carlo_drift as monte_carlo_drift
    from gfimu.budget.drift.rest_windows import RestDrift as RestDrift
    from gfimu.budget.drift.result import Drift as Drift
    from gfimu.budget.tolerances.result import ToleranceResult as ToleranceResult
    from gfimu.budget.tolerances.tolerances import ChipErrors as ChipErrors
    from gfimu.calibration.array_calibration import calibrate_array as calibrate_array
    from gfimu.calibration.array_calibration import update_array_calibration as update_array_calibration
    from gfimu.calibration.certificate.certificate import Certificate as Certificate
    from gfimu.calibration.given import CalibrationPoses as CalibrationPoses
    from gfimu.calibration.given import CalibrationPrior as CalibrationPrior
    from gfimu.calibration.given import RateTable as RateTable
    from gfimu.calibration.result import Calibration as Calibration
    from gfimu.calibration.result import load_calibration as load_calibration
    from gfimu.commands import benchmark as benchmark
    from gfimu.commands import firmware as firmware
    from gfimu.commands.benchmark import benchmark_list as benchmark_list
    from gfimu.commands.calibrate import calibrate as calibrate
    from gfimu.commands.campaign import campaign as campaign
    from gfimu.commands.campaign import campaign_plot as campaign_plot
    from gfimu.commands.campaign import campaign_status as campaign_status
    from gfimu.commands.campaign import campaign_table as campaign_table
    from gfimu.commands.certificate import certificate as certificate
    from gfimu.commands.check import check as check
    from gfimu.commands.convert import convert as convert
    from gfimu.commands.demo import demo as demo
    from gfimu.commands.demo_steps import DemoResult as DemoResult
    from gfimu.commands.design import design as design
    from gfimu.commands.diagnose import diagnose as diagnose
    from gfimu.commands.diagnose import write_report as write_report
    from gfimu.commands.drift import axis_drift as axis_drift
    from gfimu.commands.drift import drift as drift
    from gfimu.commands.drift import drift_from_position as drift_from_position
    from gfimu.commands.drift import drift_of_rest as drift_of_rest
    from gfimu.commands.estimate import Place as Place
    from gfimu.commands.estimate import estimate as estimate
    from gfimu.commands.impact import impact as impact
    from gfimu.commands.inspect import inspect as inspect
    from gfimu.commands.join import join as join
    from gfimu.commands.list import catalogue as catalogue
    from gfimu.commands.live import live as live
    from gfimu.commands.new import new as new
    from gfimu.commands.noise import noise as noise
    from gfimu.commands.optimize import optimize as optimize
    from gfimu.commands.record import record as record
    from gfimu.commands.record_settings import BoardSettings as BoardSettings
    from gfimu.commands.record_settings import RecordCallbacks as RecordCallbacks
    from gfimu.commands.schema import schema as schema
    from gfimu.commands.score import score as score
    from gfimu.commands.show import show as show
    from gfimu.commands.simulate import simulate as simulate
    from gfimu.commands.start import start as start
    from gfimu.commands.tolerance import tolerance as tolerance
    from gfimu.commands.view import view as view
    from gfimu.diagnosis.design.proposal import Proposal as Proposal
    from gfimu.diagnosis.design.run_check import RunCheck as RunCheck
    from gfimu.diagnosis.verdict.parts import NamedCause as NamedCause
    from gfimu.diagnosis.verdict.verdict import Diagnosis as Diagnosis
    from gfimu.motion.attitude import integrate_attitude as integrate_attitude
    from gfimu.motion.earth import EarthRotation as EarthRotation
    from gfimu.motion.equivalent_errors import equivalent_p_bias as equivalent_p_bias
    from gfimu.motion.equivalent_errors import equivalent_rate_drift as equivalent_rate_drift
    from gfimu.motion.estimate import Estimate as Estimate
    from gfimu.motion.estimate_summary import centripetal_agreement as centripetal_agreement
    from gfimu.motion.estimate_summary import summarise as summarise
    from gfimu.motion.impact.event import Impact as Impact
    from gfimu.motion.navigation import level as level
    from gfimu.motion.navigation import navigate as navigate
    from gfimu.motion.rest_bias import estimate_from_rest as estimate_from_rest
    from gfimu.rate.axis.accuracy.bounds import AxisBounds as AxisBounds
    from gfimu.rate.axis.accuracy.drift import AxisDrift as AxisDrift
    from gfimu.rate.bounds.posterior import posterior_rate_bound as posterior_rate_bound
    from gfimu.rate.bounds.sample import rate_bound as rate_bound
    from gfimu.rate.live import LiveRateFilter as LiveRateFilter
    from gfimu.rate.methods import estimate_rate as estimate_rate
    from gfimu.rate.result import RateEstimate as RateEstimate
    from gfimu.rate.sensing import SensorErrors as SensorErrors
    from gfimu.recording import Recording as Recording
    from gfimu.recording.formats import open_recording as open_recording
    from gfimu.recording.importing.column_map import ColumnMap as ColumnMap
    from gfimu.recording.importing.column_map import load_map as load_map
    from gfimu.recording.importing.inspection import Inspection as Inspection
    from gfimu.recording.joining.join import Joined as Joined
    from gfimu.recording.mapped import MappedFile as MappedFile
    from gfimu.recording.mimu4444 import read_mimu4444 as read_mimu4444
    from gfimu.sensor_noise import allan_deviation as allan_deviation
    from gfimu.sensor_noise import identify_noise as identify_noise
    from gfimu.sensor_noise.allan import AllanDeviation as AllanDeviation
    from gfimu.sensor_noise.identification import NoiseModel as NoiseModel
    from gfimu.sensor_noise.recording_noise import RecordingNoise as RecordingNoise
    from gfimu.sensor_noise.recording_noise import recording_noise as recording_noise
    from sim.scenarios import Scenario as Scenario
    from sim.trials.sweep.results import CampaignResult as CampaignResult
    from sim.trials.sweep.results import CampaignStatus as CampaignStatus
    from sim.trials.sweep.results import CampaignTable as CampaignTable
    from sim.twin import Twin as Twin
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
