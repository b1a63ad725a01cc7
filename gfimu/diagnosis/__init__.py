"""Diagnosis: what a simulation gets wrong against measured data, and why.

In: recordings and a world model.
Out: `Diagnosis`: named causes with size and probability, what stays unexplained, the gain, an extended model.
Rooms, each of which imports itself and those before it: `data`, `terms`, `fit`, `search`, `criticism`, `verdict`,
`report`, `design`. Above them stand `diagnose`, the verb, and `one_library`, its steps with one library of effects.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names
from gfimu.diagnosis.diagnose import diagnose as diagnose

if TYPE_CHECKING:
    from gfimu.diagnosis.criticism.lack_of_fit import lack_of_fit as lack_of_fit
    from gfimu.diagnosis.criticism.reading_curve import reading_curve as reading_curve
    from gfimu.diagnosis.criticism.surrogate import surrogates as surrogates
    from gfimu.diagnosis.criticism.views.rigid_motion import motion_columns as motion_columns
    from gfimu.diagnosis.criticism.views.rigid_motion import rigid_motion as rigid_motion
    from gfimu.diagnosis.criticism.views.run_view import RunView as RunView
    from gfimu.diagnosis.criticism.views.run_views import run_views as run_views
    from gfimu.diagnosis.data.body.gyro import smooth_gyro as smooth_gyro
    from gfimu.diagnosis.data.body.prepared import prepare_bodies as prepare_bodies
    from gfimu.diagnosis.data.body.prepared import robust_prediction as robust_prediction
    from gfimu.diagnosis.data.body.run import prepare_body_run as prepare_body_run
    from gfimu.diagnosis.data.body.stretch import BodyStretch as BodyStretch
    from gfimu.diagnosis.data.body.stretch import make_body_stretches as make_body_stretches
    from gfimu.diagnosis.data.cosine_basis import CosineBasis as CosineBasis
    from gfimu.diagnosis.data.cosine_basis import NoiseLevels as NoiseLevels
    from gfimu.diagnosis.data.integrity import check_integrity as check_integrity
    from gfimu.diagnosis.data.plausibility import refuse_implausible as refuse_implausible
    from gfimu.diagnosis.data.prepared_runs import PreparedRuns as PreparedRuns
    from gfimu.diagnosis.data.run import Run as Run
    from gfimu.diagnosis.data.run import prepare_run as prepare_run
    from gfimu.diagnosis.data.samples import frozen_stretches as frozen_stretches
    from gfimu.diagnosis.data.stretch import RunUp as RunUp
    from gfimu.diagnosis.data.stretch import make_stretches as make_stretches
    from gfimu.diagnosis.data.table.spins import State as State
    from gfimu.diagnosis.data.table.start_angle import gravity_angle as gravity_angle
    from gfimu.diagnosis.data.time_grid import time_grid as time_grid
    from gfimu.diagnosis.design.run_check import check_runs as check_runs
    from gfimu.diagnosis.design.run_check import turns_one_way as turns_one_way
    from gfimu.diagnosis.diagnose import prepare as prepare
    from gfimu.diagnosis.fit.learn import learn_noise as learn_noise
    from gfimu.diagnosis.fit.learn import learn_roughness as learn_roughness
    from gfimu.diagnosis.fit.learn import predicted_by_reference as predicted_by_reference
    from gfimu.diagnosis.fit.learn import starting_point as starting_point
    from gfimu.diagnosis.fit.random_walk import walk_strength as walk_strength
    from gfimu.diagnosis.one_library import stretches_of as stretches_of
    from gfimu.diagnosis.policy import Policy as Policy
    from gfimu.diagnosis.report.folder import write_diagnosis as write_diagnosis
    from gfimu.diagnosis.report.page import report_html as report_html
    from gfimu.diagnosis.report.picture import write_picture as write_picture
    from gfimu.diagnosis.report.plain_words import headline as headline
    from gfimu.diagnosis.report.plain_words import next_steps as next_steps
    from gfimu.diagnosis.report.plain_words import story as story
    from gfimu.diagnosis.report.rig import DrawnRig as DrawnRig
    from gfimu.diagnosis.report.tables import diagnosis_tables as diagnosis_tables
    from gfimu.diagnosis.search.long_run import spread_over_runs as spread_over_runs
    from gfimu.diagnosis.search.long_run import understand_any_length as understand_any_length
    from gfimu.diagnosis.search.nuisance_models import understand as understand
    from gfimu.diagnosis.terms.cause import Cause as Cause
    from gfimu.diagnosis.terms.cause import effects_of as effects_of
    from gfimu.diagnosis.terms.cause import mixing_of as mixing_of
    from gfimu.diagnosis.terms.columns import Columns as Columns
    from gfimu.diagnosis.terms.drive import Drive as Drive
    from gfimu.diagnosis.terms.hand.drive import HandDrive as HandDrive
    from gfimu.diagnosis.terms.library import cause_columns as cause_columns
    from gfimu.diagnosis.terms.library import family_columns as family_columns
    from gfimu.diagnosis.terms.observed import observe as observe
    from gfimu.diagnosis.terms.reach import behind_wiring as behind_wiring
    from gfimu.diagnosis.terms.reach import disjoint as disjoint
    from gfimu.diagnosis.time_limit import check_time as check_time
    from gfimu.diagnosis.time_limit import limited_to as limited_to
    from gfimu.diagnosis.verdict.likely_mistakes import likely_mistake as likely_mistake
    from gfimu.diagnosis.verdict.parts import ReferenceClock as ReferenceClock
    from gfimu.diagnosis.verdict.parts import Unlisted as Unlisted
    from gfimu.diagnosis.verdict.place import with_place as with_place
    from gfimu.diagnosis.verdict.sample_notes import with_reference_clock as with_reference_clock
    from gfimu.diagnosis.verdict.sample_notes import with_sample_notes as with_sample_notes
    from gfimu.diagnosis.verdict.verdict import Diagnosis as Diagnosis
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
