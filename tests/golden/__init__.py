"""The golden set: fixed calls of the command line with fixed inputs, and what they gave when it was last written."""

import os

# As the command line sets them, and before anything here imports numpy: sums then have one order.
for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")
