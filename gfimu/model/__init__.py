"""The world model: by what interface a diagnosis uses a simulation.

In: drive and parameters of effects.
Out: predicted readings and their derivatives; the protocols that `sim.twin.Twin` implements, and a simulation of one's
own (`own_rig`).
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.model.generic_basis import OF_READING
    from gfimu.model.located.dependences.by_name import dependence_of
    from gfimu.model.located.dependences.forms import VectorForm
    from gfimu.model.located.dependences.memories import Mode
    from gfimu.model.located.dependences.regressors import ACCELERATION, FORCES
    from gfimu.model.located.dependences.waves import Wave
    from gfimu.model.located.effect import LocatedEffect
    from gfimu.model.located.operators import Operator, body_places, channel_place, rig_places
    from gfimu.model.located.rig_state import RigState
    from gfimu.model.located.usual import USUAL
    from gfimu.model.own_rig import load_model
    from gfimu.model.world_model import BodyModel, SpinState
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
