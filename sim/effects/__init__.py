"""Physical effects: one small class each, in a registry.

In: the state of a world and the effect's sizes.
Out: changed channels or reference, with name, parameters, priors, place and the run that separates it.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from sim.effects.base import Effect as Effect
    from sim.effects.base import Pattern as Pattern
    from sim.effects.base import Size as Size
    from sim.effects.description import describe as describe
    from sim.effects.registry import BODY_EFFECTS as BODY_EFFECTS
    from sim.effects.registry import CARRIAGE_EFFECTS as CARRIAGE_EFFECTS
    from sim.effects.registry import EFFECTS as EFFECTS
    from sim.effects.registry import ENCODER_EFFECTS as ENCODER_EFFECTS
    from sim.effects.registry import FURTHER_EFFECTS as FURTHER_EFFECTS
    from sim.effects.registry import INCLINED_EFFECTS as INCLINED_EFFECTS
    from sim.effects.registry import NOT_OF_A_BODY as NOT_OF_A_BODY
    from sim.effects.registry import NOT_OF_A_CARRIAGE as NOT_OF_A_CARRIAGE
    from sim.effects.registry import NOT_OF_AN_ENCODER as NOT_OF_AN_ENCODER
    from sim.effects.registry import SIMULATED_EFFECTS as SIMULATED_EFFECTS
    from sim.effects.registry import TABLE_EFFECTS as TABLE_EFFECTS
    from sim.effects.registry import added_effects as added_effects
    from sim.effects.registry import apply_effects as apply_effects
    from sim.effects.registry import make_effect as make_effect
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
