"""`gfimu.geometry.array` by its former name, for programs that import it from here."""

from gfimu.geometry.array import OMEGA_PRODUCTS, AccelerometerArray, Chip

__all__ = ["OMEGA_PRODUCTS", "AccelerometerArray", "Chip"]
