"""Diagnosis: what a simulation gets wrong against measured data, and why.

In: recordings and a world model.
Out: `Diagnosis`: named causes with size and probability, what stays unexplained, the gain, an extended model.
Rooms, each of which imports itself and those before it: `data`, `terms`, `fit`, `search`, `criticism`, `verdict`,
`report`, `design`. Above them stand `diagnose`, the verb, and `steps`, what it does after the samples are read.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names
from gfimu.diagnosis.diagnose import diagnose  # at once: later its own module would hide it

if TYPE_CHECKING:
    from gfimu.diagnosis.criticism.views.run_view import RunView
    from gfimu.diagnosis.criticism.views.run_views import run_views
    from gfimu.diagnosis.data.body.gyro import smooth_gyro
    from gfimu.diagnosis.data.body.prepared import prepare_bodies, robust_prediction
    from gfimu.diagnosis.data.cosine_basis import CosineBasis, NoiseLevels
    from gfimu.diagnosis.data.integrity import check_integrity
    from gfimu.diagnosis.data.plausibility import refuse_implausible
    from gfimu.diagnosis.data.prepared_runs import PreparedRuns
    from gfimu.diagnosis.data.run import Run, prepare_run
    from gfimu.diagnosis.data.samples import frozen_stretches
    from gfimu.diagnosis.data.stretch import RunUp, make_stretches
    from gfimu.diagnosis.data.table.spins import State
    from gfimu.diagnosis.data.table.start_angle import gravity_angle
    from gfimu.diagnosis.data.time_grid import time_grid
    from gfimu.diagnosis.design.chip_axes import chip_axes, chip_distance
    from gfimu.diagnosis.design.run_check import check_runs, turns_one_way
    from gfimu.diagnosis.diagnose import prepare
    from gfimu.diagnosis.fit.learn import predicted_by_reference, starting_point
    from gfimu.diagnosis.policy import Policy
    from gfimu.diagnosis.report.folder import write_diagnosis
    from gfimu.diagnosis.report.page import report_html
    from gfimu.diagnosis.report.picture import write_picture
    from gfimu.diagnosis.report.plain_words import headline, next_steps, story
    from gfimu.diagnosis.report.rig import DrawnRig
    from gfimu.diagnosis.report.tables import diagnosis_tables
    from gfimu.diagnosis.search.challenge import challenged
    from gfimu.diagnosis.search.explain import Explanation
    from gfimu.diagnosis.search.free_time import FreeTime, free_time
    from gfimu.diagnosis.search.located_screen import LocatedScreen
    from gfimu.diagnosis.search.long_run import spread_over_runs, understand_any_length
    from gfimu.diagnosis.search.waves import signal_of
    from gfimu.diagnosis.steps import stretches_of
    from gfimu.diagnosis.terms.cause import Cause, effects_of, mixing_of
    from gfimu.diagnosis.terms.columns import Columns
    from gfimu.diagnosis.terms.drive import Drive
    from gfimu.diagnosis.terms.library import cause_columns, family_columns
    from gfimu.diagnosis.terms.located.alternatives import dependences
    from gfimu.diagnosis.terms.located.policy import LOCATED
    from gfimu.diagnosis.terms.located.term import LocatedBasis, LocatedTerm, located_columns
    from gfimu.diagnosis.terms.observed import observe
    from gfimu.diagnosis.terms.reach import behind_wiring, disjoint
    from gfimu.diagnosis.time_limit import check_time, limited_to
    from gfimu.diagnosis.verdict.extension import that_predict
    from gfimu.diagnosis.verdict.likely_mistakes import likely_mistake
    from gfimu.diagnosis.verdict.located import experiment_between, located_cause, of_free_time
    from gfimu.diagnosis.verdict.parts import Located, ReferenceClock
    from gfimu.diagnosis.verdict.sample_notes import with_reference_clock, with_sample_notes
    from gfimu.diagnosis.verdict.verdict import Diagnosis
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
