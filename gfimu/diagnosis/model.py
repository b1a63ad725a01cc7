"""`gfimu.world_model` by its former name, for simulations that implement it from here."""

from gfimu.lazy_names import former_name
from gfimu.world_model import (
    BasisUnits,
    BodyModel,
    Effect,
    EffectFamily,
    ExpectedNoise,
    Pattern,
    Size,
    Spin,
    SpinState,
    WorldModel,
    bound_of,
    is_of_one_recording,
)

__all__ = [
    "BasisUnits",
    "BodyModel",
    "Effect",
    "EffectFamily",
    "ExpectedNoise",
    "Pattern",
    "Size",
    "Spin",
    "SpinState",
    "WorldModel",
    "bound_of",
    "is_of_one_recording",
]

former_name(__name__, "gfimu.world_model", removed="0.4")
