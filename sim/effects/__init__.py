"""Physical effects: one small class each, in a registry; each knows its name, parameters, priors and place."""

from sim.effects.base import Effect, Pattern, Size
from sim.effects.registry import EFFECTS, apply_effects, make_effect

__all__ = ["EFFECTS", "Effect", "Pattern", "Size", "apply_effects", "make_effect"]
