"""Physical effects: one small class each, in a registry.

In: the state of a world and the effect's sizes.
Out: changed channels or reference, with name, parameters, priors, place and the run that separates it.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from sim.effects.base import Effect, Pattern, Size
    from sim.effects.description import describe
    from sim.effects.registry import (
        BODY_EFFECTS,
        CARRIAGE_EFFECTS,
        EFFECTS,
        ENCODER_EFFECTS,
        FURTHER_EFFECTS,
        INCLINED_EFFECTS,
        NOT_OF_A_BODY,
        NOT_OF_A_CARRIAGE,
        NOT_OF_AN_ENCODER,
        SIMULATED_EFFECTS,
        TABLE_EFFECTS,
        added_effects,
        apply_effects,
        make_effect,
    )
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
