"""`gfimu.geometry.array` by its former name, for programs that import it from here."""

from gfimu.geometry.array import OMEGA_PRODUCTS, AccelerometerArray, Chip
from gfimu.lazy_names import former_name

__all__ = ["OMEGA_PRODUCTS", "AccelerometerArray", "Chip"]

former_name(__name__, "gfimu.geometry.array", removed="0.4")
