"""Trials: many worlds drawn, run, judged and tabulated.

In: plans of campaigns, lists of cases.
Out: tables of outcomes: of campaigns (`sweep`), of the diagnosis (`study`), of any method that names what a simulation
gets wrong (`benchmark`); `worlds` draws.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from sim.trials.campaign.cases import check_factors as check_factors
    from sim.trials.study.cases import Case as Case
    from sim.trials.study.outcome import HiddenWorld as HiddenWorld
    from sim.trials.study.outcome import draw_world as draw_world
    from sim.trials.sweep.design import Design as Design
    from sim.trials.sweep.picture import campaign_picture as campaign_picture
    from sim.trials.sweep.plan import load_plan as load_plan
    from sim.trials.sweep.sensitivity import seed_shares as seed_shares
    from sim.trials.sweep.sensitivity import sensitivities as sensitivities
    from sim.trials.worlds.factory import WorldFactory as WorldFactory
    from sim.trials.worlds.hidden import Measurement as Measurement
    from sim.trials.worlds.hidden import bias_instability as bias_instability
    from sim.trials.worlds.hidden import hidden_effect as hidden_effect
    from sim.trials.worlds.hidden import measure as measure
    from sim.trials.worlds.hidden import random_profile as random_profile
    from sim.trials.worlds.z_scores import z_scores as z_scores
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
