"""Trials: many worlds drawn, run, judged and tabulated.

In: plans of campaigns, lists of cases.
Out: tables of outcomes: of campaigns (`sweep`), of the diagnosis (`study`), of any method that names what a simulation
gets wrong (`benchmark`); `worlds` draws.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from sim.trials.campaign.cases import check_factors
    from sim.trials.campaign.drive import DriveWork
    from sim.trials.campaign.worlds import measure_case
    from sim.trials.study.cases import study_cases
    from sim.trials.study.outcome import HiddenWorld, draw_world
    from sim.trials.sweep.dataset import Dataset
    from sim.trials.sweep.design import Case, Design
    from sim.trials.sweep.engine import run_batch
    from sim.trials.sweep.picture import campaign_picture
    from sim.trials.sweep.plan import load_plan
    from sim.trials.sweep.sensitivity import seed_shares, sensitivities
    from sim.trials.worlds.factory import WorldFactory
    from sim.trials.worlds.hidden import Measurement, bias_instability, hidden_effect, measure, random_profile
    from sim.trials.worlds.z_scores import z_scores
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
