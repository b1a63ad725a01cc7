"""The golden set: fixed calls of the command line with fixed inputs, and what they gave when it was last written."""

from tests.arithmetic import set_arithmetic

set_arithmetic()  # before anything here imports NumPy
