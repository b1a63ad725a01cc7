"""`gfimu.motion.estimation` by its former name, for programs that import it from here."""

from gfimu.motion.estimation import Estimate, estimate

__all__ = ["Estimate", "estimate"]
