"""`gfimu.motion.estimation` by its former name, for programs that import it from here."""

from gfimu.lazy_names import former_name
from gfimu.motion.estimation import Estimate, estimate

__all__ = ["Estimate", "estimate"]

former_name(__name__, "gfimu.motion.estimation", removed="0.4")
