"""Physical effects: one small class each, in a registry.

In: the state of a world and the effect's sizes.
Out: changed channels or reference, with name, parameters, priors, place and the run that separates it.
"""

from sim.effects.base import Effect, Pattern, Size
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

__all__ = [
    "BODY_EFFECTS",
    "CARRIAGE_EFFECTS",
    "EFFECTS",
    "ENCODER_EFFECTS",
    "FURTHER_EFFECTS",
    "INCLINED_EFFECTS",
    "NOT_OF_AN_ENCODER",
    "NOT_OF_A_BODY",
    "NOT_OF_A_CARRIAGE",
    "SIMULATED_EFFECTS",
    "TABLE_EFFECTS",
    "Effect",
    "Pattern",
    "Size",
    "added_effects",
    "apply_effects",
    "make_effect",
]
